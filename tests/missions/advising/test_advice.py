"""Advice, by laws that it has to keep whatever the runs were: on made-up times, and on those that are shipped."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from missions.advising.advice import Adviser
from missions.advising.experience import SHIPPED, Experience, TriedInstance, compared, read_experience
from missions.advising.judging import RuleScore, advice_score
from missions.advising.model import CHOICES, MOST_BESIDE, Model, Pooling
from missions.advising.projection import projected
from missions.advising.traits import DECIDING, TRAITS
from missions.errors import OutputError

STRATEGIES = ("first", "second", "third")
PLACE = {trait.name: at for at, trait in enumerate(TRAITS)}
N = 60


def made_up(noise: float = 0.02, strength: float = 0.5) -> Experience:
    """Sixty instances: where more is lost ``second`` is fastest, else ``first``; ``third`` always takes 30 % longer."""
    draws = np.random.Generator(np.random.Philox(5))
    instances = []
    for number in range(N):
        traits = [float(value) for value in draws.uniform(1.0, 9.0, len(TRAITS))]
        traits[PLACE["lost"]] = float(draws.uniform())
        gain = strength * (traits[PLACE["lost"]] - 0.5)
        logs = np.array([gain, -gain, 0.3])[:, None] + noise * draws.standard_normal((3, 4)) + draws.uniform()
        instances.append(TriedInstance(number, tuple(traits), tuple(map(tuple, (1000.0 * np.exp(logs)).tolist()))))
    return Experience(STRATEGIES, tuple(instances), "0", "0")


@cache
def score_of(noise: float = 0.02, strength: float = 0.5) -> dict[str, RuleScore]:
    """How good rules are on made-up instances, by name."""
    return {rule.name: rule for rule in advice_score(made_up(noise, strength)).rules}


def with_lost(lost: float) -> tuple[float, ...]:
    """Middling traits with so many vehicles lost."""
    traits = [5.0] * len(TRAITS)
    traits[PLACE["lost"]] = lost
    return tuple(traits)


def test_advice_follows_what_decides() -> None:
    adviser = Adviser(made_up())
    for lost, best in ((0.05, "first"), (0.95, "second")):
        rows = adviser.rows(with_lost(lost))
        assert rows[0].strategy == best
        assert rows[0].p_within > 0.9


def test_how_much_longer_is_what_was_put_in() -> None:
    """Where 0.8 is lost ``first`` takes exp(0.3) of what ``second`` takes."""
    rows = {row.strategy: row for row in Adviser(made_up(), (Pooling(2.5, 0.1),)).rows(with_lost(0.8))}
    assert rows["first"].longer == pytest.approx(np.expm1(0.3), abs=0.06)
    assert rows["first"].low < np.expm1(0.3) < rows["first"].high


def test_strategies_may_be_renamed_and_reordered() -> None:
    experience, order = made_up(), (2, 0, 1)
    other = Experience(
        tuple(f"own-{STRATEGIES[at]}" for at in order),
        tuple(
            replace(instance, times_s=tuple(instance.times_s[at] for at in order)) for instance in experience.instances
        ),
        "0",
        "0",
    )
    one, two = Adviser(experience).rows(with_lost(0.7)), Adviser(other).rows(with_lost(0.7))
    assert [f"own-{row.strategy}" for row in one] == [row.strategy for row in two]
    for row, twin in zip(one, two, strict=True):
        assert (row.longer, row.low, row.high, row.p_within) == pytest.approx(
            (twin.longer, twin.low, twin.high, twin.p_within), abs=1e-12
        )


def test_a_trait_that_is_the_same_everywhere_changes_nothing() -> None:
    """Whatever it is in the scenario: nothing was learned of it."""
    at = PLACE["room"]
    alike = [
        replace(instance, traits=(*instance.traits[:at], 7.0, *instance.traits[at + 1 :]))
        for instance in made_up().instances
    ]
    adviser = Adviser(replace(made_up(), instances=tuple(alike)))
    one, two = with_lost(0.8), list(with_lost(0.8))
    two[at] = 64.0
    assert adviser.rows(one) == adviser.rows(two)
    there = adviser.model.distances(np.array([compared(one), compared(two)]))
    assert there[0].tolist() == there[1].tolist()


@pytest.mark.parametrize("choices", [(), CHOICES, (Pooling(0.7, 1.0),)])
def test_times_in_other_units_give_the_same_advice(choices: tuple[Pooling, ...]) -> None:
    """Twice all times of an instance, or of all: how strategies compare is the same."""
    experience = made_up()
    doubled = [
        replace(instance, times_s=tuple(tuple(2.0 * time for time in times) for times in instance.times_s))
        if instance.number % 3
        else instance
        for instance in experience.instances
    ]
    one = Adviser(experience, choices).rows(with_lost(0.3))
    two = Adviser(replace(experience, instances=tuple(doubled)), choices).rows(with_lost(0.3))
    for row, twin in zip(one, two, strict=True):
        assert row.strategy == twin.strategy
        assert row.longer == pytest.approx(twin.longer, abs=1e-12)


def test_what_is_unexplained_is_that_of_an_instance_left_out() -> None:
    """The short cut is what fitting without the instance gives, at the scale of all.

    Of functions ``middle + sum of weight * nearness`` with weights that sum to 0, the one that is least in squares and
    penalty solves a linear system; so it is solved here, once without instance 7.
    """
    experience, pooling = made_up(), Pooling(1.0, 0.3)
    model = Model(experience.traits, experience.log_times, (pooling,))
    assert model.reference == 0
    assert set(model.poolings[1:]) == {pooling}
    nearness = np.exp(-((model.distances(experience.traits) / pooling.width) ** 2) / 2.0)
    beside = np.clip(experience.log_times - experience.log_times[:, :1], -MOST_BESIDE, MOST_BESIDE)
    rest = [at for at in range(N) if at != 7]
    system = np.zeros((N, N))
    system[:-1, :-1] = nearness[np.ix_(rest, rest)] + pooling.penalty * np.eye(N - 1)
    system[:-1, -1] = system[-1, :-1] = 1.0
    solved = np.linalg.solve(system, np.vstack([beside[rest], np.zeros((1, 3))]))
    left = beside[7] - (nearness[7, rest] @ solved[:-1] + solved[-1])
    assert model.unexplained[7, 1:] == pytest.approx(left[1:], abs=1e-9)


def test_every_choice_weighs_instances_to_one() -> None:
    experience = made_up()
    model = Model(experience.traits, experience.log_times)
    for pooling in (Pooling(), *CHOICES):
        assert model.weights(experience.traits[:5], pooling).sum(axis=1) == pytest.approx(np.ones(5), abs=1e-9)


def test_where_all_is_chance_little_is_made_of_it() -> None:
    """What is told of ``second`` varies as what is shown does where the traits tell, and far less where none does."""
    ratios = []
    for experience in (made_up(), made_up(noise=0.1, strength=0.0)):
        model = Model(experience.traits, experience.log_times)
        told = model.predicted(experience.traits)
        ratios.append((told[:, 1] - told[:, 0]).std() / (experience.log_times[:, 1] - experience.log_times[:, 0]).std())
    assert ratios[0] > 0.9
    assert ratios[1] < 0.5


def test_a_mission_that_never_ends_counts_as_half_as_long_again() -> None:
    """So what is advised is the same whether a rival took twice as long or a hundred times."""
    experience = made_up()

    def with_one(factor: float) -> Experience:
        first = experience.instances[3]
        slow = replace(first, times_s=(*first.times_s[:2], tuple(factor * time for time in first.times_s[2])))
        return replace(experience, instances=(*experience.instances[:3], slow, *experience.instances[4:]))

    assert Adviser(with_one(2.0)).rows(with_lost(0.4)) == Adviser(with_one(100.0)).rows(with_lost(0.4))


def test_shuffled_labels_lose() -> None:
    score = score_of()
    told, untold = score["advice"], score["advice, instances shuffled"]
    assert told.saved_95[0] > 0.05
    assert told.within is not None
    assert untold.within is not None
    assert told.within > 0.85
    assert untold.within < 0.7
    assert untold.saved < 0.02


def test_without_the_group_that_decides_nothing_is_gained() -> None:
    """What is lost decides, and is unforeseen."""
    score = score_of()
    assert score["advice without unforeseen"].saved < 0.02
    for group in ("sea", "work"):
        assert score[f"advice without {group}"].saved > 0.05


def test_on_shipped_experience_advice_is_told_from_chance() -> None:
    """From a strategy at random, that is; the page says that it is not told from the single best."""
    score = {rule.name: rule for rule in advice_score(read_experience()).rules}
    assert score["advice"].saved_95[0] > score["at random"].saved_95[1]


def test_nothing_is_gained_where_one_strategy_is_best_everywhere() -> None:
    assert abs(score_of(strength=0.0)["advice"].saved) < 0.01


def test_the_ceiling_falls_with_noise() -> None:
    """With much chance in each run, not even the best of half of the runs is within 3 % in the other half."""
    quiet, loud = (score_of(noise)["best in the other repeats"] for noise in (0.001, 0.2))
    assert quiet.within_half == 1.0
    assert loud.within_half < 0.8


def test_the_same_experience_gives_the_same_advice() -> None:
    assert Adviser(made_up()).rows(with_lost(0.4)) == Adviser(made_up()).rows(with_lost(0.4))


def test_a_projection_keeps_variance_and_turns_with_nothing() -> None:
    plane = projected(made_up())
    assert plane.places.shape == (N, 2)
    assert plane.places.var(axis=0).sum() / len(DECIDING) == pytest.approx(sum(plane.shares), abs=1e-9)
    assert all(named[0].startswith("+") for named in plane.named)


def test_a_file_is_read_as_it_was_written_and_refused_once_altered(tmp_path: Path) -> None:
    path = tmp_path / "experience.json"
    path.write_text(made_up().text())
    assert read_experience(path) == made_up()
    path.write_text(made_up().text().replace("[[1", "[[2", 1))
    with pytest.raises(OutputError, match=r"was altered; remoras advise --make DIR"):
        read_experience(path)
    path.write_text(made_up().text().replace('"lost"', '"lost_it"'))
    with pytest.raises(OutputError, match="other traits than this version"):
        read_experience(path)
    path.write_text("{}")
    with pytest.raises(OutputError, match="is no experience"):
        read_experience(path)


def test_the_shipped_file_is_small_and_whole() -> None:
    assert SHIPPED.stat().st_size < 200_000
    experience = read_experience()
    assert len({instance.number for instance in experience.instances}) == len(experience.instances)
    assert all(len(set(map(len, instance.times_s))) == 1 for instance in experience.instances)


def test_the_page_has_the_traits() -> None:
    page = (Path(__file__).parents[3] / "docs" / "howto" / "advise.md").read_text(encoding="utf-8")
    rows = [f"| `{trait.name}` | {trait.unit} | {trait.text} | {'yes' if trait.decides else ''} |" for trait in TRAITS]
    assert "\n".join(rows) in page
