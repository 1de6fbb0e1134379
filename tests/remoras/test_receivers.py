"""Receivers: a plan in parts, so that each vehicle may begin before it has heard the rest."""

from __future__ import annotations

from remoras.activities import Objective
from remoras.beliefs import Beliefs
from remoras.social.orders import by_receiver
from remoras.social.view import Requests
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
