"""Commands of the documents run as printed, and links have a target."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import remoras
from remoras.cli import app

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(document: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", document.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


README, TUTORIAL = ROOT / "README.md", ROOT / "docs" / "tutorial.md"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}


def is_in(line: str, text: str) -> bool:
    """True if a printed line is a line of a text; ``...`` stands for anything, spaces at the ends for nothing."""
    pattern = ".*".join(map(re.escape, line.strip().split("...")))
    return re.search(rf"^\s*{pattern}\s*$", text, re.MULTILINE) is not None


def answered(line: str) -> str:
    """Output of a ``remoras`` command in the current folder; a run may end without completion."""
    done = CliRunner().invoke(app, shlex.split(line)[1:], env={"COLUMNS": "200"})
    cut_short = done.exit_code == 1 and "completed            no" in done.stdout  # as `remoras run` says
    assert done.exit_code == 0 or cut_short, f"{line}\n{done.output}"
    return done.stdout


def called(arguments: list[str], folder: Path) -> str:
    """Output of a Python program called in a folder."""
    command = [sys.executable, *arguments]
    done = subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.slow
def test_the_first_commands_lead_to_a_study_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who takes commands, files and nothing else out of the tutorial; what these print is what comes out.

    Continuous integration runs the command of the README.
    """
    monkeypatch.chdir(tmp_path)
    (study,) = [text for text in blocks(TUTORIAL, "toml") if text.startswith("# study.toml\n")]
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    commands = "".join(blocks(TUTORIAL, "sh")).splitlines()
    said = "".join(answered(line) for line in commands if line.split()[0] == "remoras")
    printed = blocks(TUTORIAL, "text")
    assert len(printed) == 2
    assert [line for text in printed for line in text.splitlines() if not is_in(line, said)] == []
    made = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    excerpts = [text for text in blocks(TUTORIAL, "toml") if not text.startswith("# ")]
    assert len(excerpts) == 2
    assert [text for text in excerpts if text not in made] == []
    assert "217" in str(pq.read_table(tmp_path / "first" / "faults.parquet").to_pylist()[0]["time_s"])
    figure = (tmp_path / "study" / "goal-reached.pdf").read_bytes()
    (width_pt,) = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ", figure)
    assert float(width_pt) == pytest.approx(3.5 * 72.0, abs=0.5)
    (tried,) = re.findall(r"`(remoras run mine.toml .*fault=.*?)` completes", TUTORIAL.read_text(encoding="utf-8"))
    assert is_in("completed            yes", answered(tried))  # without the cause the difference is gone


@pytest.mark.slow
def test_the_python_lines_of_the_readme_run(tmp_path: Path) -> None:
    (text,) = blocks(README, "python")
    assert len([line for line in text.splitlines() if line]) <= 10
    (tmp_path / "ten.py").write_text(text, encoding="utf-8")
    assert "mission_complete" in called(["ten.py"], tmp_path)
    assert {path.name for path in tmp_path.iterdir()} >= {"tracks.pdf", "watch.html", "lossy"}


def test_the_readme_cites_this_version() -> None:
    assert f"version = {{{remoras.__version__}}}" in README.read_text(encoding="utf-8")


@pytest.mark.slow
def test_troubleshooting_shows_the_actual_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every line below a command is a line that the command prints."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    page = ROOT / "docs" / "troubleshooting.md"
    called = re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", "".join(blocks(page, "console")), re.MULTILINE)
    assert len(called) >= 6
    for command, lines in called:
        program, *arguments = shlex.split(command)
        assert program == "remoras"
        result = CliRunner().invoke(app, arguments)
        assert lines, command
        assert [line for line in lines.splitlines() if not is_in(line, result.output)] == [], result.output
        is_message = lines.startswith("remoras: ")
        assert (result.exit_code == 2) == is_message, command
        assert not is_message or len(result.stderr.splitlines()) == len(lines.splitlines()), result.stderr
    sys.modules.pop("nearest", None)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_relative_links_have_a_target(document: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", document.read_text(encoding="utf-8")):
        assert (document.parent / target).exists(), f"{document.name}: {target}"
