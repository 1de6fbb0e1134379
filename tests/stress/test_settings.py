"""Settings that seeds draw: each in a stream of its own, refused by name, run alone, and put back by shrinking."""

from dataclasses import replace
from itertools import permutations
from math import isinf
from pathlib import Path

import pytest
from small_sea import SMALL, small_plan

from exchange.acoustics.link import Transmission
from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.runs.summary import summary
from missions.scenarios import load
from missions.scenarios.deployment import deployment_of
from stress.campaign import campaign, judge
from stress.configurations import SEEDS_EACH, baseline, drawn_settings, first_of, plan_for_block
from stress.drawing import Plan, excludes, schedule_of
from stress.schedule import Schedule, StressFault, read_schedule
from stress.settings import SETTINGS, settings_named
from stress.shrinking import shrunk
from stress.steering import Instant
from stress.trial import Broken, Outcome, digest_of
from stress.ways import NEARLY_CUT, losses_of, losses_there, packets_each

SEEDS = range(0, 40 * SEEDS_EACH, SEEDS_EACH)


ACOUSTIC = ("channel.name=acoustic",)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return small_plan(strategy="", draws="all")


@pytest.mark.slow
def test_most_configurations_draw_two_to_four_settings_and_each_is_drawn_for_itself(plan: Plan) -> None:
    drawn = {seed: drawn_settings(plan, seed) for seed in SEEDS}
    assert sum(2 <= len(one) <= 4 for one in drawn.values()) > len(drawn) / 2
    fewer = small_plan(strategy="", settings=("communication.policy=ack",), draws="all")
    assert "policy" not in fewer.draws
    for seed, one in drawn.items():
        others = drawn_settings(fewer, seed)
        assert {name: lines for name, lines in one.items() if name in others and name != "policy"} == others


def test_every_setting_can_be_drawn_and_is_allowed(plan: Plan) -> None:
    for name in SETTINGS:
        alone = replace(plan, settings=ACOUSTIC if name == "site" else (), draws=(name,))
        assert any(name in drawn_settings(alone, seed) for seed in SEEDS), name


@pytest.mark.parametrize(
    ("asked", "given", "says"),
    [
        ("polisy", (), "did you mean 'policy'"),
        ("policy", ("communication.policy=ack",), "fixes communication.policy"),
        ("speeds", ("vehicle.AUV01.survey_speed_mps=1.0",), "leave one out"),
    ],
)
def test_what_is_unknown_or_fixed_is_refused(asked: str, given: tuple[str, ...], says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        settings_named(asked, given)


def test_a_file_repeats_the_settings_and_its_scenario_runs_alone(plan: Plan, tmp_path: Path) -> None:
    seed = next(seed for seed in SEEDS if {"size"} & drawn_settings(plan, seed).keys())
    schedule = baseline(plan, seed)
    with_fault = schedule.with_faults((StressFault(kind="mute", vehicle="AUV03", at_s=20.0, until_s=60.0),))
    path, alone = tmp_path / "schedule.toml", tmp_path / "alone.toml"
    path.write_text(with_fault.as_toml(), encoding="utf-8")
    alone.write_text(with_fault.as_scenario(), encoding="utf-8")
    assert read_schedule(path) == with_fault
    outcome, found = judge(with_fault), run(load(str(alone)), seed)
    assert digest_of(found.recorder, summary(found)) == outcome.digest


def test_a_clock_of_a_copy_may_jump(plan: Plan) -> None:
    seed = next(seed for seed in SEEDS if {"size"} & drawn_settings(plan, seed).keys())
    jump = StressFault(kind="clock", vehicle="AUV03", at_s=20.0, until_s=60.0, by_s=2.0)
    scenario = baseline(plan, seed).with_faults((jump,)).scenario()
    assert next(one for one in scenario.vehicle if one.name == "AUV03").clock is not None


def test_settings_are_put_back_unless_they_are_needed(plan: Plan) -> None:
    needed = {"policy": ("communication.policy=m-ack",)}
    drawn = {**needed, "lease": ("communication.lease_frames=20",)}

    def judged(schedule: Schedule) -> Outcome:
        broken = Broken("rest", 300.0, "") if "policy" in schedule.settings else None
        return Outcome(schedule, broken, ("rest",), {}, {}, False, 300.0, "", 0.0)

    small = shrunk(judged(baseline(plan, 0).with_settings(drawn)), judged)
    assert small.schedule.settings == needed
    assert small.schedule.fault == ()


@pytest.mark.slow
def test_seeds_of_a_block_share_one_configuration_and_its_first_has_no_faults() -> None:
    report = campaign(small_plan("links", draws="policy"), range(5, 9))
    assert [one.seed for one in report.outcomes] == [5, 6, 7, 8]
    assert [bool(one.schedule.fault) for one in report.outcomes] == [True, False, True, True]
    settings = [one.schedule.settings for one in report.outcomes]
    assert settings[1] == settings[2] == settings[3]
    assert first_of(5) == 0


@pytest.mark.slow
def test_steered_schedules_have_faults_near_an_instant_and_none_that_exclude_each_other(plan: Plan) -> None:
    outcome = Outcome(baseline(plan, 0), None, (), {}, {}, True, 400.0, "", 0.0, (), (Instant(350.0, "end"),))
    drawn = [schedule_of(plan_for_block(plan, outcome), seed) for seed in range(1, 200)]
    near = [any(abs(one.at_s - 350.0) <= 20.0 for one in schedule.fault) for schedule in drawn]
    assert 0.3 * len(near) < sum(near) < 0.7 * len(near)
    for schedule in drawn:
        faults = schedule.fault
        assert not any(excludes(one, other) for at, one in enumerate(faults) for other in faults[:at])
        assert all(one.until_s is None or one.until_s <= schedule.stress.heal_s for one in faults)


def test_without_settings_a_schedule_is_as_it_was() -> None:
    assert SMALL
    assert schedule_of(small_plan(), 47).settings == {}
    assert not schedule_of(small_plan(), 47).stress.must_end


def test_seas_with_cut_links_join_all_vehicles(plan: Plan) -> None:
    alone, shapes = replace(plan, draws=("topology",)), set()
    for seed in range(0, 60 * SEEDS_EACH, SEEDS_EACH):
        scenario = baseline(alone, seed).scenario()
        losses = losses_of(scenario)
        if losses:
            shapes.add(frozenset(pair for pair in losses if losses[pair] >= NEARLY_CUT))
            assert packets_each(losses, True, scenario.names_by_slot) < 100.0
            assert isinf(packets_each(losses, False, scenario.names_by_slot))
    assert len(shapes) > 15


def test_a_site_is_drawn_where_the_channel_is_acoustic_and_shifts_no_other_draw(plan: Plan) -> None:
    without = replace(plan, draws=tuple(name for name in plan.draws if name != "site"))
    for seed in range(0, 150 * SEEDS_EACH, SEEDS_EACH):
        drawn = drawn_settings(plan, seed)
        site = drawn.pop("site", None)
        assert drawn == drawn_settings(without, seed)
        assert site is None or 'channel.name="acoustic"' in drawn["channel"]


def test_links_of_sites_that_are_drawn_differ_on_this_ground(plan: Plan) -> None:
    """Of links of 150 m some lose nearly all, some nearly nothing, and many a part."""
    alone, losses = replace(plan, settings=(*SMALL, *ACOUSTIC), draws=("site",)), []
    for seed in SEEDS:
        if not drawn_settings(alone, seed):
            continue
        scenario = baseline(alone, seed).scenario()
        deployment = deployment_of(scenario)
        places = [(106.0 * number, 106.0 * number) for number in range(len(deployment.nodes))]
        packet = Transmission(0, 0, 60.0, 512, places)
        losses.append(scenario.channel.link_model(deployment, seed).p_loss(packet, 1, 150.0))
    assert len(losses) >= 15
    for low, high in ((0.0, 0.1), (0.1, 0.9), (0.9, 1.0)):
        assert sum(low <= loss <= high for loss in losses) >= 2


def test_links_that_are_cut_where_vehicles_stay_are_told_of_the_channel_acoustic() -> None:
    """Far vehicles hear nothing of faint sources; in a site noise near a receiver cuts one way alone."""
    faint = [("--set", line) for line in ("channel.name=acoustic", "channel.source_level_db=107")]
    near, far = [(10.0 * k, 0.0) for k in range(4)], [(0.0, 0.0), (10.0, 0.0), (20.0, 0.0), (900.0, 0.0)]
    scenario = load("mapping-rendezvous", faint)
    assert max(losses_there(scenario, 1, near, 0.0, 900.0).values()) < 0.1
    cut = {pair for pair, loss in losses_there(scenario, 1, far, 0.0, 900.0).items() if loss >= NEARLY_CUT}
    last = scenario.names_by_slot[-1]
    assert cut == {pair for pair in permutations(scenario.names_by_slot, 2) if last in pair}
    site = load("mapping-rendezvous", [*faint, ("--set", "channel.site.receiver_db=30")])
    found = [losses_there(site, seed, near, 0.0, 900.0) for seed in range(8)]
    assert any(one[a, b] > NEARLY_CUT and one[b, a] < 0.1 for one in found for a, b in one)
    assert losses_there(load("mapping-rendezvous"), 1, near, 0.0, 900.0) == {}


def test_news_takes_the_ways_that_exist() -> None:
    line = {pair: 0.5 if abs(ord(pair[0]) - ord(pair[1])) == 1 else 1.0 for pair in permutations("abcd", 2)}
    assert packets_each(line, True, "abcd") == 12.0
    assert isinf(packets_each(line, False, "abcd"))
    assert isinf(packets_each(line, True, "abd"))
    assert packets_each(line, False, "ab") == 4.0
    assert packets_each(line, True, "a") == 1.0
    assert isinf(packets_each(line | {("a", "b"): 0.9}, True, "ab"))
