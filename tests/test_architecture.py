"""Who may import whom, read from the sources themselves.

The rules are those of the design: ``worldmodel`` and ``exchange.acoustics`` stand alone, ``exchange`` knows the
world model, ``remoras`` knows both, ``missions`` knows all three; only two files know Mesa; the three layers of a
vehicle do not know each other; nothing knows the command line.
"""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parent.parent
OURS = ("worldmodel", "exchange", "remoras", "missions", "visualisation")
MAX_LINES = 400

MAY_IMPORT = {
    "worldmodel": {"worldmodel"},
    "exchange": {"exchange", "worldmodel"},
    "remoras": {"remoras", "exchange", "worldmodel"},
    "missions": {"missions", "remoras", "exchange", "worldmodel"},
}
ACOUSTICS_IN_EXCHANGE = {  # the policy study, and what compiles it, draw losses; nobody else hears the sea
    "exchange.study.montecarlo": {"exchange.acoustics.loss"},
    "exchange.study.study": {"exchange.acoustics.loss"},
    "exchange.study.compiler": {"exchange.acoustics.loss"},
}
KNOW_MESA = {"remoras.fleet", "remoras.vehicle"}
VISUALISATION_MAY_IMPORT = (
    "visualisation",
    "missions.runs.results",
    "missions.sweeps.runlog",
    "missions.comparison.compare",
    "exchange.study.study",
)
LAYERS = ("remoras.social.layer", "remoras.executive.layer", "remoras.functional.layer")
STAND_ALONE = ("remoras.organisation", "remoras.htn", "remoras.executive.satisfaction")
ROOF = ("remoras.cli.runs", "remoras.cli.app", "remoras.cli.sweeps", "remoras.cli.policies")
SAYS_WHEN = "missions.sweeps.execution"  # stamps a line of the sweep's log with the time it finished
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


def imports(source: str, module: str) -> list[Import]:
    """Every import of a source, wherever it stands, relative ones made absolute."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [Import(module, alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = module.split(".")[: -node.level] if node.level else []
            origin = ".".join([*above, *([node.module] if node.module else [])])
            found.append(Import(module, origin, node.lineno))
            found += [Import(module, f"{origin}.{alias.name}", node.lineno) for alias in node.names]
    return found


def within(target: str, package: str) -> bool:
    return target == package or target.startswith(package + ".")


def broken_rules(found: Import) -> Iterator[str]:
    """What an import violates, in words."""
    module, target, _ = found
    package, of = module.split(".")[0], target.split(".")[0]
    if target == "random" or target.startswith("random."):
        yield "draws come from the keyed streams, not from random"
    if of == "mesa" and module not in KNOW_MESA:
        yield "only the fleet and the vehicle know Mesa"
    if of not in OURS or module in ROOF:
        return
    if any(within(target, roof) for roof in ROOF):
        yield "nobody imports the roof"
    if package == "visualisation":
        # ``from missions import results`` is also an import of missions; the longer name decides.
        longer = any(within(allowed, target) for allowed in VISUALISATION_MAY_IMPORT)
        if not longer and not any(within(target, allowed) for allowed in VISUALISATION_MAY_IMPORT):
            yield "visualisation reads results only"
    elif of not in MAY_IMPORT[package]:
        yield f"{package} may import {', '.join(sorted(MAY_IMPORT[package]))}"
    if within(module, "exchange.acoustics") and not within(target, "exchange.acoustics"):
        yield "the sea knows nothing of ours"
    if within(target, "exchange.acoustics"):
        allowed = ACOUSTICS_IN_EXCHANGE.get(module, set())
        if package == "exchange" and not within(module, "exchange.acoustics"):
            if not any(within(target, one) or within(one, target) for one in allowed):
                yield "in exchange only the policy study draws losses"
        elif package == "remoras" and module != "remoras.fleet":
            yield "in remoras only the fleet knows the sea"
    if module in STAND_ALONE and not within(target, "remoras.errors") and target != "remoras":
        yield f"{module} stands alone"
    if module in LAYERS and any(within(target, layer) for layer in LAYERS):
        yield "the layers do not know each other"


def drawn_or_timed(source: str) -> list[str]:
    """Global random functions and wall clocks that a source uses."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Attribute):
            continue
        value = node.value
        owner = value.id if isinstance(value, ast.Name) else value.attr if isinstance(value, ast.Attribute) else ""
        nested = isinstance(value, ast.Attribute)
        from_numpy = owner == "random" and nested and node.attr not in SEEDED
        if from_numpy or (owner == "random" and not nested) or (owner, node.attr) in CLOCKS:
            found.append(f"line {node.lineno}: {owner}.{node.attr}")
    return found


def sources() -> dict[str, str]:
    """Every module of ours and its text."""
    found = {}
    for package in OURS:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            # Relative imports count from the package: its own text is read as if it were a module in it.
            found[name if parts[-1] != "__init__" else name + ".__init__"] = path.read_text(encoding="utf-8")
    return found


SOURCES = sources()


def test_every_package_has_sources() -> None:
    assert {name.split(".")[0] for name in SOURCES} == set(OURS)
    assert len(SOURCES) > 40


@pytest.mark.parametrize("module", SOURCES)
def test_imports_follow_the_design(module: str) -> None:
    name = module.removesuffix(".__init__")
    found = [
        f"{module}:{one.line} imports {one.target}: {rule}"
        for one in imports(SOURCES[module], module)
        for rule in broken_rules(one._replace(module=name))
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("module", SOURCES)
def test_no_hidden_source_of_chance_or_time(module: str) -> None:
    """A run is a pure function of scenario and seed."""
    found = drawn_or_timed(SOURCES[module])
    assert found == [] or (module == SAYS_WHEN and all("time." in one for one in found))


@pytest.mark.parametrize("module", SOURCES)
def test_files_stay_readable(module: str) -> None:
    assert len(SOURCES[module].splitlines()) <= MAX_LINES


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("worldmodel.abox", "from exchange.packets import Packet"),
        ("worldmodel.abox", "import remoras"),
        ("exchange.manager", "from remoras.social.layer import SocialLayer"),
        ("exchange.manager", "from exchange.acoustics.loss import uniform"),
        ("exchange.study.montecarlo", "from exchange.acoustics.channel import Channel"),
        ("exchange.acoustics.channel", "from exchange.packets import Packet"),
        ("exchange.acoustics.channel", "from worldmodel import TBox"),
        ("remoras.social.layer", "import mesa"),
        ("remoras.social.layer", "from mesa.agent import AgentSet"),
        ("remoras.vehicle", "from exchange.acoustics.channel import Arrival"),
        ("remoras.vehicle", "from missions.scenarios.scenario import Scenario"),
        ("remoras.social.layer", "from remoras.executive.layer import ExecutiveLayer"),
        ("remoras.executive.layer", "from . import functional"),
        ("remoras.functional.layer", "import remoras.social.layer"),
        ("remoras.htn", "from remoras.activities import Activity"),
        ("remoras.organisation", "from worldmodel import Instance"),
        ("remoras.executive.satisfaction", "from .decision import best"),
        ("missions.runs.run", "from remoras.cli.runs import main"),
        ("missions.runs.run", "from remoras import cli"),
        ("missions.scenarios.scenario", "import mesa"),
        ("missions.runs.results", "from visualisation import style"),
        ("visualisation.timelines", "from missions.runs.run import Run"),
        ("visualisation.timelines", "from missions import run"),
        ("visualisation.timelines", "import remoras.fleet"),
        ("visualisation.sweeps.comparison", "from missions.statistics import holm"),
        ("visualisation.sweeps.comparison", "from missions.sweeps.sweep import sweep"),
        ("exchange.schedule", "import random"),
        ("exchange.schedule", "def later():\n    from random import random"),
    ],
)
def test_a_violation_is_seen(module: str, line: str) -> None:
    """A source that breaks a rule is found out: else the rules above would prove nothing."""
    assert any(rule for found in imports(line, module) for rule in broken_rules(found))


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("exchange.study.montecarlo", "from exchange.acoustics.loss import uniform"),
        ("exchange.study.study", "from exchange.acoustics import loss"),
        ("exchange.acoustics.channel", "from exchange.acoustics import loss"),
        ("remoras.fleet", "import mesa\nfrom exchange.acoustics.channel import Channel"),
        ("remoras.htn", "from remoras.errors import PlanningError"),
        ("remoras.cli.runs", "from missions.runs.run import run\nfrom visualisation import style"),
        ("missions.runs.run", "from exchange.acoustics.channel import Channel"),
        ("visualisation.timelines", "from missions.runs.results import Results\nfrom missions import results"),
        (
            "visualisation.sweeps.comparison",
            "from missions import compare\nfrom missions.sweeps.runlog import SweepResults",
        ),
        ("worldmodel.abox", "import numpy as np"),
    ],
)
def test_what_the_design_allows_passes(module: str, line: str) -> None:
    assert not [rule for found in imports(line, module) for rule in broken_rules(found)]


@pytest.mark.parametrize(
    "line",
    ["random.random()", "np.random.rand(3)", "numpy.random.seed(1)", "time.time()", "datetime.now()",
     "datetime.datetime.now()"],
)  # fmt: skip
def test_hidden_chance_and_time_are_seen(line: str) -> None:
    assert drawn_or_timed(line)


@pytest.mark.parametrize("line", ["np.random.Philox(1)", "time.perf_counter()", "datetime.timedelta(1)"])
def test_seeded_generators_and_durations_pass(line: str) -> None:
    assert drawn_or_timed(line) == []
