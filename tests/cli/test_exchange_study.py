"""The folder of an exchange study is created and replaced atomically."""

from pathlib import Path

import pytest
from invoked import refused, remoras

from visualisation import policies

STUDY = ("exchange-study", "--nodes", "3", "--per", "0.3", "--policies", "ack", "--trials", "20")
FIGURES = {f"{name}.{end}" for name in ("delivered", "source", "senders") for end in ("svg", "txt", "csv")}


@pytest.fixture
def older(tmp_path: Path) -> Path:
    """Folder of a study as vector graphics, with notes of the user's."""
    folder = tmp_path / "out"
    made = remoras(*STUDY, "--format", "svg", "--out", folder)
    assert made.exit_code == 0
    assert {Path(line).name for line in made.stdout.splitlines()} == content_of(folder).keys() == FIGURES
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    return folder


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
def test_force_removes_the_older_study_and_keeps_files_of_the_user(older: Path) -> None:
    assert "--force" in refused(*STUDY, "--seed", 2, "--out", older)
    before = content_of(older)
    remoras(*STUDY, "--seed", 2, "--load", "poisson:0.01", "--capacity-bits", 256, "--out", older, "--force")
    assert content_of(older).keys() == {"loaded.csv", "notes.txt"}
    over_loss = ("--per", "0.1,0.3", "--load", "poisson:0.01", "--capacity-bits", 256, "--format", "svg", "--bound")
    remoras(*STUDY, *over_loss, "--out", older, "--force")
    assert content_of(older).keys() == FIGURES | {"notes.txt"}
    remoras(*STUDY, "--seed", 1, "--format", "svg", "--out", older, "--force")
    assert content_of(older) == before
    assert list(older.parent.iterdir()) == [older]


def test_an_interrupted_drawing_keeps_the_older_study(older: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, caption, shown = content_of(older), policies.caption, list[str]()

    def interrupted(rows: list[policies.StudyRow], kind: str) -> str:
        shown.append(kind)
        if len(shown) == 3:
            raise KeyboardInterrupt
        return caption(rows, kind)

    monkeypatch.setattr(policies, "caption", interrupted)
    ended = remoras(*STUDY, "--seed", 2, "--format", "svg", "--out", older, "--force")
    assert ended.exit_code == 130
    assert content_of(older) == before


def test_policy_of_a_file_is_studied_beside_shipped_ones() -> None:
    file = Path(__file__).parents[2] / "docs/examples/alternate_acks.py"
    made = remoras(
        "exchange-study", "--nodes", "3", "--per", "0.3", "--trials", "5", "--policies", f"ack,{file}:SPARSE"
    )
    assert made.exit_code == 0
    assert [line.split()[1] for line in made.stdout.splitlines()[1:]] == ["ack", "sparse-repeat"]
