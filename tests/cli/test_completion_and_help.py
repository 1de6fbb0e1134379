"""Shell completion and help texts: commands in order of use, each with a valid example."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from invoked import remoras
from typer.testing import CliRunner

from exchange.channel.shipped import CHANNELS
from missions.files import shipped, shipped_studies
from remoras.cli import app
from remoras.cli.app import GROUPS, HOMES, OrderedGroup
from remoras.strategies import strategies


def offered(words: str) -> list[str]:
    """What the shell is told to offer for the last of the words; an empty one is written as ''."""
    given = shlex.split(words)
    asked = {"COMP_WORDS": f"remoras {' '.join(given)}", "COMP_CWORD": str(len(given))}
    environment = {"_REMORAS_COMPLETE": "complete_bash", **asked}
    done = CliRunner().invoke(app, [], prog_name="remoras", env=environment)
    assert (done.exit_code, done.stderr) == (0, "")
    return done.stdout.split()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, results: Path, swept: Path) -> Path:
    """A run, a sweep, a file and a strategy of the user's."""
    made = tmp_path_factory.mktemp("work")
    (made / "deep").mkdir()
    for name in ("mine.toml", "mine.py", "deep/other.toml"):
        (made / name).touch()
    (made / "lossy").symlink_to(results)
    (made / "swept").symlink_to(swept)
    return made


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("ru", ["run"]),
        ("run mapping-", [name for name in shipped() if name.startswith("mapping-")]),
        ("run mine.", ["mine.toml"]),
        ("run mapping-rendezvous --strategy ''", [*strategies()]),
        ("run mapping-rendezvous --policy mps", ["mps-ack", "mps-ack-repeat"]),
        ("run mapping-rendezvous --channel ''", [*CHANNELS]),
        ("run mapping-rendezvous --set communication.p", ["communication.parking=", "communication.policy="]),
        ("validate strategies-", [name for name in shipped_studies() if name.startswith("strategies-")]),
        ("sweep giv", ["giving-up"]),
        ("sweep giving-up --strategy mi", ["mine.py"]),
        ("explain study.rep", ["study.repeats"]),
        ("new ''", ["scenario", "strategy", "mission", "sensor", "metric", "study", "organisation"]),
        ("list pol", ["policies"]),
        ("plot lossy ro", ["roles"]),
        ("plot swept ra", ["ranking"]),
        ("compare swept --baseline m-", ["m-ack", "m-ack-repeat"]),
        ("run dee", ["deep/"]),
        ("run deep/", ["deep/other.toml"]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_names_are_completed(words: str, expected: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert sorted(offered(words)) == sorted(expected)


# Help ---------------------------------------------------------------------------------------------


def commands() -> list[str]:
    listed = remoras("--help").stdout.partition("\nRun:\n")[2].partition("\nExamples:")[0]
    return re.findall(r"^  ([a-z-]+) ", listed, re.MULTILINE)


def test_help_groups_commands_by_purpose() -> None:
    shown = remoras("--help").stdout
    assert commands() == [*HOMES]
    headings = [shown.index(f"\n{heading}:\n") for heading in GROUPS]
    assert headings == sorted(headings)
    assert "..." not in shown.partition("Run:")[2]


def test_help_of_every_command_has_a_valid_example_and_no_python_types() -> None:
    everything = remoras("--help").stdout
    for name in commands():
        text = remoras(name, "--help").stdout
        assert not re.search(r"<[a-z]|\{|\blist\[|\bstr\b|\bint\b", text.partition("Example:")[0]), text
        (example,) = re.findall(r"^Example:\n  (remoras .*)$", text, re.MULTILINE)
        assert f"  {example}\n" in everything
        assert shlex.split(example)[1] == name
        given = shlex.split(example.partition(" > ")[0])[1:]
        for option in [word for word in given if word.startswith("--")]:
            assert f"  {option} " in text


def test_every_parameter_has_a_text_of_its_docstring_or_annotation() -> None:
    """A text below the wrong heading, or of a name that is no parameter, would leave a parameter without one."""
    group = OrderedGroup()
    for name in HOMES:
        made = group.get_command(None, name)
        assert made is not None
        lacking = [parameter.name for parameter in made.params if not getattr(parameter, "help", "")]
        assert not lacking, (name, lacking)
        assert "Options:\n" not in str(made.help)


def test_help_of_a_strategy_says_what_the_command_does_with_it() -> None:
    helps = [
        re.search(
            r"--strategy NAME +(.*?): a shipped name, mine.py:MINE", " ".join(remoras(name, "--help").stdout.split())
        )
        for name in ("sweep", "race", "benchmark")
    ]
    assert [one and one[1] for one in helps] == [
        "Strategy to add to those of the study",
        "Strategy to race with the shipped ones",
        "Strategy to rank among the shipped ones",
    ]


def test_optimised_python_has_the_same_commands_and_checks_nothing() -> None:
    """``python -OO`` drops docstrings, the source of options; ``-O`` assertions, without which all plug-ins conform."""

    def told(*words: str) -> tuple[int, str, str]:
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    for words in (["plot", "--help"], ["list", "strategies"]):
        assert told("-OO", "-m", "remoras", *words) == told("-m", "remoras", *words)
    code, _, error = told("-O", "-m", "remoras", "check", "channel", "perfect")
    assert (code, "run without -O" in error, error.count("\n")) == (2, True, 1)
