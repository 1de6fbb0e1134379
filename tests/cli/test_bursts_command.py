"""The command ``bursts``: what it tells of a trace, the table that it prints, its files, what it refuses."""

import json
import tomllib
from pathlib import Path

import pytest
from invoked import refused, remoras

from benchmarks.bursts import outcomes
from exchange.acoustics.bursts import BurstModel
from missions.files import toml_value
from missions.scenarios import load

LINKS = [("AUV00", "ASV00"), ("ASV00", "AUV00")]


def write(file: Path, chain: tuple[float, float, float, float], n: int, links: list[tuple[str, str]] = LINKS) -> Path:
    """A trace that the channel ``gilbert-elliott`` makes, a packet each 2 s."""
    rows = ["time_s,sender,receiver,lost"]
    for number, (sender, receiver) in enumerate(links, 1):
        lost = outcomes(BurstModel(*chain), n, seed=1, receiver=number)
        rows += [f"{2 * slot},{sender},{receiver},{int(outcome)}" for slot, outcome in enumerate(lost)]
    file.write_text("\n".join(rows) + "\n")
    return file


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("trace") / "trial.csv", (0.02, 0.1, 0.05, 0.8), 4000)


def table_in(printed: str) -> dict[str, object]:
    found: dict[str, object] = tomllib.loads(printed[printed.index("[channel]") :])["channel"]
    return found


def test_bursts_are_told_and_the_table_can_be_pasted(trace: Path):
    done = remoras("bursts", trace)
    assert done.exit_code == 0, done.output
    assert "2 links, 8000 packets" in done.stdout
    assert "one each 2 s (median), 0 long gaps" in done.stdout
    assert "bursts: BIC of gilbert-elliott" in done.stdout
    assert "very strong evidence" in done.stdout
    table = table_in(done.stdout)
    assert table.pop("name") == "gilbert-elliott"
    truth = {"p_good_to_bad": 0.02, "p_bad_to_good": 0.1, "per_good": 0.05, "per_bad": 0.8}
    assert table == pytest.approx(truth, rel=0.15)


def test_a_table_is_for_the_slot_that_is_said(trace: Path):
    """Half a step: what does not change in two slots does not in a step."""
    step, slot = (table_in(remoras("bursts", trace, *more).stdout) for more in ((), ("--slot", "1")))
    stays = [1.0 - table["p_good_to_bad"] - table["p_bad_to_good"] for table in (step, slot)]  # type: ignore[operator]
    assert stays[1] ** 2 == pytest.approx(stays[0], abs=1e-3)
    assert slot["per_bad"] == step["per_bad"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("chain", "name", "says"),
    [
        ((0.5, 0.5, 0.3, 0.3), "bernoulli", "no bursts: independent losses have the least BIC"),
        ((0.1, 0.4, 0.0, 1.0), "gilbert-elliott", "bursts: BIC of markov"),
        ((0.01, 0.03, 0.0, 0.7), "gilbert-elliott", "bursts: BIC of gilbert "),
    ],
)
def test_every_table_is_one_of_a_scenario(tmp_path: Path, chain: tuple[float, ...], name: str, says: str):
    file = write(tmp_path / "trial.csv", chain, 2000)  # type: ignore[arg-type]
    found = json.loads(remoras("bursts", file, "--json").stdout)
    assert found["verdict"].startswith(says)
    chosen = next(model for model in found["models"] if model["name"] == found["best"])
    assert chosen["channel"]["name"] == name
    assert table_in(remoras("bursts", file).stdout) == chosen["channel"]
    for model in found["models"]:
        scenario = load("mapping-rendezvous", [("--set", f"channel={toml_value(model['channel'])}")])
        assert scenario.channel.name == model["channel"]["name"]


def test_rates_of_links_are_a_matrix(tmp_path: Path):
    one = write(tmp_path / "one.csv", (0.5, 0.5, 0.1, 0.1), 1000, LINKS[:1]).read_text()
    other = write(tmp_path / "other.csv", (0.5, 0.5, 0.6, 0.6), 1000, LINKS[1:]).read_text()
    both = tmp_path / "both.csv"
    both.write_text(one + other.partition("\n")[2])
    done = remoras("bursts", both)
    assert "no bursts, but links that differ: BIC" in done.stdout
    table = table_in(done.stdout)
    assert table["name"] == "matrix"
    assert [link["receiver"] for link in table["link"]] == ["AUV00", "ASV00"]  # type: ignore[attr-defined]


def test_one_link_alone(trace: Path):
    done = remoras("bursts", trace, "--link", "AUV00,ASV00")
    assert "AUV00 to ASV00, 4000 packets" in done.stdout


def test_figure_caption_and_numbers_are_written(trace: Path, tmp_path: Path):
    done = remoras("bursts", trace, "--out", tmp_path / "drawn", "--format", "svg", "--json")
    assert json.loads(done.stdout)["packets"] == 8000
    assert {path.name for path in (tmp_path / "drawn").iterdir()} == {f"bursts.{end}" for end in ("svg", "txt", "csv")}
    assert "n = 8000 packets on 2 links" in (tmp_path / "drawn" / "bursts.txt").read_text()


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (["0,A,B,2"], "trial.csv: line 2: lost = '2' must be 0 or 1"),
        (["0,A,B,0", "x,A,B,0"], "trial.csv: line 3: time_s = 'x' must be a number of seconds, 0 or more"),
        (["0,A,B,0"] , "trial.csv: 1 packets are too few to tell bursts; needed are 100 at least"),
        ([f"{n},A,B,0" for n in range(200)], "trial.csv: all 200 packets were received: there are no bursts to fit"),
        ([f"{n},A,B,1" for n in range(200)], "trial.csv: all 200 packets were lost: there are no bursts to fit"),
    ],
)  # fmt: skip
def test_a_trace_that_tells_nothing_is_one_line(tmp_path: Path, rows: list[str], says: str):
    (tmp_path / "trial.csv").write_text("\n".join(["time_s,sender,receiver,lost", *rows]))
    message = refused("bursts", tmp_path / "trial.csv")
    assert says in message
    assert message.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--link", "AUV00"], "--link 'AUV00': allowed are two names with a comma"),
        (["--link", "AUV00,AUV09"], "has no packet of AUV00 to AUV09; allowed: ASV00,AUV00, AUV00,ASV00"),
        (["--slot", "0"], "--slot '0': allowed are seconds, 0.001 to 100000"),
        (["--slot", "nan"], "--slot 'nan': allowed are seconds"),
    ],
)
def test_misuse_is_one_clear_message_of_bursts(trace: Path, arguments: list[str], says: str):
    assert says in refused("bursts", trace, *arguments)


def test_no_file_is_one_line(tmp_path: Path):
    assert "none.csv: cannot be read: No such file" in refused("bursts", tmp_path / "none.csv")
