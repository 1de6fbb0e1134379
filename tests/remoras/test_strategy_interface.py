"""A strategy with a missing part, an exception or a wrong answer gives one message that names it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest
from samples import WORKER, auv, database

from remoras.errors import PluginError
from remoras.fleet.instant_sharing import InstantSharing
from remoras.strategies.central import Central
from remoras.strategy import (
    Declaration,
    Move,
    Situation,
    adapt_roles,
    ask,
    division_of,
    faults_of_strategy,
    form_groups,
    negotiator_of,
)
from remoras.testing.sample_worlds import GROUPS
from remoras.work import Work

FLEET = database(auv("AUV00", playable_roles=WORKER))
WORK = Work(GROUPS[1], Central().form(FLEET, GROUPS), FLEET, {})
SITUATION = Situation(1.0, 1, WORK, None, (), {})


class Unnamed(Central):
    name = 7  # type: ignore[assignment]
    declaration = "as usual"  # type: ignore[assignment]


class Both(Central):
    """Sends packets, and declares that all is known without."""

    declaration = Declaration(source="a test", messages={}, sharing=InstantSharing)


class Listing(Central):
    declaration = Declaration(
        source="a test",
        messages=["playsRole"],
        authorities={"take"},
        meets="no",
        help="by calls",  # type: ignore[arg-type]
    )


class WithNoClass(Central):
    declaration = Declaration(source="a test", messages={}, communicates=False, sharing="at once")


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (Unnamed(), ["name is int, expected str", "declaration is str, expected Declaration"]),
        (
            Both(),
            ["declaration.communicates is True; allowed: False, with instant sharing a strategy sends no packets"],
        ),
        (
            Listing(),
            [
                "declaration.messages is ['playsRole']; input should be a valid dictionary",
                "declaration.help is 'by calls'; input should be 'none', 'calls' or 'auction'",
                "declaration.meets is 'no'; input should be a valid boolean",
                "declaration.authorities is {'take'}; input should be a valid frozenset",
            ],
        ),
        (WithNoClass(), ["declaration.sharing is str, expected the class InstantSharing"]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_each_missing_part_of_a_strategy_is_named(found: Any, says: list[str]) -> None:
    assert list(faults_of_strategy(found)) == says


@dataclass
class Answering:
    """Answers every question alike; raises what is an exception."""

    answer: Any
    name: str = "answering"

    def form(self, *asked: Any) -> Any:
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    adapt = negotiator = negotiate = division = form


QUESTIONS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "form": (lambda s: form_groups(s, FLEET, GROUPS), "an Organisation"),
    "adapt": (lambda s: adapt_roles(s, WORK), "a tuple of RoleAssignment"),
    "negotiator": (lambda s: negotiator_of(s, "AUV00", GROUPS[1]), r"an object with negotiate\(situation\), or None"),
    "negotiate": (
        lambda s: ask("answering", s, SITUATION),
        r"a Move with statements of \(subject, attribute, value\), flags True or False",
    ),
    "division": (lambda s: division_of("answering", s), "a mapping of names of roles to names of vehicles"),
}


@pytest.mark.parametrize("part", QUESTIONS)
def test_an_answer_of_a_wrong_type_is_shown_with_the_expected_type(part: str) -> None:
    question, expected = QUESTIONS[part]
    with pytest.raises(PluginError, match=rf"^strategy answering: {part} returned \[1\]; expected: {expected}$"):
        question(Answering([1]))


def test_a_flag_of_a_move_that_is_no_truth_value_is_refused() -> None:
    with pytest.raises(PluginError, match=r"negotiate returned Move\(.*holding='no'.*; expected: a Move with"):
        ask("answering", Answering(Move(holding="no")), SITUATION)  # type: ignore[arg-type]
