"""Study files at the command line: the commented example, explanations of keys, validation."""

import json
import re
from pathlib import Path

import pytest
from invoked import remoras

from missions.sweeps.study import example_study, load_study, study_explanations


@pytest.fixture
def example(tmp_path: Path) -> Path:
    file = tmp_path / "study.toml"
    file.write_text(remoras("new", "study", "--example").stdout, encoding="utf-8")
    return file


def test_the_example_study_is_commented_and_loads(example: Path) -> None:
    assert example.read_text(encoding="utf-8").strip() == example_study().strip()
    assert "#" in example_study()
    sizes = {len(configuration.scenario.vehicle) for configuration in load_study(str(example)).configurations}
    assert sizes == {4, 8}


def test_every_key_of_a_study_is_in_the_example() -> None:
    written = example_study()
    assert [key for key in study_explanations() if key.split(".")[-1] not in written] == []


@pytest.mark.slow
def test_commented_keys_of_the_example_load(tmp_path: Path) -> None:
    text = example_study()
    points_from, latin_from, factorial_from, stopping_from = (
        text.index(start) for start in ("# [[point]]", "# [latin]", "# [factorial]", "# [stopping]")
    )
    point, latin, factorial, stopping = (
        re.sub(r"^# ?", "", part, flags=re.MULTILINE)
        for part in (
            text[points_from : text.index('# With sampling = "latin"')],
            text[latin_from : text.index('# With sampling = "factorial"')],
            text[factorial_from : text.index("# Optional")],
            text[stopping_from:],
        )
    )
    head = text[: text.index("# Keys of the scenario and their values")]
    for sampling, tables in (("grid", stopping), ("latin", latin), ("factorial", factorial), ("list", point)):
        file = tmp_path / f"{sampling}.toml"
        file.write_text(head.replace('sampling = "grid"', f'sampling = "{sampling}"') + tables, encoding="utf-8")
        assert load_study(str(file)).file.study.sampling == sampling


def test_validate_tells_studies_from_scenarios_and_counts_runs(example: Path) -> None:
    found = json.loads(remoras("validate", example, "--json").stdout)
    assert (found["kind"], found["configurations"], found["planned"]) == ("study", 32, 320)
    shown = remoras("validate", example).stdout
    assert "study ok; 32 configurations x 10 repeats, at most 320 runs; equal runs are made once" in shown
    assert json.loads(remoras("validate", "mapping-rendezvous", "--json").stdout)["kind"] == "scenario"
    assert "scenario ok; 4 vehicles" in remoras("validate", "mapping-rendezvous").stdout


def test_a_stopping_rule_shows_the_maximum_number_of_runs(example: Path) -> None:
    rule = '[stopping]\nmetric = "n_bytes"\nhalf_width = 1.0\nmaximum = 60\n'
    example.write_text(example_study() + rule, encoding="utf-8")
    assert "at most 1920 runs" in remoras("validate", example).stdout


@pytest.mark.parametrize(
    ("repeats", "said"), [(5, "5 repeats: no interval (8 needed), smallest p 0.062; 8 give 0.0078"), (8, "")]
)
def test_too_few_repeats_are_reported_before_any_run(tmp_path: Path, repeats: int, said: str) -> None:
    file = tmp_path / "few.toml"
    file.write_text(
        f'[study]\nname = "few"\nscenario = "mapping-rendezvous"\nrepeats = {repeats}\n'
        '[set]\nscenario.duration_s = 20.0\n[[channel]]\nname = "bernoulli"\nper = [0.1]\n',
        encoding="utf-8",
    )
    assert json.loads(remoras("validate", file, "--json").stdout)["warnings"] == [said] * bool(said)
    assert said in remoras("validate", file).stdout
    dry = remoras("sweep", file, "--out", tmp_path / "out", "--dry-run")
    assert ("no interval" in dry.stderr) is bool(said)
    assert said in dry.stderr
