"""The architecture, checked in the sources: imports, mission words, docstrings.

``ROOMS`` lists packages and their folders. Interfaces lie at the root of a package, implementations in its folders; no
folder imports a sibling. Only the fleet and the views of the truth import all three layers, and only the API and the
command line import everything. Words of a mission occur in its folder only.
"""

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parent.parent
OURS = ("worldmodel", "exchange", "remoras", "missions", "visualisation")

ROOMS: dict[str, set[str]] = {
    "worldmodel.ontology": {"worldmodel.ontology"},
    "worldmodel": {"worldmodel", "worldmodel.ontology"},
    "worldmodel.rdf": {"worldmodel.rdf", "worldmodel", "worldmodel.ontology"},
    "exchange.channel": {"exchange.channel"},
    "exchange": {"exchange", "worldmodel"},
    "exchange.policy": {"exchange.policy", "exchange", "worldmodel"},
    "exchange.wire": {"exchange.wire", "exchange.policy", "exchange", "worldmodel"},
    "exchange.manager": {"exchange.manager", "exchange.wire", "exchange.policy", "exchange", "worldmodel"},
    "exchange.drivers": {"exchange.drivers", "exchange"},
    "exchange.study": {"exchange.study", "exchange.policy", "exchange"},
    "remoras": {"remoras", "exchange", "exchange.manager", "exchange.policy", "worldmodel"},
    "remoras.social": {"remoras.social", "remoras", "exchange", "worldmodel"},
    "remoras.executive": {"remoras.executive", "remoras"},
    "remoras.functional": {"remoras.functional", "remoras"},
    "remoras.strategies": {"remoras.strategies", "remoras", "worldmodel"},
    "missions": {"missions", "worldmodel"},
    "missions.scenarios": {
        "missions.scenarios", "missions", "remoras", "remoras.strategies", "exchange", "exchange.policy",
        "exchange.channel", "worldmodel",
    },
    "missions.features": {
        "missions.features", "missions", "missions.scenarios", "remoras", "remoras.social", "remoras.functional",
        "exchange", "exchange.manager", "exchange.policy", "exchange.channel", "worldmodel",
    },
    "missions.faults": {"missions.faults", "missions", "missions.scenarios", "remoras", "worldmodel"},
    "missions.meeting": {"missions.meeting", "missions.scenarios", "missions", "remoras"},
    "missions.trident": {
        "missions.trident", "missions.meeting", "missions.scenarios", "missions", "remoras", "worldmodel",
    },
    **{
        f"missions.{mission}": {f"missions.{mission}", "missions.meeting", "missions.scenarios", "missions", "remoras"}
        for mission in ("mapping", "pandora", "arrows", "fieldwork", "minehunting")
    },
    "missions.runs": {
        "missions.runs", "missions.scenarios", "missions", "remoras", "remoras.social", "remoras.executive",
        "remoras.functional", "exchange", "exchange.manager", "exchange.policy", "exchange.channel", "worldmodel",
        "worldmodel.rdf",
    },
    "missions.nodes": {
        "missions.nodes", "missions.runs", "missions.scenarios", "missions", "remoras", "remoras.functional",
        "exchange", "exchange.drivers", "exchange.channel", "worldmodel",
    },
    "missions.sweeps": {
        "missions.sweeps", "missions.runs", "missions.scenarios", "missions", "remoras", "remoras.strategies",
        "worldmodel",
    },
    "missions.benchmark": {
        "missions.benchmark", "missions.sweeps", "missions.runs", "missions.scenarios", "missions", "remoras",
        "remoras.strategies", "exchange.channel", "worldmodel",
    },
    "missions.verification": {"missions.verification"},
    "missions.comparison": {"missions.comparison", "missions.sweeps", "missions", "worldmodel"},
    "visualisation": {
        "visualisation", "missions", "exchange.study", "exchange.channel", "exchange", "worldmodel",
    },
    "visualisation.runs": {"visualisation.runs", "visualisation", "missions", "worldmodel"},
    "visualisation.sweeps": {"visualisation.sweeps", "visualisation", "missions", "missions.comparison", "worldmodel"},
    "visualisation.report": {
        "visualisation.report", "visualisation.sweeps", "visualisation", "missions", "missions.comparison",
    },
    "visualisation.replay": {"visualisation.replay", "visualisation", "missions", "worldmodel"},
    "visualisation.exports": {"visualisation.exports", "visualisation", "missions", "worldmodel", "worldmodel.rdf"},
}  # fmt: skip
"""Rooms that the modules of a room may import."""
DOORS: dict[str, set[str]] = {
    "worldmodel.ontology": {"worldmodel.errors"},
    "exchange.wire": {"worldmodel.ontology.fields"},
    "exchange.study": {"exchange.channel.loss"},
    "remoras": {"exchange.channel.loss", "exchange.wire.definitions"},
    "remoras.social": {"exchange.manager.peers"},
    "missions": {"worldmodel.ontology.tbox", "remoras.table", "remoras.database"},
    "missions.arrows": {"exchange.channel.loss", "exchange.channel.link"},
    **{
        f"missions.{mission}": {"exchange.channel.loss"}
        for mission in ("mapping", "trident", "pandora", "fieldwork", "minehunting")
    },
    "missions.scenarios": {"remoras.executive.decision", "exchange.wire.sealing"},
    "missions.runs": {"exchange.wire.codec"},
    "missions.nodes": {"exchange.wire.codec", "exchange.wire.definitions", "exchange.wire.sealing"},
    "visualisation": {"missions.runs.results", "missions.sweeps.folder", "missions.comparison"},
    "visualisation.runs": {"missions.runs.results"},
    "visualisation.sweeps": {"missions.sweeps.folder"},
    "visualisation.report": {"missions.runs.results", "missions.sweeps.folder", "missions.sweeps.ledger"},
}  # fmt: skip
"""Single modules of other rooms that a room may import."""
FOR_ALL = {"exchange.arithmetic", "exchange.lazily"}
"""Everybody may import them; they import nothing."""
HULL = {
    "remoras.fleet.vehicle", "remoras.fleet.radio", "remoras.fleet.fleet", "remoras.fleet.standalone",
    "remoras.fleet.traffic", "remoras.truth",
}  # fmt: skip
LAYERS = ("remoras.social", "remoras.executive", "remoras.functional")
KNOW_MESA = {"remoras.mesa", "remoras.fleet.fleet", "remoras.fleet.standalone", "remoras.fleet.vehicle"}
STAND_ALONE = {
    "remoras.organisation": {"remoras.errors", "remoras.table"},
    "remoras.htn": {"remoras.errors", "remoras.process"},
    "remoras.executive.decision": {"remoras.activities", "remoras.table"},
}
FACE = "remoras", "remoras.api", "remoras.mesa", "remoras.stepped"
ROOFS = ("remoras.cli", "remoras.testing")
ENTRY = "remoras.__main__"
TOGETHER = {
    ("exchange.manager.receiver", "exchange.manager.relaying"),
    tuple(
        f"missions.scenarios.{name}"
        for name in ("channel", "communication", "faults", "fleet", "knowledge", "organisation", "scenario")
    ),
}
WORDS_OF = {
    "missions.mapping": ("area", "areas", "swath", "swaths", "cell", "cells", "coverage", "mapped"),
    "missions.trident": (
        "trident", "choreography", "decoy", "decoys", "clamp", "gripper", "reacquire", "reacquiring", "usbl",
        "likeness", "recogniser", "transponder",
    ),
    "missions.arrows": (
        "archaeology", "archaeological", "amphorae", "wooden", "magnetometer", "lawnmower", "cell", "cells", "area",
    ),
}  # fmt: skip
"""Words of a mission that nothing outside its folder may know."""
TRIES = "remoras.testing"
"""Puts plug-ins to jobs of mapping; what it puts them to is drawn by seed, and no run depends on it."""
INDEPENDENT = "missions.verification"
"""Reads results of all missions with nothing of theirs, so it has their words."""
DESIGNED = "missions.benchmark", "remoras.cli.benchmark"  # cells of an experiment's design
MEASURES = "remoras.cli.reproduction"
"""Measures published results of missions, in their words."""
BEGINS = "remoras.cli.new"
"""The first scenario of one's own is one of mapping, and the options that it comes from are called so."""
GENERAL = ("ReturningToArea", "area of operations", "areas of operations", "FocusArea", "focusArea", "focus area")
"""A vehicle stays in the area of operations whatever its mission is; focus areas are of the core ontology."""
SAYS_WHEN = {  # a sweep stamps lines of its log with the time at which a run ended; a node outlives its machine's clock
    "missions.sweeps.worker", "missions.nodes.logs", "remoras.cli.nodes",
}  # fmt: skip
SEEDED = {"Generator", "Philox", "SeedSequence", "BitGenerator", "default_rng"}
CLOCKS = {
    ("time", "time"), ("time", "time_ns"), ("time", "gmtime"), ("time", "localtime"),
    ("datetime", "now"), ("datetime", "utcnow"), ("datetime", "today"),
}  # fmt: skip


class Import(NamedTuple):
    """``module`` imports ``target``; for ``from a import b`` there is one for ``a`` and one for ``a.b``."""

    module: str
    target: str
    line: int


def sources() -> dict[str, str]:
    """Every module of ours and its text."""
    found = {}
    for package in OURS:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if "templates" in parts:  # as users write plug-ins
                continue
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text(encoding="utf-8")
    return found


SOURCES = sources()


@cache
def parsed(source: str) -> ast.Module:
    return ast.parse(source)


def _typing_only(tree: ast.Module) -> set[ast.AST]:
    """Nodes below ``if TYPE_CHECKING:``, which no program executes."""
    tests = [n for n in ast.walk(tree) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.unparse(n.test)]
    return {inner for test in tests for statement in test.body for inner in ast.walk(statement)}


@cache
def imports(source: str, module: str, typing: bool = False) -> list[Import]:
    """Every import, wherever it stands, relative ones made absolute; the names that are modules.

    Args:
        source, module: text and name of a module.
        typing: those that only a type checker follows, too.
    """
    found = []
    tree = parsed(source)
    passed_over = _typing_only(tree) if not typing and "TYPE_CHECKING" in source else set()
    package = module.split(".") if module in PACKAGES else module.split(".")[:-1]
    for node in ast.walk(tree):
        if node in passed_over:
            continue
        if isinstance(node, ast.Import):
            found += [Import(module, alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            origin = ".".join([*above, *([node.module] if node.module else [])])
            inner = [Import(module, f"{origin}.{alias.name}", node.lineno) for alias in node.names]
            modules = [one for one in inner if one.target in SOURCES]
            found += modules or [Import(module, origin, node.lineno)]
    return found


PACKAGES = {name.rpartition(".")[0] for name in SOURCES} & {*SOURCES}


def within(target: str, package: str) -> bool:
    return target == package or target.startswith(package + ".")


def in_roof(module: str) -> bool:
    return any(within(module, roof) for roof in ROOFS)


def room_of(module: str) -> str:
    """The innermost room that a module stands in; those of the roof and of missions from outside have none."""
    return max((room for room in ROOMS if within(module, room)), key=len, default="")


def broken_rules(found: Import) -> Iterator[str]:
    """Rules that an import violates, in words."""
    module, target, _ = found
    of = target.split(".")[0]
    if (target == "random" or target.startswith("random.")) and not within(module, TRIES):
        yield "draws come from the keyed streams, not from random"
    if of == "mesa" and module not in KNOW_MESA:
        yield "only the fleet, the vehicle, a vehicle by itself and the model for users know Mesa"
    if of not in OURS or target in FOR_ALL or in_roof(module) or module in (*FACE, ENTRY):
        return
    if in_roof(target):
        yield "nobody imports a roof"
    if target in FACE and module not in FACE:
        yield "nobody imports the face: name the module that is meant"
    room, other = room_of(module), room_of(target)
    if module in HULL and (other in LAYERS or within(target, "exchange.channel")):
        if other not in LAYERS and module not in ("remoras.fleet.fleet", "remoras.fleet.traffic"):
            yield "in remoras only the fleet knows the sea"
    elif other not in ROOMS[room] and not any(within(target, door) for door in DOORS.get(room, ())):
        yield f"{room} may import {', '.join(sorted(ROOMS[room] | DOORS.get(room, set())))}"
    for alone, allowed in STAND_ALONE.items():
        inside = within(module, alone) if alone == "remoras.htn" else module == alone
        if inside and not within(target, alone) and target not in allowed:
            yield f"{alone} stands alone"


def words_in(source: str) -> list[tuple[int, str]]:
    """Every word of a source, comments included, with its line: ``first_areaDone`` has three."""
    for general in GENERAL:
        source = source.replace(general, "")
    return [
        (number, word.lower())
        for number, line in enumerate(source.split("\n"), 1)
        for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", line)
    ]


def drawn_or_timed(source: str) -> list[str]:
    """Global random functions and wall clocks that a source uses."""
    found = []
    for node in ast.walk(parsed(source)):
        if not isinstance(node, ast.Attribute):
            continue
        value = node.value
        owner = value.id if isinstance(value, ast.Name) else value.attr if isinstance(value, ast.Attribute) else ""
        nested = isinstance(value, ast.Attribute)
        from_numpy = owner == "random" and nested and node.attr not in SEEDED
        if from_numpy or (owner == "random" and not nested) or (owner, node.attr) in CLOCKS:
            found.append(f"line {node.lineno}: {owner}.{node.attr}")
    return found


def circles(arrows: dict[str, set[str]]) -> set[tuple[str, ...]]:
    """Strongly connected groups of modules in the import graph."""
    graph = nx.DiGraph((module, target) for module, targets in arrows.items() for target in targets)
    return {tuple(sorted(group)) for group in nx.strongly_connected_components(graph) if len(group) > 1}


@cache
def classes() -> dict[str, list[ast.ClassDef]]:
    """Our classes by name."""
    found: dict[str, list[ast.ClassDef]] = {}
    for text in SOURCES.values():
        for statement in ast.walk(parsed(text)):
            if isinstance(statement, ast.ClassDef):
                found.setdefault(statement.name, []).append(statement)
    return found


@cache
def inherited(name: str) -> frozenset[str]:
    """Methods that the bases of our classes of this name document, as far as these are ours."""
    bases = {
        ast.unparse(base).partition("[")[0].rpartition(".")[2] for c in classes().get(name, []) for base in c.bases
    }
    bases.discard(name)
    own = {
        method.name
        for base in bases
        for one in classes().get(base, [])
        for method in one.body
        if isinstance(method, ast.FunctionDef) and ast.get_docstring(method)
    }
    return frozenset(own.union(*map(inherited, bases)))


def undocumented(source: str) -> list[str]:
    """Public functions, classes and methods without a docstring, own or of the method that they override."""

    def walk(body: list[ast.stmt], prefix: str) -> Iterator[str]:
        for node in body:
            if not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef) or node.name.startswith("_"):
                continue
            is_setter = any("setter" in ast.unparse(d) for d in node.decorator_list)
            if ast.get_docstring(node) is None and not is_setter and node.name not in inherited(prefix[:-1]):
                yield f"{prefix}{node.name}"
            if isinstance(node, ast.ClassDef):
                yield from walk(node.body, f"{node.name}.")

    tree = parsed(source)
    return [*([] if ast.get_docstring(tree) or not source.strip() else ["the module"]), *walk(tree.body, "")]


def test_every_package_has_sources() -> None:
    assert {name.split(".")[0] for name in SOURCES} == set(OURS)
    assert len(SOURCES) > 40


def test_imports_follow_the_design() -> None:
    found = [
        f"{module}:{one.line} imports {one.target}: {rule}"
        for module, text in SOURCES.items()
        for one in imports(text, module)
        for rule in broken_rules(one)
    ]
    assert not found, "\n".join(found)


def test_override_takes_the_docstring_of_its_base() -> None:
    assert not undocumented('"""A."""\nclass Homing(Behaviour):\n    """B."""\n    def perceive(self): ...')
    assert undocumented('"""A."""\nclass Homing:\n    """B."""\n    def perceives(self): ...') == ["Homing.perceives"]


def test_imports_form_no_cycle() -> None:
    arrows = {
        module: {one.target for one in imports(text, module)} for module, text in SOURCES.items() if module not in FACE
    }
    assert circles(arrows) == set()


def test_imports_for_types_form_few_cycles() -> None:
    """A module that needs the type of one above it takes values instead, or says by a Protocol what it needs.

    Excepted are an optional part and its owner, which holds it or None, and a scenario and its tables, which are
    checked against all of it.
    """
    arrows = {
        module: {one.target for one in imports(text, module, typing=True)}
        for module, text in SOURCES.items()
        if module not in FACE
    }
    assert circles(arrows) <= TOGETHER


def own_words(module: str) -> set[str]:
    """Words of the mission that a module belongs to: another one may have the same."""
    if any(within(module, one) for one in (INDEPENDENT, TRIES, MEASURES)):
        return {word for words in WORDS_OF.values() for word in words}
    if module == BEGINS:
        return {"area", "areas"}
    if any(within(module, one) for one in DESIGNED):
        return {"cell", "cells"}
    return {word for mission, words in WORDS_OF.items() if within(module, mission) for word in words}


def test_words_of_a_mission_stay_in_its_folder() -> None:
    words = set[str]().union(*WORDS_OF.values())
    found = [
        f"{module}:{line} says {word}"
        for module, text in SOURCES.items()
        for line, word in words_in(text)
        if word in words and word not in own_words(module)
    ]
    assert not found, "\n".join(found)


def test_no_hidden_source_of_randomness_or_time() -> None:
    """A run is a pure function of scenario and seed."""
    found = [
        f"{module}, {one}"
        for module, text in SOURCES.items()
        for one in drawn_or_timed(text)
        if (module not in SAYS_WHEN or "time." not in one) and not within(module, TRIES)
    ]
    assert not found, "\n".join(found)


def test_every_public_name_has_a_docstring() -> None:
    found = [f"{module}: {name}" for module, text in SOURCES.items() for name in undocumented(text)]
    assert not found, "\n".join(found)


def unexplained(source: str) -> list[int]:
    """Lines that let a function be complex without a comment on the line before that says why."""
    lines = source.splitlines()
    return [
        number for number, line in enumerate(lines, 1)
        if re.search(r"# noqa:.*\bC901\b", line) and not lines[number - 2].lstrip().startswith("#")
    ]  # fmt: skip


def test_every_complex_function_states_its_reason() -> None:
    files = [file for folder in (*OURS, "benchmarks", "tests") for file in sorted((ROOT / folder).rglob("*.py"))]
    assert len(files) > 500
    found = [f"{file.relative_to(ROOT)}:{line}" for file in files for line in unexplained(file.read_text("utf-8"))]
    assert not found, "\n".join(found)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["ruff"]["lint"]
    assert "C90" in settings["select"]
    assert settings["mccabe"]["max-complexity"] <= 15


def assigned(source: str) -> set[str]:
    """Names that a module assigns at its top."""
    return {t.id for n in ast.parse(source).body if isinstance(n, ast.Assign | ast.AnnAssign)
            for t in (n.targets if isinstance(n, ast.Assign) else [n.target]) if isinstance(t, ast.Name)}  # fmt: skip


def test_every_package_declares_its_public_names() -> None:
    assert [package for package in sorted(PACKAGES) if "__all__" not in assigned(SOURCES[package])] == []


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("worldmodel.world_model", "from exchange.packets import Packet"),
        ("exchange.channel.channel", "from worldmodel import TBox"),
        ("remoras.executive.layer", "from ..functional import layer"),
        ("missions.runs.run", "from remoras.cli import main"),
        ("visualisation.runs.roles", "from missions.runs.run import Run"),
        ("exchange.schedule", "def later():\n    from random import random"),
    ],
)
def test_a_forbidden_import_is_detected(module: str, line: str) -> None:
    assert any(rule for found in imports(line, module) for rule in broken_rules(found))


def test_an_import_cycle_is_detected() -> None:
    arrows = {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": {"e"}, "e": {"d"}}
    assert circles(arrows) == {("b", "c"), ("d", "e")}


def test_mission_words_and_hidden_randomness_are_detected() -> None:
    assert {word for _, word in words_in("# coverage of n_cells")} & set(WORDS_OF["missions.mapping"])
    assert drawn_or_timed("np.random.rand(3)")
