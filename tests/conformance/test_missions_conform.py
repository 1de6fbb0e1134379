"""Shipped missions and one of visits conform, and the check finds a mission that breaks a rule."""

from pathlib import Path

import nonconforming_missions as broken
import pytest
from visiting_mission import VisitingMission, visiting_scenario

from missions.arrows import ArrowsMission
from missions.fieldwork import EscortMission, FerryMission, RecoveryMission, ResupplyMission
from missions.mapping import MappingMission
from missions.minehunting import MinehuntingMission
from missions.pandora import PandoraMission
from missions.scenarios import load
from remoras.mission import Mission
from remoras.testing import missions as conformance
from tests.missions.small_mission import SMALL

SHORT = ("scenario.duration_s=600.0",)
SERVICE = ("fault=[]", "current.surge=[]", "chain=[]", "anode=[]", "scenario.duration_s=900.0")


@pytest.mark.slow
def test_the_mission_of_visits_conforms() -> None:
    conformance.check(VisitingMission, visiting_scenario(0.3))


@pytest.mark.slow
def test_the_mapping_mission_conforms(tmp_path: Path) -> None:
    """A whole mission."""
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    conformance.check(MappingMission, load(str(file)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mission", "name", "keys"),
    [
        (MappingMission, "mapping-rendezvous", SHORT),
        (PandoraMission, "pandora-inspection", SERVICE),
        (ArrowsMission, "arrows-archaeology", ("mission.search_s=200.0", "scenario.duration_s=500.0")),
        pytest.param(RecoveryMission, "recovery-field", SHORT, marks=pytest.mark.thorough),  # they share code with the
        pytest.param(FerryMission, "ferry-passage", SHORT, marks=pytest.mark.thorough),  # one that brings energy
        pytest.param(EscortMission, "escort-lines", SHORT, marks=pytest.mark.thorough),
        (ResupplyMission, "resupply-field", SHORT),
        (MinehuntingMission, "minehunting-contacts", SHORT),
    ],
)
def test_shipped_missions_conform(mission: type[Mission], name: str, keys: tuple[str, ...]) -> None:
    conformance.check(mission, load(name, [("--set", key) for key in keys]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mission", "says"),
    [
        (broken.Partial, "lacks .*behaviour_for.* of remoras.mission.Mission"),
        (broken.Wordless, "the ontology has no attribute objectiveDaydreaming"),
        (broken.Misdirected, "Team is a Group, not a RallyPoint"),
        (broken.TooMuch, "job 'the moon': nobody"),
        (broken.Helpless, "activity Homing of .*: behaviour_for returned None"),
        (broken.Idle, "RendezVous.*no vehicle has an activity for it"),
        (broken.Overexcited, "activity Homing of .*: moment 0: perceive returned 1.0"),
        (broken.Remembering, "a run changes the mission.*: mission.n_asked"),
        (broken.Individual, "two missions of one scenario that differ"),
        (broken.Meddling, "truth changes what vehicles do"),
        (broken.Speechless, "truth does not say why"),
        (broken.Boundless, "metric luck.*finite"),
        (broken.Careless, "does not fit its columns"),
        (broken.ByHash, "depend on the order of a set"),
    ],
    ids=lambda value: value.__name__ if isinstance(value, type) else "",
)
def test_a_mission_that_breaks_a_rule_is_found_out(mission: type[Mission], says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        conformance.check(mission, visiting_scenario(0.0))
