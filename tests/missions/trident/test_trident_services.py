"""Matching: by what the world model concludes, of what services say of themselves."""

from typing import Any

import pytest
from intervening import module, tables

from missions.scenarios.parts import database_of
from missions.trident.conclusions import WithMembers
from missions.trident.mission import TridentMission
from missions.trident.scenario import TridentScenario
from missions.trident.services import CHOOSE, FIND, FIX, HANDLE, HOLD, Matching
from remoras.beliefs import Beliefs
from remoras.organisation import Organisation
from worldmodel import Instance, WorldModel, core_ontology_paths, read_tbox

TBOX = read_tbox(*core_ontology_paths(), *TridentMission.vocabulary)
BOTH = frozenset({"ASV00", "IAUV00"})


def scenario(**keys: Any) -> TridentScenario:
    raw = tables()
    raw["mission"] |= keys
    return TridentScenario.model_validate(raw)


class Known:
    """Services of the shipped scenario, and a world model to which they may say something."""

    def __init__(self, **keys: Any) -> None:
        of = scenario(**keys)
        self.matching = Matching.of(of, database_of(of, TridentMission).values())
        named = [("ASV", "ASV00"), ("AUV", "IAUV00")]
        named += [(one.settings.capability, name) for name, one in self.matching.services.items()]
        instances = [Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named)]
        self.beliefs = Beliefs(WorldModel(TBOX, 0, instances, n_origins=2))
        self.facts = WithMembers(self.beliefs, Organisation({}, frozenset()))
        self._now_s = 0.0
        for name, one in self.matching.services.items():
            self.say(name, "providedBy", one.vehicle)
            self.say(name, "serviceStatus", "available")

    def say(self, subject: str, attribute: str, value: Any) -> None:
        self._now_s += 1.0
        self.beliefs.record([self.beliefs.fact(subject, attribute, value)], self._now_s, False)

    def ways(self, activity: str, me: str = "IAUV00", there: frozenset[str] = BOTH) -> tuple[str, ...]:
        return self.matching.ways(activity, me, self.facts, there)

    def block(self, name: str, me: str, there: frozenset[str] = BOTH) -> tuple[str, ...]:
        return self.matching.for_block(me, name, self.facts, there)


def test_a_service_of_a_class_below_the_one_asked_for_fits() -> None:
    """Stereo survey is optical survey is seabed survey; an own service stands before a cheaper one elsewhere."""
    assert Known().block("east", "IAUV00") == ("IAUV00 stereo", "IAUV00 sidescan", "ASV00 multibeam")
    assert Known().block("east", "ASV00") == ("ASV00 multibeam", "IAUV00 stereo", "IAUV00 sidescan")


def test_a_service_fits_a_defined_class_by_what_is_said_of_it() -> None:
    """Reacquisition is imaging by a vehicle under water: nobody advertises it, and who provides it decides."""
    known = Known()
    assert known.ways(FIND) == ("IAUV00 camera", "IAUV00 forward sonar")
    known.say("IAUV00 camera", "providedBy", "ASV00")
    assert known.ways(FIND) == ("IAUV00 forward sonar",)


def test_without_inference_only_what_is_called_alike_fits() -> None:
    known = Known(inference=False)
    assert [known.ways(one) for one in (FIND, FIX, HOLD, HANDLE, CHOOSE)] == [()] * 5
    assert known.block("east", "IAUV00") == ()


def test_without_inference_a_service_that_is_called_alike_does_fit() -> None:
    raw = tables()
    raw["mission"]["inference"] = False
    module(raw, "IAUV00 arm")["capability"] = "Manipulation"
    of = TridentScenario.model_validate(raw)
    matching, known = Matching.of(of, database_of(of, TridentMission).values()), Known()
    assert matching.ways(HANDLE, "IAUV00", known.facts, BOTH) == ("IAUV00 arm",)
    known.say("IAUV00 arm", "serviceStatus", "failed")
    assert matching.ways(HANDLE, "IAUV00", known.facts, BOTH) == ()


def test_a_service_that_says_it_failed_is_not_available_and_is_again_when_it_says_so() -> None:
    known = Known()
    known.say("IAUV00 arm", "serviceStatus", "failed")
    assert known.ways(HANDLE) == ("IAUV00 gripper",)
    known.say("IAUV00 arm", "serviceStatus", "available")
    assert known.ways(HANDLE) == ("IAUV00 arm", "IAUV00 gripper")


def test_the_choice_and_the_fix_go_over_to_the_other_vehicle() -> None:
    known = Known()
    assert known.ways(CHOOSE)[0] == known.ways(CHOOSE, "ASV00")[0] == "ASV00 console"
    known.say("ASV00 console", "serviceStatus", "failed")
    assert known.ways(CHOOSE) == known.ways(CHOOSE, "ASV00") == ("IAUV00 recogniser",)
    assert known.ways(FIX)[0] == "ASV00 usbl"
    known.say("ASV00 usbl", "serviceStatus", "failed")
    assert known.ways(FIX) == ("IAUV00 ranging",)


def test_services_of_who_is_not_there_do_not_count() -> None:
    assert Known().ways(CHOOSE, there=frozenset({"IAUV00"})) == ("IAUV00 recogniser",)


def test_what_has_to_be_on_board_is_of_the_own_vehicle() -> None:
    assert Known().ways(HOLD, "ASV00") == ()


@pytest.mark.parametrize(
    ("response", "found"),
    [("fixed", ("IAUV00 arm",)), ("repair", ("IAUV00 arm", "IAUV00 gripper"))],
)
def test_a_plan_has_the_services_that_it_lists_whatever_they_say(response: str, found: tuple[str, ...]) -> None:
    known = Known(response=response)
    known.say("IAUV00 arm", "serviceStatus", "failed")
    assert known.ways(HANDLE) == found


def test_every_service_is_of_the_class_that_its_activity_asks_for() -> None:
    """What the plan lists is what matching finds, but for what is on the other vehicle or was not thought of."""
    listed, matched = Known(response="repair"), Known()
    for activity in (FIX, FIND, HOLD, HANDLE, CHOOSE):
        assert set(listed.ways(activity)) <= set(matched.ways(activity))
