"""Design: the combinations of settings that a study asks for.

It is the product of scenarios, vehicles, strategies, policies, channels, points and what is unforeseen. A point sets
keys of the scenario, named as ``--set`` names them; points come from a full grid, a list, a Latin hypercube or a
two-level factorial design.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from missions.sweeps.factorial import HIGH, FactorialDesign, designed
from missions.sweeps.study_checks import LISTS, TABLE_OF, channel_place
from missions.sweeps.study_file import StudyFile, StudySetting, Unforeseen, flattened, is_axis

Settings = tuple[StudySetting, ...]
FAULT = "fault"
"""Key of the scenario that has the faults of a run."""


class Combination(NamedTuple):
    """Settings of all runs of a configuration.

    Args:
        unforeseen: name of what is unforeseen in them; empty in a study without that axis.
    """

    settings: Settings
    unforeseen: str


def combinations(file: StudyFile) -> Iterator[Combination]:
    """Every combination of settings; each scenario of the study is run with all of them."""
    axes: list[list[Settings]] = [[tuple(StudySetting(key, value, f"set.{key}") for key, value in flattened(file.set))]]
    for name, key in LISTS.items():
        values: Sequence[Any] = getattr(file.study, name) or ()
        axes.append([(StudySetting(key, value, f"study.{name}"),) for value in values] or [()])
    axes += [_channels(file), points(file)]
    cases = [
        Combination(_unforeseen(unforeseen, f"unforeseen.{unforeseen.name}"), unforeseen.name)
        for unforeseen in file.unforeseen
    ]
    for chosen in itertools.product(*axes):
        for case in cases or [Combination((), "")]:
            yield Combination((*itertools.chain(*chosen), *case.settings), case.unforeseen)


def _unforeseen(case: Unforeseen, place: str) -> Settings:
    """What an entry of ``[[unforeseen]]`` sets."""
    settings = [StudySetting(key, value, f"{place}.set.{key}") for key, value in flattened(case.set)]
    return (*settings, *([StudySetting(FAULT, list(case.fault), f"{place}.fault")] if case.fault else []))


def _channels(file: StudyFile) -> list[Settings]:
    """Settings of every channel; a list of values in its table is a grid."""
    channels = []
    for number, table in enumerate(file.channel):
        place = channel_place(file, number)
        channels += _product([StudySetting(f"channel.{key}", value, f"{place}.{key}") for key, value in table.items()])
    return channels or [()]


def points(file: StudyFile) -> list[Settings]:
    """Settings of every point, in the order of the file; the last key of a grid varies fastest."""
    table = TABLE_OF[file.study.sampling]
    if table == "point":
        return [
            tuple(StudySetting(key, value, f"point.{number}.{key}") for key, value in flattened(point))
            for number, point in enumerate(file.point, 1)
        ]
    if table == "latin":
        return _latin_hypercube(dict(flattened(file.latin)), file.study.samples, file.study.seed)
    if table == "factorial":
        return _factorial(file)
    return _product([StudySetting(key, value, f"grid.{key}") for key, value in flattened(file.grid)])


def factorial_of(file: StudyFile) -> FactorialDesign:
    """The two-level design of a study."""
    return designed(tuple(file.factors), file.study.halvings)


def _factorial(file: StudyFile) -> list[Settings]:
    """Settings of every run of a two-level design."""
    levels = file.factors
    return [
        tuple(StudySetting(key, levels[key][level == HIGH], f"factorial.{key}") for key, level in run.items())
        for run in factorial_of(file).runs
    ]


def _latin_hypercube(bounds: Mapping[str, tuple[float, float]], samples: int, seed: int) -> list[Settings]:
    """A Latin hypercube (McKay, Beckman, Conover 1979), scaled to its bounds.

    Values have six digits, and are whole where both bounds are.
    """
    from scipy.stats import qmc  # half a second to load, and few studies need it

    unit = qmc.LatinHypercube(len(bounds), seed=seed).random(samples)
    return [
        tuple(
            StudySetting(key, _between(*bounds[key], share), f"latin.{key}")
            for key, share in zip(bounds, row, strict=True)
        )
        for row in unit.tolist()
    ]


def _between(low: float, high: float, share: float) -> float:
    """The value at a share 0..1 of the way; among whole numbers each has the same part of the way.

    >>> _between(4, 6, 0.34), _between(4.0, 6.0, 0.34)
    (5, 4.68)
    """
    if isinstance(low, int) and isinstance(high, int):
        return low + min(int(share * (high - low + 1)), high - low)
    return float(f"{low + share * (high - low):.6g}")


def _product(grid: Sequence[StudySetting]) -> list[Settings]:
    """Settings of a full grid; a value that is no list, or a list of tables, stays the same everywhere."""
    choices = [
        [setting._replace(value=value) for value in (setting.value if is_axis(setting.value) else [setting.value])]
        for setting in grid
    ]
    return list(itertools.product(*choices))
