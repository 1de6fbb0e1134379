"""The five kinds of problems for GTPyhop, translated by hand: the same tasks, methods and actions.

As in GTPyhop's own translations, the state holds all facts of the problem; a predicate is a dictionary or a set, by
whichever a method asks for fewest. A method of GTPyhop gives one decomposition, so variables that HDDL leaves open are
bound in code, to the first objects that will do; where the search may have to go back, one method is declared for each
way to bind them. Roads go in circles, which GTPyhop does not notice: the way by other places is looked up beforehand.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from remoras.htn.hddl import Problem

Todo = list[tuple[str, ...]]
WAYS = 4
"""Waypoints beside a waypoint, at most."""


def _sets(problem: Problem) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, *args in problem.facts:
        found.setdefault(name, set()).add(args[0] if len(args) == 1 else tuple(args))
    return found


def _dict(problem: Problem, predicate: str) -> dict[str, str]:
    """First arguments to second ones."""
    return {key[1]: key[2] for key in problem.facts if key[0] == predicate}


def _lists(problem: Problem, predicate: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name, *args in problem.facts:
        if name == predicate:
            found.setdefault(args[0], []).append(args[1])
    return found


def _todo(problem: Problem) -> Todo:
    return [(task.name, *task.args) for task in problem.tasks]


def towers(gtpyhop: Any, problem: Problem) -> tuple[Any, Todo]:
    """Declare actions and methods; returns state and tasks."""

    def move(state: Any, ring: str, x: str, a: str, y: str, b: str) -> Any:
        if state.top[a] == ring and state.on[ring] == x and state.top[b] == y and (ring, y) in state.smaller:
            state.on[ring], state.top[a], state.top[b] = y, x, ring
            return state
        return None

    def from_the_top(state: Any, a: str, b: str, c: str) -> Any:
        return [("descend", state.top[a], a, b, c)] if state.top[a] != a else None

    def lowest(state: Any, ring: str, a: str, b: str, c: str) -> Any:
        return [("turn", a, c, b)] if state.on[ring] == a else None

    def deeper(state: Any, ring: str, a: str, b: str, c: str) -> Any:
        below = state.on[ring]
        return [("descend", below, a, c, b)] if below in state.on else None

    def turned(state: Any, a: str, b: str, c: str) -> Any:
        return [("carry", a, b), ("exchange", a, b, c)]

    def both_empty(state: Any, a: str, b: str, c: str) -> Any:
        return [] if state.top[a] == a and state.top[c] == c else None

    def there(state: Any, a: str, b: str, c: str) -> Any:
        return [("carry", a, c), ("turn", b, c, a)] if (state.top[a], state.top[c]) in state.smaller else None

    def back(state: Any, a: str, b: str, c: str) -> Any:
        return [("carry", c, a), ("turn", b, c, a)] if (state.top[c], state.top[a]) in state.smaller else None

    def carried(state: Any, a: str, b: str) -> Any:
        ring, y = state.top[a], state.top[b]
        return [("move", ring, state.on[ring], a, y, b)] if (ring, y) in state.smaller else None

    gtpyhop.declare_actions(move)
    gtpyhop.declare_task_methods("shift", from_the_top)
    gtpyhop.declare_task_methods("descend", lowest, deeper)
    gtpyhop.declare_task_methods("turn", turned)
    gtpyhop.declare_task_methods("exchange", both_empty, there, back)
    gtpyhop.declare_task_methods("carry", carried)
    top = {peg: x for x, peg in _dict(problem, "top").items()}
    state = gtpyhop.State("start", on=_dict(problem, "on"), top=top, smaller=_sets(problem)["smaller"])
    return state, _todo(problem)


# Complex only by the number of small functions inside, one for each action or method of the domain.
def transport(gtpyhop: Any, problem: Problem) -> tuple[Any, Todo]:  # noqa: C901
    """Declare actions and methods; returns state and tasks."""

    def drive(state: Any, v: str, p: str, q: str) -> Any:
        if state.at[v] == p and q in state.road[p]:
            state.at[v] = q
            return state
        return None

    def stay(state: Any, v: str, p: str) -> Any:
        return state if state.at[v] == p else None

    def pick(state: Any, v: str, p: str, i: str, m: str, n: str) -> Any:
        if state.at[v] == p and state.at.get(i) == p and state.has[v] == n and state.one_less.get(n) == m:
            del state.at[i]
            state.inside[i] = v
            state.has[v] = m
            return state
        return None

    def drop(state: Any, v: str, p: str, i: str, m: str, n: str) -> Any:
        if state.at[v] == p and state.inside.get(i) == v and state.has[v] == m and state.one_less.get(n) == m:
            del state.inside[i]
            state.at[i] = p
            state.has[v] = n
            return state
        return None

    def brought(state: Any, i: str, q: str) -> Any:
        p, v = state.at[i], next(iter(state.has))
        return [("reach", v, p), ("take", v, p, i), ("reach", v, q), ("leave", v, q, i)]

    def taken(state: Any, v: str, p: str, i: str) -> Any:
        n = state.has[v]
        return [("pick", v, p, i, state.one_less[n], n)] if n in state.one_less else None

    def left(state: Any, v: str, p: str, i: str) -> Any:
        m = state.has[v]
        return [("drop", v, p, i, m, n) for n, less in state.one_less.items() if less == m]

    def by_one_road(state: Any, v: str, q: str) -> Any:
        return [("drive", v, state.at[v], q)] if q in state.road[state.at[v]] else None

    def by_way_of(state: Any, v: str, q: str) -> Any:
        came_from, due = {q: q}, [q]
        for p in due:
            for other in state.road[p]:
                if other not in came_from:
                    came_from[other] = p
                    due.append(other)
        way = state.at[v]
        while came_from[way] != q:
            way = came_from[way]
        return [("reach", v, way), ("drive", v, way, q)]

    def is_there(state: Any, v: str, q: str) -> Any:
        return [("stay", v, q)] if state.at[v] == q else None

    gtpyhop.declare_actions(drive, stay, pick, drop)
    gtpyhop.declare_task_methods("deliver", brought)
    gtpyhop.declare_task_methods("take", taken)
    gtpyhop.declare_task_methods("leave", left)
    gtpyhop.declare_task_methods("reach", is_there, by_one_road, by_way_of)
    one_less = {n: m for m, n in _dict(problem, "one_less").items()}
    state = gtpyhop.State(
        "start", at=_dict(problem, "at"), inside={}, has=_dict(problem, "has"), one_less=one_less,
        road=_lists(problem, "road"),
    )  # fmt: skip
    return state, _todo(problem)


# Complex only by the number of small functions inside, one for each action or method of the domain.
def satellite(gtpyhop: Any, problem: Problem) -> tuple[Any, Todo]:  # noqa: C901
    """Declare actions and methods; returns state and tasks."""

    def turn(state: Any, s: str, d: str, old: str) -> Any:
        if state.facing[s] == old and d != old:
            state.facing[s] = d
            return state
        return None

    def switch_on(state: Any, i: str, s: str) -> Any:
        if state.aboard[i] == s and s in state.power:
            state.on.add(i)
            state.calibrated.discard(i)
            state.power.discard(s)
            return state
        return None

    def switch_off(state: Any, i: str, s: str) -> Any:
        if state.aboard[i] == s and i in state.on:
            state.on.discard(i)
            state.power.add(s)
            return state
        return None

    def calibrate(state: Any, s: str, i: str, d: str) -> Any:
        if state.aboard[i] == s and state.target[i] == d and state.facing[s] == d and i in state.on:
            state.calibrated.add(i)
            return state
        return None

    def expose(state: Any, s: str, d: str, i: str, m: str) -> Any:
        if (
            i in state.calibrated and state.aboard[i] == s and state.takes[i] == m and i in state.on
            and state.facing[s] == d
        ):  # fmt: skip
            state.image.add((d, m))
            return state
        return None

    def skip(state: Any) -> Any:
        return state

    def observed(state: Any, d: str, m: str) -> Any:
        for i, mode in state.takes.items():
            if mode == m:
                s = state.aboard[i]
                return [("prepare", s, i, d), ("expose", s, d, i, m)]
        return None

    def prepared(state: Any, s: str, i: str, d: str) -> Any:
        return [("activate", s, i), ("face", s, d)]

    def in_place_of(state: Any, s: str, i: str) -> Any:
        if s in state.power:
            return None
        for other in state.on:
            if state.aboard[other] == s:
                return [("free_power", s, other), ("switch_on", i, s), ("adjust", s, i, state.target[i])]
        return None

    def with_free_power(state: Any, s: str, i: str) -> Any:
        if s not in state.power:
            return None
        return [("switch_on", i, s), ("adjust", s, i, state.target[i])]

    def is_on(state: Any, s: str, i: str) -> Any:
        return [("skip",)] if i in state.on else None

    def adjusted(state: Any, s: str, i: str, d: str) -> Any:
        return [("prepare", s, i, d), ("calibrate", s, i, d)] if i not in state.calibrated else None

    def is_adjusted(state: Any, s: str, i: str, d: str) -> Any:
        return [("skip",)] if i in state.calibrated else None

    def freed(state: Any, s: str, i: str) -> Any:
        return [("switch_off", i, s)] if i in state.on and s not in state.power else None

    def turned(state: Any, s: str, d: str) -> Any:
        return [("turn", s, d, state.facing[s])] if state.facing[s] != d else None

    def is_turned(state: Any, s: str, d: str) -> Any:
        return [("skip",)] if state.facing[s] == d else None

    gtpyhop.declare_actions(turn, switch_on, switch_off, calibrate, expose, skip)
    gtpyhop.declare_task_methods("observe", observed)
    gtpyhop.declare_task_methods("prepare", prepared)
    gtpyhop.declare_task_methods("activate", is_on, with_free_power, in_place_of)
    gtpyhop.declare_task_methods("adjust", adjusted, is_adjusted)
    gtpyhop.declare_task_methods("free_power", freed)
    gtpyhop.declare_task_methods("face", turned, is_turned)
    state = gtpyhop.State(
        "start", aboard=_dict(problem, "aboard"), takes=_dict(problem, "takes"), target=_dict(problem, "target"),
        power=_sets(problem)["power"], facing=_dict(problem, "facing"), on=set(), calibrated=set(), image=set(),
    )  # fmt: skip
    return state, _todo(problem)


# Complex only by the number of small functions inside, one for each action or method of the domain.
def childsnack(gtpyhop: Any, problem: Problem) -> tuple[Any, Todo]:  # noqa: C901
    """Declare actions and methods; returns state and tasks."""

    def _make(state: Any, s: str, b: str, f: str) -> Any:
        if s in state.unmade and b in state.bread_left and f in state.filling_left:
            del state.unmade[s], state.bread_left[b], state.filling_left[f]
            state.made.add(s)
            return state
        return None

    def make(state: Any, s: str, b: str, f: str) -> Any:
        return _make(state, s, b, f)

    def make_pure(state: Any, s: str, b: str, f: str) -> Any:
        if b in state.pure_bread and f in state.pure_filling and _make(state, s, b, f):
            state.pure.add(s)
            return state
        return None

    def put(state: Any, s: str, t: str) -> Any:
        if s in state.made and state.at[t] == "kitchen":
            state.made.discard(s)
            state.on_tray[s] = t
            return state
        return None

    def move(state: Any, t: str, p: str, q: str) -> Any:
        if state.at[t] == p:
            del state.at[t]
            state.at[t] = q
            return state
        return None

    def _give(state: Any, s: str, c: str, t: str, p: str) -> Any:
        if state.waits[c] == p and state.on_tray.get(s) == t and state.at[t] == p:
            del state.on_tray[s]
            state.served.add(c)
            return state
        return None

    def give(state: Any, s: str, c: str, t: str, p: str) -> Any:
        return _give(state, s, c, t, p) if c in state.tolerant else None

    def give_pure(state: Any, s: str, c: str, t: str, p: str) -> Any:
        return _give(state, s, c, t, p) if c in state.allergic and s in state.pure else None

    def _first(found: Any, wanted: Callable[[str], bool]) -> Any:
        return next((item for item in found if wanted(item)), None)

    def without_gluten(state: Any, c: str) -> Any:
        if c not in state.allergic:
            return None
        b = _first(state.bread_left, lambda bread: bread in state.pure_bread)
        f = _first(state.filling_left, lambda filling: filling in state.pure_filling)
        return _served(state, c, "_pure", b, f)

    def with_gluten(state: Any, c: str) -> Any:
        if c not in state.tolerant:
            return None
        b = _first(state.bread_left, lambda bread: bread not in state.pure_bread)
        f = _first(state.filling_left, lambda filling: filling not in state.pure_filling)
        return _served(state, c, "", b, f)

    def _served(state: Any, c: str, how: str, b: Any, f: Any) -> Any:
        s, p = next(iter(state.unmade), None), state.waits[c]
        t = _first(state.at, lambda tray: state.at[tray] == "kitchen")
        if None in (s, b, f, t):
            return None
        return [(f"make{how}", s, b, f), ("put", s, t), ("move", t, "kitchen", p), (f"give{how}", s, c, t, p),
                ("move", t, p, "kitchen")]  # fmt: skip

    gtpyhop.declare_actions(make, make_pure, put, move, give, give_pure)
    gtpyhop.declare_task_methods("serve", without_gluten, with_gluten)
    sets = _sets(problem)
    ordered = {name: {key[1]: True for key in problem.facts if key[0] == name}
               for name in ("unmade", "bread_left", "filling_left")}  # fmt: skip
    state = gtpyhop.State(
        "start", **ordered, pure_bread=sets["pure_bread"], pure_filling=sets["pure_filling"], made=set(), pure=set(),
        on_tray={}, at=_dict(problem, "at"), waits=_dict(problem, "waits"), allergic=sets["allergic"],
        tolerant=sets["tolerant"], served=set(),
    )  # fmt: skip
    return state, _todo(problem)
