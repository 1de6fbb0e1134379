"""What has to hold of groups and their roles, once they are written out: see ``missions.scenarios.organisation``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.abilities import Gear, able_to_play, can_play, lacking
from missions.scenarios.tables import Raw, entries, list_of, names_of, one_of, table_of, text_at

NO_LEADER = "the group has no vehicle with the social layer to lead it: set social_layer = true for one of {names}"


def organisation_faults(raw: Raw, gear: Gear) -> Iterator[ConfigurationFault]:
    """All faults between groups, their roles, and those who are to play them.

    Args:
        raw: tables of a scenario, its groups written out.
        gear: of the mission.
    """
    for check in (structure_faults, _rally_points, _players_of_both, _successors):
        yield from check(raw)
    yield from _players(raw, gear)


def structure_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Faults of groups and roles alone, whoever plays them and wherever they meet."""
    for check in (_heads, _names_of_roles, _cardinalities, _played_by_cycles, _excluded_by_itself, _nesting):
        yield from check(raw)


def _roles(raw: Raw) -> dict[str, Raw]:
    """Tables of all roles by ``Group.Role``."""
    found = [(group, role) for group in entries(raw, "group") for role in entries(group, "role")]
    return {f"{group.get('name')}.{role.get('name')}": role for group, role in found}


def _key(path: str) -> str:
    group, _, role = path.partition(".")
    return f"group.{group}.role.{role}"


# Structure ---------------------------------------------------------------------------------------


def _heads(raw: Raw) -> Iterator[ConfigurationFault]:
    for group in entries(raw, "group"):
        prefix = f"group.{group.get('name')}"
        heads = [role for role in entries(group, "role") if role.get("head")]
        if len(heads) != 1 or not heads[0].get("founding"):
            yield ConfigurationFault(
                f"{prefix}.role", f"{len(heads)} heads", "one role must be head = true and founding = true"
            )
        elif heads[0].get("maximum") != 1:
            given = shown(heads[0]["maximum"]) if "maximum" in heads[0] else ""
            allowed = "allowed: 1" if given else "missing; allowed: 1"
            key = f"{prefix}.role.{heads[0].get('name')}.maximum"
            yield ConfigurationFault(key, given, f"{allowed}, since a group has one head")


def _names_of_roles(raw: Raw) -> Iterator[ConfigurationFault]:
    """Roles that roles name: by whom they are played, whom they influence, exclude and have authority over."""
    paths = list(_roles(raw))
    for group in entries(raw, "group"):
        names = names_of(group, "role")
        for role in entries(group, "role"):
            key = f"group.{group.get('name')}.role.{role.get('name')}"
            yield from one_of(f"{key}.played_by", role.get("played_by"), paths)
            for word, allowed in (
                ("influences", names), ("authority", names), ("incompatible", [*names, *paths]),
            ):  # fmt: skip
                for other in list_of(role, word):
                    yield from one_of(f"{key}.{word}", other, allowed)
            own = role.get("name"), f"{group.get('name')}.{role.get('name')}"
            for other in (name for name in list_of(role, "incompatible") if name in own):
                yield ConfigurationFault(f"{key}.incompatible", shown(other), "allowed: other roles than itself")


def _cardinalities(raw: Raw) -> Iterator[ConfigurationFault]:
    for path, role in _roles(raw).items():
        minimum, maximum = role.get("minimum", 0), role.get("maximum")
        if isinstance(minimum, int) and isinstance(maximum, int) and minimum > maximum:
            yield ConfigurationFault(f"{_key(path)}.minimum", str(minimum), f"allowed: 0 to maximum = {maximum}")


def _played_by_cycles(raw: Raw) -> Iterator[ConfigurationFault]:
    roles = _roles(raw)
    above = {path: other for path, role in roles.items() if (other := text_at(role, "played_by")) in roles}
    for cycle in _cycles(above):
        allowed = f"a cycle: {' is played by '.join([*cycle, cycle[0]])}; a role cannot wait for its own holder"
        yield ConfigurationFault(f"{_key(cycle[0])}.played_by", shown(above[cycle[0]]), allowed)


def _cycles(above: Mapping[str, str]) -> list[list[str]]:
    """Cycles of names of which each has one above it, each once."""
    found: list[list[str]] = []
    done: set[str] = set()
    for start in above:
        line: list[str] = []
        name = start
        while name in above and name not in done and name not in line:
            line.append(name)
            name = above[name]
        if name in line:
            found.append(line[line.index(name) :])
        done.update(line)
    return found


def excluded(raw: Raw) -> dict[str, set[str]]:
    """For each role, by ``Group.Role``, those that its holders may not play; in both directions."""
    roles = _roles(raw)
    found: dict[str, set[str]] = {path: set() for path in roles}
    for path, role in roles.items():
        group = path.split(".")[0]
        for name in map(str, list_of(role, "incompatible")):
            other = name if name in roles else f"{group}.{name}"
            if other in roles and other != path:
                found[path].add(other)
                found[other].add(path)
    return found


def _excluded_by_itself(raw: Raw) -> Iterator[ConfigurationFault]:
    """Roles that are incompatible with one that their holder has to play."""
    roles, apart = _roles(raw), excluded(raw)
    for path, role in roles.items():
        line = [path]
        while (above := text_at(roles[line[-1]], "played_by")) in roles and above not in line:
            line.append(above)
        for other in line[1:]:
            if other in apart[path]:
                holder = path if _lists(role, path, other) else other
                allowed = f"its holder has to play both: {' is played by '.join(line[: line.index(other) + 1])}"
                given = shown(other if holder == path else path)
                yield ConfigurationFault(f"{_key(holder)}.incompatible", given, allowed)


def _lists(role: Raw, path: str, other: str) -> bool:
    group, _, name = other.partition(".")
    same = path.startswith(f"{group}.")
    return not {other, *([name] if same else [])}.isdisjoint(map(str, list_of(role, "incompatible")))


def _nesting(raw: Raw) -> Iterator[ConfigurationFault]:
    """Groups within groups: which there are, that none is within itself, and how many there may be."""
    groups = {str(group.get("name")): group for group in entries(raw, "group")}
    for name, group in groups.items():
        yield from one_of(f"group.{name}.within", group.get("within"), list(groups))
    above = {name: outer for name, group in groups.items() if (outer := text_at(group, "within")) in groups}
    for cycle in _cycles(above):
        allowed = f"a cycle: {' is within '.join([*cycle, cycle[0]])}; allowed: a group that is not within this one"
        yield ConfigurationFault(f"group.{cycle[0]}.within", shown(above[cycle[0]]), allowed)
    templates = names_of(raw, "group_template")
    for name, group in groups.items():
        within = [one for one, outer in above.items() if outer == name]
        yield from _subgroups(
            f"group.{name}.subgroup", group, {subgroup: groups[subgroup] for subgroup in within}, templates, raw
        )


def _subgroups(
    key: str, group: Raw, within: Mapping[str, Raw], templates: Sequence[str], raw: Raw
) -> Iterator[ConfigurationFault]:
    """A group has as many subgroups of each template as it says, and no others."""
    kinds = {name: ancestry(raw, table.get("template")) for name, table in within.items()}
    tables = entries(group, "subgroup")
    for number, table in enumerate(tables, 1):
        yield from one_of(f"{key}.{number}.template", table.get("template"), templates)
        minimum, maximum = table.get("minimum", 0), table.get("maximum")
        if not isinstance(minimum, int) or not isinstance(maximum, int | None):
            continue
        if maximum is not None and minimum > maximum:
            yield ConfigurationFault(f"{key}.{number}.minimum", str(minimum), f"allowed: 0 to maximum = {maximum}")
            continue
        has = [name for name, of in kinds.items() if table.get("template") in of]
        if len(has) < minimum or (maximum is not None and len(has) > maximum):
            word, limit = ("minimum", minimum) if len(has) < minimum else ("maximum", maximum)
            listed = f": {', '.join(has)}" if has else ""
            allowed = f"{len(has)} groups of template {table.get('template')} are within {group.get('name')}{listed}"
            yield ConfigurationFault(f"{key}.{number}.{word}", str(limit), allowed)
    known = {str(table.get("template")) for table in tables}
    for name, of in kinds.items() if tables else ():
        if known.isdisjoint(of):
            allowed = f"{group.get('name')} has subgroups of {', '.join(sorted(known))} alone"
            yield ConfigurationFault(f"group.{name}.within", shown(within[name].get("within")), allowed)


def ancestry(raw: Raw, template: object) -> tuple[str, ...]:
    """A template and all that it extends, the nearest first."""
    templates = {str(table.get("name")): table for table in entries(raw, "group_template")}
    found: list[str] = []
    due = [template] if isinstance(template, str) else []
    while due:
        name = due.pop(0)
        if name in templates and name not in found:
            found.append(name)
            due += map(str, list_of(templates[name], "extends"))
    return tuple(found)


# Places and players ------------------------------------------------------------------------------


def _rally_points(raw: Raw) -> Iterator[ConfigurationFault]:
    rallies = names_of(raw, "rally_point")
    for group in entries(raw, "group"):
        yield from one_of(f"group.{group.get('name')}.rally_point", group.get("rally_point"), rallies)


def _players(raw: Raw, gear: Gear) -> Iterator[ConfigurationFault]:
    """Roles that too few vehicles are able to play, and heads that nobody with the social layer is."""
    for group in entries(raw, "group"):
        for role in entries(group, "role"):
            yield from _players_of(raw, group, role, gear)


def _players_of(raw: Raw, group: Raw, role: Raw, gear: Gear) -> Iterator[ConfigurationFault]:
    key = f"group.{group.get('name')}.role.{role.get('name')}"
    able, minimum = able_to_play(raw, group.get("name"), role.get("name")), role.get("minimum", 0)
    if not able and table_of(role, "requires"):
        lacks = [(v.get("name"), list(lacking(v, role, gear))) for v in entries(raw, "vehicle")]
        listed = [f"{name} has {' and '.join(words)}" for name, words in lacks if words]
        why = "; ".join(listed) or "those that do list other roles in playable_roles"
        yield ConfigurationFault(f"{key}.requires", shown(role["requires"]), f"no vehicle meets it: {why}")
    elif not able:
        yield ConfigurationFault(key, "", "no vehicle is able to play it: list it in playable_roles of one")
    elif isinstance(minimum, int) and len(able) < minimum:
        yield ConfigurationFault(f"{key}.minimum", str(minimum), f"only {len(able)} vehicles are able to play it")
    if role.get("head") and able and not any(v.get("social_layer", True) for v in able):
        yield ConfigurationFault(key, "", NO_LEADER.format(names=", ".join(str(v.get("name")) for v in able)))


def _players_of_both(raw: Raw) -> Iterator[ConfigurationFault]:
    """A role that the holder of another must play needs a vehicle that is able to play both."""
    for path, role in _roles(raw).items():
        other = role.get("played_by")
        if not isinstance(other, str) or "." not in other:
            continue
        both = [path.split(".", 1), other.split(".", 1)]
        if not any(all(can_play(v, *role) for role in both) for v in entries(raw, "vehicle")):
            yield ConfigurationFault(f"{_key(path)}.played_by", f'"{other}"', "no vehicle is able to play both roles")


def _successors(raw: Raw) -> Iterator[ConfigurationFault]:
    """Holders of some role of a succession have to be able to lead."""
    for group in entries(raw, "group"):
        key, given = f"group.{group.get('name')}.succession", list_of(group, "succession")
        faults = [fault for role in given for fault in one_of(key, role, names_of(group, "role"))]
        yield from faults
        head = next((str(role.get("name")) for role in entries(group, "role") if role.get("head")), None)
        if faults or not given or head is None:
            continue
        able = [vehicle for vehicle in able_to_play(raw, group.get("name"), head) if vehicle.get("social_layer", True)]
        if not any(can_play(vehicle, group.get("name"), role) for vehicle in able for role in given):
            allowed = (
                f"nobody can fill it: no vehicle that is able to play {' or '.join(map(str, given))} has the social "
                f"layer and is able to play {head}; list {head} in playable_roles of one"
            )
            yield ConfigurationFault(key, shown(given), allowed)
