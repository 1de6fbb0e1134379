"""The executive layer: satisfaction, influence signals, and the choice of activities."""

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import activity_set

from remoras.activities import ActivityKind, ActivitySet, ActivityType
from remoras.behaviours import ADVANCING, DUE, IDLE, STANDING, Perception
from remoras.executive.decision import DecisionConstants
from remoras.executive.layer import ExecutiveLayer
from remoras.motion.attraction import Pulls

CARTOGRAPHER, PERFORMER = ("Operational", "Cartographer"), ("Operational", "Performer")
ROLES = (CARTOGRAPHER, PERFORMER)
CONSTANTS = DecisionConstants(
    weight_continuing=0.2,
    weight_external=1.0,
    gain_per_s=1.0,
    tedium_per_s=-1.3,
    dismay_per_s=-2.0,
    fade_per_s=0.5,
    signal_memory_s=60.0,
)
"""What the figures below are worked out from, whatever the defaults are."""

EXPLORING = activity_set(("ZigzagExploring", ActivityType.GUIDANCE), importance=0.6, kind=ActivityKind.INDIVIDUAL)
HOMING = activity_set(("Homing", ActivityType.GUIDANCE), importance=0.3, role="Performer")
MAPPING = activity_set(
    ("Mapping", ActivityType.PRODUCTIVE),
    importance=0.6,
    kind=ActivityKind.INDIVIDUAL,
    needs="ZigzagExploring",
    sensors=("swath",),
)
EVADING = activity_set(("Evading", ActivityType.GUIDANCE), importance=4.0, role=None, kind=ActivityKind.VITAL)
LISTENING = activity_set(("Listening", ActivityType.PRODUCTIVE), importance=0.2, role="Performer", sensors=("sonar",))


def layer(*sets: ActivitySet, constants: DecisionConstants = CONSTANTS) -> ExecutiveLayer:
    executive = ExecutiveLayer(constants)
    executive.adopt(sets, ROLES)
    return executive


def chosen(executive: ExecutiveLayer) -> set[str]:
    return {executive.sets[index].name for index in executive.decision.chosen}


weights = st.floats(0.0, 1e6)


@given(weights, weights, st.floats(1e-6, 1.0), st.floats(0.01, 100.0), st.integers(-128, 127))
def test_vital_activities_come_first_whatever_the_weights(continuing, external, stimulus, importance, satisfaction):
    """Whatever is performed, called for and weighed: the faintest vital need guides, and one that is not vital is
    chosen only where it outweighs the others."""
    constants = DecisionConstants.model_construct(weight_continuing=continuing, weight_external=external)
    faint = activity_set(("Evading", ActivityType.GUIDANCE), importance=1e-3, role=None, kind=ActivityKind.VITAL)
    wanted = activity_set(("Homing", ActivityType.GUIDANCE), importance=importance, role="Performer")
    found = []
    for kind in (ActivityKind.VITAL, ActivityKind.INDIVIDUAL):
        executive = layer(replace(faint, kind=kind), wanted, constants=constants)
        executive.decide([IDLE, DUE], 0.0, 0.0)
        executive.satisfaction[PERFORMER] = float(satisfaction)
        executive.hear(PERFORMER, "AUV01", "Performer", -128, 0.0)
        executive.decide([Perception(stimulus), DUE], 0.0, 0.0)
        found.append(chosen(executive))
        assert executive.motivations[1] > executive.motivations[0]
    assert found == [{faint.name}, {wanted.name}]


@given(st.lists(st.tuples(*2 * [st.floats(-0.05, 0.05)]), min_size=20), st.floats(0.0, 127.0))
def test_noisy_stimuli_do_not_alternate_equal_activities(noise, satisfaction) -> None:
    """Of importance 1, by 5 % to both sides: they differ by 0.1 at most. Who is not dissatisfied goes on by as much."""
    assert len(turns(noise, satisfaction, weight_continuing=0.2 + 1e-9)) == 1


def turns(noise: Sequence[tuple[float, float]], satisfaction: float, weight_continuing: float) -> set[tuple[int, ...]]:
    """What a vehicle chooses of two equal activities whose stimuli tremble by ``noise``."""
    one = activity_set(("One", ActivityType.GUIDANCE), importance=1.0, role="Cartographer")
    other = activity_set(("Other", ActivityType.GUIDANCE), importance=1.0, role="Performer")
    executive = layer(one, other, constants=DecisionConstants(weight_continuing=weight_continuing))
    executive.satisfaction = dict.fromkeys(ROLES, satisfaction)
    taken = set()
    for trembles in noise:
        executive.decide([Perception(0.95 + by) for by in trembles], 0.0, 0.0)
        taken.add(executive.decision.chosen)
    return taken


def seen(stimuli: Sequence[float]) -> list[Perception]:
    return [Perception(stimulus, 0.5) for stimulus in stimuli]


@pytest.mark.parametrize("continuing", [0.0, 0.02, 0.2])
def test_stimuli_that_deviate_by_less_than_may_be_spared_change_no_decision(continuing: float) -> None:
    """One vehicle decides by all stimuli. The other knows each as it was until the change since may count."""
    spared, turns = zip(*(compared(random.Random(seed), continuing) for seed in range(40)), strict=True)
    assert sum(spared) > 4000
    assert sum(turns) > 4


def compared(draw: random.Random, continuing: float) -> tuple[int, int]:
    """Stimuli spared to the other vehicle, and changes of both decisions."""
    going = [activity_set((name, ActivityType.GUIDANCE), importance=0.8, role="Performer") for name in ("A", "B")]
    sets = (EXPLORING, replace(MAPPING, importance=1.0), *going, replace(LISTENING, importance=0.6))
    constants = CONSTANTS.model_copy(update={"weight_continuing": continuing})
    exact, sparing = layer(*sets, constants=constants), layer(*sets, constants=constants)
    stimuli = [draw.uniform(0.4, 1.0) for _ in sets]
    known, n_spared, taken = list(stimuli), 0, []

    def renewed() -> list[Perception]:
        known[:] = stimuli
        return seen(stimuli)

    for number in range(100):
        stimuli[:] = [min(1.0, max(0.05, stimulus + draw.uniform(-0.02, 0.02))) for stimulus in stimuli]
        stimuli[1] = 1.0  # as far as its need allows
        for index, (was, now) in enumerate(zip(known, stimuli, strict=True)):
            is_spared = abs(now - was) < sparing.spare(index)
            known[index], n_spared = was if is_spared else now, n_spared + is_spared
        exact.decide(seen(stimuli), 2.0 * number, 2.0)
        sparing.decide(seen(known), 2.0 * number, 2.0, renew=renewed)
        assert sparing.decision == exact.decision
        assert sparing.satisfaction == exact.satisfaction
        taken.append(exact.decision.chosen)
    return n_spared, sum(one != other for one, other in pairwise(taken))


# Calls --------------------------------------------------------------------------------------------


@given(st.floats(0.0, 0.99), st.floats(0.0, 1000.0), st.floats(0.0, 20.0))
def test_a_call_over_a_lossy_link_fades_by_expected_receptions(p_loss: float, age_s: float, receptions: float) -> None:
    """Frames last 60 / 8.5 s. A lossless link and no minimum leave the memory of 60 s."""
    constants = CONSTANTS.model_copy(update={"signal_memory_receptions": receptions})
    executive = layer(EXPLORING, HOMING, constants=constants)
    executive.hear(PERFORMER, "AUV00", "Coordinator", -128, 0.0, p_loss=p_loss)
    memory_s = max(60.0, receptions / (1.0 - p_loss) * 60.0 / 8.5)
    assert executive.calls(age_s) == pytest.approx({"AUV00": math.exp(-age_s / memory_s)})


def test_a_negative_signal_turns_a_vehicle_to_the_common_goal() -> None:
    """Performed and progressing, exploring has 0.6 + 0.2 (P + 128) / 255 = 0.7004 at P = 0. Homing has 0.3 and the
    call: it takes more than 0.4, a signal below -0.4 * 128 = -51.2."""
    executive = layer(EXPLORING, HOMING)
    executive.decide([DUE, DUE], 0.0, 0.0)
    executive.hear(PERFORMER, "AUV00", "Coordinator", -51, 0.0)
    executive.decide([DUE, DUE], 0.0, 0.0)
    assert executive.motivations == pytest.approx([0.6 + 0.2 * 128 / 255, 0.3 + 51 / 128])
    assert chosen(executive) == {"ZigzagExploring"}
    executive.hear(PERFORMER, "AUV00", "Coordinator", -52, 0.0)
    executive.decide([DUE, DUE], 0.0, 0.0)
    assert chosen(executive) == {"Homing"}


@given(st.lists(st.tuples(st.sampled_from(ROLES), st.sampled_from(["AUV01", "AUV02"]), st.integers(-128, 127))))
def test_individual_and_vital_activities_ignore_signals(calls: list[tuple[tuple[str, str], str, int]]) -> None:
    quiet, called = layer(EXPLORING, MAPPING, EVADING, HOMING), layer(EXPLORING, MAPPING, EVADING, HOMING)
    for addressed, emitter, value in calls:
        called.hear(addressed, emitter, "Coordinator", value, 0.0)
    perceptions = [ADVANCING, DUE, Perception(0.1), DUE]
    quiet.decide(perceptions, 1.0, 0.0)
    called.decide(perceptions, 1.0, 0.0)
    assert called.motivations[:3] == quiet.motivations[:3]
    assert called.motivations[3] >= quiet.motivations[3]


# Satisfaction -------------------------------------------------------------------------------------


def test_satisfaction_is_kept_per_role() -> None:
    """Ten seconds of progress as Cartographer at 1 a second; the Performer idles at 0."""
    executive = layer(EXPLORING, HOMING)
    for second in range(10):
        executive.decide([ADVANCING, DUE], float(second), 1.0)
    assert executive.satisfaction == {CARTOGRAPHER: 10.0, PERFORMER: 0.0}
    assert executive.signals() == [(CARTOGRAPHER, 10), (PERFORMER, 0)]


@pytest.mark.parametrize(
    ("one", "other", "rate"),
    [
        (ADVANCING, Perception(1.0, -1.0), 1.0),
        (ADVANCING, STANDING, 1.0),
        (STANDING, Perception(1.0, -1.0), -1.3),
        (Perception(1.0, -1.0), DUE, -2.0),
        (Perception(1.0, 0.5), STANDING, -0.15),  # half way between -1.3 and 1
        (STANDING, STANDING, -1.3),
        (DUE, STANDING, -1.3),
    ],
)
def test_progress_of_a_role_is_the_best_of_its_activities(one: Perception, other: Perception, rate: float) -> None:
    """What gets on best counts; the order of the activities does not."""
    for perceptions in ((one, other), (other, one)):
        executive = layer(HOMING, LISTENING)
        executive.decide(perceptions, 0.0, 1.0)
        assert chosen(executive) == {"Homing", "Listening"}
        assert executive.satisfaction[PERFORMER] == pytest.approx(rate)


def test_a_satisfied_vehicle_with_remaining_work_defers_a_call() -> None:
    """At 127 and with all of it left the loudest call is not heeded; with half the stimulus, 0.5 of it is."""
    executive = layer(EXPLORING, HOMING)
    for second in range(130):
        executive.decide([ADVANCING, DUE], float(second), 1.0)
    executive.hear(PERFORMER, "AUV00", "Coordinator", -128, 130.0)
    executive.decide([ADVANCING, DUE], 130.0, 0.0)
    assert executive.motivations[1] == pytest.approx(0.3)
    executive.decide([Perception(0.5, 1.0), DUE], 130.0, 0.0)
    assert executive.motivations[1] == pytest.approx(0.3 + 0.5)
    assert chosen(executive) == {"Homing"}


def test_a_call_without_effect_of_responding_is_ignored() -> None:
    executive = layer(EXPLORING, HOMING)
    executive.hear(PERFORMER, "AUV00", "Coordinator", -128, 0.0)
    executive.decide([DUE, Perception(1.0, answers=0.25)], 0.0, 0.0)
    assert executive.motivations[1] == pytest.approx(0.3 + 0.25)
    assert executive.calls(0.0) == {"AUV00": 1.0}


# Calls of holders of jobs -------------------------------------------------------------------------

LIFTER, INSPECTOR = ("Operational", "Lifter"), ("Operational", "Inspector")
LIFTING = activity_set(("Lifting", ActivityType.GUIDANCE), role="Lifter", kind=ActivityKind.INDIVIDUAL, importance=0.6)
HELPING = activity_set(("Helping", ActivityType.GUIDANCE), role="Performer", importance=0.2)


def worker(*sets: ActivitySet, name: str = "AUV05") -> ExecutiveLayer:
    """A vehicle that has a job, and is called by another one that has one."""
    executive = ExecutiveLayer(CONSTANTS.model_copy(update={"weight_external": 2.0}), name, {LIFTER, INSPECTOR})
    executive.adopt(sets, (PERFORMER, LIFTER))
    return executive


def helping(share: float, of: str = "AUV01") -> Perception:
    """Help that ends this share of the wait of one vehicle."""
    return Perception(1.0, ends=lambda caller, role: share if (caller, role) == (of, "Lifter") else 0.0)


def test_a_call_from_a_waiting_worker_draws_assistance_and_not_homing() -> None:
    """Homing settles all of a call, and matters more. Helping has 0.2 + 2 * 1.0 * 0.6 = 1.4."""
    executive = worker(HOMING, HELPING)
    executive.hear(PERFORMER, "AUV01", "Lifter", -128, 0.0)
    executive.decide([DUE, helping(0.6)], 0.0, 0.0)
    assert executive.motivations == pytest.approx([0.3, 1.4])
    assert chosen(executive) == {"Helping"}
    assert [one.source for one in executive.candidates(0.0)] == ["", "AUV01"]
    assert executive.pulls(0.0).answered == pytest.approx({"AUV01": 0.6})


@pytest.mark.parametrize(
    ("own", "heard", "emitter", "is_answered"),
    [
        (-60.0, -61, "AUV09", True),
        (-60.0, -59, "AUV01", False),
        (-60.0, -60, "AUV01", True),
        (-60.0, -60, "AUV09", False),
    ],
)
def test_a_waiting_vehicle_answers_louder_calls_only(own: float, heard: int, emitter: str, is_answered: bool) -> None:
    """Of two alike that of the first name is louder: else both would leave, and neither find the other."""
    executive = worker(LIFTING, HELPING)
    executive.satisfaction[LIFTER] = own
    executive.hear(PERFORMER, emitter, "Lifter", heard, 0.0)
    executive.decide([STANDING, helping(1.0, emitter)], 50.0, 0.0)
    assert (executive.motivations[1] > 0.2) == is_answered


# Calls for room -----------------------------------------------------------------------------------


def test_calls_on_two_roles_sharing_an_activity_do_not_alternate() -> None:
    """Each role is called in turn, so that the latest call is always on the one that is not performed."""
    as_cartographer = activity_set(("Homing", ActivityType.GUIDANCE), importance=0.3, role="Cartographer")
    executive = layer(HOMING, replace(as_cartographer, activities=HOMING.activities))
    performed = set()
    for number in range(40):
        now_s = 10.0 * number
        executive.hear(ROLES[number % 2], f"AUV0{number % 2}", "Performer", -128, now_s)
        performed.add(executive.decide([STANDING, STANDING], now_s, 2.0).chosen)
    assert len(performed) == 1
    assert executive.candidates(now_s)[0].external == executive.candidates(now_s)[1].external > 0.5


def test_signals_carry_the_source_of_the_call() -> None:
    """Own ones are even and made by who is hindered, odd ones are passed on and weaker by one."""
    executive = ExecutiveLayer(CONSTANTS, "AUV01", (), {PERFORMER: {PERFORMER}})
    executive.adopt([HOMING], [PERFORMER, CARTOGRAPHER])
    executive.decide([DUE], 0.0, 0.0)
    executive.satisfaction |= {PERFORMER: -77.0, CARTOGRAPHER: -77.0}
    assert executive.signals() == [(PERFORMER, 0), (CARTOGRAPHER, -77)]
    executive.is_hindered = True
    assert executive.signals() == [(PERFORMER, -78), (CARTOGRAPHER, -77)]
    executive.satisfaction[PERFORMER] = 40.0
    assert executive.signals()[0] == (PERFORMER, -32)  # it has called, and is hindered still
    executive.yields_to = 100 / 128
    assert executive.signals()[0] == (PERFORMER, -99)


@pytest.mark.parametrize(("updates_satisfy", "sign"), [(True, 1), (False, -1)])
def test_a_waiting_leader_calls_only_if_updates_do_not_satisfy(updates_satisfy: bool, sign: int) -> None:
    """It waits at the rally point, while information gathering progresses, which is perceived and not performed."""
    gathering = replace(
        HOMING, activities=(replace(HOMING.activities[0], name="Gathering", type=ActivityType.ORGANISATIONAL),)
    )
    executive = layer(HOMING, gathering, constants=CONSTANTS.model_copy(update={"updates_satisfy": updates_satisfy}))
    for number in range(10):
        executive.decide([STANDING, ADVANCING], 2.0 * number, 2.0)
    assert executive.decision.chosen == (0,)
    assert sign * dict(executive.signals())[PERFORMER] > 0


def test_a_role_without_a_job_calls_its_other_holders() -> None:
    executive = layer(HOMING)
    executive.hear(PERFORMER, "AUV01", "Performer", -128, 0.0)
    executive.decide([DUE], 0.0, 0.0)
    assert executive.pulls(0.0) == Pulls(0.0, {"AUV01": 1.0}, {})


def test_a_call_of_equal_rank_changes_guidance_and_no_activity() -> None:
    executive = ExecutiveLayer(CONSTANTS, "AUV01", {LIFTER}, {LIFTER: {LIFTER, INSPECTOR}})
    executive.adopt([LIFTING], [LIFTER])
    executive.hear(LIFTER, "AUV02", "Inspector", -100, 0.0)
    executive.hear(LIFTER, "AUV03", "Lifter", -99, 0.0)
    executive.decide([DUE], 0.0, 0.0)
    assert executive.motivations == [0.6]
    assert executive.pulls(0.0) == Pulls(0.0, {}, {"AUV02": 100 / 128}, {"AUV03": 99 / 128}, True)


# What pulls at guidance ---------------------------------------------------------------------------


def test_a_call_answered_by_the_guiding_activity_attracts() -> None:
    """AUV02 calls louder than AUV01: 128 and 64 of 128; nothing is heeded less than what outweighs the own content."""
    executive = layer(HOMING)
    executive.hear(PERFORMER, "AUV01", "Coordinator", -64, 0.0)
    executive.hear(PERFORMER, "AUV02", "Coordinator", -128, 0.0)
    executive.decide([DUE], 0.0, 0.0)
    assert executive.pulls(0.0) == Pulls(0.0, {"AUV02": 1.0}, {})


def test_only_a_remembered_call_of_equal_rank_repels() -> None:
    """-96 is three quarters of -128, at any age up to the memory of 60 s; the own call is -32, a quarter."""
    executive = ExecutiveLayer(CONSTANTS, "", (), {role: {role} for role in ROLES})
    executive.adopt([HOMING, EXPLORING], ROLES)
    executive.hear(PERFORMER, "AUV01", "Performer", -96, 0.0)
    executive.hear(CARTOGRAPHER, "AUV02", "Cartographer", -128, 0.0)
    executive.decide([DUE, IDLE], 0.0, 0.0)
    executive.satisfaction[PERFORMER] = -32.0
    for now_s in (0.0, 60.0):
        assert executive.pulls(now_s) == Pulls(0.25, {}, {"AUV01": 0.75}, {}, True)
    assert executive.pulls(60.1).equals == {}
