"""Modems of a user's own: a table of a scenario or a file, checked, and kept with the results."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from exchange.acoustics.modems import modems
from missions.document import Document
from missions.errors import ConfigurationError
from missions.files import shipped
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.loading import scenario_from
from missions.scenarios.modem import ModemTable, modem_named
from missions.sweeps.study import load_study
from remoras.cli import app

OWN = """
[modem.quay]
payload_bytes = 48
rate_bps = 300.0
head_s = 0.2
range_m = 1500.0
"""
SCENARIO = shipped()["mapping-rendezvous"].read_text(encoding="utf-8").replace('"nanomodem-v3"', '"quay"')
CURVE = 'modulation = "table"\nper_at_snr = '
SHORT = [("--set", "scenario.duration_s=60.0")]


def refused(text: str, path: str = "mine.toml") -> str:
    with pytest.raises(ConfigurationError) as error:
        scenario_from(Document.of_text(text, path))
    return str(error.value)


def test_a_table_of_the_scenario_is_the_modem_of_all_parts_that_ask() -> None:
    """48 B at 300 bit/s behind 0.2 s are 1.48 s; a slot has a guard of 1000 m at 1500 m/s on top."""
    setup = resolved(scenario_from(Document.of_text(SCENARIO + OWN + "receive_w = 0.5", "mine.toml")))
    assert setup.modem.packet_s(8 * 48) == pytest.approx(1.48)
    assert setup.schedule.slot_s == pytest.approx(1.48 + 1000.0 / 1500.0)
    data = setup.database["AUV00"]
    assert data.transmit_j_per_bit == pytest.approx(10.0 / 300.0)
    assert data.transmit_j_per_packet == pytest.approx(2.0)
    counted = SCENARIO.replace('modem = "quay"', 'modem = "quay"\ncount_listening = true') + OWN + "receive_w = 0.5"
    listening = resolved(scenario_from(Document.of_text(counted, "mine.toml")))
    assert listening.database["AUV00"].hotel_w - data.hotel_w == pytest.approx(0.5)


@pytest.mark.parametrize("name", sorted(modems()))
@pytest.mark.parametrize("key", ["payload_bytes", "rate_bps", "range_m"])
def test_a_shipped_profile_can_be_written_as_a_table(name: str, key: str) -> None:
    """The very keys of the shipped file, so that one of its profiles can be copied and changed."""
    path = Path(__file__).parents[3] / "exchange/acoustics/modems.toml"
    profile = tomllib.loads(path.read_text(encoding="utf-8"))[name]
    table = ModemTable.model_validate_json(json.dumps(profile), strict=True)
    assert modem_named(name, {name: table}) == modems()[name]
    del profile[key]
    with pytest.raises(ValueError, match=key):
        ModemTable.model_validate_json(json.dumps(profile), strict=True)


def test_a_file_gives_the_same_scenario_as_its_table(tmp_path: Path) -> None:
    (tmp_path / "quay.toml").write_text(OWN, encoding="utf-8")
    by_file = SCENARIO.replace('modem = "quay"', 'modem = "quay.toml"')
    beside = scenario_from(Document.of_text(by_file, str(tmp_path / "mine.toml")))
    assert beside == scenario_from(Document.of_text(SCENARIO + OWN, "mine.toml"))


def test_an_option_names_a_file_of_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "quay.toml").write_text(OWN, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    found = load("mapping-rendezvous", [("--set", "communication.modem=quay.toml")])
    assert found.modem == scenario_from(Document.of_text(SCENARIO + OWN, "mine.toml")).modem
    assert resolved(found).modem.name == "quay"


def test_a_run_is_repeated_from_its_folder_when_the_file_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("quay.toml").write_text(OWN, encoding="utf-8")
    first = run(load("mapping-rendezvous", [*SHORT, ("--set", "communication.modem=quay.toml")]), 3)
    write_results(first, tmp_path / "found")
    Path("quay.toml").unlink()
    results = Results.read(tmp_path / "found")
    again = run(results.scenario, 3)
    assert again.recorder.rows("packets") == first.recorder.rows("packets") != []
    assert results.manifest["modem"]["rate_bps"] == 300.0


def test_a_study_has_such_a_modem_on_an_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("quay.toml").write_text(OWN, encoding="utf-8")
    study = '[study]\nname = "s"\nscenario = "mapping-rendezvous"\nrepeats = 2\n[grid]\n'
    Path("study.toml").write_text(f'{study}communication.modem = ["nanomodem-v3", "quay.toml"]\n', encoding="utf-8")
    found = [configuration.scenario.communication.modem for configuration in load_study("study.toml").configurations]
    assert found == ["nanomodem-v3", "quay"]


def test_link_budget_tells_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    more = 'band_khz = [24.0, 32.0]\nmodulation = "psk"\nsource_level_db = 170.0\n'
    Path("quay.toml").write_text(OWN + more, encoding="utf-8")
    done = CliRunner().invoke(app, ["sea", "--modem", "quay.toml", "--ranges", "1000"])
    assert done.exit_code == 0, done.output
    assert done.output.splitlines()[1].startswith("quay")


def test_scenarios_without_one_do_not_list_any() -> None:
    """So runs and sweeps of before keep their ids."""
    assert "modem" not in load("mapping-rendezvous", []).model_dump()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("rate_bps = 300.0\n", "", r"mine\.toml:\d+: modem\.quay\.rate_bps: missing"),
        ("300.0", "0.0", r"modem\.quay\.rate_bps = 0\.0: input should be greater than 0"),
        ("300.0", "inf", r"modem\.quay\.rate_bps = inf"),
        ("rate_bps", "rate_bs", r"modem\.quay\.rate_bs = 300\.0: unknown key, allowed here: .*did you mean 'rate_bps'"),
        ("= 48", "= 15", r"mine\.toml:\d+: modem\.quay\.payload_bytes = 15: .* 16"),
        ("= 48", "= 16", r"communication\.policy = \"ack\": its acknowledgements .*take ack or another modem"),
        ("= 48", "= 48\nframe_bytes = 49", r"modem\.quay\.frame_bytes = 49: allowed: up to payload_bytes = 48"),
        ("= 48", "= 48\nband_khz = [9.0, 9.0]", r"modem\.quay\.band_khz = \[9\.0, 9\.0\]: the lower end must come"),
        ("= 48", '= 48\nequipment = "Sonar"', r"modem\.quay\.equipment = \"Sonar\": allowed: AcousticModem, FSKModem"),
        ("= 48", '= 48\nunverified = ["ratebps"]', r"modem\.quay\.unverified = \"ratebps\": allowed: .*'rate_bps'"),
        ("= 48", '= 48\nmodulation = "ofdm"', r"modem\.quay\.modulation = \"ofdm\""),
        ("= 48", '= 48\nmodulation = "table"', r"modem\.quay\.per_at_snr: 0 points; modulation = \"table\" needs 2"),
        ("= 48", "= 48\nper_at_snr = [[0.0, 0.5], [1.0, 0.1]]", r"per_at_snr = .*has an effect with modulation"),
        ("= 48", f"= 48\n{CURVE}[[0.0, 0.5], [1.0, 1.1]]", r"modem\.quay\.per_at_snr\.2\.2 = 1\.1: .* equal to 1"),
        ("= 48", f"= 48\n{CURVE}[[0.0, -0.1], [1.0, 0.1]]", r"modem\.quay\.per_at_snr\.1\.2 = -0\.1: .*equal to 0"),
        ("= 48", f"= 48\n{CURVE}[[1.0, 0.5], [0.0, 0.7]]", r"mine\.toml:\d+: .*0 dB comes behind 1 dB; sort its"),
        ("= 48", f"= 48\n{CURVE}[[1.0, 0.5], [1.0, 0.5]]", r"per_at_snr = .*1 dB comes behind 1 dB; sort its points"),
        ('"quay"', '"quai"', r"communication\.modem = \"quai\": allowed: quay, nanomodem-v3, .*did you mean 'quay'"),
        ('"quay"', '"no.toml"', r"communication\.modem = \"no\.toml\": there is no file no\.toml; allowed: a TOML"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_told_in_one_line(old: str, new: str, says: str) -> None:
    said = refused((SCENARIO + OWN).replace(old, new, 1))
    matching = [line for line in said.splitlines() if "missing" not in line or "missing" in says]
    assert len(matching) == 1
    assert re.search(says, matching[0]), said


def test_the_name_of_a_shipped_profile_is_taken() -> None:
    text = (SCENARIO + OWN).replace("quay", "atm-900")
    assert "modem.atm-900: is the name of a shipped profile; give it another" in refused(text)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (OWN.replace("rate_bps = 300.0\n", ""), "quay.toml:2: modem.quay.rate_bps: missing"),
        (OWN.replace("300.0", "-1.0"), "quay.toml:4: modem.quay.rate_bps = -1.0: input should be greater than 0"),
        (OWN + "[modem.other]\n", "must hold one table [modem.NAME] and nothing else"),
        ("payload_bytes = 48\n", "must hold one table [modem.NAME] and nothing else"),
        ("[modem.quay\n", "quay.toml:1: TOML"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_with_the_line_of_that_file(tmp_path: Path, content: str, says: str) -> None:
    (tmp_path / "quay.toml").write_text(content, encoding="utf-8")
    said = refused(SCENARIO.replace('"quay"', '"quay.toml"'), str(tmp_path / "mine.toml"))
    assert len(said.splitlines()) == 1
    assert says in said


def test_one_name_for_a_table_and_for_that_of_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "quay.toml").write_text(OWN, encoding="utf-8")
    said = refused(SCENARIO.replace('"quay"', '"quay.toml"') + OWN, str(tmp_path / "mine.toml"))
    assert "quay.toml has one of this name, too; rename one of them" in said


def test_on_the_acoustic_channel_the_profile_says_band_and_modulation() -> None:
    text = SCENARIO.replace('name = "bernoulli"', 'name = "acoustic"').replace("per = 0.0\n", "")
    assert 'name = "acoustic"' in text
    said = refused(text + OWN)
    assert "needs band_khz and modulation of the modem quay" in said
    assert "the profile quay has no source_level_db" in said


@given(
    st.integers(17, 600), st.floats(1.0, 1e5), st.floats(0.0, 10.0), st.integers(0, 4000),
)  # fmt: skip
def test_the_time_on_the_air_is_linear_in_size(payload: int, rate_bps: float, head_s: float, size_bits: int) -> None:
    table = ModemTable(payload_bytes=payload, rate_bps=rate_bps, head_s=head_s, range_m=1.0)
    found = modem_named("own", {"own": table}).packet_s(size_bits)
    assert found == pytest.approx(head_s + size_bits / rate_bps, rel=1e-12)
