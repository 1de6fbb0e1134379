"""Vehicles as the ground truth of a mission sees them, with a team of a head A and a hand B."""

from types import SimpleNamespace
from typing import Any

from sample_vehicles import AUV

from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification

TEAM = Group(
    "Team",
    (RoleSpecification("Head", 1, 1, head=True, founding=True), RoleSpecification("Hand", 1, None, founding=True)),
    "jetty",
    "AreaMapping",
)
PLAYED = (RoleAssignment("Team", "Head", "A"), RoleAssignment("Team", "Hand", "B"))
JETTY_M = (100.0, 100.0)


class Seen(SimpleNamespace):
    """Vehicle as the ground truth sees it."""

    @property
    def able_data(self) -> VehicleData | None:
        return self.data if self.is_alive or self.will_return else None

    def can_play(self, group: str, role: str) -> bool:
        return role in self.able

    def has_met(self, group: str) -> bool:
        return bool(self.met)

    def objectives_of(self, vehicle: str) -> Any:
        return self.has

    def leads(self, group: str) -> bool:
        return bool(self.name == "A")

    def has_planned(self, group: str) -> bool:
        return bool(self.planned)

    def gives_out(self, group: str) -> bool:
        return bool(self.busy)


def seen(name: str, **given: Any) -> Any:
    """Vehicle far from the jetty; by default all is agreed and no work is in progress."""
    one = Seen(
        name=name, position_m=(0.0, 0.0), is_alive=True, speed_mps=1.0, sensing=(), performed=(), finished=(), has=(),
        organisation=Organisation.of([TEAM], PLAYED), issued=(), issued_objectives=(), planned=True, busy=False,
        data=AUV, is_in_contact=True, communicates=True, will_return=False, able=("Hand",), met=False, is_patient=False,
        makes_headway=True, waits=None,
    )  # fmt: skip
    vars(one).update(given)
    return one


class Facts(Known):
    """Knowledge of a vehicle: values by key, and all received cells."""

    def __init__(self, known: dict[tuple[str, str], Any] | None = None, cells: dict[str, set[float]] | None = None):
        self.known, self.cells = known or {}, cells or {}

    def get(self, key: tuple[str, str], default: Any = None, /) -> Any:
        return self.known.get(key, default)

    def values(self, key: tuple[str, str]) -> set[Any]:
        if key[0] == "mappedCell":
            return self.cells.get(key[1], set())
        return {self.known[key]} if key in self.known else set()
