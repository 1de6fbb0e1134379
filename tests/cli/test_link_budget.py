"""The command ``sea`` of a scenario, and what ``list modems`` says of numbers."""

import json
from pathlib import Path

import pytest
from invoked import refused, remoras

from exchange.acoustics.modems import modems


def points(*arguments: object) -> list[dict[str, float]]:
    done = remoras("sea", *arguments, "--json")
    assert done.exit_code == 0, done.output
    found: list[dict[str, float]] = json.loads(done.stdout)
    return found


def test_a_line_for_each_modem_and_range():
    done = remoras("sea", "--modem", "nanomodem-v3,whoi-psk-1", "--ranges", "2000,1000")
    assert done.exit_code == 0, done.output
    head, *lines = done.stdout.splitlines()
    assert head.split()[:4] == ["modem", "range", "/", "m"]
    assert [line.split()[:2] for line in lines] == [
        [name, range_m] for name in ("nanomodem-v3", "whoi-psk-1") for range_m in ("1000", "2000")
    ]


def test_the_sea_is_that_of_the_scenario_and_can_be_set():
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
def test_the_reach_that_the_documents_state(spreading: float, fading: str, half_m: tuple[int, ...]):
    names = ("nanomodem-v3", "whoi-fsk-0", "whoi-psk-1", "atm-900")
    for name, range_m in zip(names, half_m, strict=True):
        sea = ("--set", f"channel.spreading={spreading}", "--set", f"channel.fading={fading}")
        near, far = points("--modem", name, *sea, "--ranges", f"{range_m - 50},{range_m + 50}")
        assert near["delivered"] > 0.5 > far["delivered"]


def test_the_channel_may_be_named_that_is_told_of():
    assert points("--set", 'channel.name="acoustic"', "--ranges", "1000") == points("--ranges", "1000")


def test_packets_are_drawn_beside_the_budget(tmp_path: Path):
    """Shares of 4000 packets are within 4 standard errors of the budget, the same each time, and in the files."""
    asked = (
        "--modem",
        "whoi-psk-1",
        "--ranges",
        "1000,6000,7000,9000",
        "--draws",
        "4000",
        "--set",
        "channel.spreading=2",
    )
    found = points(*asked)
    for one in found:
        error = (one["delivered"] * (1.0 - one["delivered"]) / 4000) ** 0.5
        assert abs(one["drawn"] - one["delivered"]) <= 4.0 * error + 1e-12
        assert one["n_drawn"] == 4000
    assert 0.2 < found[2]["drawn"] < 0.5
    assert points(*asked) == found
    assert points(*asked, "--seed", "2") != found
    done = remoras("sea", *asked, "--out", tmp_path / "reach")
    assert done.exit_code == 0, done.output
    drawn = (tmp_path / "reach" / "delivery-against-range-drawn.csv").read_text().splitlines()
    assert drawn[0] == "modem,range_m,n_packets,n_arrived,delivered,low,high"
    assert [line.split(",")[4] for line in drawn[1:]] == [f"{one['drawn']:.6g}" for one in found]
    assert "shares of 4000 packets" in (tmp_path / "reach" / "delivery-against-range.txt").read_text()


def test_figure_caption_and_numbers_are_written(tmp_path: Path):
    done = remoras("sea", "--ranges", "1000,3000", "--out", tmp_path / "reach", "--format", "svg")
    assert done.exit_code == 0, done.output
    names = {path.name for path in (tmp_path / "reach").iterdir()}
    assert names == {f"delivery-against-range.{end}" for end in ("svg", "txt", "csv")}
    said = (tmp_path / "reach" / "delivery-against-range.txt").read_text()
    assert "nanomodem-v3" in said
    assert "Spreading exponent 1.5" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--modem", "s2c-18-34"], "set channel.source_level_db"),
        (["--modem", "nanomodem"], "did you mean 'nanomodem-v3'"),
        (["--ranges", "far"], "--ranges 'far': allowed are metres"),
        (["--ranges", "0,100"], "above 0 and at most 100000"),
        (["--ranges", "nan"], "above 0 and at most 100000"),
        (["--set", "channel.spreading=3"], "less than or equal to 2"),
        (["--set", "channel.name=trace"], "--set channel.name=trace: sea tells of the channel acoustic alone"),
        (["--set", 'channel={name="perfect"}'], "allowed: its keys, such as channel.spreading=2"),
        (["--set", "channel.per=0.3"], "not used by the acoustic channel"),
    ],
)
def test_misuse_is_one_clear_message(arguments: list[str], says: str):
    assert says in refused("sea", *arguments)


def test_the_list_of_modems_marks_what_is_not_verified():
    lines = remoras("list", "modems").stdout.splitlines()
    nano = next(line for line in lines if "nanomodem-v3" in line)
    assert "168 dB re 1 uPa at 1 m," in nano
    assert "measured losses from -3 to 6 dB" in nano
    silent = next(line for line in lines if "s2c-18-34" in line)
    assert "source level unknown" in silent
    assert lines[-1].strip() == "(?) no source was found for this number: it is an estimate"
    assert sum(line.count("(?)") for line in lines[:-1]) == sum(len(modem.unverified) for modem in modems().values())
