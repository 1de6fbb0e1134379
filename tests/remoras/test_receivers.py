"""Receivers: a plan in parts, so that each vehicle may begin before it has heard the rest."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from missions.runs.run import run
from missions.scenarios import load
from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact
from remoras.mission import SocialPart
from remoras.social.orders import aims, by_receiver
from remoras.social.requests import Requests
from worldmodel import Instance, WorldModel, core_ontology_paths, read_tbox

TBOX = read_tbox(*core_ontology_paths())
NAMED = [
    ("AUV", "AUV00"),
    ("AUV", "AUV01"),
    ("Role", "Operational.Performer"),
    ("Role", "Operational.Cartographer"),
    ("Role", "Operational.LeftWinger"),
    ("Role", "Operational.RightWinger"),
    ("RallyPoint", "buoy"),
    ("Group", "Operational"),
]
INSTANCES = tuple(Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(NAMED))
PERFORMER, MAPPER, LEFT, RIGHT = (name for kind, name in NAMED if kind == "Role")
HOMING, FOLLOWING = "objectiveRendezVous", "objectiveMissionGathering"


def beliefs() -> Beliefs:
    return Beliefs(WorldModel(TBOX, 0, INSTANCES, n_origins=2, run_time_instances_per_origin=0))


def is_individual(objective: Objective) -> bool:
    return objective.name == "RendezVous"


def test_each_vehicle_has_its_roles_and_what_their_holders_pursue_then_come_all_then_few() -> None:
    """Roles in the order given; the objective of a role that two are given is in both of their parts."""
    known = beliefs()
    stated = [
        ("AUV01", "playsRole", RIGHT),
        ("AUV00", "playsRole", LEFT),
        ("AUV00", "playsRole", MAPPER),
        ("AUV01", "playsRole", MAPPER),
        (LEFT, FOLLOWING, "Operational"),
        (LEFT, HOMING, "buoy"),
        (MAPPER, HOMING, "buoy"),
        (PERFORMER, FOLLOWING, "Operational"),
    ]
    role_named = Requests(known, {}).role_named
    parts = by_receiver([known.fact(*one) for one in stated], known, role_named, is_individual)
    assert parts == [[known.fact(*stated[index]) for index in part] for part in ((0, 3, 6), (1, 2, 5, 6), (7,), (4,))]


def test_aims_are_said_with_their_role_and_what_is_pursued_together_can_wait() -> None:
    """What was agreed before the dive is known to everybody."""
    known, mission = beliefs(), SimpleNamespace(is_individual=is_individual)
    objectives = [
        Objective("Operational", "LeftWinger", "RendezVous", "buoy"),
        Objective("Operational", "LeftWinger", "MissionGathering", "Operational"),
        Objective("Operational", "RightWinger", "RendezVous", "buoy"),
    ]

    def said(attribute: str, role: str) -> list[Fact]:
        return aims([("AUV01", attribute, role)], objectives, objectives[2:], known, cast(SocialPart, mission))

    assert said("playsRole", LEFT) == [known.fact(LEFT, HOMING, "buoy")]
    assert said("playsRole", RIGHT) == said("leftRole", LEFT) == []


FRAME_S = 16 * 1.7725
"""Sixteen slots of a packet of 64 bytes and a guard for 1000 m: the first assignments count from its end."""


@pytest.fixture(scope="module")
def taken_s() -> dict[str, float]:
    """When each of 16 vehicles first took a role with a job; the channel is perfect."""
    short = load("mapping-patches", [("--set", "fleet.size=16"), ("--set", "scenario.duration_s=150")])
    times_s: dict[str, float] = {}
    for time_s, vehicle, _, role, event in run(short).recorder.rows("roles"):
        if event == "assigned" and time_s > 0.0 and role != "Cartographer":
            times_s.setdefault(vehicle, time_s)
    return times_s


def test_in_a_large_fleet_some_begin_before_all_is_said(taken_s: dict[str, float]) -> None:
    """Ten vehicles with work need more than one packet: the first begin after one frame, all within five.

    It fails if a plan is one block in fragments: then all would begin at once, when the last fragment is heard.
    """
    assert min(taken_s.values()) == pytest.approx(FRAME_S, abs=0.1)
    assert 2.0 * FRAME_S < max(taken_s.values()) < 5.5 * FRAME_S


def test_who_is_expected_to_end_last_is_told_first(taken_s: dict[str, float]) -> None:
    """AUV14 has the largest patch (250 by 100 m), farthest from the start."""
    assert taken_s["AUV14"] == min(taken_s.values())


def test_who_has_no_work_is_told_of_no_roles(taken_s: dict[str, float]) -> None:
    """Thirteen patches go to ten vehicles at most, if three take two; AUV00 to AUV14 are fifteen."""
    assert len(taken_s) < 15
