"""Statements of a strategy that no vehicle can record."""

from dataclasses import dataclass

import pytest

from missions.runs.run import run
from missions.scenarios import load
from remoras.errors import PluginError
from remoras.organisation import Group
from remoras.strategies.central import Central
from remoras.strategy import Move, Situation, Statable, Statement


@dataclass
class Stating:
    """Negotiator that states one fact."""

    fact: Statable

    def negotiate(self, situation: Situation) -> Move:
        return Move((Statement((self.fact,)),))


@dataclass(frozen=True)
class States(Central):
    name: str = "states"
    fact: Statable = ("", "", "")

    def negotiator(self, me: str, group: Group) -> Stating:  # type: ignore[override]
        return Stating(self.fact)


@pytest.mark.parametrize(
    ("fact", "says"),
    [
        (("AUV01", "playsRoles", "Operational.Midfield"), "no attribute is named 'playsRoles'.*; did you mean"),
        (("AUV77", "playsRole", "Operational.Midfield"), "no .*instance is named 'AUV77'.*; did you mean"),
        (("AUV01", "playsRole", "Midfield"), "no .*instance is named 'Midfield'; allowed: ASV00"),
        (("AUV01", "batteryFraction", 7.0), r"7\.0 is outside \[0\.0, 1\.0\]"),
    ],
)
def test_a_statement_that_cannot_be_recorded_names_strategy_and_vehicle(fact: Statable, says: str) -> None:
    scenario = load("mapping-rendezvous", [("--set", "scenario.duration_s=60")])
    with pytest.raises(PluginError, match=f"strategy states: a statement of A.V0. cannot be recorded: .*{says}"):
        run(scenario, 1, strategy=States(fact=fact))
