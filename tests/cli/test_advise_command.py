"""The command advise."""

import json
from pathlib import Path

from invoked import refused, remoras

from missions.advising.traits import DECIDING


def test_advice_names_a_strategy_its_rivals_and_what_it_rests_on() -> None:
    done = remoras("advise", "mapping-patches", "--set", "channel.per=0.5", "--json")
    assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)
    assert len(said["strategies"]) == 9
    assert said["strategies"][0]["strategy"] == said["strategy"]
    assert said["strategies"][0]["longer"] == 0.0
    assert [row["longer"] for row in said["strategies"]] == sorted(row["longer"] for row in said["strategies"])
    assert all(row["low"] <= row["high"] and 0.0 <= row["p_within"] <= 1.0 for row in said["strategies"])
    assert [near["distance"] for near in said["nearest"]] == sorted(near["distance"] for near in said["nearest"])
    assert said["outside"] == []
    assert {trait["name"]: trait["value"] for trait in said["traits"]}["loss"] == 0.5


def test_text_says_the_same_as_json() -> None:
    said = json.loads(remoras("advise", "mapping-corridor", "--set", "channel.per=0.3", "--json").stdout)
    lines = remoras("advise", "mapping-corridor", "--set", "channel.per=0.3").stdout.splitlines()
    assert lines[0].startswith(f"{said['strategy']}: ")
    rows = [
        line.split() for line in lines if line.strip().startswith(tuple(row["strategy"] for row in said["strategies"]))
    ]
    assert [row[0] for row in rows[1:]] == [row["strategy"] for row in said["strategies"]]
    shown = [line.split()[0] for line in lines if " / " in line]
    assert shown == [trait.name for trait in DECIDING]


def test_what_lies_outside_is_said() -> None:
    done = remoras("advise", "mapping-patches", "--set", "channel.per=0.97", "--set", "communication.policy=m-ack")
    outside = next(line for line in done.stdout.splitlines() if line.startswith("outside of what was drawn"))
    assert "loss = 0.97 (" in outside
    assert "policy m-ack (all instances: ack)" in outside
    teams = json.loads(remoras("advise", "mapping-nine-teams", "--set", "current.east_mps=0.1", "--json").stdout)[
        "outside"
    ]
    assert {"3 groups with jobs (all instances: 1)", "feature current (in no instance)"} <= set(teams)
    other = json.loads(remoras("advise", "pandora-inspection", "--json").stdout)["outside"]
    assert any(text.startswith("mission missions.pandora:PandoraMission") for text in other)


def test_misuse_is_one_line() -> None:
    assert "advice is about jobs that a group divides" in refused("advise", "arrows-archaeology")
    assert "SCENARIO is missing" in refused("advise")
    assert "mapping-patches" in refused("advise", "mapping-patch")
    assert "no experience for advice" in refused("advise", "mapping-patches", "--experience", "pyproject.toml")
    assert refused("advise", "--make", "pyproject.toml") == "remoras: pyproject.toml: File exists\n"


def test_footprints_are_drawn_with_their_numbers(tmp_path: Path) -> None:
    done = remoras("advise", "--map", tmp_path, "--format", "svg")
    assert done.exit_code == 0, done.stderr
    lines = (tmp_path / "footprints.csv").read_text().splitlines()
    assert lines[0].split(",")[:3] == ["instance", "x", "y"]
    caption = (tmp_path / "footprints.txt").read_text()
    assert caption.startswith(f"{len(lines) - 1} instances")
    assert (tmp_path / "footprints.svg").is_file()


def test_how_good_it_is_can_be_asked() -> None:
    said = json.loads(remoras("advise", "--judge", "--json").stdout)
    assert [rule["name"] for rule in said["rules"]][:4:3] == ["advice", "best in the other repeats"]
    assert said["rules"][0]["within"] > said["rules"][2]["within"]
