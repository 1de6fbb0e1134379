"""The decision: vital sets first, then the maximal combination of activity sets with the best mean motivation."""

from collections.abc import Sequence
from itertools import combinations as subsets

from hypothesis import given
from hypothesis import strategies as st
from samples import activity_set

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.executive.decision import Choice

G, P, C = ActivityType.GUIDANCE, ActivityType.PRODUCTIVE, ActivityType.COMMUNICATION
N = ActivityType.ORGANISATIONAL


def one(*activities: tuple[str, ActivityType], needs: str | None = None, vital: bool = False) -> ActivitySet:
    """A set whose activities all have an effect."""
    kind = ActivityKind.VITAL if vital else ActivityKind.COLLECTIVE
    return activity_set(*activities, needs=needs, kind=kind, sensors=("sonar",))


SENDING = one(("Sending", C))


def best(sets: Sequence[ActivitySet], *motivations: float) -> tuple[int, ...]:
    return Choice(sets).best(motivations)


def test_activities_without_effect_conflict_with_none() -> None:
    """Both organise, which changes nothing without planning: they go together."""
    locating = activity_set(("Listening", P), ("Global", N), sensors=())
    homing = activity_set(("Homing", G), ("Global", N), sensors=())
    listening = ActivitySet(None, locating.kind, (Activity("Listening", P, (), ("sonar",)), Activity("Global", N)), 0.5)
    assert homing.types == 1 << G
    assert locating.types == 0
    assert best([homing, listening, SENDING], 0.5, 0.5, 0.5) == (0, 1, 2)
    assert best([homing, locating], 0.5, 0.9) == (0,)


# Against every subset -----------------------------------------------------------------------------

TYPES = list(ActivityType)
type_choices = st.lists(st.sampled_from(TYPES), min_size=1, max_size=3, unique=True)


@st.composite
def drawn_sets(draw: st.DrawFn) -> list[ActivitySet]:
    """Free sets, vital ones, and chains: sets that provide what others need, which others need in their turn."""
    vital = [one((f"V{n}", types[0]), vital=True) for n, types in enumerate(draw(st.lists(type_choices, max_size=2)))]
    free = [one(*((f"F{n}", t) for t in types)) for n, types in enumerate(draw(st.lists(type_choices, max_size=4)))]
    linked = []
    for _ in range(draw(st.integers(0, 5))):
        link = draw(st.integers(0, 3))  # 0 needs nothing, each other what the one before gives
        types = draw(type_choices)
        linked.append(one(*((f"Link{link}", t) for t in types), needs=f"Link{link - 1}" if link else None))
    return list(draw(st.permutations([*vital, *free, *linked])))


def is_valid(sets: list[ActivitySet], chosen: tuple[int, ...]) -> bool:
    taken = 0
    for index in chosen:
        if sets[index].types & taken:
            return False
        taken |= sets[index].types
    present = {activity.name for index in chosen for activity in sets[index].activities}
    return all(sets[index].needs is None or sets[index].needs in present for index in chosen)


def by_definition(sets: list[ActivitySet], motivations: Sequence[float]) -> tuple[int, ...]:
    """Vital ones in their order; of the rest every subset is tried, and those that another contains are left out."""
    vital: tuple[int, ...] = ()
    for index, one_set in enumerate(sets):
        if one_set.kind is ActivityKind.VITAL and motivations[index] > 0 and is_valid(sets, (*vital, index)):
            vital += (index,)
    rest = [index for index, s in enumerate(sets) if motivations[index] > 0 and s.kind is not ActivityKind.VITAL]
    every = [chosen for n in range(len(rest) + 1) for chosen in subsets(rest, n)]
    valid = [set(chosen) for chosen in every if is_valid(sets, vital + chosen)]
    maximal = [chosen for chosen in valid if chosen and not any(chosen < other for other in valid)]

    def rank(chosen: set[int]) -> tuple[float, list[int]]:
        n = sum(len(sets[index].activities) for index in chosen)
        return -sum(len(sets[index].activities) * motivations[index] for index in chosen) / n, sorted(chosen)

    return tuple(sorted({*vital, *(min(maximal, key=rank) if maximal else ())}))


@given(drawn_sets(), st.data())
def test_the_decision_is_the_best_of_all_maximal_combinations(sets: list[ActivitySet], data: st.DataObject) -> None:
    # sixteenths add up exactly, so equal means are equal
    motivations = [data.draw(st.integers(0, 16)) / 16 for _ in sets]
    assert Choice(sets).best(motivations) == by_definition(sets, motivations)


@given(drawn_sets(), st.data())
def test_a_decision_is_kept_only_while_a_search_would_repeat_it(sets: list[ActivitySet], data: st.DataObject) -> None:
    """Motivations drift, some by steps that are too small to matter, some by such that are not."""
    choice = Choice(sets)
    motivations = [data.draw(st.integers(0, 8)) / 8 for _ in sets]
    for _ in range(6):
        assert choice.best(motivations) == Choice(sets).best(motivations)
        motivations = [max(0.0, of + data.draw(st.integers(-3, 3)) / 32) if of else of for of in motivations]


@given(drawn_sets(), st.data())
def test_the_performed_combination_has_the_best_mean_motivation(sets: list[ActivitySet], data: st.DataObject) -> None:
    """The mean with each set is that of a best combination with it; what is performed and not vital has the highest."""
    motivations = [data.draw(st.integers(0, 16)) / 16 for _ in sets]
    choice = Choice(sets)
    chosen = choice.best(motivations)
    means = [choice.best_mean(motivations, index) for index in range(len(sets))]
    known = [mean for mean in means if mean is not None]
    for index in chosen:
        if sets[index].kind is not ActivityKind.VITAL:
            assert means[index] == max(known)
        else:
            assert means[index] is None
