"""Fault kinds of users: effects and refusals; numbers of the shipped kinds."""

import sys
from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.fault import kinds
from missions.runs.assembly import faults_in
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.scenario import Scenario

ROOT = Path(__file__).parents[2]


def test_shipped_kinds_have_distinct_numbers() -> None:
    """Draws are keyed by them: two kinds of one number would shift each other."""
    assert [kind.number_of(name) for name, kind in kinds().items()] == list(range(9))


# A kind from outside ------------------------------------------------------------------------------

MINE = """
from pydantic import Field
from remoras import Condition, DeclaredFault

class Fouled(DeclaredFault):
    TEXT = "weed is in its propeller"
    weed_w: float = Field(gt=0.0, description="power that the weed takes, W")
    leaves = lambda self, data: Condition(speed_factor=0.5, drain_w=self.weed_w)
    detail = lambda self, data, how_long: f"{self.weed_w:g} W, {how_long}"

class Mute(DeclaredFault):
    TEXT = "says nothing"
    leaves = lambda self, data: Condition(is_mute=True)

class Numbered(Mute):
    NUMBER = 0

class Wrong(Mute):
    leaves = lambda self, data: 0.5

class Odd(Mute):
    leaves = lambda self: Condition()

class Strict(Mute):
    def checks(self, key, scenario, mission, before): raise RuntimeError("not today")

class Silent(DeclaredFault):
    TEXT = "does nothing"

class Nameless(DeclaredFault):
    leaves = lambda self, data: Condition(is_mute=True)

class Leaves:
    pass
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file with kinds from outside, in the folder of its scenario."""
    (tmp_path / "own_kinds.py").write_text(MINE, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "own_kinds", raising=False)
    return tmp_path


def scenario(*faults: str, duration_s: float = 300.0) -> Scenario:
    tables = ",".join(f"{{vehicle='AUV01', {one}}}" for one in faults)
    settings = (f"fault=[{tables}]", f"scenario.duration_s={duration_s}")
    return load("mapping-rendezvous", [("--set", one) for one in settings])


def track(done: Run) -> dict[float, tuple[float, float]]:
    """Speed and energy of AUV01 by time."""
    return {row[0]: (row[5], row[6]) for row in done.recorder.trajectories if row[1] == "AUV01"}


@pytest.mark.usefixtures("mine")
def test_user_fault_kind_begins_and_ends() -> None:
    weed = "kind='own_kinds:Fouled', at_s=100, until_s=200, weed_w="
    sound, light, fouled = (run(scenario(*given), 1) for given in ((), (f"{weed}1",), (f"{weed}70",)))
    rows = [row for row in fouled.recorder.faults if row[1] == "AUV01"]
    assert rows == [
        (100.0, "AUV01", "own_kinds:Fouled", "70 W, until 200 s"),
        (200.0, "AUV01", "own_kinds:Fouled", "over"),
    ]
    before, own = track(sound), track(fouled)
    assert all(before[time_s] == own[time_s] for time_s in own if time_s < 100.0)
    assert max(own[time_s][0] for time_s in own if 110.0 < time_s < 199.0) == pytest.approx(
        0.5 * max(before[time_s][0] for time_s in own if 110.0 < time_s < 199.0)
    )
    for from_s, until_s, more_w in ((110.0, 150.0, 69.0), (210.0, 250.0, 0.0)):
        used_j = [track(one)[until_s][1] - track(one)[from_s][1] for one in (light, fouled)]
        assert used_j[1] - used_j[0] == pytest.approx(more_w * (until_s - from_s), abs=1e-6)


@pytest.mark.usefixtures("mine")
def test_user_fault_kind_changes_no_draw_of_other_kinds() -> None:
    others = "kind='lost', vehicle='any', rate_per_h=20", "kind='drains', vehicle='any', drain_w=5, at_s=[0,200]"
    tables = [f"{{{one}}}" for one in others]
    weed = "{kind='own_kinds:Fouled', vehicle='any', at_s=[0, 200], weed_w=9}"
    made = [load("mapping-rendezvous", [("--set", f"fault=[{','.join(one)}]")]) for one in (tables, [weed, *tables])]
    (alone, beside) = ([one for one in faults_in(resolved(own), 4) if "own" not in one.kind] for own in made)
    assert alone == beside != []


def test_fault_kind_may_be_a_file_beside_the_scenario(mine: Path) -> None:
    text = (ROOT / "missions" / "mapping" / "rendezvous.toml").read_text(encoding="utf-8")
    table = '\n[[fault]]\nkind = "own_kinds.py:Fouled"\nvehicle = "AUV01"\nat_s = 9\nweed_w = 1\n'
    (mine / "weedy.toml").write_text(text + table, encoding="utf-8")
    (fault,) = load(str(mine / "weedy.toml")).fault
    assert (fault.kind, fault.model_dump(exclude_none=True)["weed_w"]) == ("own_kinds:Fouled", 1.0)


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize(
    ("table", "key", "says"),
    [
        ("kind='own_kinds:Silent', at_s=9", "kind", "does nothing; define leaves(data)"),
        ("kind='own_kinds:Nameless', at_s=9", "kind", "lacks TEXT, a line that describes the fault"),
        ("kind='own_kinds:Odd', at_s=9", "kind", "leaves(self) cannot be called as leaves(data)"),
        ("kind='own_kinds:Numbered', at_s=9", "kind", "has a NUMBER, which is reserved for shipped kinds"),
        ("kind='own_kinds:Wrong', at_s=9", "kind", "leaves returned 0.5; expected: a Condition"),
        ("kind='own_kinds:Strict', at_s=9", "kind", "whose tables are well-formed, but raised Runtime"),
        ("kind='own_kinds:Leaves', at_s=9", "kind", "a subclass of remoras.DeclaredFault is needed, not the class"),
        ("kind='no_such:Kind', at_s=9, depth_m=3", "kind", "No module named 'no_such'"),
        ("kind='own_kinds:Fouled', at_s=9", "weed_w", "missing"),
    ],
)  # fmt: skip
def test_invalid_user_fault_kind_is_refused_in_one_line(table: str, key: str, says: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        scenario(table)
    (said,) = str(caught.value).splitlines()
    assert f"(fault.1.{key})" in said
    assert says in said
