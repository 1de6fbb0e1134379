"""``remoras stress`` as one calls it: its report, its files, a repeated schedule, and what it refuses."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from remoras.cli import app

SHORT = ("--set", "scenario.duration_s=120")
"""The mission does not complete by then, so nobody is asked to."""


def called(*arguments: str, code: int = 0) -> str:
    done = CliRunner().invoke(app, ["stress", *arguments])
    assert done.exit_code == code, done.output
    return done.stdout if code != 2 else done.output


@pytest.fixture
def report(tmp_path: Path) -> tuple[dict[str, object], Path]:
    arguments = "mapping-rendezvous", "--seeds", "1:4", "--jobs", "1", *SHORT, "--json", "--out", str(tmp_path / "out")
    return json.loads(called(*arguments)), tmp_path / "out"


def test_the_report_has_table_kinds_and_recoveries(report: tuple[dict[str, object], Path]) -> None:
    found, folder = report
    assert found["seeds"] == [1, 2, 3, 4]
    assert (found["n_runs"], found["n_broken"], found["broken"]) == (4, 0, [])
    assert found["happened"]
    held = {(row["invariant"], row["kind"]) for row in found["table"]}  # type: ignore[attr-defined]
    none = {(row["invariant"], row["kind"]) for row in found["not_exercised"]}  # type: ignore[attr-defined]
    assert held
    assert none
    assert held.isdisjoint(none)
    assert json.loads((folder / "report.json").read_text(encoding="utf-8")) == found
    assert "4 schedules, 0 with a breach" in (folder / "report.txt").read_text(encoding="utf-8")


BREAKS = """
from stress.invariants.seam import Moment

class Never:
    name = "never"
    moment = Moment.TICK
    not_under = frozenset()

    def broken(self, scene):
        return "it is late" if scene.now_s > 60.0 else None

class Raises(Never):
    def broken(self, scene):
        return 1 / 0

class Half:
    name = "half"
"""


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The current folder, with a file of invariants."""
    folder = tmp_path_factory.mktemp("laws")
    (folder / "own_laws.py").write_text(BREAKS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.syspath_prepend(str(folder))
        yield folder


def test_a_breach_is_shrunk_written_and_repeated_byte_for_byte(here: Path) -> None:
    own = ("--invariant", "own_laws.py:Never")
    text = called("mapping-rendezvous", "--seeds", "3", "--jobs", "1", *SHORT, *own, "--out", "out", code=1)
    assert "never broken by seed 0" in text
    assert "shrunk to no fault" in text
    small = json.loads((here / "out" / "report.json").read_text(encoding="utf-8"))["shrunk"][0]
    assert small["n_runs"] <= 60
    schedule = str(here / "out" / "shrunk-never.toml")
    again = [json.loads(called("--replay", schedule, "--json", *own, code=1)) for _ in range(2)]
    assert again[0] == again[1]
    assert again[0]["digest"] == small["digest"]
    assert again[0]["broken"]["invariant"] == "never"
    assert again[0]["broken"]["last_events"]
    assert "held: exceptions" in called("--replay", schedule)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("mapping-rendezvouz",), "did you mean 'mapping-rendezvous'?"),
        (("mapping-rendezvous", "--faults", "partitions"), "did you mean 'partition'?"),
        (("mapping-rendezvous", "--faults", "biased", *SHORT), "nothing in mapping-rendezvous that this may befall"),
        (("mapping-rendezvous", "--seeds", "9:1"), "--seeds '9:1'"),
        (("mapping-rendezvous", "--time", "soon"), "--time 'soon'"),
        (("mapping-rendezvous", "--time", "0.01s", *SHORT), "--time = 0.01 s: one seed takes up to"),
        (("mapping-rendezvous", "--invariant", "own_laws.py:Gone", *SHORT), '--invariant = "own_laws.py:Gone"'),
        (("mapping-rendezvous", "--invariant", "own_laws.py:Half", *SHORT), "lacks moment, not_under, broken"),
        (("mapping-rendezvous", "--invariant", "gone.py:Law", *SHORT), "no such file"),
        (("mapping-rendezvous", "--invariant", "beliefz", *SHORT), '--invariant = "beliefz"'),
        (
            ("mapping-rendezvous", "--seeds", "1", "--jobs", "1", "--invariant", "own_laws.py:Raises", *SHORT),
            "--invariant = never: its broken raised ZeroDivisionError: division by zero in own_laws.py:",
        ),
        (("--replay", "gone.toml"), "gone.toml"),
        ((), "SCENARIO: missing"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(arguments: tuple[str, ...], says: str, here: Path) -> None:
    message = called(*arguments, code=2)
    assert says in message
    assert len(message.strip().splitlines()) == 1
