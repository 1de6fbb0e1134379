"""The decision: maximal combinations of activities, and the one with the best mean motivation."""

import math
from itertools import combinations as subsets

from hypothesis import given
from hypothesis import strategies as st
from samples import activity_set

from remoras.activities import Activity, ActivitySet, ActivityType
from remoras.executive.decision import best, combinations

G, N, P, C = ActivityType.GUIDANCE, ActivityType.NAVIGATION, ActivityType.PRODUCTIVE, ActivityType.COMMUNICATION

HOMING = activity_set(("Homing", G), ("Global", N))
ZIGZAG = activity_set(("ZigzagExploring", G), ("Global", N))
MAPPING = activity_set(("Mapping", P), needs="ZigzagExploring")
SENDING = activity_set(("Sending", C))


def everything(sets: list[ActivitySet]) -> int:
    return (1 << len(sets)) - 1


def test_mapping_goes_with_exploring_and_falls_with_it() -> None:
    sets = [HOMING, ZIGZAG, MAPPING, SENDING]
    assert combinations(sets, 0b1111) == ((0, 3), (1, 2, 3))
    assert combinations(sets, 0b1101) == ((0, 3),)  # nobody explores: nothing to map
    assert combinations(sets, 0b1100) == ((3,),)


def test_nothing_motivated_is_nothing_chosen() -> None:
    found = combinations([HOMING, MAPPING], 0)
    assert best(found, [2, 1], [0.0, 0.0]) == ()


def test_a_set_is_taken_whole() -> None:
    """A set that works on its way is not done in part where another one works."""
    towing = activity_set(("Towing", ActivityType.GUIDANCE), ("Pulling", ActivityType.PRODUCTIVE), sensors=("sonar",))
    listening = activity_set(("Listening", ActivityType.PRODUCTIVE), sensors=("sonar",))
    assert combinations([towing, listening, SENDING], 0b111) == ((0, 2), (1, 2))


def test_what_has_no_effect_stands_in_nobody_s_way() -> None:
    """Both name navigation, which changes nothing of what the vehicle does: they go together."""
    locating = activity_set(("Listening", P), ("Global", N), sensors=())
    listening = ActivitySet(None, locating.kind, (Activity("Listening", P, (), ("sonar",)), Activity("Global", N)), 0.5)
    assert HOMING.types == 1 << G
    assert locating.types == 0
    assert combinations([HOMING, listening, SENDING], 0b111) == ((0, 1, 2),)


def test_the_mean_is_over_activities_and_not_over_sets() -> None:
    # (2 * 0.5 + 1 * 0.9) / 3 = 0.6333 beats (1 * 0.6) / 1; over sets 0.7 would beat it too, so make it tell:
    # (3 * 0.4 + 1 * 1.0) / 4 = 0.55 loses against 0.6, although the mean over sets would be 0.7.
    assert best([(0, 1), (2,)], [2, 1, 1], [0.5, 0.9, 0.6]) == (0, 1)
    assert best([(0, 1), (2,)], [3, 1, 1], [0.4, 1.0, 0.6]) == (2,)


def test_of_equals_the_first_is_chosen() -> None:
    assert best([(0,), (1,)], [1, 1], [0.5, 0.5]) == (0,)


# Against every subset -----------------------------------------------------------------------------

TYPES = list(ActivityType)
type_choices = st.lists(st.sampled_from(TYPES), min_size=1, max_size=3, unique=True)


@st.composite
def free_sets(draw: st.DrawFn) -> list[ActivitySet]:
    """Sets that need nothing of each other."""
    chosen = draw(st.lists(type_choices, max_size=7))
    return [activity_set(*((f"A{number}", t) for t in types)) for number, types in enumerate(chosen)]


@st.composite
def sets_with_needs(draw: st.DrawFn) -> list[ActivitySet]:
    """Free sets, some that all need one activity, and some, of the same types, that provide it.

    A set that needs another one can be performed beside it: their types differ.
    """
    types = draw(type_choices)
    others = [one for one in TYPES if one not in types]
    beside = st.lists(st.sampled_from(others), min_size=1, max_size=3, unique=True)
    providers = [activity_set(*(("Exploring", t) for t in types)) for _ in range(draw(st.integers(0, 2)))]
    needy = [
        activity_set(*((f"N{number}", t) for t in own), needs="Exploring")
        for number, own in enumerate(draw(st.lists(beside, max_size=3)))
    ]
    return list(draw(st.permutations([*draw(free_sets())[:4], *providers, *needy])))


def is_valid(sets: list[ActivitySet], chosen: tuple[int, ...]) -> bool:
    taken = 0
    for index in chosen:
        if sets[index].types & taken:
            return False
        taken |= sets[index].types
    present = {activity.name for index in chosen for activity in sets[index].activities}
    return all(sets[index].needs is None or sets[index].needs in present for index in chosen)


def all_maximal(sets: list[ActivitySet], motivated: int) -> set[tuple[int, ...]]:
    """By definition: the valid subsets that no other valid subset contains."""
    indices = [index for index in range(len(sets)) if motivated >> index & 1]
    valid = [chosen for n in range(len(indices) + 1) for chosen in subsets(indices, n) if is_valid(sets, chosen)]
    return {one for one in valid if not any(set(one) < set(other) for other in valid)} - {()}


@given(free_sets() | sets_with_needs(), st.integers(0, 2**16 - 1))
def test_combinations_are_exactly_the_maximal_ones(sets: list[ActivitySet], motivated: int) -> None:
    found = combinations(sets, motivated & everything(sets))
    assert set(found) - {()} == all_maximal(sets, motivated & everything(sets))
    assert list(found) == sorted(set(found))


@given(free_sets() | sets_with_needs(), st.data())
def test_the_decision_has_the_best_mean_of_all_maximal_combinations(
    sets: list[ActivitySet], data: st.DataObject
) -> None:
    # sixteenths add up exactly, so equal means are equal
    motivations = [data.draw(st.integers(0, 16)) / 16 for _ in sets]
    motivated = sum(1 << index for index, value in enumerate(motivations) if value > 0)
    sizes = [len(one.activities) for one in sets]
    chosen = best(combinations(sets, motivated), sizes, motivations)

    def mean(combination: tuple[int, ...]) -> float:
        total = math.fsum(sizes[index] * motivations[index] for index in combination)
        return total / sum(sizes[index] for index in combination)

    candidates = all_maximal(sets, motivated)
    if not candidates:
        assert chosen == ()
    else:
        assert chosen == min(candidates, key=lambda combination: (-mean(combination), combination))


def test_a_set_that_falls_out_leaves_no_smaller_combination_behind() -> None:
    """Without its provider the needy set goes, and what remains of its clique is part of another combination."""
    organising = activity_set(("Organising", ActivityType.ORGANISATIONAL))
    exploring = activity_set(("Exploring", ActivityType.PLANNING))
    needy = activity_set(("Needy", ActivityType.PLANNING), needs="Exploring")
    assert combinations([organising, exploring, needy], 0b111) == ((0, 1),)
