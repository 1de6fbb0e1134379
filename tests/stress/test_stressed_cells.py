"""Cells under random faults: each is looked at by itself, and what gateways bring has to be what was recorded."""

from __future__ import annotations

from typing import Any

import pytest
import tomli_w
from planted import PLANTS

from benchmarks.cells import raw_of
from remoras.flotilla import Passage
from stress.campaign import judge
from stress.drawing import Plan, plan_of, schedule_of
from stress.invariants.knowledge import KnowledgeAgreement, Rest
from stress.invariants.seam import Moment, Scene
from stress.schedule import Schedule
from stress.trial import run_trial

SHRUNK = 1.0 / 3.0


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Two cells of four with a gateway, whose areas take a fifth of the time."""
    raw = raw_of(2, 1, 4, hops=1)
    for area in raw["area"]:
        x0, y0 = (min(corner[axis] for corner in area["corners_m"]) for axis in (0, 1))
        area["corners_m"] = [[x0 + (x - x0) * SHRUNK, y0 + (y - y0) * SHRUNK] for x, y in area["corners_m"]]
    raw["communication"]["lease_frames"] = 10
    raw["mission"]["meeting_deadline_s"] = 360.0
    path = tmp_path_factory.mktemp("cells") / "cells.toml"
    path.write_text(tomli_w.dumps(raw))
    return plan_of(str(path))


def calm(plan: Plan) -> Schedule:
    return schedule_of(plan, 1).with_faults(())


def test_a_gateway_is_befallen_by_its_first_address(plan: Plan) -> None:
    assert len(plan.vehicles) == 7
    assert [name for name in plan.vehicles if "Gateway" in name] == ["Gateway c0r0 to c1r0"]
    assert "clock" not in plan.kinds  # cells have one time


@pytest.mark.parametrize("seed", range(1, 4))
def test_what_is_promised_holds_in_cells(plan: Plan, seed: int) -> None:
    outcome = judge(schedule_of(plan, seed))
    assert outcome.broken is None, outcome.broken
    assert not {KnowledgeAgreement.name, Rest.name} & {*outcome.judged}  # no quiet time follows


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4, 16))
def test_what_is_promised_holds_in_cells_in_many_schedules(plan: Plan, seed: int) -> None:
    assert judge(schedule_of(plan, seed)).broken is None


def test_a_gateway_that_brings_what_nobody_recorded_is_found(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    true = Passage._facts

    def false(passage: Passage, block: Any) -> Any:
        facts = true(passage, block)
        return facts and tuple(fact._replace(value=11 - fact.value) for fact in facts)  # AUV00 and AUV01 there: 5, 6

    monkeypatch.setattr(Passage, "_facts", false)
    broken = judge(calm(plan)).broken
    assert broken is not None
    assert broken.invariant == "recorded"
    assert "a gateway brings" in broken.text


class HeardInAllCells:
    """Asked of all fleets together, whenever somebody hears a packet."""

    name = "heard"
    moment = Moment.EVENT
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._senders: set[str] = set()

    def broken(self, scene: Scene) -> str | None:
        if scene.heard is not None:
            self._senders.add(scene.heard.vehicle.name[-4:])
        return " and ".join(sorted(self._senders)) if len(self._senders) > 1 else None


def test_what_a_user_asks_of_packets_is_asked_in_all_cells(plan: Plan) -> None:
    broken = run_trial(calm(plan), [HeardInAllCells]).broken
    assert broken is not None
    assert broken.text == "c0r0 and c1r0"


@pytest.mark.slow
@pytest.mark.parametrize("invariant", ["beliefs", "newest", "energy", "authority"])
def test_what_is_planted_is_named_in_cells(plan: Plan, invariant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    planted = next(one for one in PLANTS if one.invariant == invariant)
    planted.plant(monkeypatch)
    schedules = (schedule_of(plan, seed) for seed in range(1, 41))
    fitting = (one for one in schedules if not planted.needs or planted.needs & one.kinds)
    assert any((broken := judge(one).broken) is not None and broken.invariant == invariant for one in fitting)
