"""Bad ontology files: `remoras validate` and `remoras run` say each fault in one line, with what is allowed."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from missions.files import shipped
from remoras.cli import app

PREFIXES = """
@prefix ex: <https://example.org/own#> .
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
"""
BAD = {
    "not RDF": ("ex:A a owl:Class ;;; nonsense", "is not Turtle: ", "what Turtle 1.1 allows"),
    "cyclic": (
        "ex:A a owl:Class ; rdfs:subClassOf ex:A .",
        "ex:A: it is, or descends from, a superclass of itself",
        "a hierarchy",
    ),
    "without range": (
        "ex:p a owl:DatatypeProperty ; rdfs:domain rm:Vehicle .",
        "ex:p: 0 rdfs:range",
        "xsd:double, xsd:decimal, xsd:integer, xsd:boolean, xsd:string, rm:Point, owl:oneOf (strings) "
        "or a declared class",
    ),
    "an import that is not read": (
        "<https://example.org/own> a owl:Ontology ; owl:imports <https://w3id.org/remoras/seabeds> .",
        "it imports <https://w3id.org/remoras/seabeds>, which is none of the files that are read",
        "did you mean 'https://w3id.org/remoras/seabed'?",
    ),
    "a unit without IRI": (
        "ex:p a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:double ; "
        'rm:minimum 0 ; rm:maximum 1 ; rm:resolution 0.1 ; rm:unit "m" .',
        'ex:p: rm:unit is "m"',
        "none, or one unit of QUDT such as <http://qudt.org/vocab/unit/M>",
    ),
}


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """The shipped scenario with an ontology file of its own, which is not there yet."""
    path = tmp_path / "mine.toml"
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    path.write_text(f'{text}\n[worldmodel]\nontology = ["own.ttl"]\n', encoding="utf-8")
    return path


def refused(*arguments: str) -> str:
    """The only line that a command says before it gives up."""
    done = CliRunner().invoke(app, arguments, env={"COLUMNS": "2000"})
    assert done.exit_code == 2, done.output
    lines = [line for line in done.stderr.splitlines() if line]
    assert len(lines) == 1, done.stderr
    return lines[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_one_line(scenario: Path, tmp_path: Path, name: str) -> None:
    text, wrong, allowed = BAD[name]
    (tmp_path / "own.ttl").write_text(PREFIXES + text, encoding="utf-8")
    line = refused("run", str(scenario), "--out", str(tmp_path / "out"))
    assert line.startswith(f"remoras: {scenario}:"), line
    assert 'worldmodel.ontology = "own.ttl": ' in line
    assert wrong in line
    assert allowed in line.partition("; allowed: ")[2]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["validate", "run"])
def test_a_missing_file_is_one_line(scenario: Path, command: str) -> None:
    line = refused(command, str(scenario))
    assert f'worldmodel.ontology = "own.ttl": there is no file {scenario.with_name("own.ttl")}; allowed: ' in line


def test_a_sound_file_is_taken(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "own.ttl").write_text(PREFIXES + "ex:Wellhead a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest .")
    done = CliRunner().invoke(app, ["validate", str(scenario)])
    assert done.exit_code == 0, done.output
