"""Groups formed, dissolved and formed again during a mission: on detections, under losses, with authority only.

`mapping-inspection` is `mapping-rendezvous` with features of the seabed, and the group Inspectors. The head of the
operational group forms it once something is found. AUV00 is that head; AUV01 and AUV02 are Performers.
"""

import random
from typing import Any

import pytest
from recorded import flown
from resting import fleet_at_rest, named, stated

from missions.runs.run import Run
from remoras.fleet.vehicle import Vehicle
from remoras.organisation import Organisation
from worldmodel import Block, merge

INSPECTION, GROUP = "mapping-inspection", "Inspectors"


def changes(finished: Run, viewer: str) -> list[tuple[float, str]]:
    """Time and event of each formation and dissolution of the group, in the view of one vehicle."""
    rows = [row for row in finished.recorder.organisation if row[1] == viewer and row[3] == GROUP]
    return [(row[0], row[5]) for row in rows if row[5] in ("formed", "dissolved")]


# What was found decides --------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("strategy", "per"), [("remoras", 0.4), ("cbba", 0.4)])
def test_a_group_is_formed_on_a_detection_and_dissolved_after_inspection(strategy: str, per: float) -> None:
    finished = flown(INSPECTION, "finds.number=2", f"strategy.name={strategy}", f"channel.per={per}")
    assert finished.completed, finished.reason
    found_s = [one.time_s for one in finished.milestones if one.name == "found"]
    inspected_s = [one.time_s for one in finished.milestones if one.name == "inspected"]
    assert len(inspected_s) == 2
    for viewer in ("AUV00", "AUV01", "AUV02"):
        times_s, events = zip(*changes(finished, viewer), strict=True)
        assert events == ("formed", "dissolved") * (len(events) // 2)
        assert times_s[0] > min(found_s)
        assert times_s[-1] > max(inspected_s)
    assert not finished.setup.agreement.organisation.members(GROUP)
    members = {row[2] for row in finished.recorder.organisation if row[3] == GROUP and row[5] == "assigned"}
    assert members <= {"AUV00", "AUV01", "AUV02"}


# Who may -----------------------------------------------------------------------------------------


def form(head: str, number: int) -> tuple[tuple[str, str, Any], ...]:
    return (GROUP, "formedUnder", head), (GROUP, "formation", number)


def takes_in(vehicle: Vehicle, block: Block, now_s: float) -> None:
    vehicle.consider(merge(vehicle.beliefs.model, [block]).changes, now_s)


@pytest.mark.parametrize("issuer", ["AUV02", "ASV00"])
def test_only_a_leader_of_the_group_or_its_supervisor_dissolves_it(issuer: str) -> None:
    with fleet_at_rest(scenario=INSPECTION) as forger, fleet_at_rest(scenario=INSPECTION) as others:
        vehicle = named(others, "AUV00")
        formed = stated(named(forger, "AUV00"), *form("AUV01", 1))
        for block in (formed, stated(named(forger, issuer), (GROUP, "dissolved", 1), now_s=2.0)):
            takes_in(vehicle, block, 3.0)
            vehicle._take_effect(3.0)
        assert vehicle.social.organisation.heads(GROUP) == ("AUV01",)
        assert others.recorder.organisation[-1][5:7] == ("refused", issuer)


# Whatever is heard first -------------------------------------------------------------------------


def history() -> list[tuple[str, tuple[tuple[str, str, Any], ...]]]:
    """Formed under AUV01, who recruits AUV02; dissolved; formed anew under AUV02, who recruits AUV00."""
    member = f"{GROUP}.InspectionMember"
    return [
        ("AUV00", form("AUV01", 1)),
        ("AUV00", ((GROUP, "hasMission", "Inspection"),)),
        ("AUV01", (("AUV02", "playsRole", member),)),
        ("AUV00", ((GROUP, "dissolved", 1),)),
        ("AUV00", form("AUV02", 2)),
        ("AUV02", (("AUV00", "playsRole", member),)),
        ("AUV00", ((GROUP, "hasMission", "Inspection"),)),
    ]


def view_after(order: list[int], rounds: int) -> tuple[Organisation, dict[str, tuple[str, ...]]]:
    with fleet_at_rest(scenario=INSPECTION) as by, fleet_at_rest(scenario=INSPECTION) as others:
        blocks = [stated(named(by, issuer), *facts, now_s=1.0 + n) for n, (issuer, facts) in enumerate(history())]
        vehicle = named(others, "ASV00")
        for n, index in enumerate(order):
            takes_in(vehicle, blocks[index], 10.0 + n)
            if n % rounds == rounds - 1:
                vehicle._take_effect(10.0 + n)
        vehicle._take_effect(30.0)
        return vehicle.social.organisation, dict(vehicle.social.missions)


def test_forming_and_dissolving_commute_in_any_reception_order() -> None:
    organisation, given = expected = view_after(list(range(7)), 1)
    assert organisation.heads(GROUP) == ("AUV02",)
    assert organisation.members(GROUP) == ("AUV00", "AUV02")
    assert given[GROUP] == ("Inspection",)
    drawn = random.Random(7)
    for _ in range(12):
        order = drawn.sample(range(7), 7)
        assert view_after(order, drawn.choice([1, 2, 7])) == expected, order
