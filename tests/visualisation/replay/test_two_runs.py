"""Where two runs part: at the first packet that is another, says something else or is heard by others."""

from pathlib import Path
from typing import Any

from replayed import LOSSY, asked, data_of, recorded

from missions.runs.results import Results

APART = "([one, two]) => R.divergence(one, two)"


def apart(folder: Path, *runs: Results) -> Any:
    return asked([data_of(one) for one in runs], APART, folder)


def said(results: Results) -> list[tuple[int, list[tuple[Any, ...]]]]:
    """Slot and facts of every packet."""
    facts: dict[str, list[tuple[Any, ...]]] = {}
    for row in results.table("items").to_pylist():
        facts.setdefault(row["uid"], []).append((row["subject"], row["attribute"], row["value"]))
    return [
        (row["slot"], [fact for uid in row["item_uids"] + row["status_uids"] for fact in facts.get(uid, ())])
        for row in results.table("packets").to_pylist()
    ]


def test_at_the_first_packet_that_others_heard(tmp_path: Path) -> None:
    """The same seed at two loss rates: the first slot with other receivers is where they part."""
    runs = [recorded(tmp_path / str(per), f"channel.per={per}", "scenario.duration_s=200") for per in (0.3, 0.6)]
    pairs = zip(*(one.table("packets").to_pylist() for one in runs), strict=False)
    first = next(a for a, b in pairs if a["receivers"] != b["receivers"])
    told = apart(tmp_path, *runs)
    assert told == {"time_s": first["time_s"], "text": f"slot {first['slot']} is heard by others"}
    assert apart(tmp_path, runs[0], runs[0]) is None


def test_at_the_first_packet_that_says_something_else_in_as_many_words(tmp_path: Path) -> None:
    """A vehicle that starts elsewhere says so in a packet of the same size with as many items."""
    starts = ("vehicle.AUV02.start_m=[0.0,0.0]", "vehicle.AUV02.start_m=[40.0,0.0]")
    runs = [
        recorded(tmp_path / str(number), LOSSY, "scenario.duration_s=60", start) for number, start in enumerate(starts)
    ]
    packets, (one, two) = runs[0].table("packets").to_pylist(), map(said, runs)
    number = next(number for number, (a, b) in enumerate(zip(one, two, strict=True)) if a != b)
    assert packets[number]["sender"] == "AUV02"
    told = apart(tmp_path, *runs)
    slot, at_s = packets[number]["slot"], packets[number]["time_s"]
    assert told == {"time_s": at_s, "text": f"AUV02 says something else in slot {slot}"}


def test_where_one_goes_on_and_the_other_does_not(tmp_path: Path) -> None:
    runs = [recorded(tmp_path / str(end_s), LOSSY, f"scenario.duration_s={end_s}") for end_s in (60, 61)]
    assert apart(tmp_path, *runs) == {"time_s": 60.0, "text": "one of them ends"}
