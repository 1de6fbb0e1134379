"""Each feature is one file, whose removal removes the feature and nothing else."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from sampling import sampled

from missions.files import shipped
from missions.scenarios import load
from missions.scenarios.features import features, used_in

ROOT = Path(__file__).parents[2]
WITHOUT = """
import hashlib, json, pkgutil, sys
left_out, names, *use = sys.argv[1:]
sound = pkgutil.iter_modules
pkgutil.iter_modules = lambda path: [one for one in sound(path) if one.name != left_out]
if left_out:
    of_bound = ["remoras.strategies.oracle", "remoras.fleet.instant_sharing"]
    taken = of_bound if left_out == "oracle" else ["missions.features." + left_out]
    sys.modules.update(dict.fromkeys(taken))  # whoever imports it fails
from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.runs.results import summary
from missions.scenarios import load
from missions.scenarios.features import features

def refused(name, *settings):
    try:
        load(name, [("--set", one) for one in settings])
        return []
    except ConfigurationError as error:
        return str(error).splitlines()

given = [("--set", "scenario.duration_s=150.0"), ("--set", "channel.per=0.3")]
finished = run(load("mapping-rendezvous", given), 3)
rows = {name: list(finished.recorder.rows(name)) for name in finished.recorder.tables}
digest = hashlib.sha256(json.dumps([rows, summary(finished)], default=str, sort_keys=True).encode()).hexdigest()
no_longer = [name for name in names.split() if refused(name)]
print(json.dumps([digest, refused("mapping-rendezvous", *use), list(features()), no_longer]))
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


@cache
def using() -> list[str]:
    """Shipped scenarios that use some."""
    return [name for name in shipped() if any(feature in used_in(load(name)) for feature in features().values())]


def said_without(feature: str, *use: str) -> list[Any]:
    """Digest of a run, how settings are refused, which features there are, and shipped scenarios that are refused."""
    # a process of its own: tables take in the keys of features once, when they are imported
    command = [sys.executable, "-c", WITHOUT, feature, " ".join(using()), *use]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=240)
    assert made.returncode == 0, made.stderr
    found: list[Any] = json.loads(made.stdout)
    return found


@pytest.fixture(scope="module")
def whole() -> Any:
    """Digest of the run with all features there, of which it uses none."""
    digest, _, names, refused = said_without("")
    assert (set(names), refused) == (set(USES), [])
    return digest


@pytest.mark.parametrize("feature", sorted(USES))
def test_feature_in_use_is_detected(feature: str) -> None:
    loaded = load("mapping-rendezvous", [("--set", one) for one in USES[feature]])
    assert features()[feature] in used_in(loaded)


def test_features_that_are_off_leave_no_keys_in_the_manifest() -> None:
    """Features that are on by default have keys."""
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


@pytest.mark.slow
@pytest.mark.parametrize("feature", sampled(sorted(USES), "clocks", "navigation"))
def test_a_feature_can_be_taken_away(feature: str, whole: str) -> None:
    """A run that does not use it gives the same bytes; a scenario that does is refused in a line that names it."""
    digest, refused, names, no_longer = said_without(feature, *USES[feature])
    assert feature not in names
    assert digest == whole
    assert 1 <= len(refused) <= 2
    assert "unknown key" in refused[0]
    assert feature in refused[0]
    assert no_longer == [name for name in using() if features()[feature] in used_in(load(name))]


@pytest.mark.slow
def test_the_upper_bound_can_be_taken_away(whole: str) -> None:
    """The strategy and its component with global knowledge; its name is then refused with the known ones."""
    digest, (refused,), *_ = said_without("oracle", "strategy.name='oracle'")
    assert digest == whole
    assert 'strategy.name) = "oracle"' in refused
    assert "remoras-planned" in refused
