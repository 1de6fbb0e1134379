"""Shipped missions and one of visits conform, and the check detects a mission that breaks a rule."""

import nonconforming_missions as broken
import pytest
from visiting_mission import VisitingMission, visiting_scenario

from missions.arrows import ArrowsMission
from missions.fieldwork import EscortMission, FerryMission, RecoveryMission, ResupplyMission
from missions.mapping import MappingMission
from missions.minehunting import MinehuntingMission
from missions.pandora import PandoraMission
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.trident import TridentMission
from remoras.mission import Mission
from remoras.testing import missions as conformance

SHORT = "scenario.duration_s=200.0"
SHIPPED: dict[str, tuple[type[Mission], tuple[str, ...]]] = {
    "mapping-rendezvous": (MappingMission, ()),
    "pandora-inspection": (PandoraMission, ("fault=[]", "current.surge=[]", "chain=[]", "anode=[]")),
    "arrows-archaeology": (ArrowsMission, ("mission.search_s=150.0",)),
    "trident-intervention": (TridentMission, ()),
    "minehunting-contacts": (MinehuntingMission, ()),
    "resupply-field": (ResupplyMission, ()),
    "recovery-field": (RecoveryMission, ()),
    "ferry-passage": (FerryMission, ()),
    "escort-lines": (EscortMission, ()),
}


@pytest.mark.slow
def test_the_mission_of_visits_conforms() -> None:
    """A whole mission."""
    conformance.check(VisitingMission, visiting_scenario(0.3))


FURTHER = ("resupply-field", "ferry-passage", "escort-lines", "minehunting-contacts")
"""Missions that share their code with the recovery, which is quickest, and the longest mission."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.thorough) if name in FURTHER else name for name in SHIPPED]
)
def test_shipped_missions_conform(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other processes give the digests of tests/reference, of all missions."""
    monkeypatch.setattr(conformance, "check_free_of_hashes", lambda scenario: None)
    mission, keys = SHIPPED[name]
    conformance.check(mission, load(name, [("--set", key) for key in (SHORT, *keys)]))


def test_words_and_activities_of_finds_conform() -> None:
    """No plan assigns an inspection, so it needs no word; it has no activity before a find is known."""
    setup = resolved(load("mapping-inspection"))
    conformance.check_words(setup)
    assert conformance.check_activities(setup)[1] == ["Inspecting"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mission", "says"),
    [
        (broken.Partial, "lacks .*behaviour_for.* of remoras.mission.Mission"),
        (broken.Wordless, "the ontology has no attribute objectiveDaydreaming"),
        (broken.Misdirected, "Team is a Group, not a RallyPoint"),
        (broken.TooMuch, "job 'the moon': no vehicle"),
        (broken.Helpless, "activity Homing of .*: behaviour_for returned None"),
        (broken.Idle, "RendezVous.*no vehicle has an activity for it"),
        (broken.Overexcited, "activity Homing of .*: moment 0: perceive returned 1.0"),
        (broken.Partisan, "activity Homing of .*: moment 0: perceive returned 1.0"),
        (broken.Remembering, "a run changes the mission.*: mission.n_asked"),
        (broken.Individual, "two missions of one scenario that differ"),
        (broken.Meddling, "truth changes what vehicles do"),
        (broken.Speechless, "truth has no reason"),
        (broken.Boundless, "metric luck.*finite"),
        (broken.Careless, "does not fit its columns"),
        (broken.ByHash, "depend on the order of a set"),
    ],
    ids=lambda value: value.__name__ if isinstance(value, type) else "",
)
def test_a_mission_that_breaks_a_rule_is_detected(
    mission: type[Mission], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if mission is not broken.ByHash:  # runs in other processes take long
        monkeypatch.setattr(conformance, "check_free_of_hashes", lambda scenario: None)
    with pytest.raises(AssertionError, match=says):
        conformance.check(mission, visiting_scenario(0.0))
