"""Forged organisational acts are refused by every vehicle of a fleet and leave no trace.

The facts are put into a world model as if they had been heard, at time 1, before anybody has said anything. The fleet
is that of `mapping-rendezvous`: ASV00 is MissionAdministrator of the Coordination group, AUV00 its Tactician and
Coordinator of the Operational group, AUV01 and AUV02 are Performers. Here AUV02 has no social layer.
"""

from contextlib import AbstractContextManager
from typing import Any

import pytest
from resting import Said, fleet_at_rest, miss, named, stated

from remoras.authority import Authority
from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from remoras.organisation import Organisation, Outcome
from remoras.strategies import strategies
from worldmodel import merge

RECRUITING = [name for name, one in strategies().items() if Authority.RECRUIT in one.declaration.authorities]
TAKING = [name for name, one in strategies().items() if Authority.TAKE in one.declaration.authorities]
PLAIN = "vehicle.AUV02.social_layer=false"
NARROW = "vehicle.AUV02.playable_roles=['Performer','Cartographer','RightWinger']"


def fleet_of(strategy: str, *settings: str, scenario: str = "mapping-rendezvous") -> AbstractContextManager[Fleet]:
    given = {one.partition("=")[0]: one for one in (PLAIN, NARROW, f"strategy.name='{strategy}'", *settings)}
    return fleet_at_rest(*given.values(), scenario=scenario)


def state(vehicle: Vehicle) -> tuple[Any, ...]:
    social = vehicle.social
    return (
        social.organisation,
        social.present,
        dict(social.objectives),
        dict(social.missions),
        bool(social.planner.due),
        social.takes_no_jobs,
        social.objectives_of(vehicle.name),
        [group for group in social.organisation.groups if social.leads(group)],
    )


def refused_by_all(strategy: str, issuer: str, *facts: Said, settings: tuple[str, ...] = (), **of: str) -> set[str]:
    """Every vehicle refuses the facts and is as before; the outcomes that its rows name."""
    outcomes = []
    with fleet_of(strategy, *settings, **of) as forger, fleet_of(strategy, *settings, **of) as fleet:
        block = stated(named(forger, issuer), *facts)  # by its copy in another fleet
        for vehicle in fleet.vehicles:
            before = state(vehicle)
            n_rows, n_faults = len(fleet.recorder.organisation), len(fleet.recorder.faults)
            changes = merge(vehicle.beliefs.model, [block]).changes
            assert changes, "it was not heard"
            vehicle.consider(changes, 1.0)
            vehicle._take_effect(2.0)
            assert state(vehicle) == before, f"it left a trace at {vehicle.name}"
            rows = [row for row in fleet.recorder.organisation[n_rows:] if row[1] == vehicle.name]
            assert rows, f"{vehicle.name} wrote no row"
            assert {(row[5], row[6]) for row in rows} == {("refused", issuer)}
            faults = fleet.recorder.faults[n_faults:]
            assert [row[1:3] for row in faults] == [(vehicle.name, "refused assignment")] * len(rows)
            outcomes += [row[-1] for row in rows]
    return set(outcomes)


EVICT = ("AUV00", "leftRole", "Operational.Coordinator")
FORGED: dict[str, tuple[str, Said, Outcome]] = {
    "evict the head": ("AUV01", EVICT, Outcome.NO_AUTHORITY),
    "promote oneself": ("AUV01", ("AUV01", "playsRole", "Operational.Coordinator"), Outcome.NO_AUTHORITY),
    "give an objective": (
        "AUV01", ("Operational.Performer", "objectiveRendezVous", "coordination rally"), Outcome.NO_AUTHORITY
    ),
    "give a mission": ("AUV01", ("Operational", "hasMission", "AreaMapping"), Outcome.NO_AUTHORITY),
    "unable": ("AUV00", ("AUV02", "playsRole", "Operational.LeftWinger"), Outcome.UNABLE),
    "assign from outside": ("ASV00", ("AUV01", "playsRole", "Operational.LeftWinger"), Outcome.OUTSIDE),
    "mission without social layer": (
        "AUV02", ("Operational", "hasMission", "AreaMapping"), Outcome.NO_SOCIAL_LAYER,
    ),
}  # fmt: skip


@pytest.mark.parametrize("act", FORGED)
def test_every_forged_act_is_refused_by_all(act: str) -> None:
    """Under a strategy that lets its members do most."""
    issuer, fact, outcome = FORGED[act]
    assert refused_by_all("contract-net", issuer, fact) == {outcome.value}


GROUP, MEMBER = "Inspectors", "Inspectors.InspectionMember"
"""The head of the operational group may form the inspectors, and a role of them."""
FORMATION = (GROUP, "formation", 1)
FORMATIONS: dict[str, tuple[str, tuple[Said, ...], Outcome]] = {
    "form": ("AUV01", ((GROUP, "formedUnder", "AUV01"), FORMATION), Outcome.NO_AUTHORITY),
    "form under somebody unable": ("AUV00", ((GROUP, "formedUnder", "AUV02"), FORMATION), Outcome.UNABLE),
    "form without a number": ("AUV00", ((GROUP, "formedUnder", "AUV01"),), Outcome.NO_AUTHORITY),
    "dissolve what is not there": ("AUV01", ((GROUP, "dissolved", 1),), Outcome.NOT_GROUP),
    "take a role of what is not there": ("AUV01", (("AUV01", "playsRole", MEMBER),), Outcome.NOT_GROUP),
}


@pytest.mark.parametrize("act", FORMATIONS)
def test_every_forged_formation_is_refused_by_all(act: str) -> None:
    issuer, facts, outcome = FORMATIONS[act]
    assert refused_by_all("remoras", issuer, *facts, scenario="mapping-inspection") == {outcome.value}


@pytest.mark.parametrize("strategy", [*RECRUITING, *TAKING])
def test_a_vehicle_without_social_layer_takes_no_part_in_allocation(strategy: str) -> None:
    taken = ("AUV02", "playsRole", "Operational.RightWinger")
    assert refused_by_all(strategy, "AUV02", taken) == {Outcome.NO_SOCIAL_LAYER.value}
    assert refused_by_all(strategy, "AUV01", taken) == {Outcome.NO_AUTHORITY.value}


SUCCEEDED = ("group.Operational.succession=['Performer']",)
UNABLE = ("vehicle.AUV01.playable_roles=['Performer','LeftWinger']",)


@pytest.mark.parametrize(
    ("settings", "head", "term", "outcome"),
    [
        (SUCCEEDED, "AUV00", 1, Outcome.NO_AUTHORITY),  # claimed for another
        (UNABLE, "AUV01", 1, Outcome.UNABLE),
        (SUCCEEDED, "AUV01", 1, Outcome.HEAD_PRESENT),  # the lead stays where it is
        (SUCCEEDED, "AUV01", 64, Outcome.HEAD_PRESENT),
        (SUCCEEDED, "AUV01", 65, Outcome.TERM_LEAPS),
    ],
)
def test_an_invalid_leadership_claim_is_refused_by_all(settings, head, term, outcome) -> None:
    claim = (("Operational", "headedBy", head), ("Operational", "headTerm", term))
    assert refused_by_all("remoras", "AUV01", *claim, settings=settings) == {outcome.value}


# Whoever leads when it says so -------------------------------------------------------------------

ORDER = ("AUV02", "playsRole", "Operational.RightWinger")
CLAIM = (("Operational", "headedBy", "AUV01"), ("Operational", "headTerm", 1))


def heard(issuer: str, claim_s: float, order_s: float, claim_first: bool) -> Organisation:
    """Knowledge of ASV00 after a claim of AUV01 and an order of ``issuer``, received in two rounds.

    Args:
        claim_s, order_s: when they were stated.
        claim_first: the claim is heard first.
    """
    with fleet_of("central", *SUCCEEDED) as said, fleet_of("central", *SUCCEEDED) as fleet:
        blocks = [
            stated(named(said, name), *facts, now_s=at_s)
            for name, facts, at_s in (("AUV01", CLAIM, claim_s), (issuer, (ORDER,), order_s))
        ]
        vehicle = named(fleet, "ASV00")
        miss(vehicle, "AUV00")
        for number, block in enumerate(blocks if claim_first else blocks[::-1]):
            vehicle.consider(merge(vehicle.beliefs.model, [block]).changes, 10.0 + number)
            vehicle._take_effect(10.0 + number)
        return vehicle.social.organisation


@pytest.mark.parametrize("claim_first", [True, False])
@pytest.mark.parametrize(
    ("issuer", "claim_s", "order_s", "counts"),
    [
        ("AUV01", 1.0, 2.0, True),  # it leads
        ("AUV01", 2.0, 1.0, False),  # it did not lead yet
        ("AUV00", 2.0, 1.0, True),  # it still led
        ("AUV00", 1.0, 2.0, False),  # it leads no longer, whether that is heard first or not
    ],
)
def test_an_order_is_valid_if_its_issuer_led_when_it_was_given(issuer, claim_s, order_s, counts, claim_first) -> None:
    organisation = heard(issuer, claim_s, order_s, claim_first)
    assert organisation.heads("Operational") == ("AUV01",)
    assert organisation.plays("AUV02", "Operational", "RightWinger") is counts
