"""Tables of bans and of biases that cannot be: one message each, with what is allowed."""

from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.scenarios import load

BIAS = 'kind="biased", vehicle="AUV02", at_s=0.0'


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ('ban=[{issuer="AUV0", vehicle="AUV02", at_s=6.0}]', r"ban\.1\.issuer.*allowed: ASV00.*did you mean 'AUV0"),
        ('ban=[{issuer="AUV00", vehicle="nobody", at_s=6.0}]', r"ban\.1\.vehicle.*allowed: ASV00"),
        ('ban=[{issuer="AUV00", vehicle="AUV00", at_s=6.0}]', r"ban\.1\.issuer.*of itself does not count"),
        ('ban=[{issuer="AUV00", vehicle="AUV02", at_s=2e4}]', r"ban\.1\.at_s.*below scenario\.duration_s = 14400"),
        ('ban=[{issuer="AUV00", vehicle="AUV02", at_s=9.0, until_s=8.0}]', r"ban\.1\.until_s.*above at_s = 9"),
        ('ban=[{issuer="AUV00", vehicle="AUV02", at_s=9.0, from_s=0.5}]', r"ban\.1\.from_s"),
        (f"fault=[{{{BIAS}}}]", r"fault\.1\.attribute.*required by kind biased"),
        (f'fault=[{{{BIAS}, attribute="location"}}]', r"fault\.1\.offset.*required by kind biased"),
        (
            f'fault=[{{{BIAS}, attribute="locaton", offset=[1.0, 0.0]}}]',
            r"fault\.1\.attribute.*did you mean 'location'",
        ),
        (f'fault=[{{{BIAS}, attribute="location", offset=1.0}}]', r"fault\.1\.offset.*a point: \[east, north\]"),
        ('fault=[{kind="lost", vehicle="AUV02", at_s=1.0, offset=1.0}]', r"fault\.1\.offset.*only by biased"),
        ('object=[{name="x", position_m=[1.0, 2.0], classification="whale"}]', r"classification"),
    ],
)
def test_what_cannot_be_is_one_message(setting: str, says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        load("mapping-objects", [("--set", setting)])


def test_scenarios_without_them_do_not_list_them() -> None:
    """So runs and sweeps of before keep their ids."""
    text = load("mapping-rendezvous", [("--set", 'fault=[{kind="lost", vehicle="AUV02", at_s=1.0}]')]).model_dump_json()
    for word in ('"ban"', '"object"', '"offset"', '"attribute"'):
        assert word not in text


@pytest.mark.parametrize("offset", ['"far"', "[1.0, 2.0, 3.0]", "[nan, 0.0]", "[]", "true"])
def test_what_is_no_offset_is_refused_in_one_line(offset: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        load("mapping-objects", [("--set", f'fault=[{{{BIAS}, attribute="location", offset={offset}}}]')])
    (line,) = str(refused.value).splitlines()
    assert "fault.1.offset" in line
    assert line.endswith("allowed: a number, or [east, north] for a point")


def test_a_bias_may_be_of_an_attribute_that_the_scenario_adds(tmp_path: Path) -> None:
    path = tmp_path / "own.ttl"
    path.write_text(
        "@prefix rm: <https://w3id.org/remoras/marine#> . @prefix owl: <http://www.w3.org/2002/07/owl#> .\n"
        "@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
        "rm:leakRate a owl:DatatypeProperty ; rdfs:domain rm:ObjectOfInterest ; rdfs:range xsd:double ;\n"
        "    rm:minimum 0 ; rm:maximum 500 ; rm:resolution 1 .\n"
    )
    own = ("--set", f'worldmodel.ontology=["{path.as_posix()}"]')
    scenario = load("mapping-objects", [own, ("--set", f'fault=[{{{BIAS}, attribute="leakRate", offset=3.0}}]')])
    assert scenario.fault[0].attribute == "leakRate"
