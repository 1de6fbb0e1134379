"""Who founds the groups."""

from samples import GROUPS, LEADER, WORKER, auv, database

from remoras.strategies.founding import founded


def test_founding_roles_go_to_those_with_the_most_energy() -> None:
    fleet = database(
        auv("AUV00", playable_roles=LEADER, energy_j=1.0e6),
        auv("AUV01", playable_roles=LEADER, energy_j=2.0e6),
        auv("AUV02", playable_roles=WORKER),
        auv("AUV03", playable_roles=WORKER),
    )
    formed = founded(fleet, GROUPS)
    assert formed.members("Coordination", "Tactician") == ("AUV01",)
    assert formed.members("Operational", "Coordinator") == ("AUV01",)  # played by the Tactician
    assert formed.members("Operational", "Performer") == ("AUV02", "AUV03")  # as many as are able
    assert formed.members("Operational", "Cartographer") == ()  # allocated during the mission


def test_of_equals_the_lower_node_founds() -> None:
    fleet = database(*(auv(name, playable_roles=LEADER) for name in ("AUV02", "AUV00", "AUV01")))
    assert founded(fleet, GROUPS).members("Coordination") == ("AUV00",)


def test_a_head_has_the_social_layer() -> None:
    """REMORAS IV.B: at least one vehicle per group must have it, and it is the one that leads."""
    fleet = database(auv("AUV00", playable_roles=LEADER, social_layer=False), auv("AUV01", playable_roles=WORKER))
    formed = founded(fleet, GROUPS)
    assert formed.members("Coordination", "Tactician") == ("AUV00",)
    assert formed.heads("Operational") == ()
