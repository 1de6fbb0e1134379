"""Strategies that fail, each in its way; they form what ``remoras`` forms, unless they fail before."""

import os
from dataclasses import dataclass

from remoras.strategies.remoras import Remoras


@dataclass(frozen=True)
class Raising(Remoras):
    name: str = "raising"

    def form(self, fleet_data, groups):
        raise ValueError("no fleet today")


@dataclass(frozen=True)
class Killing(Remoras):
    name: str = "killing"

    def form(self, fleet_data, groups):
        os._exit(9)


RAISING, KILLING = Raising(), Killing()
