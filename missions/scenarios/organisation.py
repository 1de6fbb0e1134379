"""Specification of the organisation: groups as a file gives them, written out into groups that stand for themselves.

A ``[[group_template]]`` is a group without a place of its own: a ``[[group]]`` with ``template`` has its keys and its
roles, besides or instead of which it has those that it lists itself. Templates and roles have parents by ``extends``.
Of several parents the later one wins, and the own keys win over all; tables in them are joined key by key. A role with
``abstract = true``, and every ``[[role]]`` of the file, is there to be extended and nothing else.

Works on the raw tables, before anything else is checked: checks, missions and manifests see whole groups. Where a key
comes from is kept, so that a fault names the table that has it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.tables import Raw, entries, names_of, one_of

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
