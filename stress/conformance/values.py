"""What every value rule has to keep to, as one check of it.

From a test: ``check(rule)``; it raises ``AssertionError`` with what is wrong.
"""

import dataclasses
import math
import random
from itertools import pairwise

from exchange.values import Moment, QueuePlace, ValueRule, Waiting
from worldmodel import Terms

FRAME_S = 20.0
N_CANDIDATES = 60
N_LATER = 12


def candidates(draw: random.Random, moment: Moment) -> list[Waiting]:
    """Candidates as queues have them, all taken by then."""
    found = []
    for _ in range(N_CANDIDATES):
        slots_ago = draw.randrange(40)
        since_s = max(0.0, moment.now_s - FRAME_S * slots_ago - draw.choice([0.0, 3.7]))
        found.append(
            Waiting(
                priority=draw.choice([1, 1, 3, 10, 50, 1000]),
                observed_s=max(0.0, since_s - draw.choice([0.0, 0.5, 400.0])),
                since_s=since_s,
                since_slot=max(0, moment.n_slots - slots_ago),
                credit=draw.choice([0, 0, 7, 300]),
                n_said=draw.choice([0, 0, 1, 2, 30]),
                terms=Terms(draw.choice([math.inf, 30.0, 900.0])),
            )
        )
    return found


def check(rule: ValueRule, seed: int = 1) -> None:
    """Hold a rule against the seam: names, finite values that are the same again, and an order that lasts."""
    assert isinstance(rule.name, str), f"name is {rule.name!r}, not a text"
    assert rule.name, "name is empty"
    draw = random.Random(seed)
    moment = Moment(2000.0, 100)
    waiting = candidates(draw, moment)
    for one in waiting:
        before = dataclasses.replace(one)
        place, value = rule.place(one), rule.value(one, moment)
        assert one == before, f"it changes what it is asked about: {before} is {one}"
        assert isinstance(value, int | float), f"value gives {value!r}, not a number, for {before}"
        assert math.isfinite(value), f"value gives {value!r}, not a finite number, for {before}"
        assert (rule.place(one), rule.value(one, moment)) == (place, value), f"another answer the second time: {before}"
        assert place is None or isinstance(place, QueuePlace), f"place gives {place!r}, neither a Place nor None"
        assert place is None or math.isfinite(place.rank), f"rank {place.rank} of {before}"
    for step in range(N_LATER):
        later = Moment(moment.now_s + FRAME_S * step, moment.n_slots + step)
        _check_order(rule, waiting, later)


def _check_order(rule: ValueRule, waiting: list[Waiting], moment: Moment) -> None:
    """In each group, the higher rank has no lower value at that moment."""
    groups: dict[object, list[tuple[float, float, Waiting]]] = {}
    for one in waiting:
        place = rule.place(one)
        if place is not None:
            groups.setdefault((one.priority, place.group), []).append((place.rank, rule.value(one, moment), one))
    for group, members in groups.items():
        members.sort(key=lambda member: member[0])
        for (_, value, lower), (_, better, higher) in pairwise(members):
            assert value <= better * (1 + 1e-12) + 1e-9, (
                f"group {group} at {moment}: {higher} has the higher rank and the lower value, {better} below {value} "
                f"of {lower}; place has to give None, or other groups"
            )
