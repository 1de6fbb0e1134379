"""Knowledge rebuilt from a recorded run equals that of the vehicles and agrees with packets and decisions."""

import random
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from missions.errors import OutputError
from missions.runs.assembly import assemble
from missions.runs.knowledge_at import Belief, Memory
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import Run, result_of, run
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load
from remoras.fleet.fleet import Fleet
from visualisation import ExportError
from visualisation.exports import Selection, export
from worldmodel import TYPE_UID, WorldModel

MOMENTS = 12
LOSS = ("channel.per=0.6",)
FAULTS = (
    "fault=[{kind='deaf',vehicle='AUV01',at_s=150,until_s=900},{kind='lost',vehicle='AUV02',at_s=500,until_s=1100},"
    "{kind='mute',vehicle='ASV00',at_s=300,until_s=700},{kind='joins',vehicle='AUV00',at_s=60}]",
    "communication.lease_frames=30",
)
"""One vehicle is cut off and comes back, one is missed and comes back, the head of all joins late."""
RESTARTS = (
    "fault=[{kind='restarts',vehicle='AUV01',at_s=300,until_s=360,memory='lost'},"
    "{kind='restarts',vehicle='AUV02',at_s=500,until_s=540,memory='kept'},"
    "{kind='restarts',vehicle='AUV01',at_s=900,until_s=1000,memory='kept'},"
    "{kind='restarts',vehicle='AUV00',at_s=1100,until_s=1140,memory='lost'}]",
)
"""Vehicles begin anew, with and without what they knew; one of them twice, one of them the head."""
EMPTY = ("vehicle.AUV01.energy_j=60000", "vehicle.ASV00.energy_j=20000")
"""Batteries that are empty in the middle of the mission."""
CASES = {"sound": (), "faults": FAULTS, "empty batteries": EMPTY, "restarts": RESTARTS}
NEAR_S = 0.001
"""A moment at which a slot opens is not asked for: who speaks then has moved before."""


def scenario(*settings: str, strategy: str = "remoras") -> Scenario:
    return load("mapping-rendezvous", [("--set", one) for one in (*settings, f"strategy.name='{strategy}'")])


def held_by(model: WorldModel) -> tuple[Any, ...]:
    """Contents of a world model: items, pending and refused blocks, statuses, private blocks, bans, counters."""
    return (
        (model.state_hash(), sorted(model.arrivals.waiting), sorted(model.arrivals.refused)),
        (list(model.blocks()), list(model.statuses()), list(model.private_blocks()), dict(model.banned)),
        (model.next_sequence, model.next_private),
    )


def state_of(fleet: Fleet) -> dict[str, Any]:
    """Current knowledge of every vehicle."""
    found = {}
    for vehicle in fleet.vehicles:
        model, social = vehicle.beliefs.model, vehicle.social
        found[vehicle.name] = (
            held_by(model),
            (social.organisation, social.present, social.absent),
            (frozenset(vehicle.social.objectives.values()), vehicle.social.missions),
        )
    return found


def live(loaded: Scenario, seed: int, moments_s: Sequence[float]) -> dict[float, dict[str, Any]]:
    """Knowledge of every vehicle at these times, recorded while the mission is stepped."""
    fleet, found = assemble(resolved(loaded), seed), {}
    while fleet.running:
        fleet.step()
        if fleet.now_s in moments_s:
            found[fleet.now_s] = state_of(fleet)
    return found


def compare(loaded: Scenario, seed: int, folder: Path | None = None) -> Run:
    """Compare rebuilt with recorded knowledge at random times of a run."""
    finished = run(loaded, seed)
    results: Results | MemoryResults = MemoryResults(finished)
    if folder is not None:
        write_results(finished, folder)
        results = Results.read(folder)
    slot_s = finished.setup.schedule.slot_s
    ticks_s = [float(t) for t in range(int(finished.recorder.trajectories[-1][0]) + 1)]
    apart_s = [t for t in ticks_s if abs(t - round(t / slot_s) * slot_s) > NEAR_S]
    moments_s = random.Random(seed).sample(apart_s, MOMENTS)
    knew = live(loaded, seed, moments_s)
    assert len(knew) == MOMENTS
    for at_s, vehicles in knew.items():
        for name, (held, seen, aims) in vehicles.items():
            known = results.known(name, at_s)
            assert held_by(known.model) == held, (name, at_s)
            assert (known.organisation, known.present, known.absent) == seen, (name, at_s)
            assert (known.objectives, known.missions) == aims, (name, at_s)
    return finished


# What is asked ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("known") / "run"
    write_results(run(scenario(*LOSS, "scenario.duration_s=120"), 3), made)
    return made


def test_values_and_beliefs_are_by_name(folder: Path) -> None:
    results = Results.read(folder)
    first, last = results.known("AUV01", 0.0), results.known("AUV01", 120.0)
    assert first.value("AUV01", "playsRole") is None
    assert last.value("AUV01", "playsRole") == "Operational.Cartographer"
    told = next(one for one in last.beliefs if one[:2] == ("Operational", "hasMission"))
    assert told == Belief("Operational", "hasMission", "AreaMapping", 0.0, "ASV00")
    heard_s = [one.time_s for one in last.beliefs if one[:2] == ("AUV02", "position")]
    assert len(heard_s) == 1
    assert heard_s[0] <= 120.0


def test_unknown_vehicle_and_time_are_refused(folder: Path) -> None:
    results = Results.read(folder)
    with pytest.raises(OutputError, match=r"no vehicle 'AUV1'; there are .*; did you mean 'AUV0"):
        results.known("AUV1", 10.0)
    for at_s in (-1.0, 120.5, float("nan")):
        with pytest.raises(OutputError, match=rf"at_s is {at_s}; allowed: 0 to 120\.0, the end of the run"):
            results.known("AUV01", at_s)
    for wrong in ("x", None, [1.0], 1 + 0j):
        with pytest.raises(OutputError, match=rf"at_s is {re.escape(repr(wrong))}; allowed: 0 to 120\.0, the end"):
            results.known("AUV01", wrong)  # type: ignore[arg-type]
    with pytest.raises(OutputError, match=r"no vehicle 3; there are"):
        results.known(3, 10.0)  # type: ignore[arg-type]
    assert repr(results.known("AUV01", np.int64(10))) == "<Known to AUV01 at 10 s>"


def test_missing_table_is_named(folder: Path, tmp_path: Path) -> None:
    partly = Path(shutil.copytree(folder, tmp_path / "partly"))
    (partly / "items.parquet").unlink()
    with pytest.raises(OutputError, match=r"no table 'items'; there are"):
        Results.read(partly).known("AUV01", 10.0)


def test_expired_waiting_items_are_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 100 s AUV01 finds an object, keeps that to itself, and tells where it is: the others wait for 30 s. Then it
    says what it found: they hold that, and no longer what they forgot."""
    settings = ("worldmodel.waiting_s=30", "communication.needs.location=20", "channel.name='perfect'")
    loaded = scenario(*settings)
    monkeypatch.setattr(type(resolved(loaded).mission), "instances_found_per_vehicle", 1)
    setup = resolved(loaded)
    fleet, states = assemble(setup, 1), {}
    finder = next(vehicle for vehicle in fleet.vehicles if vehicle.name == "AUV01")
    model, tbox = finder.beliefs.model, setup.tbox
    uid, found = model.new_instance_uid(), tbox.class_named("ObjectOfInterest").uid
    announced, located = [(uid, TYPE_UID, found)], [(uid, tbox.attribute_named("location").uid, (10.0, 20.0))]
    while fleet.now_s < 260.0:
        fleet.step()
        if fleet.now_s == 100.0:
            finder.radio.tell(model.record(announced, 100.0, private=True), finder.social.addressed, 100.0)
            finder.radio.tell(model.record(located, 100.0), finder.social.addressed, 100.0)
        if fleet.now_s == 200.0:
            finder.radio.tell(model.record([*announced, *located], 200.0), finder.social.addressed, 200.0)
        if fleet.now_s in (110.0, 136.0, 165.0, 250.0):
            states[fleet.now_s] = state_of(fleet)
    dropped = [row[1] for row in fleet.recorder.faults if row[2].startswith("dropped block")]
    assert set(dropped) == {"ASV00", "AUV00", "AUV02"}
    memory = Memory(MemoryResults(result_of(setup, 1, fleet, 0.0)), setup)
    waiting = {at_s: len(vehicles["AUV00"][0][0][1]) for at_s, vehicles in states.items()}
    assert waiting == {110.0: 1, 136.0: 0, 165.0: 1, 250.0: 0}  # at 165 s it has come again, and waits anew
    for at_s, vehicles in states.items():
        for name, (held, _, _) in vehicles.items():
            assert held_by(memory.known(name, at_s).model) == held, (name, at_s)


# What was known ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_rebuilt_knowledge_includes_groups_formed_and_dissolved_at_sea() -> None:
    settings = ("channel.per=0.4", "finds.number=2", "finds.longest_stay_s=60")
    finished = compare(load("mapping-inspection", [("--set", one) for one in settings]), 3)
    assert {row[5] for row in finished.recorder.organisation} >= {"formed", "dissolved"}


@pytest.mark.slow
def test_values_pruned_before_a_ban_stay_removed() -> None:
    """A ban hides what is newer than its time, so that values count again that nobody has kept; and what it hides is
    not pruned. A vehicle that is away prunes nothing for as long."""
    prune = [
        f"{{class='ObjectOfInterest',attribute='{one}',older_than_s=60}}" for one in ("location", "classification")
    ]
    settings = (
        "channel.per=0.4",
        "scenario.duration_s=1400",
        f"worldmodel.prune=[{','.join(prune)}]",
        "ban=[{issuer='ASV00',vehicle='AUV01',at_s=700,from_s=300,until_s=1100}]",
        "fault=[{kind='lost',vehicle='AUV02',at_s=500,until_s=900}]",
    )
    finished = compare(load("mapping-objects", [("--set", one) for one in settings]), 3)
    model = MemoryResults(finished).known("AUV00", finished.end_s).model
    assert sum(block is None for _, block in model.items()) > 5


def test_items_of_damaged_packets_are_not_known(tmp_path: Path) -> None:
    spoilt = "damage.share=0.2", "communication.crc_bits=16", "scenario.duration_s=600"
    finished = compare(scenario(*LOSS, *spoilt), 4, tmp_path / "run")
    assert len(finished.recorder.rows("refused")) > 20


def test_relayed_status_with_undetected_damage_is_no_error() -> None:
    settings = ("channel.name=network", "damage.share=0.15", "damage.unchecked=true", "scenario.duration_s=600")
    finished = run(scenario(*settings), 3)
    recorded = {row[0] for row in finished.recorder.items}
    said = {uid for row in MemoryResults(finished).table("packets").to_pylist() for uid in row["status_uids"]}
    assert said - recorded
    assert MemoryResults(finished).known("AUV01", 500.0).model.statuses()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("strategy", "case"),
    [
        ("remoras", "faults"),
        pytest.param("central", "empty batteries", marks=pytest.mark.thorough),
        pytest.param("status-broadcast", "restarts", marks=pytest.mark.thorough),
        ("oracle", "restarts"),  # under a bound memory that is lost is told anew at once
    ],
)
def test_rebuilt_knowledge_is_correct_for_every_kind_of_strategy(strategy: str, case: str) -> None:
    compare(scenario(*LOSS, *CASES[case], strategy=strategy), 11)


SETTINGS = (
    "scenario.duration_s=400", "channel.per=0.4", "communication.policy=mps-ack-repeat", "scenario.settle_s=2000",
)  # fmt: skip


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("knowledge") / "run"
    write_results(run(load("mapping-rendezvous", [("--set", one) for one in SETTINGS]), 7), folder)
    return Results.read(folder)


def test_query_is_limited_to_vehicle_and_time(results: Results) -> None:
    asked = "SELECT (COUNT(?f) AS ?n) { ?f sit:ofAttribute rm:mappedCell }"
    counts = [results.query(asked, "AUV01", at_s)[1][0][0] for at_s in (0.0, 200.0, 400.0)]
    assert counts[0] == 0 < counts[1] < counts[2]
    columns, rows = results.query(asked)
    assert columns == ("vehicle", "n")
    assert [row[0] for row in rows] == list(results.knowledge())
    late = "SELECT ?f { ?r sit:received ?f ; sit:receivedAt ?at FILTER(?at > 200) }"
    assert results.query(late, "AUV01", 200.0)[1] == []
    assert results.query(late, "AUV01", 400.0)[1] != []


def test_invalid_export_or_query_is_refused_in_one_line(results: Results, tmp_path: Path) -> None:
    (tmp_path / "there.ttl").write_text("mine", encoding="utf-8")
    for about, says in (
        ({"vehicle": "AUV1"}, "no vehicle 'AUV1'; there are .*; did you mean 'AUV01'"),
        ({"at_s": 1e6}, "at_s is 1000000.0; allowed: 0 to "),
    ):
        with pytest.raises((OutputError, ExportError), match=says) as caught:
            export(results, "ttl", tmp_path / "new.ttl", selection=Selection(**about))  # type: ignore[arg-type]
        assert "\n" not in str(caught.value)
        assert not (tmp_path / "new.ttl").exists()
    with pytest.raises(ExportError, match=r"there.ttl: exists; name another with --out or add --force"):
        export(results, "ttl", tmp_path / "there.ttl")
    assert (tmp_path / "there.ttl").read_text(encoding="utf-8") == "mine"
    with pytest.raises(ExportError, match="is a folder; name a file"):
        export(results, "ttl", tmp_path)
