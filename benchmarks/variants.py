"""Run missions with one respect of the shipped scenario changed, such as a lost vehicle.

Seeds are 1 to ``--repeats``. A line gives the completed runs with Wilson interval, their mean completion time, the end
of the latest run, runs that declared a job impossible, runs that recovered a decoy, headline shares with the interval
of the mean (Student's t), and the incomplete runs that state a reason.
"""

from __future__ import annotations

import argparse
import copy
import random
import tempfile
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import tomli_w

from missions.metric import Better
from missions.runs.run import Run, run
from missions.scenarios import load, shipped
from missions.statistics import t_half_width, wilson_interval

Raw = dict[str, Any]
NO_CHANGE: Mapping[str, Collection[int]] = {}
NAMES = ("pandora-inspection", "trident-intervention", "arrows-archaeology")


def _tables(name: str) -> Raw:
    return copy.deepcopy(tomllib.loads(shipped()[name].read_text(encoding="utf-8")))


def _pandora(n_stuck: int, n_vehicles: int = 3, tools: Mapping[str, Collection[int]] = NO_CHANGE) -> Raw:
    """The inspection without its faults, with stuck valves, and each tool on the vehicles of these numbers alone."""
    raw = _tables(NAMES[0])
    del raw["fault"]
    raw["upset"] = [{"kind": "stuck"}] * n_stuck
    raw["vehicle"] = raw["vehicle"][:n_vehicles]
    for number, vehicle in enumerate(raw["vehicle"]):
        vehicle["sensor"] = [tool for tool in vehicle["sensor"] if number in tools.get(tool["type"], range(3))]
    return raw


def _drawn(seed: int) -> Raw:
    """One tool of one vehicle dies, at a time that is drawn."""
    rng, raw = random.Random(seed), _pandora(2)
    vehicle, tool = f"AUV0{rng.randrange(3)}", rng.choice(["arm", "wrench", "camera"])
    raw["fault"] = [{"vehicle": vehicle, "kind": "sensor", "sensor": tool, "at_s": rng.uniform(20.0, 1500.0)}]
    return raw


def _split(seed: int) -> Raw:
    """Arm and wrench on one vehicle each, which are drawn."""
    arm, wrench = random.Random(seed).sample(range(3), 2)
    return _pandora(2, 3, {"arm": [arm], "wrench": [wrench]})


def _fleet(seed: int) -> Raw:
    """One to three vehicles, of which one keeps all tools and the others may have none, lose one, or be lost."""
    rng = random.Random(seed)
    n = rng.choice([1, 2, 3])
    able, tools = rng.randrange(n), ("arm", "wrench", "camera")
    have = {kind: [number for number in range(n) if number == able or rng.random() < 0.6] for kind in tools}
    raw = _pandora(rng.randrange(4), n, have)
    raw["channel"]["per"], raw["fault"] = rng.choice([0.0, 0.2, 0.5]), []
    for vehicle in raw["vehicle"][:able] + raw["vehicle"][able + 1 :]:
        has = [kind["type"] for kind in vehicle["sensor"] if kind["type"] in tools]
        fault = {"vehicle": vehicle["name"], "at_s": rng.uniform(20.0, 2500.0)}
        if rng.random() < 0.4:
            raw["fault"].append({**fault, "kind": "lost"})
        elif has:
            raw["fault"].append({**fault, "kind": "sensor", "sensor": rng.choice(has)})
    return raw


def _trident(dead: str, at_s: float, n_divers: int = 2) -> Raw:
    """Arm and gripper of one vehicle die."""
    raw = _tables(NAMES[1])
    raw["fleet"]["size"] = 1 + n_divers
    raw["fault"] = [{"vehicle": dead, "kind": "sensor", "sensor": part, "at_s": at_s} for part in ("arm", "gripper")]
    return raw


LOST_WAYS = (
    ("arm", "gripper"),
    ("clamp", "hover"),
    ("camera", "forward sonar"),
    ("stereo", "sidescan", "arm", "gripper"),
)
"""Modules of Trident without which a vehicle has no way to recover."""
SPARED = ((), ("camera",), ("clamp",), ("arm",), ("stereo",))
"""Modules for each of which a vehicle has another."""


def _trident_drawn(seed: int) -> Raw:
    """Two or three divers, of which one keeps a way to do all and the others lose theirs; times and loss are drawn."""
    rng, raw = random.Random(seed), _tables(NAMES[1])
    divers = [f"IAUV0{number}" for number in range(rng.choice([2, 3]))]
    raw["fleet"]["size"], raw["channel"]["per"] = 1 + len(divers), rng.choice([0.0, 0.2, 0.5])
    able, raw["fault"] = rng.choice(divers), []
    for diver in divers:
        modules, at_s = rng.choice(SPARED if diver == able else LOST_WAYS), rng.uniform(50.0, 1900.0)
        raw["fault"] += [{"vehicle": diver, "kind": "sensor", "sensor": part, "at_s": at_s} for part in modules]
    return raw


def _lost(name: str, vehicle: str, times_s: Sequence[float], n_divers: int = 1) -> Callable[[int], Raw]:
    """A vehicle is lost at one of these times."""

    def tables(seed: int) -> Raw:
        raw = _tables(NAMES[1]) if name == NAMES[1] else _pandora(3, 3, {"wrench": [seed % 3]})
        if name == NAMES[1]:
            raw["fleet"]["size"] = 1 + n_divers
        of = vehicle or raw["vehicle"][seed % 3]["name"]
        raw["fault"] = [{"vehicle": of, "kind": "lost", "at_s": times_s[seed % len(times_s)]}]
        return raw

    return tables


def _search(*lost: str, transit_mps: float = 1.5) -> Callable[[int], Raw]:
    """A search in which vehicles are lost at one of four times, and the camera's is so fast."""

    def tables(seed: int) -> Raw:
        raw, at_s = _tables(NAMES[2]), (300.0, 900.0, 1500.0, 2400.0)[seed % 4]
        raw["fault"] = [{"vehicle": vehicle, "kind": "lost", "at_s": at_s} for vehicle in lost]
        raw["vehicle"][3]["transit_speed_mps"] = transit_mps
        return raw

    return tables


def _failing(*modules: tuple[str, float], n_divers: int = 1, each_s: float = 0.0) -> Callable[[int], Raw]:
    """Modules of Trident, by service, die at a time that is later by ``each_s`` for each seed."""

    def tables(seed: int) -> Raw:
        raw = _tables(NAMES[1])
        raw["fleet"]["size"] = 1 + n_divers
        raw["fault"] = []
        for service, at_s in modules:
            vehicle, _, sensor = service.partition(" ")
            died_s = at_s + each_s * seed
            raw["fault"].append({"vehicle": vehicle, "kind": "sensor", "sensor": sensor, "at_s": died_s})
        return raw

    return tables


def _at_one_look(tables: Callable[[int], Raw]) -> Callable[[int], Raw]:
    """A verdict may be wrong as often as one look of the sonar is, so that one look of either finder decides."""

    def hasty(seed: int) -> Raw:
        raw = tables(seed)
        raw["mission"].update(p_mistaken=0.45, p_missed=0.45)
        return raw

    return hasty


def _in_a_corner(seed: int) -> Raw:
    """The target lies in a corner of a block, one after another."""
    raw = _tables(NAMES[1])
    block, right, upper = raw["block"][seed % 2], seed // 2 % 2, seed // 4 % 2
    raw["recovery"]["target_m"] = [block["x_m"][right], block["y_m"][upper]]
    return raw


def _in_another_order(name: str) -> Callable[[int], Raw]:
    """The file lists the vehicles from last to first, and so they speak."""

    def tables(seed: int) -> Raw:
        raw = _tables(NAMES[1]) if name == NAMES[1] else _pandora(3, 3, {"wrench": [seed % 3]})
        raw["vehicle"].reverse()
        for slot, vehicle in enumerate(raw["vehicle"]):
            vehicle["slot"] = slot
        return raw

    return tables


def _on_one(tool: str, number: int) -> Callable[[int], Raw]:
    """A tool on one vehicle alone; the valves are stuck where that is the wrench."""
    tools = {tool: [number]}
    return lambda seed: _pandora(3 if tool == "wrench" else 1, 3, tools)


VARIANTS: dict[str, Callable[[int], Raw]] = {
    **{f"pandora: {tool} on AUV0{n} only": _on_one(tool, n) for tool in ("wrench", "arm", "camera") for n in range(3)},
    "pandora: arm and wrench on one each": _split,
    "pandora: no wrench": lambda seed: _pandora(3, 3, {"wrench": []}),
    "pandora: a tool dies": _drawn,
    "pandora: a fleet is drawn": _fleet,
    "pandora: one vehicle": lambda seed: _pandora(1, 1),
    "pandora: one vehicle, no wrench": lambda seed: _pandora(1, 1, {"wrench": []}),
    "trident: IAUV00 at 100 s": lambda seed: _trident("IAUV00", 100.0),
    "trident: IAUV00 at 1600 s": lambda seed: _trident("IAUV00", 1600.0),
    "trident: IAUV01 at 100 s": lambda seed: _trident("IAUV01", 100.0),
    "trident: IAUV01 at 1600 s": lambda seed: _trident("IAUV01", 1600.0),
    "trident: drawn": _trident_drawn,
    "trident: one diver at 100 s": lambda seed: _trident("IAUV00", 100.0, 1),
    "trident: nothing dies": _failing(),
    **{f"trident: camera at {at_s:.0f} s": _failing(("IAUV00 camera", at_s)) for at_s in (100.0, 400.0, 800.0)},
    "trident: one look decides": _at_one_look(_failing()),
    "trident: one look decides, camera at 100 s": _at_one_look(_failing(("IAUV00 camera", 100.0))),
    "trident: camera between two looks": _failing(("IAUV00 camera", 1480.0), each_s=6.0),
    "trident: both finders": _failing(("IAUV00 camera", 1400.0), ("IAUV00 forward sonar", 1450.0), each_s=10.0),
    "trident: arm, and gripper of the other": _failing(("IAUV01 gripper", 1.0), ("IAUV00 arm", 1500.0), n_divers=2),
    "trident: who chooses": _failing(("IAUV00 recogniser", 100.0), ("ASV00 console", 200.0)),
    "trident: who surveys": _failing(("ASV00 multibeam", 100.0), ("IAUV00 stereo", 200.0), ("IAUV00 sidescan", 300.0)),
    "trident: the only diver is lost": _lost(NAMES[1], "IAUV00", (300.0, 900.0, 1450.0, 1550.0)),
    "trident: the first diver is lost": _lost(NAMES[1], "IAUV00", (300.0, 900.0, 1450.0, 1600.0), 2),
    "trident: ASV00 is lost": _lost(NAMES[1], "ASV00", (300.0, 900.0, 1300.0, 1500.0)),
    "trident: target in a corner": _in_a_corner,
    "trident: vehicles in another order": _in_another_order(NAMES[1]),
    "pandora: who has the wrench is lost": _lost(NAMES[0], "", (600.0,)),
    "pandora: vehicles in another order": _in_another_order(NAMES[0]),
    "arrows: nobody is lost": _search(),
    "arrows: the camera is twice as fast": _search(transit_mps=3.0),
    "arrows: AUV01 is lost": _search("AUV01"),
    "arrows: the camera is lost": _search("AUV03"),
    "arrows: ASV00 is lost": _search("ASV00"),
    "arrows: all but AUV01 are lost": _search("ASV00", "AUV02", "AUV03"),
    "arrows: all but the camera are lost": _search("ASV00", "AUV01", "AUV02"),
}


def flown(raw: Raw, seed: int, settings: Sequence[str] = ()) -> Run:
    """A run of these tables, some keys set as ``KEY=VALUE``."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "variant.toml"
        path.write_text(tomli_w.dumps(raw), encoding="utf-8")
        return run(load(str(path), [("--set", setting) for setting in settings]), seed)


def shares_of(runs: Sequence[Run]) -> Iterator[str]:
    """Of each headline share of which more is better, its mean and interval."""
    for metric in runs[0].mission.metrics:
        if metric.headline and metric.better is Better.HIGHER and metric.name.endswith("_fraction"):
            values = [value for done in runs if isinstance(value := metric.of(done), float)]
            yield f"{metric.name} {fmean(values):.2f}" + (f" ± {t_half_width(values):.2f}" if len(values) > 1 else "")


def main() -> int:
    """Print a line for each variant."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.variants", description=__doc__)
    parser.add_argument("name", nargs="*", help="beginnings of variants; all by default")
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    arguments = parser.parse_args()
    if unknown := [one for one in arguments.name if not any(name.startswith(one) for name in VARIANTS)]:
        parser.error(f"no variant begins with {', '.join(unknown)}: there are {', '.join(VARIANTS)}")
    if arguments.repeats < 1:
        parser.error(f"--repeats is {arguments.repeats}: allowed is 1 or more")
    for name, tables in VARIANTS.items():
        if arguments.name and not name.startswith(tuple(arguments.name)):
            continue
        runs = [flown(tables(seed), seed, arguments.set) for seed in range(1, arguments.repeats + 1)]
        done = sum(one.completed for one in runs)
        low, high = wilson_interval(done, len(runs))[:2]
        over_s = max(one.recorder.rows("trajectories")[-1][0] for one in runs)
        n_said = sum(any(stone.name == "impossible" for stone in one.milestones) for one in runs)
        n_mistaken = sum(any(stone.name == "mistaken" for stone in one.milestones) for one in runs)
        times_s = [one.milestones[-1].time_s for one in runs if one.completed]
        of = f"{done} of {len(runs)} ({low:.0%} to {high:.0%})"
        of += f" after {sum(times_s) / done:.0f} s" if done else ""
        n_why = sum(bool(one.reason) for one in runs if not one.completed)
        said = [f"impossible said in {n_said}", f"a decoy recovered in {n_mistaken}", *shares_of(runs)]
        said += [f"{n_why} of {len(runs) - done} say why not"] if done < len(runs) else []
        print(f"{name}: {of}, the last over by {over_s:.0f} s, {', '.join(said)}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
