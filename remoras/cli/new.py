"""Command ``new``: a scenario from six options, or a plug-in with its test from a template."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer

from missions.errors import LONGEST_VALUE, check_name, cut
from missions.files import shipped
from remoras.cli import completion
from remoras.cli.app import as_typed, command, fail

AUTHORS = 'pip install "remoras-sim[authors]"'
TEMPLATES = Path(__file__).with_name("templates")
SCENARIO = "scenario"
PLUGINS: dict[str, tuple[str, ...]] = {
    "strategy": ("nearest.py",),
    "mission": ("buoys.py", "buoys.ttl", "buoys.toml"),
    "sensor": ("thermometer.py",),
    "metric": ("closest.py",),
}
"""Templates per kind of plug-in, in reading order."""
OBJECTS = {"strategy": "NEAREST", "mission": "BuoyMission", "sensor": "ThermometerSettings", "metric": "CLOSEST"}
"""Object of each template that scenarios name."""
PYPROJECT = """\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "{distribution}"
version = "0.1.0"
dependencies = ["remoras-sim"]

[project.entry-points."remoras.plugins"]
"{kind}.{name}" = "{name}:{object}"

[tool.setuptools]
packages = ["{name}"]
package-data = {{ {name} = ["*.ttl", "*.toml"] }}
"""
KINDS = (SCENARIO, *PLUGINS)
EXAMPLES = (SCENARIO, "study", "organisation")
OFFERED = tuple(dict.fromkeys((*KINDS, *EXAMPLES)))


@command("new", "remoras new scenario mine --vehicles 4 --areas 6 --per 0.5", names_code=False)
def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND", help=f"One of {', '.join(KINDS)}.", autocompletion=completion.offering(*OFFERED)
        ),
    ] = SCENARIO,
    name: str = "",
    vehicles: Annotated[int | None, typer.Option(min=2, max=16)] = None,
    areas: Annotated[int | None, typer.Option(min=1, max=36)] = None,
    side: float | None = None,
    modem: Annotated[str | None, typer.Option(autocompletion=completion.modem)] = None,
    per: float | None = None,
    lost: Annotated[int | None, typer.Option(min=0)] = None,
    package: bool = False,
    out: Path = Path(),
    force: bool = False,
    example: Annotated[
        bool, typer.Option("--example", help=f"Print a commented example of KIND ({', '.join(EXAMPLES)}) instead.")
    ] = False,
) -> None:
    """Create a working scenario, strategy, mission, sensor or metric.

    A plug-in includes its conformance test.

    Args:
        name (NAME): Name of the scenario or plug-in and of its files; none with --example.

    Options:
        vehicles (N): Scenario: number of AUVs, 2 to 16.  [default: 3]
        areas (N): Scenario: number of areas to map, 1 to 36.  [default: 4]
        side (METRES): Scenario: side of an area, 50 to 1000.  [default: 150]
        modem (NAME): Scenario: modem profile of every vehicle.  [default: nanomodem-v3]
        per (RATE): Scenario: packet error rate, 0 to 0.95.  [default: 0.3]
        lost (N): Scenario: number of AUVs that fail during the mission, 0 to 15.  [default: 0]
        package: Plug-in: write a folder that pip installs, with pyproject.toml.
        out (DIR): Folder for the files.
        force: Replace existing files.
    """
    if example:
        _print_example(kind, name)
        return
    if kind in EXAMPLES and kind not in KINDS:
        fail(f"a {kind} starts from a commented example: remoras new {kind} --example > {name or kind}.toml")
    check_name("kind", kind, KINDS)
    if not name:
        fail(f"NAME is missing; allowed: new {kind} NAME; a commented file is printed by: new scenario --example")
    options = {"vehicles": vehicles, "areas": areas, "side": side, "modem": modem, "per": per, "lost": lost}
    chosen: dict[str, Any] = {option: value for option, value in options.items() if value is not None}
    if package and kind == SCENARIO:
        fail(f"--package: applies to plug-ins; allowed: {', '.join(PLUGINS)}")
    if kind == SCENARIO:
        from exchange.channel.modems import modems
        from missions.mapping.new_scenario import scenario_text

        _check_scenario_name(name)
        ranges_m = {profile.name: profile.range_m for profile in modems().values()}
        if modem is not None:
            check_name("--modem", modem, list(ranges_m))
        files = {f"{name}.toml": scenario_text(name, ranges_m, **chosen)}
        trial = f"remoras run {as_typed(out / f'{name}.toml')} --out first"
    else:
        if chosen:
            fail(f"--{next(iter(chosen))}: applies to scenarios; a {kind} has no such option")
        folder = out / _distribution(name)
        _check_plugin_name(name, folder / name if package else out)
        files = dict((package_files if package else plugin_files)(kind, name))
        trial = f"python -m pytest -q {as_typed(out / next(file for file in files if 'test_' in file))}"
        # Without a slash pip would search the package index for the name.
        trial = f"pip install {as_typed(folder)}/ && {trial}" if package else trial
        trial += f"  # {AUTHORS} has what it needs"
    written = [out / file for file in files]
    # A dangling link does not exist, but writing would follow it.
    existing = [str(path) for path in written if path.exists() or path.is_symlink()]
    if existing and not force:
        fail(f"{', '.join(existing)}: already there; --force replaces; another NAME or --out DIR keeps existing files")
    for path, text in zip(written, files.values(), strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        print(path)
    print(f"try it with: {trial}")


def _print_example(kind: str, name: str) -> None:
    from missions.sweeps.study import example_study

    check_name("example", kind, EXAMPLES)
    if name:
        fail(f"NAME {cut(name, LONGEST_VALUE)!r}: an example has no name; allowed: none")
    if kind == "study":
        print(example_study().rstrip())
        return
    path = shipped()["mapping-rendezvous"]
    if kind == "organisation":
        path = shipped()["mapping-nine-teams"].parent / "organisations" / "three-teams.toml"
    print(path.read_text(encoding="utf-8").rstrip())


def plugin_files(kind: str, name: str) -> Iterator[tuple[str, str]]:
    """Yield name and text of each file of a new plug-in, conformance test included."""
    stem = PLUGINS[kind][0].removesuffix(".py")
    for file in (*PLUGINS[kind], f"test_{stem}.py"):
        text = (TEMPLATES / file).read_text(encoding="utf-8")
        yield file.replace(stem, name), _renamed(text, stem, name)


def package_files(kind: str, name: str) -> Iterator[tuple[str, str]]:
    """Yield path and text of each file of a distribution with a new plug-in."""
    folder, stem = _distribution(name), PLUGINS[kind][0].removesuffix(".py")
    its_object = _renamed(OBJECTS[kind], stem, name)
    yield f"{folder}/pyproject.toml", PYPROJECT.format(distribution=folder, kind=kind, name=name, object=its_object)
    for file, text in plugin_files(kind, name):
        place = "tests" if file.startswith("test_") else name
        yield f"{folder}/{place}/{'__init__.py' if file == f'{name}.py' else file}", text


def _distribution(name: str) -> str:
    return f"remoras-{name.replace('_', '-')}"


def _renamed(text: str, stem: str, name: str) -> str:
    for old, its in ((stem, name), (stem.upper(), name.upper()), (stem.capitalize(), _capitals(name))):
        text = text.replace(old, its)
    return text


def _capitals(name: str) -> str:
    """Class name: ``by_range`` gives ``ByRange``."""
    return "".join(part.capitalize() for part in name.split("_"))


def _check_scenario_name(name: str) -> None:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}", name):
        fail(f"NAME {cut(name, LONGEST_VALUE)!r}: allowed: up to 40 letters, digits, - and _, a letter or digit first")
    if name in shipped():
        fail(f"NAME {name!r}: is the name of a shipped scenario; allowed: any other")


def _check_plugin_name(name: str, out: Path) -> None:
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", name) or len(name) > 40 or keyword.iskeyword(name):
        allowed = "up to 40 small letters, digits and single _, a letter first, no keyword of Python"
        fail(f"NAME {cut(name, LONGEST_VALUE)!r}: is no name of a module; allowed: {allowed}")
    spec = find_spec(name)
    where = getattr(spec, "origin", None)
    if spec is not None and (where is None or Path(where).parent.resolve() != out.resolve()):
        fail(f"NAME {name!r}: a module of that name is installed, and would be imported instead; allowed: any other")
