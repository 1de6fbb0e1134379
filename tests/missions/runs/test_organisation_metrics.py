"""Metrics of the organisation, from tables that are written by hand, and from short runs."""

from types import SimpleNamespace
from typing import Any

import pytest

from missions.runs.organisation_metrics import (
    holder_conflict_fraction,
    malformed_s,
    missed,
    n_refused_acts,
    view_divergence,
)
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.scenarios import load
from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.recorder import Recorder

TEAM = Group(
    "Team", (RoleSpecification("Head", 1, 1, head=True, founding=True), RoleSpecification("Digger", 0, 1, job="pit"))
)
NAMES = ("A", "B", "C")
Change = tuple[float, str, str, str, str]
"""Time, viewer, peer, role and event."""


def finished(*changes: Change, faults: list[tuple[Any, ...]] | None = None, private_jobs: bool = False) -> Run:
    """A run of 100 s in which views changed so."""
    recorder = Recorder()
    for at_s, viewer, peer, role, event in changes:
        recorder.organisation.append((at_s, viewer, peer, "Team", role, event, "A", "assign", "", "", "success"))
    recorder.faults.extend(faults or [])
    setup = SimpleNamespace(
        strategy=SimpleNamespace(declaration=SimpleNamespace(private_jobs=private_jobs)),
        agreement=SimpleNamespace(organisation=Organisation.of([TEAM]), groups=(TEAM,)),
        subjects=None,
        database=dict.fromkeys(NAMES),
    )
    made: Any = SimpleNamespace(recorder=recorder, setup=setup, end_s=100.0, scenario=load("mapping-rendezvous"))
    return made  # type: ignore[no-any-return]


AGREED = [(0.0, viewer, "A", "Head", "assigned") for viewer in NAMES]
DIGS: Change = (20.0, "B", "B", "Digger", "assigned")


def test_views_that_agree_do_not_diverge() -> None:
    assert view_divergence(finished()) == view_divergence(finished(*AGREED)) == 0.0


def test_a_view_is_wrong_until_it_is_as_the_peer_sees_itself() -> None:
    """B digs from 20 s; C hears of it at 50 s, A never: of 6 pairs two err for 30 s, one for 50 s."""
    heard: Change = (50.0, "C", "B", "Digger", "assigned")
    expected = (2 / 6 * 30.0 + 1 / 6 * 50.0) / 100.0
    assert view_divergence(finished(*AGREED, DIGS, heard)) == pytest.approx(expected, abs=1e-6)
    # who believes in a job that another never heard of errs too, until the end
    believed = (60.0, "A", "C", "Digger", "assigned")
    assert view_divergence(finished(*AGREED, believed)) == pytest.approx(1 / 6 * 0.4, abs=1e-6)


def test_a_pair_that_differs_in_two_roles_is_one_pair() -> None:
    more: Change = (20.0, "B", "B", "Head", "assigned")
    assert (
        view_divergence(finished(DIGS, more)) == view_divergence(finished(DIGS)) == pytest.approx(2 / 6 * 0.8, abs=1e-6)
    )


def test_jobs_that_everybody_notes_for_itself_are_nobodys_error() -> None:
    """Roles without a job are compared all the same."""
    assert view_divergence(finished(*AGREED, DIGS, private_jobs=True)) == 0.0
    leads: Change = (50.0, "B", "B", "Head", "assigned")
    assert view_divergence(finished(*AGREED, DIGS, leads, private_jobs=True)) == pytest.approx(2 / 6 * 0.5, abs=1e-6)


def test_who_is_out_of_the_mission_does_not_count() -> None:
    """A is away from 40 s to 70 s: then C alone errs, in one of 2 pairs. C is lost for good at 90 s: A errs, of 2."""
    faults = [(40.0, "A", "lost", ""), (70.0, "A", "lost", "over"), (90.0, "C", "energy", "battery exhausted")]
    expected = (2 / 6 * 20.0 + 1 / 2 * 30.0 + 2 / 6 * 20.0 + 1 / 2 * 10.0) / 100.0
    assert view_divergence(finished(DIGS, faults=faults)) == pytest.approx(expected, abs=1e-6)
    alone = [(0.0, name, "lost", "") for name in ("A", "C")]
    assert view_divergence(finished(DIGS, faults=alone)) is None


def test_holders_are_in_conflict_while_a_role_has_more_of_them_than_room() -> None:
    """B and C both dig from 30 s to 45 s, each by its own view; what A believes of them is no conflict."""
    both: list[Change] = [DIGS, (30.0, "C", "C", "Digger", "assigned"), (45.0, "B", "B", "Digger", "left")]
    believed = [(0.0, "A", name, "Digger", "assigned") for name in NAMES]
    assert holder_conflict_fraction(finished(*both)) == 0.15
    assert holder_conflict_fraction(finished(*believed)) == 0.0
    assert holder_conflict_fraction(finished(*both, faults=[(40.0, "B", "lost", "")])) == 0.1
    assert holder_conflict_fraction(finished(*both, private_jobs=True)) == 0.15  # who keeps it private does it too


def test_refusals_are_counted_at_every_vehicle() -> None:
    run = finished(*AGREED)
    assert n_refused_acts(run) == 0
    refused = ("A", "Team", "Head", "refused", "B", "release", "", "", "issuer without authority")
    run.recorder.organisation.extend([(5.0, "A", *refused), (6.0, "C", *refused)])
    assert n_refused_acts(run) == 2


@pytest.mark.parametrize("strategy", ["plan-and-dispatch", "cbba"])
def test_views_agree_where_nothing_is_lost(strategy: str) -> None:
    """For half a frame at most, and in `cbba` of roles that are told; its jobs would differ in 3 of 4 pairs."""
    settings = [("--set", f"strategy.name='{strategy}'"), ("--set", "scenario.duration_s=300")]
    run = run_scenario(load("mapping-patches", settings), 1)
    divergence = view_divergence(run)
    assert divergence is not None
    assert divergence < 0.02
    assert n_refused_acts(run) == 0


def test_the_organisation_is_malformed_while_a_role_has_too_few_or_too_many() -> None:
    """Nobody leads before 10 s and after A is lost at 60 s; B and C both dig from 30 s to 45 s."""
    led: Change = (10.0, "A", "A", "Head", "assigned")
    both: list[Change] = [DIGS, (30.0, "C", "C", "Digger", "assigned"), (45.0, "B", "B", "Digger", "left")]
    believed: Change = (0.0, "B", "A", "Head", "assigned")  # it does not make A the head
    run = finished(believed, led, *both, faults=[(60.0, "A", "lost", "")])
    assert malformed_s(run) == 10.0 + 15.0 + 40.0
    assert missed(run) == {"group.Team.role.Head.minimum": 50.0, "group.Team.role.Digger.maximum": 15.0}


def test_a_team_that_loses_its_head_is_malformed_until_another_leads() -> None:
    lost = [("--set", 'fault=[{kind="lost",vehicle="AUV00",at_s=300.0}]'), ("--set", "scenario.duration_s=1500")]
    run = run_scenario(load("mapping-rendezvous", lost), seed=1)
    assert 0.0 < missed(run)["group.Operational.role.Coordinator.minimum"] < 900.0
    assert malformed_s(run) >= missed(run)["group.Operational.role.Coordinator.minimum"]
    assert malformed_s(run_scenario(load("mapping-rendezvous", lost[1:]), seed=1)) == 0.0
