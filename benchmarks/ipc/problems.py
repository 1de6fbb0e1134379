"""Five problems of each of five kinds of the International Planning Competition 2020, total order, of growing size.

The competition's repository states no licence for its files, so these domains are written anew, with the same ways to
decompose the same tasks; ``tests/tools/ipc.py`` plans the competition's own files from a copy of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise
from pathlib import Path

from remoras.htn.hddl import Problem, parse

FOLDER = Path(__file__).parent
NUMBERS = range(1, 6)
Fact = tuple[str, ...]


def _names(kind: str, count: int) -> list[str]:
    return [f"{kind}{number}" for number in range(1, count + 1)]


def _text(
    name: str,
    objects: Mapping[str, Iterable[str]],
    facts: Iterable[Fact],
    tasks: Iterable[Fact],
    goal: Iterable[Fact] = (),
) -> str:
    def forms(found: Iterable[Fact]) -> str:
        return " ".join(f"({' '.join(atom)})" for atom in found)

    typed = " ".join(f"{' '.join(ones)} - {kind}" for kind, ones in objects.items())
    return (
        f"(define (problem p) (:domain {name}) (:objects {typed})\n  (:htn :ordered-tasks (and {forms(tasks)}))\n"
        f"  (:init {forms(facts)})\n  (:goal (and {forms(goal)})))"
    )


def towers(number: int) -> str:
    """A tower of ``number`` + 2 rings, to be shifted from peg a to peg c."""
    rings, pegs = _names("r", number + 2), ["a", "b", "c"]
    stack = [*rings, "a"]
    facts = [("on", upper, lower) for upper, lower in pairwise(stack)]
    facts += [("top", "r1", "a"), ("top", "b", "b"), ("top", "c", "c")]
    facts += [("smaller", ring, other) for place, ring in enumerate(rings) for other in (*rings[place + 1 :], *pegs)]
    goal = [("on", upper, lower) for upper, lower in pairwise([*rings, "c"])]
    return _text("towers", {"ring": rings, "peg": pegs}, facts, [("shift", "a", "b", "c")], goal)


def transport(number: int) -> str:
    """``number`` + 1 parcels, each to a place of its own, on a tree of roads; two vehicles."""
    places, parcels, vehicles = _names("p", 3 * number + 3), _names("i", number + 1), _names("v", 2)
    facts: list[Fact] = []
    for place, name in enumerate(places[1:], 1):
        above = places[(place - 1) // 2]
        facts += [("road", above, name), ("road", name, above)]
    facts += [("at", vehicle, places[place]) for place, vehicle in enumerate(vehicles)]
    facts += [("has", vehicle, "n2") for vehicle in vehicles]
    facts += [("one_less", "n0", "n1"), ("one_less", "n1", "n2")]
    facts += [("at", parcel, places[2 * place + 1]) for place, parcel in enumerate(parcels)]
    wanted = [(parcel, places[-1 - 2 * place]) for place, parcel in enumerate(parcels)]
    objects = {"vehicle": vehicles, "parcel": parcels, "place": places, "room": ["n0", "n1", "n2"]}
    goal = [("at", *package) for package in wanted]
    return _text("transport", objects, facts, [("deliver", *delivery) for delivery in wanted], goal)


def satellite(number: int) -> str:
    """``number`` + 1 satellites with two instruments each, three modes, four images for each satellite."""
    satellites, modes, directions = _names("s", number + 1), _names("m", 3), _names("d", 3 * number + 4)
    instruments = _names("i", 2 * len(satellites))
    facts: list[Fact] = []
    for place, one in enumerate(satellites):
        facts += [("power", one), ("facing", one, directions[place])]
    for place, instrument in enumerate(instruments):
        facts += [("aboard", instrument, satellites[place // 2]), ("takes", instrument, modes[place % 3])]
        facts.append(("target", instrument, directions[(2 * place + 3) % len(directions)]))
    wanted = [
        (directions[image % len(directions)], modes[(image + image // len(directions)) % 3])
        for image in range(4 * len(satellites))
    ]
    objects = {"satellite": satellites, "direction": directions, "instrument": instruments, "mode": modes}
    goal = [("image", *image) for image in wanted]
    return _text("satellite", objects, facts, [("observe", *image) for image in wanted], goal)


def rover(number: int) -> str:
    """Two rovers on ``number`` + 4 rows of three waypoints, soil and rock to be sampled, two images to be taken."""
    waypoints, rovers = _names("w", 3 * (number + 4)), _names("x", 2)
    facts: list[Fact] = []
    ways = [(place, place + step) for place in range(len(waypoints)) for step in (1, 3)
            if place + step < len(waypoints) and (step == 3 or place % 3 != 2)]  # fmt: skip
    for low, high in ways:
        for pair in ((low, high), (high, low)):
            names = [waypoints[place] for place in pair]
            facts += [("sight", *names), *(("way", one, *names) for one in rovers)]
    for place, one in enumerate(rovers):
        camera, store = f"c{place + 1}", f"s{place + 1}"
        facts += [("at", one, waypoints[place]), ("store_of", store, one), ("empty", store), ("for_images", one)]
        facts += [("aboard", camera, one), ("takes", camera, f"m{place + 1}"), ("target", camera, "o1")]
    facts += [("for_soil", rovers[0]), ("for_rock", rovers[1]), ("stands", "l1", waypoints[4])]
    facts += [("seen_from", "o1", waypoints[3]), ("seen_from", "o2", waypoints[-2])]
    soil, rock = waypoints[2::4], waypoints[1::4]
    facts += [*(("soil", place) for place in soil), *(("rock", place) for place in rock)]
    images = [("o1", "m1"), ("o2", "m2")]
    objects = {"rover": rovers, "waypoint": waypoints, "store": ["s1", "s2"], "camera": ["c1", "c2"],
               "objective": ["o1", "o2"], "mode": ["m1", "m2"], "lander": ["l1"]}  # fmt: skip
    tasks: list[Fact] = [*(("soil_data", place) for place in soil), *(("rock_data", place) for place in rock)]
    goal: list[Fact] = [*(("told_soil", place) for place in soil), *(("told_rock", place) for place in rock)]
    tasks += [("image_data", *image) for image in images]
    goal += [("told_image", *image) for image in images]
    return _text("rover", objects, facts, tasks, goal)


def childsnack(number: int) -> str:
    """``number`` + 7 children, every third of them allergic, at three tables; three trays."""
    children, tables, trays = _names("c", number + 7), _names("t", 3), _names("y", 3)
    breads, fillings = _names("b", len(children)), _names("f", len(children))
    sandwiches = _names("s", len(children) + number)
    is_allergic = [place % 3 == 0 for place in range(len(children))]
    facts: list[Fact] = [("at", tray, "kitchen") for tray in trays]
    for place, child in enumerate(children):
        facts += [("bread_left", breads[place]), ("filling_left", fillings[place])]
        facts += [("waits", child, tables[place % 3]), ("allergic" if is_allergic[place] else "tolerant", child)]
        if is_allergic[place]:
            facts += [("pure_bread", breads[place]), ("pure_filling", fillings[place])]
    facts += [("unmade", sandwich) for sandwich in sandwiches]
    objects = {"child": children, "bread": breads, "filling": fillings, "sandwich": sandwiches, "tray": trays,
               "place": tables}  # fmt: skip
    goal = [("served", child) for child in children]
    return _text("childsnack", objects, facts, [("serve", child) for child in children], goal)


KINDS: Mapping[str, Callable[[int], str]] = {
    "towers": towers, "transport": transport, "satellite": satellite, "rover": rover, "childsnack": childsnack,
}  # fmt: skip
"""The text of a problem by its number, from 1; a domain's text is in the file of its name."""


def problem(kind: str, number: int) -> Problem:
    """Problem ``number`` of a kind, read."""
    path = FOLDER / f"{kind}.hddl"
    return parse(path.read_text(encoding="utf-8"), KINDS[kind](number), domain_file=path.name)
