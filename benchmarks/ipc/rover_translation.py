"""The rovers for GTPyhop; see ``translations``."""

from __future__ import annotations

from typing import Any

from benchmarks.ipc.translations import WAYS, Todo, _dict, _lists, _sets, _todo
from remoras.htn.hddl import Problem


def rover(gtpyhop: Any, problem: Problem) -> tuple[Any, Todo]:
    """Declare actions and methods; returns state and tasks."""
    _declare_actions(gtpyhop)
    _declare_ways(gtpyhop)
    _declare_jobs(gtpyhop)
    sets = _sets(problem)
    ways: dict[str, dict[str, list[str]]] = {}
    for key in problem.facts:
        if key[0] == "way":
            ways.setdefault(key[1], {}).setdefault(key[2], []).append(key[3])
    seen_by: dict[str, list[str]] = {}
    for key in problem.facts:
        if key[0] == "sight":
            seen_by.setdefault(key[2], []).append(key[1])
    state = gtpyhop.State(
        "start", at=_dict(problem, "at"), way=ways, sight=sets["sight"], seen_by=seen_by, passed=set(),
        stands=_dict(problem, "stands"), store=_dict(problem, "store_of"), empty=sets["empty"], full=set(),
        for_soil=sets["for_soil"], for_rock=sets["for_rock"], for_images=sets["for_images"], soil=sets["soil"],
        rock=sets["rock"], has_soil=set(), has_rock=set(), has_image=set(), aboard=_dict(problem, "aboard"),
        takes=_dict(problem, "takes"), target=_dict(problem, "target"), seen_from=_lists(problem, "seen_from"),
        calibrated=set(), told_soil=set(), told_rock=set(), told_image=set(),
    )  # fmt: skip
    return state, _todo(problem)


# Complex only by the number of small functions inside, one for each action or method of the domain.
def _declare_actions(gtpyhop: Any) -> None:  # noqa: C901
    def drive(state: Any, x: str, v: str, w: str) -> Any:
        if state.at[x] == v and w in state.way[x][v] and (v, w) in state.sight:
            state.at[x] = w
            return state
        return None

    def _sample(state: Any, kind: str, x: str, s: str, w: str) -> Any:
        left = getattr(state, kind)
        if not (state.at[x] == w and w in left and x in getattr(state, f"for_{kind}")):
            return None
        if state.store[s] != x or s not in state.empty:
            return None
        left.discard(w)
        state.empty.discard(s)
        state.full.add(s)
        getattr(state, f"has_{kind}").add((x, w))
        return state

    def sample_soil(state: Any, x: str, s: str, w: str) -> Any:
        return _sample(state, "soil", x, s, w)

    def sample_rock(state: Any, x: str, s: str, w: str) -> Any:
        return _sample(state, "rock", x, s, w)

    def drop(state: Any, x: str, s: str) -> Any:
        if state.store[s] == x and s in state.full:
            state.full.discard(s)
            state.empty.add(s)
            return state
        return None

    def calibrate(state: Any, x: str, c: str, o: str, w: str) -> Any:
        if not (x in state.for_images and state.aboard[c] == x and state.target[c] == o and state.at[x] == w):
            return None
        if w not in state.seen_from[o]:
            return None
        state.calibrated.add((c, x))
        return state

    def picture(state: Any, x: str, w: str, o: str, c: str, m: str) -> Any:
        if not ((c, x) in state.calibrated and state.aboard[c] == x and x in state.for_images and state.takes[c] == m):
            return None
        if state.at[x] != w or w not in state.seen_from[o]:
            return None
        state.calibrated.discard((c, x))
        state.has_image.add((x, o, m))
        return state

    def _tell(state: Any, kind: str, what: Any, x: str, place: str, of_lander: str, u: str) -> Any:
        if not (state.at[x] == place and state.stands[of_lander] == u and (place, u) in state.sight):
            return None
        if (x, *what) not in getattr(state, f"has_{kind}"):
            return None
        getattr(state, f"told_{kind}").add(what)
        return state

    def tell_soil(state: Any, x: str, lander: str, w: str, v: str, u: str) -> Any:
        return _tell(state, "soil", (w,), x, v, lander, u)

    def tell_soil_here(state: Any, x: str, lander: str, w: str, u: str) -> Any:
        return _tell(state, "soil", (w,), x, w, lander, u)

    def tell_rock(state: Any, x: str, lander: str, w: str, v: str, u: str) -> Any:
        return _tell(state, "rock", (w,), x, v, lander, u)

    def tell_rock_here(state: Any, x: str, lander: str, w: str, u: str) -> Any:
        return _tell(state, "rock", (w,), x, w, lander, u)

    def tell_image(state: Any, x: str, lander: str, o: str, m: str, v: str, u: str) -> Any:
        return _tell(state, "image", (o, m), x, v, lander, u)

    def mark(state: Any, w: str) -> Any:
        state.passed.add(w)
        return state

    def unmark(state: Any, w: str) -> Any:
        if w in state.passed:
            state.passed.discard(w)
            return state
        return None

    def skip(state: Any) -> Any:
        return state

    gtpyhop.declare_actions(
        drive, sample_soil, sample_rock, drop, calibrate, picture, tell_soil, tell_soil_here, tell_rock, tell_rock_here,
        tell_image, mark, unmark, skip,
    )  # fmt: skip


def _declare_ways(gtpyhop: Any) -> None:
    def is_there(state: Any, x: str, w: str) -> Any:
        return [("skip",)] if state.at[x] == w else None

    def leave(state: Any, x: str, w: str) -> Any:
        v = state.at[x]
        return [("mark", v), ("go_on", x, v, w), ("unmark", v)]

    def arrived(state: Any, x: str, v: str, w: str) -> Any:
        return [("skip",)] if state.at[x] == w else None

    def last_leg(state: Any, x: str, v: str, w: str) -> Any:
        return [("drive", x, v, w)] if w in state.way[x][v] else None

    def one_leg(number: int) -> Any:
        def leg(state: Any, x: str, v: str, w: str) -> Any:
            ways = state.way[x][v]
            if w in ways or number >= len(ways) or ways[number] in state.passed:
                return None
            mid = ways[number]
            return [("drive", x, v, mid), ("mark", mid), ("go_on", x, mid, w), ("unmark", mid)]

        leg.__name__ = f"leg_{number}"
        return leg

    gtpyhop.declare_task_methods("go", is_there, leave)
    gtpyhop.declare_task_methods("go_on", arrived, last_leg, *map(one_leg, range(WAYS)))


# Complex only by the number of small functions inside, one for each action or method of the domain.
def _declare_jobs(gtpyhop: Any) -> None:  # noqa: C901
    def is_empty(state: Any, s: str, x: str) -> Any:
        return [("skip",)] if s in state.empty else None

    def emptied(state: Any, s: str, x: str) -> Any:
        return [("drop", x, s)] if s not in state.empty else None

    def _sampled(state: Any, kind: str, w: str) -> Any:
        for s, x in state.store.items():
            if x in getattr(state, f"for_{kind}"):
                return [("go", x, w), ("clear", s, x), (f"sample_{kind}", x, s, w), (f"report_{kind}", x, w)]
        return None

    def soil_sampled(state: Any, w: str) -> Any:
        return _sampled(state, "soil", w)

    def rock_sampled(state: Any, w: str) -> Any:
        return _sampled(state, "rock", w)

    def _elsewhere(state: Any, tell: str, x: str, *what: str) -> Any:
        for lander, u in state.stands.items():
            for v in state.seen_by[u]:
                return [("go", x, v), (tell, x, lander, *what, v, u)]
        return None

    def soil_elsewhere(state: Any, x: str, w: str) -> Any:
        return _elsewhere(state, "tell_soil", x, w)

    def rock_elsewhere(state: Any, x: str, w: str) -> Any:
        return _elsewhere(state, "tell_rock", x, w)

    def image_elsewhere(state: Any, x: str, o: str, m: str) -> Any:
        return _elsewhere(state, "tell_image", x, o, m)

    def _here(state: Any, tell: str, x: str, w: str) -> Any:
        for lander, u in state.stands.items():
            if (w, u) in state.sight and state.at[x] == w:
                return [(tell, x, lander, w, u)]
        return None

    def soil_here(state: Any, x: str, w: str) -> Any:
        return _here(state, "tell_soil_here", x, w)

    def rock_here(state: Any, x: str, w: str) -> Any:
        return _here(state, "tell_rock_here", x, w)

    def pictured(state: Any, o: str, m: str) -> Any:
        for c, x in state.aboard.items():
            if x in state.for_images and state.takes[c] == m:
                w = state.seen_from[o][0]
                return [("set_up", x, c), ("go", x, w), ("picture", x, w, o, c, m), ("report_image", x, o, m)]
        return None

    def is_set_up(state: Any, x: str, c: str) -> Any:
        o = state.target[c]
        w = state.seen_from[o][0]
        return [("go", x, w), ("calibrate", x, c, o, w)]

    gtpyhop.declare_task_methods("clear", is_empty, emptied)
    gtpyhop.declare_task_methods("soil_data", soil_sampled)
    gtpyhop.declare_task_methods("rock_data", rock_sampled)
    gtpyhop.declare_task_methods("report_soil", soil_elsewhere, soil_here)
    gtpyhop.declare_task_methods("report_rock", rock_elsewhere, rock_here)
    gtpyhop.declare_task_methods("report_image", image_elsewhere)
    gtpyhop.declare_task_methods("image_data", pictured)
    gtpyhop.declare_task_methods("set_up", is_set_up)
