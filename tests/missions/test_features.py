"""Each feature is one file: who takes it away loses the feature, and nothing else."""

import json
import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from missions.files import shipped
from missions.scenarios import load
from missions.scenarios.extending import features, used_in

ROOT = Path(__file__).parents[2]
LEAVING_OUT = """
import hashlib, json, pkgutil, sys
left_out, folder, *use = sys.argv[1:]
sound = pkgutil.iter_modules
pkgutil.iter_modules = lambda path: [one for one in sound(path) if one.name != left_out]
if left_out:
    of_bound = ["remoras.strategies.oracle", "remoras.bound"]
    taken = of_bound if left_out == "oracle" else ["missions.features." + left_out]
    sys.modules.update(dict.fromkeys(taken))  # whoever imports it fails
"""
WITHOUT = """
from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.runs.summary import summary
from missions.scenarios import load
from missions.scenarios.extending import features
PLAIN = [("--set", "scenario.duration_s=150.0"), ("--set", "channel.per=0.3")]
finished = run(load("mapping-rendezvous", PLAIN), 3)
rows = {name: list(finished.recorder.rows(name)) for name in finished.recorder.tables}
found = json.dumps([rows, summary(finished)], default=str, sort_keys=True)
refused = ""
try:
    load("mapping-rendezvous", [*PLAIN, *(("--set", one) for one in use)])
except ConfigurationError as error:
    refused = str(error)
print(json.dumps([hashlib.sha256(found.encode()).hexdigest(), refused, list(features())]))
"""
USES = {
    "ban": ["ban=[{issuer='AUV00', vehicle='AUV02', at_s=6.0}]"],
    "clocks": ["communication.clocks={offset_s=0.2, apart_s=0.5}"],
    "need": ["need=[{attribute='batteryFraction', vehicle='ASV00', from_s=60.0}]"],
    "parking": ["communication.parking=false"],
    "relaying": ["communication.relaying=false"],
    "summaries": ["communication.summaries=false"],
    "watch": ["watch={cpu_s=1.0}"],
    "current": ["current={east_mps=0.2, tide_period_h=2.0}"],
    "navigation": ["navigation={drift=0.01}", "beacon=[{name='buoy', position_m=[0.0, 0.0], range_m=90.0}]"],
    "damage": ["damage={share=0.1}", "communication.crc_bits=16"],
    "uncertainty": ["uncertainty={p_miss=0.1, speed_spread=0.05}"],
    "passage": ["passage={x_m=[640.0, 650.0], y_m=350.0, width_m=60.0}"],
}
"""What a scenario has to say to use each feature."""


def said_apart(program: str, *arguments: str) -> str:
    """What a process of its own prints; files are all there, so what others keep would be taken for its own."""
    command = [sys.executable, "-c", program, *arguments]
    with tempfile.TemporaryDirectory() as kept:
        env = {**os.environ, "XDG_CACHE_HOME": kept}
        made = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False, timeout=240)
    assert made.returncode == 0, made.stderr
    return made.stdout


def said_without(feature: str, *use: str, program: str = "", folder: str = "") -> list[Any]:
    """Digest of a run, how a scenario with these settings is refused, and which features there are; what more is said.

    Args:
        feature: that is taken away, or nothing; use: settings.
        program: that runs after that; folder: for its results.
    """
    # a process of its own: tables take in the keys of features once, when they are imported
    said = said_apart(LEAVING_OUT + WITHOUT + program, feature, folder, *use)
    found, *more = map(json.loads, said.splitlines())
    return [*found, *more]


@pytest.fixture(scope="module")
def whole() -> str:
    """Digest of the run with all features there, of which it uses none."""
    digest, _, names = said_without("")
    assert names == list(features())
    assert isinstance(digest, str)
    return digest


@pytest.mark.parametrize("feature", sorted(USES))
def test_a_feature_that_is_there_is_taken(feature: str) -> None:
    loaded = load("mapping-rendezvous", [("--set", one) for one in USES[feature]])
    assert features()[feature] in used_in(loaded)


def test_features_that_are_off_write_nothing_into_the_manifest() -> None:
    """What is on unless a scenario says otherwise stands there."""
    written = load("mapping-rendezvous").model_dump(mode="json", exclude_none=True)
    there = [
        f"{place}.{key}"
        for feature in features().values()
        for place, keys in feature.keys.items()
        for key in keys
        for table in ([written.get(place, [])] if place else [[written]])
        if any(key in one for one in (table if isinstance(table, list) else [table]))
    ]
    assert sorted(there) == ["communication.parking", "communication.relaying", "communication.summaries"]


IN_STILL_WATER = """
import re, tempfile
from pathlib import Path
from missions.runs.run import run
from missions.scenarios import load
text = Path("missions/pandora/inspection.toml").read_text(encoding="utf-8")
of_current = r"(?m)^ *\\[+current.*\\n(?:(?! *\\[).*\\n)*"
still, n_tables = re.subn(of_current, "", text)
assert n_tables > 1, n_tables
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "still.toml"
    file.write_text(still, encoding="utf-8")
    scenario = load(str(file), [("--set", "scenario.duration_s=30.0"), ("--set", "fault=[]")])
n_rows = len(run(scenario, 1).recorder.trajectories)
print(json.dumps([scenario.foretold, list(scenario.surges(1)), n_rows > 0]))
"""


def test_a_mission_that_asks_how_the_water_moves_works_where_nothing_moves_it() -> None:
    assert json.loads(said_apart(LEAVING_OUT + IN_STILL_WATER, "current", "")) == [None, [], True]


PROGRAM = """
from typer.testing import CliRunner
from missions.files import shipped
from remoras.cli.app import app
def said(*words, code=0):
    found = CliRunner().invoke(app, list(words))
    assert found.exit_code == code, found.output + repr(found.exception)
said("list", "scenarios")
said("list")
said("explain", "channel.per")
said("validate", "mapping-rendezvous")
said("run", "mapping-rendezvous", "--set", "scenario.duration_s=60", "--out", folder, code=1)  # not complete by then
said("plot", folder, "trajectories")
refused = {}
for name in shipped():
    try:
        load(name)
    except ConfigurationError as error:
        refused[name] = [fault.key for fault in error.faults]
print(json.dumps(refused))
"""


@cache
def in_use() -> dict[str, list[Any]]:
    """Features that each shipped scenario uses."""
    return {name: list(used_in(load(name))) for name in shipped()}


@pytest.mark.slow
@pytest.mark.parametrize("feature", sorted(USES))
def test_a_feature_can_be_taken_away(feature: str, whole: str, tmp_path: Path) -> None:
    """A run that does not use it gives the same bytes; a scenario that does is refused in a line that names it.

    The program lists, explains, validates, runs and plots; of shipped scenarios those alone are refused that use it.
    """
    program, folder = PROGRAM, str(tmp_path / "results")
    digest, refused, names, faults_of = said_without(feature, *USES[feature], program=program, folder=folder)
    assert feature not in names
    assert digest == whole
    assert "unknown key" in refused
    assert feature in refused
    assert len(refused.splitlines()) <= 2
    keys = {key for of_table in features()[feature].keys.values() for key in of_table}
    assert set(faults_of) == {name for name, used in in_use().items() if features()[feature] in used}
    assert all(keys & set(key.split(".")) for faults in faults_of.values() for key in faults)


def test_the_upper_bound_can_be_taken_away(whole: str) -> None:
    """The strategy, and the part by which all is known at once: whoever names it is told of the others."""
    digest, refused, _ = said_without("oracle", "strategy.name='oracle'")
    assert digest == whole
    assert 'strategy.name) = "oracle"' in refused
    assert "remoras-planned" in refused
    assert len(refused.splitlines()) == 1


def test_every_feature_is_tried() -> None:
    assert set(USES) == set(features())


PRINTED = """
import json, pkgutil, sys
from pathlib import Path
folder, at_s = sys.argv[1], sys.argv[2]
sound = pkgutil.iter_modules
def beside(path):
    if path[0].endswith("features"):
        path.append(folder)  # as if the file lay beside the others
    return sound(path)
pkgutil.iter_modules = beside
from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.scenarios import load
lost = "fault=[{vehicle='AUV02', kind='lost', at_s=20.0}]"
given = [f"headcount=[{{at_s=10.0}}, {{at_s={at_s}}}]", lost, "scenario.duration_s=60.0"]
try:
    made = run(load("mapping-rendezvous", [("--set", one) for one in given]), 1)
    print(json.dumps(list(made.recorder.rows("headcount"))))
except ConfigurationError as error:
    print(json.dumps(str(error)))
"""


def printed_feature(folder: Path, at_s: float) -> object:
    """What comes of the feature of the how-to, with a second count at a time (s)."""
    page = (ROOT / "docs" / "howto" / "feature.md").read_text(encoding="utf-8")
    (folder / "headcount.py").write_text(page.split("```python\n")[1].split("```")[0], encoding="utf-8")
    return json.loads(said_apart(PRINTED, str(folder), str(at_s)))


@pytest.mark.slow
def test_the_feature_of_the_how_to_works_as_printed(tmp_path: Path) -> None:
    """One vehicle of four is lost at 20 s; the mission is over at 60 s."""
    assert printed_feature(tmp_path, 30.0) == [[10.0, 4], [30.0, 3]]
    assert "headcount.2.at_s" in str(printed_feature(tmp_path, 90.0))
