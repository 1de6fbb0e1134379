"""The table [strategy] of a scenario: parameters that are set, and what is refused."""

import re

import pytest

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios import load
from missions.scenarios.parts import strategy_of
from remoras.strategies import parameters, strategies
from remoras.strategies.remoras import Remoras

OF_CENTRAL = "central has margin, help_s, acknowledge_rounds, common_plan, announces, repairs, queue"


class Speechless:
    """A strategy that forgot what its vehicles negotiate with, and where it is from."""

    name = "speechless"
    form = staticmethod(Remoras.form)
    adapt = Remoras.adapt


SPEECHLESS = Speechless()


def faults_of(*settings: str) -> tuple[ConfigurationFault, ...]:
    with pytest.raises(ConfigurationError) as caught:
        load("mapping-patches", [("--set", setting) for setting in settings])
    for fault, line in zip(caught.value.faults, str(caught.value).splitlines(), strict=True):
        assert fault.key in line
        assert fault.given in line
        assert fault.allowed in line
    return caught.value.faults


def test_a_parameter_is_set_and_the_others_keep_their_defaults() -> None:
    options = ("strategy.name=central", "strategy.parameters.queue=3")
    strategy = strategy_of(load("mapping-patches", [("--set", option) for option in options]))
    others = {
        "margin": 0.05,
        "help_s": 60.0,
        "acknowledge_rounds": 400,
        "common_plan": "missions",
        "announces": "next-jobs",
        "repairs": "changes",
    }
    assert {p.name: p.default for p in parameters(strategy)} == {"queue": 3} | others
    assert {p.name: p.default for p in parameters(strategies()["central"])} == {"queue": 2} | others


@pytest.mark.parametrize(
    ("strategy", "setting", "given", "says"),
    [
        ("central", "queu=3", "3", f"{OF_CENTRAL}; did you mean 'queue'"),
        ("central", "bundle=3", "3", f"{OF_CENTRAL}$"),
        ("oracle", "queue=3", "3", "oracle has no parameters"),
        ("central", "queue=0", "0", "greater than or equal to 1"),
        ("central", "queue=65", "65", "less than or equal to 64"),
        ("central", "queue=2.5", "2.5", "valid integer"),
        ("central", "queue=two", '"two"', "valid integer"),
        ("central", "queue=true", "true", "valid integer"),
        ("central", "queue=[3]", "[3]", "valid integer"),
        ("central", "queue={most=3}", '{"most": 3}', "valid integer"),
        ("cbba", "discount_s=0.0", "0.0", "greater than 0"),
        ("fixed-partition", "margin=inf", "Infinity", "less than or equal to 100"),
        ("fixed-partition", "margin=nan", "NaN", "greater than or equal to 0|less than"),
    ],
)  # fmt: skip
def test_a_wrong_parameter_is_one_fault(strategy: str, setting: str, given: str, says: str) -> None:
    (fault,) = faults_of(f"strategy.name={strategy}", f"strategy.parameters.{setting}")
    assert fault.key == f"--set (strategy.parameters.{setting.partition('=')[0]})"
    assert fault.given == given
    assert re.search(says, fault.allowed)


def test_of_an_object_that_is_no_strategy_it_is_said_what_is_missing() -> None:
    (fault,) = faults_of(f"strategy.name={__name__}:SPEECHLESS")
    assert fault.key == "--set (strategy.name)"
    assert fault.given == f'"{__name__}:SPEECHLESS"'
    assert fault.allowed == "a strategy: lacks declaration, negotiator of remoras.strategy.Strategy"
