"""Configurations: what a seed draws of the settings of a scenario, and the run without faults that it is measured by.

Seeds come in blocks. Those of a block have one configuration, a function of the first; that one is run without faults,
and says by when the others have to be done, and at which instants something rare is under way. So a configuration
costs no run that is not a schedule itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from missions.errors import ConfigurationError
from missions.scenarios import load
from stress.drawing import Plan, of_scenario
from stress.draws import SETTINGS as PURPOSE
from stress.draws import Draws, stream_of
from stress.schedule import VERSION, Schedule, StressTable, overrides
from stress.settings import SETTINGS
from stress.trial import Outcome

SEEDS_EACH = 6
"""Seeds of a block."""
LONGEST = 8.0
"""How many times as long as with the settings of its file a mission without faults may take, beside waits."""
HEALED_S = 1.0
"""Nothing has to heal where nothing befalls the fleet."""


def first_of(seed: int) -> int:
    """The first seed of the block of one."""
    return seed - seed % SEEDS_EACH


def drawn_settings(plan: Plan, seed: int) -> dict[str, tuple[str, ...]]:
    """KEY=VALUE of each setting that a seed draws; what the scenario refuses beside those before it is left out."""
    found: dict[str, tuple[str, ...]] = {}
    scenario = load(plan.scenario, overrides(plan.strategy, plan.settings))
    for name in plan.draws:
        setting, draws = SETTINGS[name], Draws(seed, stream_of(name), PURPOSE)
        if draws.uniform() >= (setting.p if len(plan.draws) > MOST_NAMED else NAMED_P):
            continue
        lines = setting.lines(draws, scenario)
        try:
            more = load(plan.scenario, overrides(plan.strategy, plan.settings, {**found, name: lines}))
        except ConfigurationError:
            continue
        if more != scenario:
            found[name], scenario = lines, more
    return found


MOST_NAMED, NAMED_P = 5, 0.5
"""Where the user names so few settings, each is drawn in half of the configurations."""


def baseline(plan: Plan, seed: int) -> Schedule:
    """The schedule of the first seed of a block: its configuration, without faults."""
    drawn = drawn_settings(plan, seed)
    own = of_scenario(plan, load(plan.scenario, overrides(plan.strategy, plan.settings, drawn)))
    may_fail = any(SETTINGS[name].why_unfinished for name in drawn)
    about = StressTable(
        version=VERSION,
        scenario=plan.scenario,
        strategy=plan.strategy,
        settings=plan.settings,
        vehicles=own.vehicles,
        seed=seed,
        heal_s=HEALED_S,
        bound_s=min(plan.duration_s, round(LONGEST * plan.usual_s + own.wait_s + own.grace_s, 1)),
        must_finish=plan.completes and not may_fail,
        must_end=plan.completes,
    )
    return Schedule(stress=about, settings=drawn)


def plan_for_block(plan: Plan, outcome: Outcome) -> Plan:
    """The plan of the other seeds of a block, by what came of the first."""
    schedule = outcome.schedule
    own = of_scenario(plan, load(plan.scenario, schedule.overrides))
    return replace(
        own,
        drawn=schedule.settings,
        usual_s=outcome.end_s,
        completes=outcome.completed,
        must_end=schedule.stress.must_end,
        instants=outcome.instants if schedule.stress.must_end else (),
    )


def settings_line(settings: Mapping[str, tuple[str, ...]]) -> str:
    """Settings in one line; the scenario's own if there are none."""
    return "; ".join(", ".join(lines) for lines in settings.values()) or "the settings of the scenario"
