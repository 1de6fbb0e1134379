"""Every shipped strategy conforms, and each check detects a strategy that breaks its rule."""

from collections.abc import Callable
from itertools import product

import nonconforming_strategies as broken
import pytest

from remoras.errors import PluginError
from remoras.strategies import Strategy, configured, strategies
from remoras.strategies.fmc_ata import FMC_ATA
from remoras.strategies.grape import GRAPE
from remoras.testing import strategies as conformance

HELPED = {
    f"{name}, {help}": configured(strategies()[name], {"help": help})
    for name, help in [
        *product(("contract-net", "cbba", "status-broadcast"), ("calls", "auction")), ("plan-and-dispatch", "auction"),
    ]
}  # fmt: skip
SHIPPED = {**strategies(), "grape": GRAPE, "fmc-ata": FMC_ATA, **HELPED}
IN_THE_SAME_CODE = ("remoras-planned", "plan-and-dispatch", "central", "cbba-plain")
"""Strategies whose vehicles negotiate as those of ``remoras`` and ``cbba``, by other parameters."""
VISITING = {*strategies(), *HELPED} - {"remoras"}
"""Strategies whose jobs of another mission ``test_visits`` sees done in their order."""
OF_THE_VALUE = (conformance.check_parts, conformance.check_declaration, conformance.check_parameters)
CASES = [
    pytest.param(
        check,
        name,
        id=f"{check.__name__.removeprefix('check_')}-{name}",
        marks=[pytest.mark.thorough] * (name in HELPED or name in ("grape", "fmc-ata")),
    )
    for check, name in product(conformance.CHECKS, SHIPPED)
    if check in OF_THE_VALUE
    or (name not in IN_THE_SAME_CODE and (check is not conformance.check_does_jobs_in_order or name not in VISITING))
]


@pytest.mark.slow
@pytest.mark.parametrize(("check", "name"), CASES)
def test_every_shipped_strategy_conforms(check: Callable[[Strategy], None], name: str) -> None:
    check(SHIPPED[name])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("check", "strategy", "says"),
    [
        (conformance.check_declaration, broken.Unexplained(), "'whistle' is neither"),
        (conformance.check_declaration, broken.SecretSignals(), "influences and messages disagree"),
        (conformance.check_parameters, broken.Undescribed(), "haste is not described"),
        (conformance.check_parameters, broken.Unbounded(), "haste has no lower and upper bound"),
        (conformance.check_parameters, broken.WrongDefault(), "haste: its default is refused"),
        (conformance.check_allocates_within_the_group, broken.Unable(), "founds what it cannot play"),
        (conformance.check_allocates_within_the_group, broken.Outsiders(), "given to no member of"),
        (conformance.check_allocates_within_the_group, broken.Doubled(), "given to several vehicles"),
        (conformance.check_allocates_within_the_group, broken.Hasty(), "its job needs others that are not done"),
        (conformance.check_does_jobs_in_order, broken.Hasty(), "jobs not done: recovery"),
        (conformance.check_does_jobs_in_order, broken.Skipping(), "jobs not done: west, recovery"),
        (
            conformance.check_states_within_the_group,
            broken.Gullible(),
            "negotiates for|cannot play it|an authority",
        ),
        (conformance.check_states_within_the_group, broken.Presumptuous(), "the declaration has to name an authority"),
        (
            conformance.check_runs,
            broken.Powerless(),
            "requests to assign .*: issuer without authority; .*Authority.TAKE",
        ),
        (conformance.check_runs, broken.Skipping(), "not together"),
        (conformance.check_runs, broken.Talkative(), "states .* blocks, its declaration allows"),
        (conformance.check_runs, broken.Undeclared(), "sends undeclared facts: {'hasMission'}"),
        (conformance.check_survives_silence, broken.Waiting(), "no vehicle maps an area"),
        (conformance.check_survives_the_silence_of_one, broken.Fickle(), "leaves .* times"),
        (conformance.check_survives_the_silence_of_one, broken.Resentful(), "cut off for a time: .*not together"),
    ],
    ids=lambda value: value.__name__ if callable(value) else type(value).__name__,
)
def test_a_strategy_that_breaks_a_rule_is_detected(check, strategy, says) -> None:
    with pytest.raises(AssertionError, match=says):
        check(strategy)


def test_a_strategy_that_fails_while_receiving_nothing_is_detected() -> None:
    with pytest.raises(PluginError, match=r"negotiate raised (KeyError|ValueError)"):
        conformance.check_survives_silence(broken.Trusting())


@pytest.mark.slow
def test_a_strategy_that_depends_on_hashes_is_detected() -> None:
    with pytest.raises(AssertionError, match="depend on the order of a set"):
        conformance.check_deterministic("nonconforming_strategies:BY_HASH")


def test_every_check_runs_on_a_strategy_given_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all the checks, whatever they are, and of the one in other processes."""
    made: list[str] = []
    noting = [lambda strategy, n=n: made.append(f"{n} {strategy.name}") for n in range(len(conformance.CHECKS))]
    monkeypatch.setattr(conformance, "CHECKS", noting)
    monkeypatch.setattr(conformance, "check_deterministic", made.append)
    assert len(list(conformance.conforms("remoras"))) == len(noting) + 1
    assert made == [*(f"{n} remoras" for n in range(len(noting))), "remoras"]
