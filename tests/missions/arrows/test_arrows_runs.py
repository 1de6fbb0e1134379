"""Runs: what telling, inference and contact are there for, by what goes when they are taken away."""

import math
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from searching import SCENARIO, SILENCE, Facts, mission, run, run_of, text

from missions.arrows.metrics import METRICS, alone_of
from missions.arrows.scenario import SITES
from missions.runs.run import Run
from remoras.activities import Activity, ActivityType
from remoras.motion import Motion


def metric(of: Run, name: str) -> float:
    (value,) = (one.of(of) for one in METRICS if one.name == name)
    assert isinstance(value, int | float)
    return float(value)


def last_apart_bits(of: Run) -> float:
    return float(of.recorder.rows("fleet_maps")[-1][2])


def said(of: Run, attribute: str) -> list[tuple[str, str, str]]:
    return [(row[1], row[4], row[6]) for row in of.recorder.items if row[5] == attribute]


def test_sites_are_found_identified_and_pictured_and_all_come_home() -> None:
    of = run()
    assert metric(of, "found_fraction") > 0.0
    assert metric(of, "identified_fraction") > 0.0
    assert {"AUV03"} == {vehicle for vehicle, _, _ in said(of, "picturedBy")}
    assert [one.name for one in of.milestones if one.group == "Divers"] == ["gathered"]
    assert of.recorder.trajectories[-1][0] < 1200.0 + 900.0


def test_one_seed_gives_the_same_rows() -> None:
    other = run_of(SCENARIO)
    for table in ("items", "contacts", "trajectories", "maps", "identified"):
        assert run().recorder.rows(table) == other.recorder.rows(table)


def test_who_searches_by_itself_tells_where_and_keeps_clear_of_what_others_hold() -> None:
    targets = [vehicle for vehicle, _, _ in said(run(), "searchTarget")]
    assert set(targets) == {"AUV01", "AUV02"}
    central = [vehicle for vehicle, _, _ in said(run("mission.search=central"), "searchTarget")]
    assert set(central) == {"ASV00"}
    assert said(run("mission.search=lawnmower"), "searchTarget") == []


def test_in_silence_each_searches_and_comes_home_and_the_maps_stay_apart() -> None:
    silent = run(*SILENCE)
    assert metric(silent, "found_fraction") > 0.0
    assert last_apart_bits(silent) > 10.0 * last_apart_bits(run())
    at_m = {row[1]: (row[2], row[3]) for row in silent.recorder.trajectories[-4:]}
    assert all(math.dist(place_m, (600.0, -60.0)) <= 60.0 for place_m in at_m.values())


@pytest.mark.parametrize("search", ["elementary", "lawnmower"])
def test_who_is_not_told_of_anomalies_identifies_none(search: str) -> None:
    """The camera is on a vehicle that finds nothing itself: without telling, a search is as if all were alone."""
    found = {metric(run(f"mission.search={search}", *SILENCE), "identified_fraction")}
    assert found == {0.0}


def test_anomalies_that_are_kept_to_oneself_are_identified_by_nobody(tmp_path: Path) -> None:
    file = tmp_path / "mute.toml"
    file.write_text(text().replace("\nlocation = 40\ncontact = 40", ""), encoding="utf-8")
    assert metric(run_of(str(file)), "identified_fraction") == 0.0
    assert metric(run(), "identified_fraction") > 0.0


def test_without_the_definitions_nothing_is_concluded_to_be_a_site(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The class of what is identified follows from the vocabulary; pictures are taken of what follows to be a site."""
    from missions.arrows.mission import ArrowsMission

    (words,) = ArrowsMission.vocabulary
    plain = words.read_text(encoding="utf-8").split("\n")
    kept, is_definition = [], False
    for line in plain:
        is_definition = is_definition or line.strip().startswith("owl:equivalentClass")
        if is_definition:
            if line.rstrip().endswith(" ."):
                kept[-1] = kept[-1].rstrip().removesuffix(";") + "."
                is_definition = False
            continue
        kept.append(line)
    target = tmp_path / "plain.ttl"
    target.write_text("\n".join(kept), encoding="utf-8")
    monkeypatch.setattr(ArrowsMission, "vocabulary", (target,))
    of = run_of(SCENARIO)
    assert any(kind in SITES for _, _, kind in said(of, "identity"))
    assert said(of, "picturedBy") == []


def test_who_comes_back_where_it_has_much_to_tell_is_less_alone_and_maps_are_more_alike() -> None:
    faint = "channel.source_level_db=108"
    held, free = (run(faint, f"mission.contact={one}", search_s=2400.0) for one in ("true", "false"))
    longest = [max(longest_s for _, longest_s in alone_of(one).values()) for one in (held, free)]
    assert longest[0] < longest[1]
    assert metric(held, "apart_bits") < 0.75 * metric(free, "apart_bits")


def test_a_camera_that_knows_of_nothing_comes_back_into_contact() -> None:
    """Where it would not, it hovers where it has identified the last anomaly, and hears of no other."""
    far, near = Motion(600.0, 700.0), Motion(600.0, -20.0)
    for contact, goes in (("true", True), ("false", False)):
        of = mission("channel.source_level_db=108", f"mission.contact={contact}")
        camera = of.behaviour_for(
            Activity("Identifying", ActivityType.GUIDANCE, ("search area",)), of._database["AUV03"]
        )
        picture = SimpleNamespace(facts=Facts({}), body=SimpleNamespace(now_s=100.0))
        assert (camera.perceive(far, picture, True).stimulus > 0.0) is goes
        reference = camera.reference(far, picture)
        assert (reference is not None and reference.target_m == (600.0, -60.0)) is goes
        assert camera.perceive(near, picture, True).stimulus == 0.0


def test_a_lost_searcher_leaves_its_part_to_the_other(tmp_path: Path) -> None:
    """The other goes where the lost one would have gone: under a leash it needs no word for that."""
    file = tmp_path / "lost.toml"
    file.write_text(text() + '\n[[fault]]\nkind = "lost"\nvehicle = "AUV01"\nat_s = 300.0\n', encoding="utf-8")
    of = run_of(str(file))
    way = [(row[2], row[3]) for row in of.recorder.trajectories if row[1] == "AUV02"]
    with_it = [(row[2], row[3]) for row in run().recorder.trajectories if row[1] == "AUV02"]
    assert way != with_it
    assert metric(of, "found_fraction") > 0.0


def tables(text_: str, name: str) -> list[str]:
    """The tables of a list, each with its text."""
    return [f"[[{name}]]{part.split('[[')[0]}" for part in text_.split(f"[[{name}]]")[1:]]


def test_the_order_of_tables_makes_no_difference(tmp_path: Path) -> None:
    shuffled = text()
    for name in ("kind", "historic_find"):
        listed = [one.split("\n# ")[0].rstrip() + "\n\n" for one in tables(shuffled, name)]
        for one in listed:
            assert one.rstrip() in shuffled
            shuffled = shuffled.replace(one.rstrip() + "\n", "", 1)
        shuffled += "\n" + "".join(reversed(listed))
    file = tmp_path / "shuffled.toml"
    file.write_text(shuffled, encoding="utf-8")
    assert run_of(str(file)).recorder.trajectories == run().recorder.trajectories


def test_a_shift_of_the_whole_world_shifts_the_search(tmp_path: Path) -> None:
    """Nothing is found sooner or later because the origin of the chart is elsewhere."""
    shifted = re.sub(
        r"^(position_m|start_m) = \[(.*), (.*)\]",
        lambda of: f"{of[1]} = [{float(of[2]) + 1024.0}, {float(of[3]) - 2048.0}]",
        text(),
        flags=re.MULTILINE,
    )
    for old, new in (
        ("x_m = [-100.0, 1300.0]", "x_m = [924.0, 2324.0]"),
        ("y_m = [-200.0, 900.0]", "y_m = [-2248.0, -1148.0]"),
        ("x_m = [0.0, 1200.0]", "x_m = [1024.0, 2224.0]"),
        ("y_m = [0.0, 800.0]", "y_m = [-2048.0, -1248.0]"),
    ):
        assert old in shifted
        shifted = shifted.replace(old, new)
    file = tmp_path / "shifted.toml"
    file.write_text(shifted, encoding="utf-8")
    found = [[row[:5] for row in of.recorder.rows("contacts")] for of in (run(), run_of(str(file)))]
    assert found[0] == found[1]


@pytest.mark.slow
def test_by_itself_it_finds_sites_sooner_than_along_lanes() -> None:
    """Mean over 5 seeds, shipped channel: the prior is used, and lanes do not know it."""
    seeds = range(1, 6)
    by = {
        search: sum(
            metric(run(f"mission.search={search}", seed=seed, search_s=2400.0), "mean_found_s") for seed in seeds
        )
        for search in ("elementary", "lawnmower")
    }
    assert by["elementary"] < 0.95 * by["lawnmower"]
