"""What has to hold between the tables of this mission; malformed tables are passed over, as everywhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.pandora.scenario import ANY, KINDS
from missions.scenarios.abilities import sensor_tables
from missions.scenarios.tables import (
    PointM,
    Raw,
    bounds_of,
    entries,
    names_of,
    one_of,
    outside_faults,
    point_of,
)

APART_M = 2.5
"""Parts lie so far from each other at least, so that a tool touches one alone."""
SEEN_APART_M = 0.5
"""So far apart lie points that are looked at, as far as a vehicle that holds its place may be off."""


def parts_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """All faults of parts and of what is upset.

    Args:
        raw: the tables as TOML has them.
    """
    if not any(names_of(raw, kind) for kind in KINDS):
        tables = ", ".join(f"[[{kind}]]" for kind in KINDS)
        yield ConfigurationFault("panel", "", f"there is nothing to be serviced: give one of {tables}")
    yield from _names(raw)
    placed = [(f"{kind}.{name}", points_m) for kind, name, points_m in _points(raw)]
    keys = [(f"{key}.{_key_of(key)}", point_m) for key, points_m in placed for point_m in points_m]
    yield from outside_faults(raw, keys)
    yield from _overlaps(raw)
    yield from _tools(raw)
    for valve in entries(raw, "valve"):
        yield from one_of(f"valve.{valve.get('name')}.panel", valve.get("panel"), names_of(raw, "panel"))
    yield from _upsets(raw)


def _tools(raw: Raw) -> Iterator[ConfigurationFault]:
    """Kinds of sensors that the plan demands, and that no vehicle has. Nobody plans to use a wrench."""
    carried = {table.get("type", "camera") for vehicle in entries(raw, "vehicle") for table in sensor_tables(vehicle)}
    demanded = {"camera": tuple(KINDS), "arm": ("valve", "anode")}
    for kind, parts in demanded.items():
        names = [name for part in parts for name in names_of(raw, part)]
        if names and carried and kind not in carried:
            allowed = f'no vehicle has one, and the plan demands it for {names[0]}; allowed: type = "{kind}" in one'
            yield ConfigurationFault("vehicle.sensor", kind, allowed)


def _key_of(key: str) -> str:
    return "points_m" if key.startswith("chain.") else "position_m"


def _points(raw: Raw) -> Iterator[tuple[str, str, list[PointM]]]:
    """Kind, name and points of every part."""
    for kind in KINDS:
        for part in entries(raw, kind):
            points = part.get("points_m")
            of_chain = [p for point in points for p in point_of({"p": point}, "p")] if isinstance(points, list) else []
            yield kind, str(part.get("name")), of_chain if kind == "chain" else point_of(part, "position_m")


def _names(raw: Raw) -> Iterator[ConfigurationFault]:
    others = {name for kind in ("vehicle", "group", "rally_point") for name in names_of(raw, kind)}
    listed = [(kind, name) for kind in KINDS for name in names_of(raw, kind)]
    counts = Counter(name for _, name in listed)
    for kind, name in dict.fromkeys(listed):
        if counts[name] > 1 or name in others:
            allowed = f"used {counts[name] + (name in others)} times; parts need names of their own"
            yield ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', allowed)
        if name == ANY:
            yield ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', "stands for a valve that is drawn")


def _overlaps(raw: Raw) -> Iterator[ConfigurationFault]:
    """What a tool works on too near to another such part, and points that are looked at too near to each other."""
    placed = [(kind, name, point_m) for kind, name, points_m in _points(raw) for point_m in points_m]
    worked = [place for place in placed if place[0] in ("valve", "anode")]
    for number, (kind, name, at_m) in enumerate(worked):
        for _, other, other_m in worked[:number]:
            if distance(at_m, other_m) < APART_M:
                allowed = f"{distance(at_m, other_m):.3g} m from {other}; allowed: {APART_M:g} m or more"
                yield ConfigurationFault(f"{kind}.{name}.position_m", str(list(at_m)), allowed)
    looked = [place for place in placed if place[0] in ("panel", "chain")]
    for number, (kind, name, at_m) in enumerate(looked):
        for _, other, other_m in looked[:number]:
            if distance(at_m, other_m) < SEEN_APART_M:
                key = _key_of(f"{kind}.")
                allowed = f"{distance(at_m, other_m):.3g} m from {other}; allowed: {SEEN_APART_M:g} m or more"
                yield ConfigurationFault(f"{kind}.{name}.{key}", str(list(at_m)), allowed)


def _moved_out(raw: Raw, key: str, distance_m: object, part: object) -> Iterator[ConfigurationFault]:
    """A distance by which a valve, in whichever direction, would leave the world."""
    bounds = bounds_of(raw)
    valves = [entry for entry in entries(raw, "valve") if part in (ANY, entry.get("name"))]
    places_m = [at_m for valve in valves for at_m in point_of(valve, "position_m")]
    if bounds is None or not places_m or isinstance(distance_m, bool) or not isinstance(distance_m, int | float):
        return
    west_m, south_m, east_m, north_m = bounds
    room_m = min(min(x - west_m, east_m - x, y - south_m, north_m - y) for x, y in places_m)
    if 0.0 < room_m < distance_m:
        allowed = f"at most {room_m:g}: beyond, the valve may lie outside of the world"
        yield ConfigurationFault(key, f"{distance_m:g}", allowed)


def _upsets(raw: Raw) -> Iterator[ConfigurationFault]:
    valves, upsets = names_of(raw, "valve"), entries(raw, "upset")
    seen: set[object] = set()
    for number, upset in enumerate(upsets, 1):
        key, part, kind = f"upset.{number}", upset.get("part", ANY), upset.get("kind")
        yield from one_of(f"{key}.part", part, [*valves, ANY])
        if part != ANY and part in seen:
            yield ConfigurationFault(f"{key}.part", f'"{part}"', "is upset already; allowed: one upset for each valve")
        seen.add(part)
        if kind == "moved" and "distance_m" not in upset:
            yield ConfigurationFault(f"{key}.distance_m", "", "missing: how far the valve is from its place")
        if kind == "moved":
            yield from _moved_out(raw, f"{key}.distance_m", upset.get("distance_m"), part)
        if kind in ("turned", "stuck") and "distance_m" in upset:
            allowed = f"not used by kind {kind}, only by moved: leave it out"
            yield ConfigurationFault(f"{key}.distance_m", str(upset["distance_m"]), allowed)
    if len(upsets) > len(valves):
        allowed = f"each befalls another valve, and there are {len(valves)}"
        yield ConfigurationFault("upset", f"{len(upsets)} tables", allowed)
