"""What a scenario says of world models: rules that name nothing are refused, and others act on every vehicle."""

from typing import Any

import pytest

from missions.errors import ConfigurationError
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from worldmodel import WorldModel

RULE = "worldmodel.prune=[{class='Area',attribute='mappedCell',older_than_s=60}]"


def models(*settings: str) -> dict[str, WorldModel]:
    """What the vehicles know after ten minutes in which every third packet is lost."""
    loaded = load("mapping-rendezvous", [("--set", one) for one in ("channel.per=0.3", *settings)])
    fleet = assemble(resolved(loaded), 3)
    while fleet.running and fleet.now_s < 600.0:
        fleet.step()
    return {vehicle.name: vehicle.beliefs.model for vehicle in fleet.vehicles}


def test_a_fleet_that_prunes_holds_less_and_knows_the_same() -> None:
    kept, pruned = models(), models(RULE)
    assert {name: model.state_hash() for name, model in pruned.items()} == {
        name: model.state_hash() for name, model in kept.items()
    }
    for name, model in pruned.items():
        slots = [(uid, a.uid) for uid in range(model.n_uids) for a in model.tbox.attributes]
        assert model.digest() == kept[name].digest()
        assert [model.latest(*slot) for slot in slots] == [kept[name].latest(*slot) for slot in slots]
    n_kept, n_pruned = (sum(1 for m in of.values() for _ in m.blocks()) for of in (kept, pruned))
    assert n_pruned < n_kept / 4
    assert n_kept - n_pruned == sum(count for model in pruned.values() for _, count in model.pruned())


def test_how_long_and_how_many_blocks_wait_is_said_to_every_vehicle() -> None:
    loaded = load("mapping-rendezvous", [("--set", "worldmodel={waiting_s=30.0, waiting_blocks=5}")])
    for vehicle in assemble(resolved(loaded), 1).vehicles:
        arrivals = vehicle.beliefs.model.arrivals
        assert (arrivals.waiting_s, arrivals.waiting_blocks) == (30.0, 5)


@pytest.mark.parametrize(
    ("rule", "reason"),
    [
        ({"class": "Vehikel"}, r"prune\.1\.class\) = \"Vehikel\": allowed: Thing.*did you mean 'Vehicle'"),
        ({"attribute": "position"}, r"prune\.1\.attribute\) = \"position\": allowed: areaDone"),  # a status
        ({"attribute": "type"}, r"prune\.1\.attribute\) = \"type\""),
        ({"older_than_s": -1.0}, r"prune\.1\.older_than_s\) = -1"),
        ({"older": 1.0}, r"prune\.1\.older\) = 1.*unknown key, allowed here: class, attribute"),
    ],
)
def test_rules_that_name_nothing_are_refused(rule: dict[str, Any], reason: str) -> None:
    given = {"class": "Vehicle", "attribute": "playsRole", "older_than_s": 60.0} | rule
    text = ", ".join(f"{key} = {value!r}" for key, value in given.items())
    with pytest.raises(ConfigurationError, match=reason):
        load("mapping-rendezvous", [("--set", f"worldmodel.prune=[{{{text}}}]")])


@pytest.mark.parametrize("setting", ["worldmodel.waiting_s=0", "worldmodel.waiting_blocks=0", "worldmodel.waits=1"])
def test_bounds_that_cannot_be_are_refused(setting: str) -> None:
    with pytest.raises(ConfigurationError, match=r"worldmodel\.wait"):
        load("mapping-rendezvous", [("--set", setting)])
