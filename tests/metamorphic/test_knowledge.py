"""Exchanged knowledge changes plans: each test removes one part and checks the claimed effect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from recorded import flown

from exchange.manager.receiver import Receiver
from exchange.packets import DecodedPacket, Reception
from missions.mapping.metrics import duplicate_fraction
from missions.runs.run import Run
from missions.scenarios import shipped

MAP = "mappedCell = 1\n"
"""The line by which vehicles exchange what they have mapped; an attribute that is not listed is not exchanged."""
AUV01_ENERGY_J = 215_000.0
"""AUV01 has mapped most of its area when it has to go home with this (of about 40 W + 15 v^3 W at 1.54 m/s)."""


def of(scenario: str, strategy: str, per: float, *settings: str) -> Run:
    return flown(scenario, f"strategy.name={strategy}", f"channel.per={per}", *settings)


def plans(finished: Run) -> list[Any]:
    """Assignments, acceptances and releases of roles, with times."""
    return list(finished.recorder.rows("roles"))


@pytest.mark.slow
def test_acknowledgements_change_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who learns nothing from rows goes on repeating what is known, and takes back what it gave.

    Summaries tell who holds what too, so neither of the two has them here.

    It fails if room in packets were without limit, or nobody asked what is acknowledged: then rows would be ballast.
    """
    given = "mapping-patches", "contract-net", 0.7, "communication.summaries=false"
    usual = of(*given)
    apply = Receiver.apply

    def without_rows(receiver: Receiver, decoded: DecodedPacket, *more: Any) -> Reception:
        packet = decoded.packet._replace(acks=0)
        return apply(receiver, decoded._replace(packet=packet, own=0), *more)

    monkeypatch.setattr(Receiver, "apply", without_rows)
    ignoring = of(*given)
    assert plans(ignoring) != plans(usual)
    assert ignoring.milestones != usual.milestones


@pytest.mark.slow
def test_areas_are_mapped_twice_if_mapping_is_not_reported(tmp_path: Path) -> None:
    """AUV01 goes home from an area over half done: whoever takes it over goes on where it stopped, if it knows where.

    At most 3 % are mapped twice with the map, more than 15 % without. It fails if areas are begun anew on a hand-over,
    or if jobs are weighed and surveyed whole whatever is known of them.
    """
    low = f"vehicle.AUV01.energy_j={AUV01_ENERGY_J}"
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    assert MAP in text
    untold = tmp_path / "untold.toml"
    untold.write_text(text.replace(MAP, ""), encoding="utf-8")
    knowing, ignorant = (of(one, "remoras", 0.3, low) for one in ("mapping-rendezvous", str(untold)))
    stopped_s = next(m.time_s for m in knowing.milestones if (m.name, m.vehicle) == ("mapping_stopped", "AUV01"))
    assert sum(row[0] <= stopped_s and row[1] == "AUV01" for row in knowing.recorder.rows("coverage")) > 50
    assert knowing.completed
    assert duplicate_fraction(knowing) <= 0.03
    assert duplicate_fraction(ignorant) > 0.15
    assert plans(knowing) != plans(ignorant)
