"""Groups of a scenario: templates, inheritance, formation, and the organisation file.

A ``[[group]]`` with ``template`` inherits the keys and roles of a ``[[group_template]]`` and may add or replace them.
Templates and roles have parents by ``extends``. A later parent overrides an earlier one, own keys override all; nested
tables are merged by key. Inheritance is resolved on raw tables before validation, so that checks, missions and
manifests see whole groups.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from missions.document import Document, validated
from missions.errors import ConfigurationFault, one_of, repeated
from missions.files import is_file, shown
from missions.scenarios.fleet import lacking
from remoras.faults import HEAD_OF
from remoras.mission import Mission
from remoras.organisation import Group, RoleKey, RoleSpecification, Subgroups
from remoras.table import Name, Positive, Section, Sparse, unless
from worldmodel import ontology_path

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

Raw = Mapping[str, Any]
Node = TypeVar("Node", bound=Hashable)

GROUP, TEMPLATE, ROLE = "group", "group_template", "role"
TABLES = (GROUP, TEMPLATE, ROLE)
EXTENDS, ABSTRACT = "extends", "abstract"
OWN = frozenset({"name", EXTENDS, ABSTRACT})  # keys that are not inherited


class Requires(Sparse):
    """Requirements of a role on its vehicle; a table in a ``[[group.role]]``."""

    UNSAID = frozenset({"capability"})

    sensor: str | None = Field(None, description="kind or name of a required sensor")
    capability: str | None = Field(None, description="class in the ontology by its equipment, such as SurveyPlatform")
    speed_mps: Positive | None = Field(None, description="minimum transit speed")
    depth_m: Positive | None = Field(None, description="minimum depth rating")
    endurance_s: Positive | None = Field(None, description="minimum battery life at survey speed")
    social_layer: bool = Field(False, description="it has the social layer")


class Role(Sparse):
    """One ``[[group.role]]``."""

    UNSAID = frozenset({"incompatible", "authority", "requires"})

    name: Name = Field(description="name of the role")
    minimum: int = Field(0, ge=0, description="minimum holders")
    maximum: int | None = Field(None, ge=1, description="maximum holders; any number if absent")
    head: bool = Field(False, description="its holder leads the group")
    founding: bool = Field(False, description="held from the start, not allocated during the mission")
    job: str | None = Field(None, description="job of its holder")
    played_by: str | None = Field(None, description="Group.Role whose holder must play it")
    influences: tuple[str, ...] = Field((), description="roles of the group that its influence signals address")
    incompatible: tuple[str, ...] = Field(
        (), description="roles incompatible with it: Role of the group, or Group.Role; holds in both directions"
    )
    authority: tuple[str, ...] = Field(
        (), description="roles of the group that its holders may assign, release and give objectives"
    )
    requires: Requires | None = Field(None, description="requirements on a vehicle")
    extends: tuple[str, ...] = Field(
        (),
        exclude=True,
        description="roles whose keys it inherits: of the group or a [[role]]; the later wins, its own keys over all",
    )
    abstract: bool = Field(False, exclude=True, description="abstract, to be extended only: no role of the group")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.maximum is not None and self.minimum > self.maximum:
            yield "minimum", f"allowed: 0 to maximum = {self.maximum}"


class GroupTable(Sparse):
    """One ``[[group]]``."""

    model_config = ConfigDict(json_schema_extra=unless("template", "rally_point", "role"))
    UNSAID = frozenset({"template", "within", "subgroup", "information"})

    name: Name = Field(description="name of the group")
    template: str | None = Field(
        None, description="[[group_template]] whose keys and roles it inherits, in addition to or overridden by its own"
    )
    within: str | None = Field(None, description="parent group, whose leader supervises it")
    subgroup: tuple[Subgroups, ...] = Field((), description="number of subgroups per template; any if absent")
    rally_point: str = Field(description="rally point of the group")
    mission: str | None = Field(None, description="initial mission; else assigned at run time")
    formed_by: str | None = Field(
        None,
        description="group whose leader forms and dissolves this one at run time; formed before the mission if absent",
    )
    succession: tuple[str, ...] = Field(
        (), description="roles of the group whose holders succeed a lost leader, in this order"
    )
    information: Literal["replicated", "held by head"] = Field(
        "replicated",
        description="need for facts on the jobs of the group: of all members, or of leader and assignee",
    )
    role: tuple[Role, ...] = Field(min_length=1, description="roles of the group")

    @property
    def head(self) -> Role | None:
        """Role whose holder leads the group; None if not declared."""
        return next((role for role in self.role if role.head), None)

    @property
    def role_names(self) -> list[str]:
        """Names of its roles."""
        return [role.name for role in self.role]


# Inheritance ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TableLayer:
    """Table from which a group or role is made, with its dotted key in the file."""

    key: str
    table: Raw


@dataclass(frozen=True)
class Specification:
    """Tables with inheritance resolved; ``layers`` are the sources of a group or role, in order of precedence."""

    raw: Raw
    faults: tuple[ConfigurationFault, ...] = ()
    layers: Mapping[str, tuple[TableLayer, ...]] = field(default_factory=dict)

    def attributed(self, faults: Sequence[ConfigurationFault]) -> list[ConfigurationFault]:
        """Map faults of resolved tables to their source tables, once each."""
        attributed: list[ConfigurationFault] = []
        seen: set[tuple[str, str, str]] = set()
        for fault in faults:
            key, owner = self._source(fault.key)
            if (key, fault.given, fault.allowed) in seen:
                continue
            seen.add((key, fault.given, fault.allowed))
            allowed = f"{fault.allowed} (for {owner})" if owner else fault.allowed
            attributed.append(ConfigurationFault(key, fault.given, allowed, fault.line, fault.file))
        return attributed

    def _source(self, key: str) -> tuple[str, str]:
        parts = key.split(".")
        # A role (group.G.role.R) before its group (group.G): the longer key is the nearer source.
        for length in (4, 2):
            whole, rest = ".".join(parts[:length]), parts[length:]
            layers = self.layers.get(whole, ())
            if len(parts) < length or not layers or (length == 2 and rest[:1] == [ROLE] and len(rest) > 1):
                continue
            layer = next((layer for layer in layers if rest and rest[0] in layer.table), layers[0])
            source = ".".join([layer.key, *rest])
            return source, "" if source == key else ".".join(parts[1:length:2])
        return key, ""


class _Shape(BaseModel):
    """Keys by which groups, templates and roles refer to each other."""

    model_config = ConfigDict(extra="allow")

    name: str
    template: str | None = None
    extends: tuple[str, ...] = ()
    abstract: bool = False
    role: tuple[_Shape, ...] = ()


class _Organisation(BaseModel):
    role: tuple[_Shape, ...] = ()
    group_template: tuple[_Shape, ...] = ()
    group: tuple[_Shape, ...] = ()


def specified(raw: Raw) -> Specification:
    """Resolve templates, parents and abstract roles; with faults of names and parents the tables stay as they are."""
    _, malformed = validated(_Organisation, raw)
    if malformed:
        return Specification(raw, tuple(malformed))
    made = _Writer(raw)
    groups = [made.group(group) for group in raw.get(GROUP, ())]
    return Specification({**raw, GROUP: groups} if groups else raw, tuple(made.faults), made.layers)


class _Writer:
    def __init__(self, raw: Raw) -> None:
        self.faults: list[ConfigurationFault] = []
        self.layers: dict[str, tuple[TableLayer, ...]] = {}
        self._templates = self._by_name(raw, TEMPLATE)
        self._library = self._by_name(raw, ROLE)

    def _by_name(self, raw: Raw, kind: str) -> dict[str, TableLayer]:
        tables: list[Raw] = raw.get(kind, [])
        for name, count in repeated(table["name"] for table in tables):
            self.faults.append(ConfigurationFault(f"{kind}.{name}.name", f'"{name}"', f"used {count} times"))
        return {table["name"]: TableLayer(f"{kind}.{table['name']}", table) for table in tables}

    # Groups --------------------------------------------------------------------------------------

    def group(self, table: Raw) -> Raw:
        key, template = f"{GROUP}.{table['name']}", table.get("template")
        levels = [TableLayer(key, table)]
        self.faults += one_of(f"{key}.template", template, list(self._templates))
        if template in self._templates:
            levels += self._ancestry(self._templates[template], self._templates, [])
        self.layers[key] = tuple(levels)
        resolved = _joined([{k: v for k, v in level.table.items() if k != ROLE} for level in levels])
        if any(ROLE in level.table for level in levels):
            resolved[ROLE] = self._roles(key, levels)
        return {**resolved, **{k: table[k] for k in ("name", "template") if k in table}}

    def _roles(self, key: str, levels: Sequence[TableLayer]) -> list[Raw]:
        """Resolve the roles of a group, in the order of its farthest template; keep second ones of a name."""
        own: dict[str, list[TableLayer]] = {}
        again: list[Raw] = []
        # From the farthest template on, which gives the order of the roles.
        for level in reversed(levels):
            for role in level.table.get(ROLE, ()):
                layer, layers = TableLayer(f"{level.key}.{ROLE}.{role['name']}", role), own.setdefault(role["name"], [])
                if any(other.key == layer.key for other in layers):
                    again.append(role)  # reported by ``structure_faults``
                else:
                    layers.insert(0, layer)
        resolved = []
        for name, layers in own.items():
            if not any(layer.table.get(ABSTRACT) for layer in layers):
                made = self._of_parents(name, layers, own, ())
                self.layers[f"{key}.{ROLE}.{name}"] = tuple(made)
                resolved.append({"name": name, **_joined([layer.table for layer in made])})
        return [*resolved, *again]

    # Parents -------------------------------------------------------------------------------------

    def _of_parents(
        self, name: str, layers: Sequence[TableLayer], own: Mapping[str, list[TableLayer]], below: tuple[str, ...]
    ) -> list[TableLayer]:
        holder = next((layer for layer in layers if EXTENDS in layer.table), layers[0])
        sources = list(layers)
        for parent in self._parents(holder, [*own, *self._library]):
            # A role may extend the library role of its own name.
            if parent in own and parent != name:
                if parent in below:
                    self._cycle(holder, [*below[below.index(parent) :], name, parent])
                else:
                    sources += self._of_parents(parent, own[parent], own, (*below, name))
            elif parent in self._library:
                sources += self._ancestry(self._library[parent], self._library, [])
            else:
                self._cycle(holder, [name, parent])
        return sources

    def _ancestry(self, layer: TableLayer, kin: Mapping[str, TableLayer], below: list[str]) -> list[TableLayer]:
        line = [*below, layer.table["name"]]
        sources = [layer]
        for parent in self._parents(layer, list(kin)):
            if parent in line:
                self._cycle(layer, [*line[line.index(parent) :], parent])
            else:
                sources += self._ancestry(kin[parent], kin, line)
        return sources

    def _parents(self, layer: TableLayer, known: Sequence[str]) -> list[str]:
        parents: Sequence[str] = layer.table.get(EXTENDS, ())
        for name in parents:
            self.faults += one_of(f"{layer.key}.{EXTENDS}", name, list(dict.fromkeys(known)))
        # The last parent has precedence.
        return [name for name in reversed(parents) if name in known]

    def _cycle(self, layer: TableLayer, names: Sequence[str]) -> None:
        allowed = f"a cycle: {' extends '.join(names)}; allowed: parents that do not extend it themselves"
        self.faults.append(ConfigurationFault(f"{layer.key}.{EXTENDS}", shown(layer.table[EXTENDS]), allowed))


def _joined(tables: Sequence[Raw]) -> dict[str, Any]:
    merged: dict[str, Any] = {}
    for table in reversed(tables):
        for key, value in table.items():
            if key in OWN:
                continue
            before = merged.get(key)
            merged[key] = {**before, **value} if isinstance(value, dict) and isinstance(before, dict) else value
    return merged


NO_LEADER = "the group has no vehicle with the social layer to lead it: set social_layer = true for one of {names}"


def organisation_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield all faults between groups, their roles and rally points."""
    yield from structure_faults(scenario.group, scenario.group_template)
    rallies = [point.name for point in scenario.rally_point]
    for group in scenario.group:
        yield from one_of(f"group.{group.name}.rally_point", group.rally_point, rallies)


def structure_faults(groups: Sequence[GroupTable], templates: Sequence[Raw]) -> Iterator[ConfigurationFault]:
    """Yield faults of groups and roles alone, independent of vehicles and rally points."""
    roles = {(group.name, role.name): role for group in groups for role in group.role}
    for group in groups:
        yield from _head(group)
        yield from _names_of_roles(group, roles)
    yield from _played_by(roles)
    yield from _nesting(groups, templates)


def role_key(path: str) -> RoleKey:
    """Split ``Group.Role`` into names."""
    group, _, role = path.partition(".")
    return group, role


def _at(role: RoleKey) -> str:
    return f"group.{role[0]}.role.{role[1]}"


# Structure --------------------------------------------------------------------------------------


def _head(group: GroupTable) -> Iterator[ConfigurationFault]:
    heads = [role for role in group.role if role.head]
    if len(heads) != 1 or not heads[0].founding:
        allowed = "one role must be head = true and founding = true"
        yield ConfigurationFault(f"group.{group.name}.role", f"{len(heads)} heads", allowed)
    elif heads[0].maximum != 1:
        allowed = "missing; allowed: 1" if heads[0].maximum is None else "allowed: 1"
        key = f"{_at((group.name, heads[0].name))}.maximum"
        yield ConfigurationFault(key, "", f"{allowed}, since a group has one head")


def _names_of_roles(group: GroupTable, roles: Mapping[RoleKey, Role]) -> Iterator[ConfigurationFault]:
    paths, names = [".".join(key) for key in roles], group.role_names
    for name, count in repeated(names):
        yield ConfigurationFault(_at((group.name, name)), "", f"listed {count} times")
    for name in group.succession:
        yield from one_of(f"group.{group.name}.succession", name, names)
    for role in group.role:
        key = _at((group.name, role.name))
        yield from one_of(f"{key}.played_by", role.played_by, paths)
        for relation, allowed in (("influences", names), ("authority", names), ("incompatible", [*names, *paths])):
            for other in getattr(role, relation):
                yield from one_of(f"{key}.{relation}", other, allowed)
        for other in {role.name, f"{group.name}.{role.name}"}.intersection(role.incompatible):
            yield ConfigurationFault(f"{key}.incompatible", shown(other), "allowed: other roles than itself")


def _played_by(roles: Mapping[RoleKey, Role]) -> Iterator[ConfigurationFault]:
    above = {key: other for key, role in roles.items() if (other := role_key(role.played_by or "")) in roles}
    for cycle in _cycles(above):
        line = " is played by ".join(".".join(key) for key in [*cycle, cycle[0]])
        allowed = f"a cycle: {line}; a role cannot wait for its own holder"
        yield ConfigurationFault(f"{_at(cycle[0])}.played_by", "", allowed)
    apart = excluded(roles)
    for key in roles:
        # Incompatibility holds along the whole chain, since one vehicle plays all of its roles.
        line_up = [key]
        while (other := above.get(line_up[-1], key)) not in line_up:
            line_up.append(other)
            if other in apart[key]:
                # The key that lists the other role is at fault; it may be in either table.
                own = {".".join(other), *([other[1]] if other[0] == key[0] else [])}
                holder, named = (key, other) if not own.isdisjoint(roles[key].incompatible) else (other, key)
                played = " is played by ".join(".".join(step) for step in line_up)
                allowed = f"its holder has to play both: {played}"
                yield ConfigurationFault(f"{_at(holder)}.incompatible", shown(".".join(named)), allowed)


def _cycles(above: Mapping[Node, Node]) -> list[list[Node]]:
    cycles: list[list[Node]] = []
    done: set[Node] = set()
    # Each node has one parent: following it ends, meets a known node or closes a cycle.
    for start in above:
        line: list[Node] = []
        name = start
        while name in above and name not in done and name not in line:
            line.append(name)
            name = above[name]
        if name in line:
            cycles.append(line[line.index(name) :])
        done.update(line)
    return cycles


def excluded(roles: Mapping[RoleKey, Role]) -> dict[RoleKey, set[RoleKey]]:
    """Return the incompatible roles of each role, also if only the other role lists it."""
    apart: dict[RoleKey, set[RoleKey]] = {key: set() for key in roles}
    for key, role in roles.items():
        for name in role.incompatible:
            other = role_key(name) if role_key(name) in roles else (key[0], name)
            if other in roles and other != key:
                apart[key].add(other)
                apart[other].add(key)
    return apart


def _nesting(listed: Sequence[GroupTable], templates: Sequence[Raw]) -> Iterator[ConfigurationFault]:
    groups = {group.name: group for group in listed}
    for name, group in groups.items():
        yield from one_of(f"group.{name}.within", group.within, list(groups))
    above = {name: outer for name, group in groups.items() if (outer := group.within) in groups and outer is not None}
    for cycle in _cycles(above):
        allowed = f"a cycle: {' is within '.join([*cycle, cycle[0]])}; allowed: a group that is not within this one"
        yield ConfigurationFault(f"group.{cycle[0]}.within", "", allowed)
    names = [table["name"] for table in templates]
    for name, group in groups.items():
        kinds = {inner: ancestry(templates, groups[inner].template) for inner, outer in above.items() if outer == name}
        yield from _subgroups(group, kinds, names)


def _subgroups(
    group: GroupTable, kinds: Mapping[str, Sequence[str]], templates: Sequence[str]
) -> Iterator[ConfigurationFault]:
    for number, table in enumerate(group.subgroup, 1):
        key = f"group.{group.name}.subgroup.{number}"
        yield from one_of(f"{key}.template", table.template, templates)
        has = [name for name, lineage in kinds.items() if table.template in lineage]
        if len(has) < table.minimum or (table.maximum is not None and len(has) > table.maximum):
            bound = "minimum" if len(has) < table.minimum else "maximum"
            names = f": {', '.join(has)}" if has else ""
            allowed = f"{len(has)} groups of template {table.template} are within {group.name}{names}"
            yield ConfigurationFault(f"{key}.{bound}", "", allowed)
    known = {table.template for table in group.subgroup}
    for name, lineage in kinds.items() if known else ():
        if known.isdisjoint(lineage):
            allowed = f"{group.name} has subgroups of {', '.join(sorted(known))} alone"
            yield ConfigurationFault(f"group.{name}.within", shown(group.name), allowed)


def ancestry(templates: Sequence[Raw], template: str | None) -> tuple[str, ...]:
    """Return a template and all that it extends, the nearest first."""
    named = {table["name"]: table for table in templates}
    lineage: list[str] = []
    due = [] if template is None else [template]
    while due:
        name = due.pop(0)
        if name in named and name not in lineage:
            lineage.append(name)
            due += named[name].get(EXTENDS, ())
    return tuple(lineage)


# Players ----------------------------------------------------------------------------------------


def player_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: roles with too few able vehicles, or none that meets the other conditions."""
    for (group, name), role in scenario.roles.items():
        key, able = _at((group, name)), scenario.able_to_play(group, name)
        if not able and role.requires is not None:
            lacks = [(v.name, list(lacking(v, role, scenario, mission))) for v in scenario.vehicle]
            listed = [f"{vehicle} has {' and '.join(words)}" for vehicle, words in lacks if words]
            why = "; ".join(listed) or "those that do list other roles in playable_roles"
            required = role.requires.model_dump(exclude_unset=True)
            yield ConfigurationFault(f"{key}.requires", shown(required), f"no vehicle meets it: {why}")
        elif not able:
            yield ConfigurationFault(key, "", "no vehicle is able to play it: list it in playable_roles of one")
        elif len(able) < role.minimum:
            yield ConfigurationFault(f"{key}.minimum", "", f"only {len(able)} vehicles are able to play it")
        if role.head and able and not any(vehicle.social_layer for vehicle in able):
            yield ConfigurationFault(key, "", NO_LEADER.format(names=", ".join(vehicle.name for vehicle in able)))
    yield from _players_of_both(scenario)
    yield from _successors(scenario)


def playable_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield faults: unknown roles in the vehicles' lists."""
    roles = sorted({name for _, name in scenario.roles})
    paths = [*roles, *(".".join(key) for key in scenario.roles)]
    for vehicle in scenario.vehicle:
        for role in vehicle.playable_roles or ():
            if role not in paths:
                yield from one_of(f"vehicle.{vehicle.name}.playable_roles", role, paths if "." in role else roles)


def _players_of_both(scenario: Scenario) -> Iterator[ConfigurationFault]:
    for key, role in scenario.roles.items():
        other = role_key(role.played_by or ".")
        if all(other) and not any(vehicle.can_play(*key) and vehicle.can_play(*other) for vehicle in scenario.vehicle):
            yield ConfigurationFault(f"{_at(key)}.played_by", "", "no vehicle is able to play both roles")


def _successors(scenario: Scenario) -> Iterator[ConfigurationFault]:
    for group in scenario.group:
        key, roles, head = f"group.{group.name}.succession", group.succession, group.head
        if not roles or head is None or not {*roles} <= {*group.role_names}:
            continue
        able = [vehicle for vehicle in scenario.able_to_play(group.name, head.name) if vehicle.social_layer]
        if not any(vehicle.can_play(group.name, role) for vehicle in able for role in roles):
            allowed = (
                f"no vehicle can fill it: none that is able to play {' or '.join(roles)} has the social "
                f"layer and is able to play {head.name}; list {head.name} in playable_roles of one"
            )
            yield ConfigurationFault(key, "", allowed)


ORGANISATION = "organisation"


class OrganisationTables(Section):
    """Content of an organisation file."""

    role: tuple[dict[str, Any], ...] = ()
    group_template: tuple[dict[str, Any], ...] = ()
    group: tuple[GroupTable, ...] = Field(min_length=1)


def with_organisation(document: Document, folder: Path) -> tuple[Document, list[ConfigurationFault]]:
    """Merge the organisation file, named relative to ``folder``; raise ConfigurationError if it is unreadable."""
    if ORGANISATION not in document.raw:
        return document, []
    file = document.raw[ORGANISATION]
    if not isinstance(file, str):
        return document, [ConfigurationFault(ORGANISATION, shown(file), "a text: the name of a TOML file")]
    path = folder / file
    if not is_file(path):
        allowed = f"there is no file {path}; allowed: a TOML file with {', '.join(TABLES)}"
        return document, [ConfigurationFault(ORGANISATION, shown(file), allowed)]
    part = Document.at(path)
    faults = _unknown(part)
    for name in TABLES:
        if name in document.raw:
            allowed = f"given beside {ORGANISATION} = {shown(file)}, where the groups are: leave one of them out"
            faults.append(ConfigurationFault(name, "", allowed, document.line_of(name), document.path))
    if not part.raw.get(GROUP):
        allowed = f"there is no [[group]] in {path}; allowed: a TOML file with {', '.join(TABLES)}"
        return document, [*faults, ConfigurationFault(ORGANISATION, shown(file), allowed)]
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
    """True if all tables belong to an organisation file."""
    return bool(raw) and set(raw) <= set(TABLES)


def checked(document: Document) -> tuple[Sequence[GroupTable], int]:
    """Return the resolved groups of an organisation file, and the number of its templates.

    Raises ConfigurationError with every fault, except of rally points, jobs, vehicles and keys of a mission.
    """
    raw = document.raw
    shape, faults = validated(_Organisation, raw)
    if shape is None:
        raise document.error([*_unknown(document), *faults])
    templates: list[Raw] = raw.get(TEMPLATE, [])
    # A template is checked by a group of it, since its roles are whole only there.
    alone = [{"rally_point": "", "name": f"{table['name']} without a group", "template": table["name"]} for table in
             templates if not shape.group]  # fmt: skip
    specification = specified({**raw, GROUP: [*raw.get(GROUP, ()), *alone]})
    tables, faults = validated(
        OrganisationTables, {key: specification.raw[key] for key in TABLES if key in specification.raw}, True
    )
    faults = [*_unknown(document), *specification.faults, *faults]
    if tables is not None:
        faults += structure_faults(tables.group, templates)
    if faults or tables is None:
        raise document.error(specification.attributed(faults))
    return tables.group, len(templates)


FORMATION_WORDS = ontology_path("formation")
"""Ontology in the ``vocabulary`` of a mission that forms groups at run time."""


def formation_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: groups that cannot be formed, or that have keys of initial groups."""
    formers = {group.name: group.formed_by for group in scenario.group if group.formed_by is not None}
    circular = {name for cycle in _cycles(formers) for name in cycle}
    for group in scenario.group:
        if group.formed_by is None:
            continue
        key = f"group.{group.name}.formed_by"
        yield from one_of(key, group.formed_by, [other.name for other in scenario.group if other is not group])
        if group.name in circular and group.formed_by != group.name:
            allowed = "no group of the circle would ever be there: leave formed_by out of one of them"
            yield ConfigurationFault(key, "", allowed)
        if FORMATION_WORDS not in mission.vocabulary:
            allowed = f"the mission {mission.__name__} forms no groups at run time: leave it out"
            yield ConfigurationFault(key, "", allowed)
        if group.mission is not None:
            allowed = "a group formed at run time is given its mission then: leave it out"
            yield ConfigurationFault(f"group.{group.name}.mission", "", allowed)
    for number, fault in enumerate(scenario.fault, 1):
        if fault.vehicle.startswith(HEAD_OF) and fault.vehicle.removeprefix(HEAD_OF) in formers:
            allowed = (
                "a group has no head before it is formed at run time: name a vehicle, or the head of another group"
            )
            yield ConfigurationFault(f"fault.{number}.vehicle", "", allowed)


def groups_of(scenario: Scenario) -> tuple[Group, ...]:
    """Return the groups with the specifications of their roles."""
    apart = excluded(scenario.roles)
    return tuple(_group(table, apart, ancestry(scenario.group_template, table.template)) for table in scenario.group)


AS_IN_TABLE = {"name", "minimum", "maximum", "head", "founding", "job", "influences", "authority"}


def _group(table: GroupTable, excluded: Mapping[RoleKey, set[RoleKey]], templates: tuple[str, ...]) -> Group:
    roles = tuple(
        RoleSpecification(
            **{key: getattr(role, key) for key in AS_IN_TABLE},
            played_by=role_key(role.played_by) if role.played_by else None,
            incompatible=frozenset(excluded[table.name, role.name]),
        )
        for role in table.role
    )
    place = table.within, templates, table.subgroup, table.formed_by
    return Group(table.name, roles, table.rally_point, table.mission, table.succession, *place)
