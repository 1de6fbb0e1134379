"""Runs: what telling, inference and contact are there for, by what goes when they are taken away."""

import math
import re
from pathlib import Path

import pytest
from searching import SCENARIO, SILENCE, Facts, mission, run, run_of, text

from missions.arrows.detectors import shown_code
from missions.arrows.metrics import METRICS
from missions.arrows.mission import ArrowsMission
from missions.arrows.scenario import SITES
from missions.arrows.seafloor import contact_code
from missions.runs.run import Run
from remoras.activities import Activity, ActivityType
from remoras.behaviours import Behaviour
from remoras.motion import Motion
from remoras.picture import Picture


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


@pytest.mark.slow
def test_who_searches_by_itself_tells_where_and_keeps_clear_of_what_others_hold() -> None:
    targets = [vehicle for vehicle, _, _ in said(run(), "searchTarget")]
    assert set(targets) == {"AUV01", "AUV02"}
    central = [vehicle for vehicle, _, _ in said(run("mission.search=central"), "searchTarget")]
    assert set(central) == {"ASV00"}
    assert said(run("mission.search=lawnmower"), "searchTarget") == []


def test_in_silence_each_searches_and_comes_home_and_the_maps_stay_apart() -> None:
    silent = run(*SILENCE)
    assert metric(silent, "found_fraction") > 0.0
    assert last_apart_bits(silent) > 5.0 * last_apart_bits(run())
    at_m = {row[1]: (row[2], row[3]) for row in silent.recorder.trajectories[-4:]}
    assert all(math.dist(place_m, (600.0, -60.0)) <= 60.0 for place_m in at_m.values())


@pytest.mark.slow
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


@pytest.mark.slow
def test_who_comes_back_where_it_has_much_to_tell_has_more_of_it_identified() -> None:
    """One run; the page has the mean over 20."""
    faint = "channel.source_level_db=108"
    held, free = (run(faint, f"mission.contact={one}", search_s=2400.0) for one in ("true", "false"))
    assert metric(held, "identified_fraction") > metric(free, "identified_fraction") > 0.0


def test_where_all_is_heard_a_leash_holds_nobody() -> None:
    """Not one position differs: neither at the start, nor where somebody passes by the rally point."""
    loud = "channel.source_level_db=130"
    held, free = (run(loud, f"mission.contact={one}") for one in ("true", "false"))
    assert held.recorder.trajectories == free.recorder.trajectories


def camera_of(of: ArrowsMission) -> Behaviour:
    return of.behaviour_for(Activity("Identifying", ActivityType.GUIDANCE, ("search area",)), of._database["AUV03"])


def test_a_camera_that_knows_of_nothing_comes_back_where_it_hears_more() -> None:
    """Where it would not, it hovers where it has identified the last anomaly, and hears of no other."""
    far, near = Motion(200.0, 700.0), Motion(690.0, 390.0)
    picture = Picture(frame_s=6.0, facts=Facts({}))
    picture.body.now_s = 1000.0
    for contact, heard_s, goes in (("true", 100.0, True), ("true", 900.0, False), ("false", 100.0, False)):
        of = mission("channel.source_level_db=108", f"mission.contact={contact}")
        camera = camera_of(of)
        picture.peers.heard_s = {"AUV01": heard_s, "AUV02": 990.0}
        assert (camera.perceive(far, picture, True).stimulus > 0.0) is goes
        reference = camera.reference(far, picture)
        assert (reference is not None and reference.target_m == of.reach.point_m) is goes
        assert camera.perceive(near, picture, True).stimulus == 0.0


def test_what_two_vehicles_found_is_identified_once_by_all_images_of_it() -> None:
    """Images of it are noted under one of its two names; a camera that waits for those of the other waits for good."""
    facts, at_m = Facts({}), Motion(600.0, 400.0)
    facts.add("Anomaly-310", (600.0, 400.0))
    facts.add("Anomaly-610", (608.0, 400.0))
    facts.told["shown", "Anomaly-610"] = {shown_code(number, 3, 4) for number in range(4)}
    camera, picture = camera_of(mission()), Picture(frame_s=6.0, facts=facts)
    picture.body.now_s = 100.0
    (concluded,) = camera.perceive(at_m, picture, True).concludes
    ((anomaly, attribute, identity, _),) = concluded.facts
    assert (attribute, identity) == ("identity", "rock")
    facts.known["identity", anomaly] = identity
    camera.perceive(at_m, picture, True)
    assert camera.perceive(at_m, picture, True).stimulus == 0.0


def test_a_camera_goes_first_where_a_site_is_most_likely() -> None:
    """A hull that is all but certain is a site, though little is left to be learnt there."""
    facts, of = Facts({}), mission()
    cells = {"hull": 10 * 30 + 20, "doubt": 10 * 30 + 10}
    facts.told["contact", "AUV01"] = {contact_code(look, one, cells["hull"]) for look in range(3) for one in (0, 1)}
    facts.told["contact", "AUV02"] = {contact_code(0, 0, cells["doubt"])}
    for name, cell in cells.items():
        facts.add(name, of.grid.centre_m(cell))
    camera, picture = camera_of(of), Picture(frame_s=6.0, facts=facts)
    camera.perceive(Motion(620.0, 420.0), picture, True)
    reference = camera.reference(Motion(620.0, 420.0), picture)
    assert reference is not None
    assert reference.target_m == of.grid.centre_m(cells["hull"])


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
