"""Which packets the map shows as links: all of a few, of many the newest whole and the losses before as stubs."""

from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from replayed import LOSSY, asked, data_of, recorded

from missions.runs.results import Results

RATE = 60.0
LINKS = """([run], { times, rate, selected }) => {
  const facts = new R.Facts(run, new Map());
  return times.map((t) => R.linksAt(facts, { t, pace: String(rate), rate, playing: true }, selected)
    .map((one) => [one.packet.slot, run.vehicles[one.to.v].name, one.to.arrival_s !== null, one.age, one.isWhole]));
}"""


def links(results: Results, folder: Path, times_s: list[float], selected: int = -1) -> list[list[list[Any]]]:
    given = {"times": times_s, "rate": RATE, "selected": selected}
    found: list[list[list[Any]]] = asked([data_of(results)], LINKS, folder, given, ("facts.js", "packets.js"))
    return found


def newest(results: Results, at_s: float, fade_s: float) -> list[tuple[int, str, bool]]:
    """(slot, receiver, heard) of the newest packets of a time that ended alike, by sender and receiver."""
    seen, found = set(), []
    for row in reversed(results.table("packets").to_pylist()):
        if not 0.0 < at_s - row["time_s"] <= fade_s:
            continue
        for name in [*row["receivers"], *row["lost_by"]]:
            key = row["sender"], name, name in row["receivers"]
            if key not in seen:
                seen.add(key)
                found.append((row["slot"], name, key[2]))
    return found


@pytest.mark.parametrize("n_vehicles", [4, 16])
def test_the_newest_links_are_whole_and_older_losses_stay(tmp_path: Path, n_vehicles: int) -> None:
    """At 60 times real time links fade for 15 s, a quarter of a second of the reader's, or a frame of 16 slots."""
    scenario = {4: "mapping-rendezvous", 16: "mapping-patches"}[n_vehicles]
    sizes = () if n_vehicles == 4 else ("fleet.size=16",)
    results = recorded(tmp_path / "run", LOSSY, "scenario.duration_s=150", *sizes, scenario=scenario)
    rows = results.table("packets").to_pylist()
    slot_s = (rows[-1]["time_s"] - rows[0]["time_s"]) / (rows[-1]["slot"] - rows[0]["slot"])
    fade_s = max(0.25 * RATE, n_vehicles * slot_s)
    times_s = [30.0, 75.3, 120.0]
    for at_s, told in zip(times_s, links(results, tmp_path, times_s), strict=True):
        expected = newest(results, at_s, fade_s)
        assert len(expected) > (100 if n_vehicles == 16 else 10)
        shown = [(slot, name, heard) for slot, name, heard, _, _ in told]
        assert len(set(shown)) == len(shown) == min(len(expected), 150)
        assert set(shown) <= set(expected)
        assert [slot for slot, *_ in shown] == sorted((slot for slot, *_ in shown), reverse=True)
        assert [is_whole for *_, is_whole in told] == [number < 30 for number in range(len(told))]
        first_slot = shown[-1][0] + 1  # of all packets since then nothing is left out
        assert {one for one in shown if one[0] >= first_slot} == {one for one in expected if one[0] >= first_slot}
        assert all(0.0 <= age <= 1.0 for *_, age, _ in told)


def test_in_a_large_fleet_the_links_are_those_of_the_selected_vehicle(tmp_path: Path) -> None:
    results = recorded(tmp_path / "run", LOSSY, "scenario.duration_s=100", "fleet.size=16", scenario="mapping-patches")
    name = results.scenario.vehicle[3].name
    sender = {row["slot"]: row["sender"] for row in results.table("packets").to_pylist()}
    [told] = links(results, tmp_path, [90.0], selected=3)
    assert len(told) > 10
    assert all(name in (sender[slot], receiver) for slot, receiver, *_ in told)


@pytest.mark.parametrize("n_packets", [0, 1])
def test_without_two_packets_nobody_knows_how_long_a_slot_is(tmp_path: Path, n_packets: int) -> None:
    results = recorded(tmp_path / "run", "scenario.duration_s=1")
    path = results.folder / "packets.parquet"
    pq.write_table(pq.read_table(path).slice(0, n_packets), path)
    at_start, at_end = links(results, tmp_path, [0.0, 1.0])
    assert at_start == []
    assert [(slot, heard) for slot, _, heard, _, _ in at_end] == [(0, True)] * 3 * n_packets
