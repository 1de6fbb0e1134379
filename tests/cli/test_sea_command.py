"""``sea --describe`` of networks and scenarios, the option ``--network``, the marks of ``list modems``."""

import json
from pathlib import Path

import pytest
from invoked import remoras

from exchange.channel.modems import modems
from exchange.channel.network import network_of, shipped


def points(*arguments: object) -> list[dict[str, float]]:
    done = remoras("sea", "--describe", *arguments, "--json")
    assert done.exit_code == 0, done.output
    found: list[dict[str, float]] = json.loads(done.stdout)
    return found


def test_sea_prints_a_line_per_modem_and_range():
    done = remoras("sea", "--describe", "--modem", "nanomodem-v3,whoi-psk-1", "--ranges", "2000,1000")
    assert done.exit_code == 0, done.output
    head, *lines = done.stdout.splitlines()
    assert head.split()[:4] == ["modem", "range", "/", "m"]
    assert [line.split()[:2] for line in lines] == [
        [name, range_m] for name in ("nanomodem-v3", "whoi-psk-1") for range_m in ("1000", "2000")
    ]


def test_sea_uses_the_scenario_and_its_overrides():
    """By hand: 2 km lose 66.02 dB by spherical spreading, and 2 * 7.3915 by the absorption of Thorp at 28 kHz."""
    sea = ("--set", "channel.spreading=2", "--set", "channel.absorption=thorp")
    (one,) = points("mapping-patches", "--modem", "nanomodem-v3", "--ranges", "2000", *sea)
    assert one["transmission_loss_db"] == pytest.approx(80.8036, rel=1e-4)
    assert one["snr_db"] == pytest.approx(10.481, abs=1e-3)
    assert one["ebn0_db"] == pytest.approx(22.856, abs=1e-3)
    (loud,) = points("--modem", "nanomodem-v3", "--ranges", "2000", *sea, "--set", "channel.source_level_db=178")
    assert loud["snr_db"] - one["snr_db"] == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("spreading", "fading", "half_m"),
    [
        (2, "frame", (3350, 5050, 6600, 5050)),
        (1.5, "frame", (5700, 8150, 9900, 14_400)),
        (2, "bit", (3350, 3150, 4450, 1350)),
        (2, "none", (3350, 5300, 7500, 5650)),
    ],
)
def test_sea_prints_the_ranges_that_the_documents_state(spreading: float, fading: str, half_m: tuple[int, ...]):
    names = ("nanomodem-v3", "whoi-fsk-0", "whoi-psk-1", "atm-900")
    for name, range_m in zip(names, half_m, strict=True):
        sea = ("--set", f"channel.spreading={spreading}", "--set", f"channel.fading={fading}")
        near, far = points("--modem", name, *sea, "--ranges", f"{range_m - 50},{range_m + 50}")
        assert near["delivered"] > 0.5 > far["delivered"]


def test_the_list_of_modems_marks_what_is_not_verified():
    lines = remoras("list", "modems").stdout.splitlines()
    nano = next(line for line in lines if "nanomodem-v3" in line)
    assert "168 dB re 1 uPa at 1 m," in nano
    assert "measured losses from -3 to 6 dB" in nano
    silent = next(line for line in lines if "s2c-18-34" in line)
    assert "source level unknown" in silent
    assert lines[-1].strip() == "(?) no source was found for this number: it is an estimate"
    assert sum(line.count("(?)") for line in lines[:-1]) == sum(len(modem.unverified) for modem in modems().values())


SHORT = ("--set", "scenario.duration_s=30")


def test_a_network_is_described_with_source_and_assumptions() -> None:
    text = remoras("sea", "--describe", "mission-2012").stdout
    assert "source: M. Chitre" in text
    assert "assumed: static links on moving vehicles" in text
    assert "unknown: which frames were counted" in text
    rows = [line.split() for line in text.splitlines()]
    assert ["27", "0.326", "0.826", "-", "0.975", "0.023"] in rows
    found = json.loads(remoras("sea", "--describe", "hermes-june", "--json").stdout)
    assert found["per_over_range"][3] == [120.0, 0.484]
    assert found["assumed"] == "losses over range as measured"


@pytest.mark.parametrize("name", shipped())
def test_figures_of_sea_have_a_caption_and_numbers(name: str, tmp_path: Path) -> None:
    remoras("sea", "--describe", name, "--out", tmp_path, "--format", "svg")
    stem = tmp_path / f"network-{name}"
    assert stem.with_suffix(".svg").read_text().startswith("<?xml")
    assert shipped()[name].citation in stem.with_suffix(".txt").read_text()
    if not shipped()[name].per_over_range:
        assert network_of(str(stem.with_suffix(".csv"))).per == shipped()[name].per


def test_the_option_names_channel_and_network() -> None:
    found = json.loads(remoras("run", "mapping-patches", *SHORT, "--network", "mission-2012", "--json").stdout)
    assert (found["channel"], found["per"]) == ("network", pytest.approx(0.42, abs=1e-3))
    both = ("--channel", "network", "--network", "mission-2012")
    assert json.loads(remoras("run", "mapping-patches", *SHORT, *both, "--json").stdout) == found
