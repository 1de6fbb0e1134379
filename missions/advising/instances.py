"""Instances: scenarios drawn from numbers, on which strategies are run so that advice can rest on them.

An instance is drawn by its number alone: ground, fleet, sea and what is unforeseen are drawn apart from each other.
So anybody can make instance 17 again, and more instances change none of those before.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from itertools import permutations
from typing import Any

from exchange.acoustics.loss import INSTANCES, uniform
from exchange.arithmetic import exp, log
from missions.files import shipped, text_of
from remoras.plugins import named_object

GROUND, GENERATOR = "mapping-patches", "missions.mapping.drawn_ground:drawn_ground"
"""Shipped scenario of which all are drawn, and what draws its ground."""
DURATION_S = 7200.0
"""A run that has not completed counts with this time."""
SMALL, LARGE = (2, 11), (12, 20)
"""Fewest and most vehicles that work, beside the one on the surface; each factor between them is as likely."""
LARGE_SHARE = 0.05
JOBS = (4, 14)
SQUARES = (140, 480)
"""Least and most of the ground, in squares of 25 m, but at most as many for each vehicle as below."""
SQUARES_EACH = 150
SQUARE_S = 17.0
"""Time in which a vehicle maps a square, for when faults are drawn."""
MODEMS = (("nanomodem-v3", 0.4), ("s2c-18-34", 0.1), ("seatrac-x150", 0.1), ("whoi-fsk-0", 0.2), ("janus", 0.2))
SEAS = (("alike", 0.4), ("bursts", 0.2), ("unlike", 0.2), ("measured at sea", 0.2))
MOST_MEASURED = 4
"""Vehicles that work where losses are those of the five nodes that were measured."""
CASES = (("nothing", 0.35), ("one lost", 0.25), ("head lost", 0.25), ("head and one lost", 0.15))

SEED = 2033
"""Of the draws of all instances; the runs of instance n have the master seed ``SEED * 1000 + n``."""

Tables = dict[str, Any]


def drawn_scenario(number: int, seed: int = SEED) -> Tables:
    """The tables of a scenario without a strategy of its own.

    Args:
        number: of the instance, 0 to 999.
        seed: of the draws of all instances, 0 to 2^62.
    """
    draws = InstanceDraws(number, seed)
    least, most = LARGE if draws.share() < LARGE_SHARE else SMALL
    n_workers = int(draws.scaled(least, most + 0.999))
    squares = min(SQUARES[1], SQUARES_EACH * n_workers)
    base = tomllib.loads(text_of(shipped()[GROUND]))
    tables: Tables = named_object(GENERATOR)(
        base, draws.whole(0, 2**40), (n_workers, n_workers), JOBS, (SQUARES[0], squares)
    )
    tables["scenario"] |= {"name": f"instance-{number:03d}", "title": "", "duration_s": DURATION_S}
    if n_workers == SMALL[0]:
        _without_one(tables)
    _speeds(tables, draws)
    _sea(tables, draws, n_workers)
    _unforeseen(tables, draws, n_workers, squares)
    return tables


class InstanceDraws:
    """Numbers of one instance, one after another."""

    def __init__(self, number: int, seed: int) -> None:
        self._number, self._seed, self._drawn = number, seed, 0

    def share(self) -> float:
        """A number in [0, 1)."""
        self._drawn += 1
        return uniform(self._seed, INSTANCES, self._number, 0, self._drawn)

    def whole(self, least: int, most: int) -> int:
        """A whole number of a range, both of whose ends are in it."""
        return least + int((most - least + 1) * self.share())

    def between(self, least: float, most: float) -> float:
        """A number of a range, of four digits."""
        return float(f"{least + (most - least) * self.share():.4g}")

    def scaled(self, least: float, most: float) -> float:
        """A number of a range in which each factor is as likely, of four digits."""
        return float(f"{least * exp(log(most / least) * self.share()):.4g}")

    def one_of(self, choices: Sequence[tuple[str, float]]) -> str:
        """One of some names, each with its share; the shares add up to 1."""
        at = self.share()
        for name, share in choices:
            at -= share
            if at < 0.0:
                return name
        return choices[-1][0]


def _without_one(tables: Tables) -> None:
    """Take out the last but one of the listed vehicles: the fleet is smaller than what is listed."""
    gone = tables["vehicle"].pop(-2)
    tables["vehicle"][-1]["slot"] = gone["slot"]


def _speeds(tables: Tables, draws: InstanceDraws) -> None:
    """Vehicles unlike in what the fleet knows of them, or not; and unlike what it knows."""
    factors = [draws.scaled(0.7, 1.4) for _ in tables["vehicle"]]
    if draws.share() < 0.5:
        for vehicle, factor in zip(tables["vehicle"], factors, strict=True):
            for key in ("transit_speed_mps", "survey_speed_mps"):
                vehicle[key] = round(vehicle[key] * factor, 3)
            if "sensor" in vehicle:
                vehicle["sensor"]["speed_limit_mps"] = round(vehicle["sensor"]["speed_limit_mps"] * factor, 3)
    spread = draws.between(0.05, 0.4)
    tables["uncertainty"] = {"speed_spread": spread if draws.share() < 0.6 else 0.0}


def _sea(tables: Tables, draws: InstanceDraws, n_workers: int) -> None:
    """Modem, length of a slot, and losses of one of four shapes."""
    about = tables["communication"]
    about["modem"] = draws.one_of(MODEMS)
    guard_s = round(about["range_m"] / tables["world"]["sound_speed_mps"] + draws.scaled(0.01, 4.0), 3)
    if draws.share() < 0.5:
        about["guard_s"] = guard_s
    shape, per = draws.one_of(SEAS), draws.between(0.0, 0.85)
    if shape == "measured at sea" and n_workers > MOST_MEASURED:
        shape = "unlike"
    tables["channel"] = CHANNELS[shape](per, _names(tables, n_workers), draws)


def _names(tables: Tables, n_workers: int) -> list[str]:
    """Vehicles of the fleet; copies are numbered on."""
    return [vehicle["name"] for vehicle in tables["vehicle"] if vehicle["vehicle_type"] != "AUV"] + _working(
        tables, n_workers
    )


def _working(tables: Tables, n_workers: int) -> list[str]:
    listed = [vehicle["name"] for vehicle in tables["vehicle"] if vehicle["vehicle_type"] == "AUV"]
    free = (name for name in (f"AUV{number:02d}" for number in range(100)) if name not in listed)
    last = int(listed[-1][-2:])
    return listed + [name for name in free if int(name[-2:]) > last][: n_workers - len(listed)]


def _alike(per: float, names: Sequence[str], draws: InstanceDraws) -> Tables:
    return {"name": "bernoulli", "per": per}


def _bursts(per: float, names: Sequence[str], draws: InstanceDraws) -> Tables:
    """A bad link loses everything, for some slots on average."""
    ends, per = 1.0 / draws.scaled(3.0, 40.0), min(per, 0.8)
    ends = min(ends, 1.0 - per)  # shorter ones do not lose as much
    return {
        "name": "gilbert-elliott",
        "p_good_to_bad": round(ends * per / (1.0 - per), 6),
        "p_bad_to_good": round(ends, 6),
        "per_good": 0.0,
        "per_bad": 1.0,
    }


def _unlike(per: float, names: Sequence[str], draws: InstanceDraws) -> Tables:
    """Each directed link has its own loss: the odds of all are spread about those of the mean."""
    middle, spread = log(max(per, 0.05) / (1.0 - max(per, 0.05))), draws.between(0.5, 3.0)
    links = [
        {"sender": sender, "receiver": receiver, "per": round(1.0 / (1.0 + exp(-odds)), 3)}
        for sender, receiver in permutations(names, 2)
        for odds in [middle + spread * (2.0 * draws.share() - 1.0)]
    ]
    return {"name": "matrix", "per": per, "link": links}


def _measured(per: float, names: Sequence[str], draws: InstanceDraws) -> Tables:
    return {"name": "network", "network": "mission-2012"}


CHANNELS: Mapping[str, Callable[[float, Sequence[str], InstanceDraws], Tables]] = {
    "alike": _alike, "bursts": _bursts, "unlike": _unlike, "measured at sea": _measured,
}  # fmt: skip
"""Table of the channel of each shape of the losses."""


def _unforeseen(tables: Tables, draws: InstanceDraws, n_workers: int, squares: int) -> None:
    """Work that is found, and vehicles that are lost while there is work."""
    number = draws.whole(1, 8)
    tables["finds"] = {"number": number if draws.share() < 0.35 else 0}
    case, about_s = draws.one_of(CASES), SQUARE_S * squares / n_workers
    if case == "head and one lost" and n_workers < 4:
        case = "head lost"
    early, late = sorted((round(draws.between(0.1, 0.9) * about_s), round(draws.between(0.1, 0.9) * about_s)))
    victims = {"one lost": ["any"], "head lost": ["head of Operational"], "nothing": []}
    tables["fault"] = [
        {"vehicle": vehicle, "kind": "lost", "at_s": [float(early), float(late)]}
        for vehicle in victims.get(case, ["head of Operational", "any"])
    ]
