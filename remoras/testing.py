"""For tests of your own strategies, missions and managers: the fleet, or managers alone, under random faults."""

from stress.lives import Aired, Life
from stress.storm.fates import DOUBLED, HEARD, LOST, Copy, Fate, chances, damaged, flipped, late, replayed
from stress.storm.machine import storm_machine
from stress.storm.storm import LawBroken, Make, Storm

__all__ = [
    "DOUBLED",
    "HEARD",
    "LOST",
    "Aired",
    "Copy",
    "Fate",
    "LawBroken",
    "Life",
    "Make",
    "Storm",
    "chances",
    "damaged",
    "flipped",
    "late",
    "replayed",
    "storm_machine",
]
