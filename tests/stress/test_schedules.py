"""Schedules: pure functions of their seeds, the same in a file, and refused in one line where they are wrong."""

from dataclasses import replace
from pathlib import Path

import pytest
from small_sea import small_plan

from missions.errors import ConfigurationError
from stress.drawing import Plan, plan_of, schedule_of
from stress.kinds import KINDS, SELDOM
from stress.schedule import Schedule, StressFault, read_schedule

SEEDS = range(1, 400)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return small_plan()


def written(schedule: Schedule, folder: Path) -> Path:
    path = folder / "schedule.toml"
    path.write_text(schedule.as_toml(), encoding="utf-8")
    return path


def test_a_schedule_is_a_function_of_its_seed(plan: Plan) -> None:
    drawn = [schedule_of(plan, seed) for seed in SEEDS]
    assert drawn == [schedule_of(replace(plan, cost_s=1e3), seed) for seed in SEEDS]
    assert len({schedule.fault for schedule in drawn}) > 0.98 * len(drawn)


def test_every_kind_is_drawn_for_a_while_and_for_good_where_it_may(plan: Plan) -> None:
    faults = [fault for seed in SEEDS for fault in schedule_of(plan, seed).fault]
    assert {fault.kind for fault in faults} == set(KINDS) - SELDOM
    stays = {fault.kind for fault in faults if fault.is_permanent}
    assert stays == {name for name, kind in KINDS.items() if kind.may_stay}


def test_what_is_transient_is_over_when_it_heals(plan: Plan) -> None:
    for schedule in (schedule_of(plan, seed) for seed in SEEDS):
        for fault in schedule.fault:
            assert fault.at_s < schedule.stress.heal_s < schedule.stress.bound_s
            assert fault.until_s is None or fault.at_s < fault.until_s <= schedule.stress.heal_s
            assert fault.until_s is not None or KINDS[fault.kind].may_stay or KINDS[fault.kind].is_sudden
        assert len({fault.vehicle for fault in schedule.permanent}) <= 1


def test_a_file_gives_the_same_schedule(plan: Plan, tmp_path: Path) -> None:
    for seed in range(1, 12):
        schedule = schedule_of(plan, seed)
        assert read_schedule(written(schedule, tmp_path)) == schedule


def test_faults_that_a_scenario_may_declare_become_its_own(plan: Plan) -> None:
    seed = next(seed for seed in SEEDS if {"restarts", "mute"} & schedule_of(plan, seed).kinds)
    schedule = schedule_of(plan, seed)
    declared = [fault.said() for fault in schedule.fault if KINDS[fault.kind].is_of_scenario]
    own = [table.model_dump(exclude_none=True) for table in schedule.scenario().fault]
    assert [{**table, "at_s": table["at_s"]} for table in own] == declared


def changed(schedule: Schedule, old: str, new: str) -> str:
    text = schedule.as_toml()
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("version = 1", "version = 7", "stress.version = 7: this is version 1"),
        ('"AUV02"]', '"AUV03"]', "stress.vehicles"),
        ('kind = "mute"', 'kind = "mutes"', "did you mean 'mute'?"),
        ('vehicle = "AUV01"\nat_s', 'vehicle = "AUV09"\nat_s', "fault.1.vehicle"),
        ("at_s = 50.0\nuntil_s = 90.0", "at_s = 500000.0", "must be below stress.bound_s"),
        ("until_s = 90.0", "until_s = 40.0", "must be above at_s = 50"),
        ("until_s = 90.0", "until_s = 90.0\nbits = 3", "not used by kind mute"),
        ("until_s = 90.0", "untill_s = 90.0", "did you mean 'until_s'?"),
        ('scenario = "mapping-rendezvous"', 'scenario = "mapping-rendezvouz"', "did you mean 'mapping-rendezvous'?"),
        ("[stress]", "[stress", "TOML"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(old: str, new: str, says: str, plan: Plan, tmp_path: Path) -> None:
    mute = StressFault(kind="mute", vehicle="AUV01", at_s=50.0, until_s=90.0)
    path = tmp_path / "wrong.toml"
    path.write_text(changed(schedule_of(plan, 1).with_faults([mute]), old, new), encoding="utf-8")
    with pytest.raises(ConfigurationError) as refused:
        read_schedule(path)
    message = str(refused.value)
    assert says in message
    assert message.startswith(str(path))
    assert len(message.splitlines()) == 1


def test_an_unknown_kind_is_refused_with_the_nearest() -> None:
    with pytest.raises(ConfigurationError, match="did you mean 'partition'"):
        plan_of("mapping-rendezvous", kinds=["partitions"])
