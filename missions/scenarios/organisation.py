"""Groups of a scenario: roles, formation, and the file of an organisation.

A ``[[group_template]]`` is a group without a place of its own: a ``[[group]]`` with ``template`` has its keys and its
roles, besides or instead of which it has those that it lists itself. Templates and roles have parents by ``extends``.
Of several parents the later one wins, and the own keys win over all; tables in them are joined key by key. A role with
``abstract = true``, and every ``[[role]]`` of the file, is there to be extended and nothing else.

Works on the raw tables, before anything else is checked: checks, missions and manifests see whole groups. Where a key
comes from is kept, so that a fault names the table that has it.

Groups that are formed at sea: what has to hold of ``formed_by``.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from missions.document import Document
from missions.errors import ConfigurationFault
from missions.files import LARGEST_BYTES, is_file, shown, text_of
from missions.scenarios.copies import Gear, able_to_play, can_play, lacking
from missions.scenarios.scenario import GroupTable
from missions.scenarios.tables import Raw, Section, entries, list_of, names_of, one_of, table_of, text_at
from remoras.faults import HEAD_OF
from remoras.mission import Mission
from worldmodel import ontology_path

GROUP, TEMPLATE, ROLE = "group", "group_template", "role"
TABLES = (GROUP, TEMPLATE, ROLE)
"""Tables at the top of a file that make up the specification of an organisation."""
EXTENDS, ABSTRACT = "extends", "abstract"
OWN = frozenset({"name", EXTENDS, ABSTRACT})
"""Keys that nobody inherits."""


@dataclass(frozen=True)
class TableLayer:
    """A table that a group or role is made from, and its dotted key in the file."""

    key: str
    table: Raw


@dataclass(frozen=True)
class Specification:
    """Tables of a scenario with every group written out.

    Attributes:
        raw: the tables.
        faults: of templates, parents and names.
        layers: by dotted key of a group or a role, the tables that it is made from, those that win first.
    """

    raw: Raw
    faults: tuple[ConfigurationFault, ...] = ()
    layers: Mapping[str, tuple[TableLayer, ...]] = field(default_factory=dict)

    def attributed(self, faults: Sequence[ConfigurationFault]) -> list[ConfigurationFault]:
        """Faults of what was written out as faults of the tables that it comes from, once each."""
        found: list[ConfigurationFault] = []
        said: set[tuple[str, str, str]] = set()
        for fault in faults:
            key, of = self._source(fault.key)
            if of and (key, fault.given, fault.allowed) in said:
                continue
            said.add((key, fault.given, fault.allowed))
            allowed = f"{fault.allowed} (for {of})" if of else fault.allowed
            found.append(ConfigurationFault(key, fault.given, allowed, fault.line, fault.file))
        return found

    def _source(self, key: str) -> tuple[str, str]:
        """The key of the table that has it, and the group or role that it is for if that is another table."""
        parts = key.split(".")
        for length in (4, 2):
            whole, rest = ".".join(parts[:length]), parts[length:]
            layers = self.layers.get(whole, ())
            if len(parts) < length or not layers or (length == 2 and rest[:1] == [ROLE] and len(rest) > 1):
                continue
            layer = next((layer for layer in layers if rest and rest[0] in layer.table), layers[0])
            source = ".".join([layer.key, *rest])
            return source, "" if source == key else ".".join(parts[1:length:2])
        return key, ""


def specified(raw: Raw) -> Specification:
    """The tables of a scenario with templates, parents and abstract roles written out."""
    listed = raw.get(GROUP)
    has_parents = any(EXTENDS in role or ABSTRACT in role for g in entries(raw, GROUP) for role in entries(g, ROLE))
    if not isinstance(listed, list) or not (TEMPLATE in raw or ROLE in raw or has_parents):
        return Specification(raw, tuple(_without_templates(raw)))
    made = _Writer(raw)
    groups = [made.group(group) if isinstance(group, dict) else group for group in listed]
    return Specification({**raw, GROUP: groups}, tuple(made.faults), made.layers)


def _without_templates(raw: Raw) -> Iterator[ConfigurationFault]:
    for group in entries(raw, GROUP):
        yield from one_of(f"{GROUP}.{group.get('name')}.template", group.get("template"), [])


class _Writer:
    """Writes groups out.

    Args:
        raw: tables of a scenario.
    """

    def __init__(self, raw: Raw) -> None:
        self.faults: list[ConfigurationFault] = []
        self.layers: dict[str, tuple[TableLayer, ...]] = {}
        self._templates = self._named(raw, TEMPLATE)
        self._library = self._named(raw, ROLE)
        self._said: set[str] = set()
        for layer in self._library.values():
            self._whether_abstract(layer)

    def _named(self, raw: Raw, kind: str) -> dict[str, TableLayer]:
        """Tables of a kind by name; the first where several have one."""
        for number, table in enumerate(entries(raw, kind), 1):
            if not isinstance(table.get("name"), str):
                self.faults.append(ConfigurationFault(f"{kind}.{number}.name", "", "missing"))
        for name, count in Counter(names_of(raw, kind)).items():
            if count > 1:
                self.faults.append(ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', f"used {count} times"))
        tables = [table for table in reversed(entries(raw, kind)) if isinstance(table.get("name"), str)]
        return {table["name"]: TableLayer(f"{kind}.{table['name']}", table) for table in reversed(tables)}

    def _whether_abstract(self, layer: TableLayer) -> None:
        if not isinstance(layer.table.get(ABSTRACT, False), bool):
            self._fault(f"{layer.key}.{ABSTRACT}", layer.table[ABSTRACT], "true or false")

    def _fault(self, key: str, given: Any, allowed: str) -> None:
        if key not in self._said:
            self._said.add(key)
            self.faults.append(ConfigurationFault(key, shown(given), allowed))

    # Groups --------------------------------------------------------------------------------------

    def group(self, table: Raw) -> Raw:
        """A group with all that it has of its template."""
        key = f"{GROUP}.{table.get('name')}"
        own = TableLayer(key, table)
        template = table.get("template")
        levels = [own]
        if isinstance(template, str):
            if template not in self._templates:
                self.faults += one_of(f"{key}.template", template, list(self._templates))
            else:
                levels += self._ancestry(self._templates[template], self._templates.get, [], list(self._templates))
        self.layers[key] = tuple(levels)
        found = _joined([{k: v for k, v in level.table.items() if k != ROLE} for level in levels])
        if any(ROLE in level.table for level in levels):
            lists = [level.table[ROLE] for level in levels if ROLE in level.table]
            malformed = next((listed for listed in lists if not isinstance(listed, list)), None)
            found[ROLE] = self._roles(key, levels) if malformed is None else malformed
        return {**found, **{k: table[k] for k in ("name", "template") if k in table}}

    def _roles(self, key: str, levels: Sequence[TableLayer]) -> list[Any]:
        """Roles of a group written out, in the order of its farthest template; what is no table stays as it is."""
        own: dict[str, list[TableLayer]] = {}
        others: list[Any] = []
        for level in reversed(levels):
            tables = level.table.get(ROLE, [])
            for number, role in enumerate(tables, 1):
                name = role.get("name") if isinstance(role, dict) else None
                layer = TableLayer(f"{level.key}.{ROLE}.{name if isinstance(name, str) else number}", role)
                if not isinstance(name, str) or any(other.key == layer.key for other in own.get(name, ())):
                    others.append(role)  # reported as what it is
                else:
                    own.setdefault(name, []).insert(0, layer)
                    self._whether_abstract(layer)
        found = []
        for name, layers in own.items():
            if any(layer.table.get(ABSTRACT) is True for layer in layers):
                continue
            made = self._of_parents(name, layers, own, ())
            self.layers[f"{key}.{ROLE}.{name}"] = tuple(made)
            found.append({"name": name, **_joined([layer.table for layer in made])})
        return [*found, *others]

    # Parents -------------------------------------------------------------------------------------

    def _of_parents(
        self, name: str, layers: Sequence[TableLayer], own: Mapping[str, list[TableLayer]], below: tuple[str, ...]
    ) -> list[TableLayer]:
        """The tables that a role of a group is made from, those that win first.

        Args:
            name: of the role.
            layers: tables of the group and of its templates that list it.
            own: those of all roles of the group, by name.
            below: roles that this one is a parent of.
        """
        holder = next((layer for layer in layers if EXTENDS in layer.table), None)
        found = list(layers)
        if holder is None:
            return found
        key, known = f"{holder.key}.{EXTENDS}", list(dict.fromkeys([*own, *self._library]))
        for parent in reversed(self._parents(key, holder.table[EXTENDS], known)):
            if parent in own and parent != name:
                if parent in below:
                    self._cycle(key, holder.table[EXTENDS], [*below[below.index(parent) :], name, parent])
                    continue
                found += self._of_parents(parent, own[parent], own, (*below, name))
            elif parent in self._library:
                found += self._ancestry(self._library[parent], self._library.get, [], list(self._library))
            else:
                self._cycle(key, holder.table[EXTENDS], [name, parent])
        return found

    def _ancestry(
        self, layer: TableLayer, named: Callable[[str], TableLayer | None], below: list[str], known: Sequence[str]
    ) -> list[TableLayer]:
        """A template or a role of the library and all its parents, those that win first."""
        name = str(layer.table.get("name"))
        key, given = f"{layer.key}.{EXTENDS}", layer.table.get(EXTENDS, [])
        found = [layer]
        for parent in reversed(self._parents(key, given, known)):
            line = [*below, name]
            if parent in line:
                self._cycle(key, given, [*line[line.index(parent) :], parent])
            elif (above := named(parent)) is not None:
                found += self._ancestry(above, named, line, known)
        return found

    def _parents(self, key: str, given: Any, known: Sequence[str]) -> list[str]:
        """Names of parents that there are; the others are faults."""
        if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
            self._fault(key, given, f"a list of names, of {', '.join(known)}")
            return []
        for fault in (fault for name in given for fault in one_of(key, name, known)):
            if (text := f"{key} {fault.given}") not in self._said:
                self._said.add(text)
                self.faults.append(fault)
        return [name for name in given if name in known]

    def _cycle(self, key: str, given: Any, names: Sequence[str]) -> None:
        allowed = f"a cycle: {' extends '.join(names)}; allowed: parents that do not extend it themselves"
        self._fault(key, given, allowed)


def _joined(tables: Sequence[Raw]) -> dict[str, Any]:
    """Keys of several tables, those of the first win; tables in them are joined key by key."""
    found: dict[str, Any] = {}
    for table in reversed(tables):
        for key, value in table.items():
            if key in OWN:
                continue
            before = found.get(key)
            found[key] = {**before, **value} if isinstance(value, dict) and isinstance(before, dict) else value
    return found


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


ORGANISATION = "organisation"
"""Key of a scenario that names the file."""


class OrganisationTables(Section):
    """What an organisation file holds."""

    role: tuple[dict[str, Any], ...] = ()
    group_template: tuple[dict[str, Any], ...] = ()
    group: tuple[GroupTable, ...] = Field(min_length=1)


def with_organisation(document: Document) -> tuple[Document, list[ConfigurationFault]]:
    """A scenario with the tables of the organisation file that it names, or what is wrong with that.

    Args:
        document: whose key ``organisation`` names a file, relative to its own.

    Raises:
        ConfigurationError: the file cannot be read, or is not TOML.
    """
    if ORGANISATION not in document.raw:
        return document, []
    given = document.raw[ORGANISATION]
    if not isinstance(given, str):
        return document, [ConfigurationFault(ORGANISATION, shown(given), "a text: the name of a TOML file")]
    path = Path(document.path).parent / given
    if not is_file(path):
        allowed = f"there is no file {path}; allowed: a TOML file with {', '.join(TABLES)}"
        return document, [ConfigurationFault(ORGANISATION, shown(given), allowed)]
    part = Document.of_text(text_of(path, LARGEST_BYTES), str(path))
    faults = _unknown(part)
    for name in TABLES:
        if name in document.raw:
            allowed = f"given beside {ORGANISATION} = {shown(given)}, where the groups are: leave one of them out"
            faults.append(ConfigurationFault(name, "", allowed, document.line_of(name), document.path))
    if not entries(part.raw, GROUP):
        allowed = f"there is no [[group]] in {path}; allowed: a TOML file with {', '.join(TABLES)}"
        return document, [*faults, ConfigurationFault(ORGANISATION, shown(given), allowed)]
    own = {name: tables for name, tables in part.raw.items() if name in TABLES}
    return replace(document, raw={**document.raw, **own}, parts=(part,)), faults


def _unknown(part: Document) -> list[ConfigurationFault]:
    return [
        ConfigurationFault(
            name, "", f"unknown in an organisation file; allowed: {', '.join(TABLES)}", part.line_of(name), part.path
        )
        for name in part.raw
        if name not in TABLES
    ]


def is_organisation(raw: Raw) -> bool:
    """True if tables are those of an organisation file alone."""
    return bool(raw) and set(raw) <= set(TABLES)


def checked(document: Document) -> Specification:
    """An organisation file with its groups written out; a template without a group is checked as if it had one.

    What needs a scenario is not checked: rally points, jobs, who is able to play a role, and keys of a mission.

    Raises:
        ConfigurationError: with every fault of the file.
    """
    raw = document.raw
    unused = set(names_of(raw, TEMPLATE)).difference(str(entry.get("template")) for entry in entries(raw, GROUP))
    pretended = [
        {"rally_point": "", "name": f"{name} without a group", "template": name}
        for name in names_of(raw, TEMPLATE)
        if name in unused and not entries(raw, GROUP)
    ]
    listed = raw.get(GROUP, [])
    found = specified({**raw, GROUP: [*listed, *pretended]} if isinstance(listed, list) else raw)
    faults = [*_unknown(document), *found.faults, *_malformed(document, found.raw), *structure_faults(found.raw)]
    if faults:
        raise document.error(found.attributed(faults))
    return found


def _malformed(document: Document, raw: Raw) -> list[ConfigurationFault]:
    """Faults of single values; keys that a mission may have are passed over."""
    tables = {name: raw[name] for name in (ROLE, TEMPLATE, GROUP) if name in raw}
    try:
        OrganisationTables.model_validate_json(json.dumps(tables, default=str), strict=True)
    except ValidationError as error:
        return document.faults_of(error, OrganisationTables, tables, ("extra_forbidden",))
    return []


FORMATION_WORDS = ontology_path("formation")
"""Listed in the ``vocabulary`` of a mission that forms groups at sea."""


def formation_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Groups that nobody could form, or that would have what only founded groups have.

    Args:
        raw: the tables as TOML has them.
        mission: class of the mission.
    """
    formers = {str(entry.get("name")): entry["formed_by"] for entry in entries(raw, "group") if "formed_by" in entry}
    missions = {str(entry.get("name")): entry.get("mission") for entry in entries(raw, "group")}
    for group, former in formers.items():
        key = f"group.{group}.formed_by"
        unknown = list(one_of(key, former, [name for name in names_of(raw, "group") if name != group]))
        yield from unknown
        if not unknown and _is_circular(group, formers):
            allowed = "no group of the circle would ever be there: leave formed_by out of one of them"
            yield ConfigurationFault(key, f'"{former}"', allowed)
        if FORMATION_WORDS not in mission.vocabulary:
            allowed = f"the mission {mission.__name__} forms no groups at sea: leave it out"
            yield ConfigurationFault(key, f'"{former}"', allowed)
        if missions[group] is not None:
            allowed = "a group that is formed at sea is given its mission there: leave it out"
            yield ConfigurationFault(f"group.{group}.mission", f'"{missions[group]}"', allowed)
    for number, fault in enumerate(entries(raw, "fault"), 1):
        vehicle = str(fault.get("vehicle"))
        if vehicle.startswith(HEAD_OF) and vehicle.removeprefix(HEAD_OF) in formers:
            allowed = "nobody leads a group before it is formed at sea: name a vehicle, or the head of another group"
            yield ConfigurationFault(f"fault.{number}.vehicle", f'"{vehicle}"', allowed)


def _is_circular(group: str, formers: dict[str, object]) -> bool:
    seen: set[object] = set()
    at: object = group
    while isinstance(at, str) and at in formers and at not in seen:
        seen.add(at)
        at = formers[at]
    return at == group
