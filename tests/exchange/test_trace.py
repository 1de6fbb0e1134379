"""The channel model ``trace``: links follow the file, and invalid files are refused."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.channel.link import Transmission
from exchange.channel.models import Deployment, LinkFileError
from exchange.channel.modems import modems
from exchange.channel.trace import LossSeries, TraceChannel, trace_of

POND = Deployment({"Boat": 1, "Diver": 0}, (5.0, 0.0), modems()["nanomodem-v3"], 1000.0, 40.0)
OUTCOMES = """\
time_s,sender,receiver,lost
0.0,Diver,Boat,1
2.0,Boat,Diver,0
10.0,Diver,Boat,0
12.0,Boat,Diver,1
20.0,Diver,Boat,0
22.0,Boat,Diver,1
30.0,Diver,Boat,1
32.0,Boat,Diver,0
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "links.csv"
    path.write_text(OUTCOMES, encoding="utf-8")
    return path


def asked(channel: TraceChannel, sender: int, times_s: list[float]) -> list[float]:
    links = channel.link_model(POND, 1)
    return [links.p_loss(Transmission(0, sender, time_s, 100), 1 - sender, 9.0) for time_s in times_s]


def test_links_follow_the_recorded_trace(file: Path):
    channel = TraceChannel(file=str(file))
    assert asked(channel, 0, [0.0, 9.9, 10.0, 25.0, 30.0, 39.0]) == [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]
    assert asked(channel, 1, [0.0, 2.0, 12.0, 22.0, 32.0]) == [0.0, 0.0, 1.0, 1.0, 0.0]
    assert list(channel.misfits(POND)) == []


def test_a_repeated_trace_restarts_at_its_beginning(file: Path):
    """It lasts until 32 s and for the median gap of 10 s."""
    assert asked(TraceChannel(file=str(file), repeat=True), 0, [42.0, 52.0, 420.0]) == [1.0, 0.0, 1.0]
    assert asked(TraceChannel(file=str(file)), 0, [420.0]) == [1.0]


def test_further_columns_and_row_order_are_ignored(file: Path, tmp_path: Path):
    rows = [",".join([*line.split(",")[::-1], "x"]) for line in OUTCOMES.splitlines()]
    other = tmp_path / "other.csv"
    other.write_text("\n".join([rows[0], *rows[:0:-1], ""]), encoding="utf-8")
    assert trace_of(str(other)) == trace_of(str(file))


@given(st.lists(st.tuples(st.floats(0.0, 1e5), st.floats(0.0, 1.0)), min_size=1, unique_by=lambda row: row[0]))
def test_a_loss_series_returns_its_rates_and_a_mean_between_them(rows: list[tuple[float, float]]):
    series = LossSeries(*zip(*sorted(rows), strict=True))
    rates = set(series.per)
    assert {series.at(time_s) for time_s in (0.0, 1.0, 777.7, 1e6)} <= rates
    assert min(rates) - 1e-9 <= series.mean(2e5) <= max(rates) + 1e-9


def text(*rows: str, columns: str = "time_s,sender,receiver,lost") -> str:
    return "\n".join((columns, *rows)) + "\n"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "has the columns none; needed are time_s, sender, receiver and lost or per"),
        (text(), "has no rows"),
        (text("0,A,B,1,1", columns="time_s,sender,receiver,lost,per"), "needed are .* and lost or per"),
        (text("0,A,B,2"), "line 2: lost = '2' must be 0 or 1"),
        (text("0,A,B,1.2", columns="time_s,sender,receiver,per"), "line 2: per = '1.2' must be a number from 0 to 1"),
        (text("-1,A,B,0"), "line 2: time_s = '-1' must be a number of seconds, 0 or more"),
        (text("0,A,A,0"), "line 2: from 'A' to 'A' is no link of two vehicles"),
        (text("0,A,B,0", "0,A,B,1"), "line 3: a second row from A to B at 0 s"),
    ],
)
def test_an_invalid_trace_is_refused_with_its_row(tmp_path: Path, content: str, says: str):
    file = tmp_path / "bad.csv"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(LinkFileError, match=says):
        trace_of(str(file))


def test_files_that_cannot_be_read_are_refused(tmp_path: Path, file: Path):
    with pytest.raises(LinkFileError, match="cannot be read: No such file"):
        trace_of(str(tmp_path / "none.csv"))
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(LinkFileError, match="is no CSV"):
        trace_of(str(tmp_path / "bytes.csv"))
    with pytest.raises(LinkFileError, match="is not the file that was used: its sha256 is"):
        trace_of(str(file), "0" * 64)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"nodes": {"Boat": 1, "Buoy": 0}}, "names the vehicle Diver; the scenario has Boat, Buoy: rename"),
        ({"nodes": {"Boat": 1, "Diver": 0, "Buoy": 2}}, "no row of the link from Boat to Buoy and 3 more"),
        ({"duration_s": 43.0}, "ends at 42 s, the run at 43 s: set scenario.duration_s .*, or channel.repeat = true"),
    ],
)
def test_a_trace_of_another_fleet_or_a_shorter_time_is_one_clear_fault(file, changed, says):
    (fault,) = TraceChannel(file=str(file)).misfits(replace(POND, **changed))  # type: ignore[arg-type]
    assert fault.key == "file"
    assert fault.given == f'"{file}"'
    assert re.search(says, fault.allowed)


def test_a_trace_without_a_file_is_a_fault():
    (fault,) = TraceChannel().misfits(POND)
    assert (fault.key, fault.allowed[:8]) == ("file", "missing:")
