"""What the documents tell a user to type works, and their links lead somewhere."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from missions.scenarios import shipped
from missions.sweeps.study import load_study
from remoras.cli import app

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(document: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", document.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def test_the_tutorial_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tutorial = ROOT / "docs" / "tutorial.md"
    for line in "".join(blocks(tutorial, "sh")).splitlines():
        command, _, target = line.partition(" > ")
        result = CliRunner().invoke(app, shlex.split(command)[1:])
        assert result.exit_code == 0, f"{line}: {result.output}"
        if target:
            Path(target).write_text(result.stdout, encoding="utf-8")
    for block in blocks(tutorial, "python"):
        exec(compile(block, str(tutorial), "exec"), {"__name__": "tutorial"})


def test_the_how_tos_work_as_scripts(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for number, block in enumerate(blocks(ROOT / "docs" / "howto.md", "python")):
        file = re.match(r"# (\w+\.py)\n", block)
        script = tmp_path / (file[1] if file else f"block{number}.py")
        script.write_text(block, encoding="utf-8")
        command = [sys.executable, script.name]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{block}\n{done.stderr}"


def test_the_strategy_of_the_how_tos_conforms(tmp_path: Path) -> None:
    (block,) = [text for text in blocks(ROOT / "docs" / "howto.md", "python") if text.startswith("# nearest.py")]
    (tmp_path / "nearest.py").write_text(block, encoding="utf-8")
    command = [sys.executable, str(ROOT / "tests" / "conformance" / "strategy_conformance.py"), "nearest:NEAREST"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("ok  check_") == 10


def test_the_tables_of_the_how_tos_load(tmp_path: Path) -> None:
    shipped_text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    found = blocks(ROOT / "docs" / "howto.md", "toml")
    assert sum(block.startswith("[channel]") for block in found) == 2
    for number, block in enumerate(found):
        file = tmp_path / f"{number}.toml"
        if "[study]" in block:
            file.write_text(block, encoding="utf-8")
            assert load_study(str(file)).configurations
        else:
            table = re.escape(block.splitlines()[0])
            text, replaced = re.subn(
                rf"^{table}\n.*?(?=^\[)", lambda _, block=block: block + "\n", shipped_text, flags=re.M | re.S
            )
            assert replaced == 1
            file.write_text(text, encoding="utf-8")
            assert CliRunner().invoke(app, ["validate", str(file)]).exit_code == 0


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_relative_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", document.read_text(encoding="utf-8")):
        assert (document.parent / target).exists(), f"{document.name}: {target}"
