"""Settings that a seed may draw: what of a scenario is not as its file has it, each in a stream of its own.

A setting is a group of keys that belong together. It is on with a probability of its own, and what it sets is a pure
function of seed and name, so that leaving one out shifts no draw of another. What the user has fixed is not drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from exchange.acoustics.modems import modems
from exchange.policies import PAPER_POLICIES
from missions.errors import ConfigurationError, ConfigurationFault
from missions.feature import Sample
from missions.files import toml_value
from missions.scenarios.extending import features
from missions.scenarios.scenario import Scenario
from remoras.strategies import strategies
from stress import sampling
from stress.draws import Draws
from stress.sampling import choice_of
from worldmodel import suggestion

OFTEN, NOW_AND_THEN, SELDOM = 0.3, 0.075, 0.03
"""Probabilities that a setting is drawn: most schedules have two to four."""
NONE, EVERY = "none", "all"
"""What ``--settings`` takes beside names."""


@dataclass(frozen=True)
class Setting:
    """One setting.

    Attributes:
        name: as ``--settings`` and files of schedules say it; text: what is drawn.
        keys: what it sets; one of ``[vehicle]`` is that of any vehicle.
        draw: values by key; empty where the scenario has nothing that it could set.
        p: probability that it is drawn.
        why_unfinished: why a mission with it need not be completed; empty where it has to be.
    """

    name: str
    text: str
    keys: tuple[str, ...]
    draw: Sample
    p: float = NOW_AND_THEN
    why_unfinished: str = ""

    def lines(self, draws: Draws, scenario: Scenario) -> tuple[str, ...]:
        """KEY=VALUE of what is drawn."""
        return tuple(f"{key}={toml_value(value)}" for key, value in self.draw(draws, scenario).items())

    def is_fixed_by(self, given: Sequence[str]) -> bool:
        """True if the user has set any of its keys, or a table around one."""
        fixed = [setting.partition("=")[0].strip().split(".") for setting in given]
        return any(_overlap(key.split("."), path) for key in self.keys for path in fixed)


def _overlap(key: Sequence[str], given: Sequence[str]) -> bool:
    """True if one of two dotted keys is the other's, or around it; of a vehicle without its name."""
    if key[0] == given[0] == "vehicle" and len(given) > 1:
        given = ["vehicle", *given[2:]]
    return all(one == other for one, other in zip(key, given, strict=False))


LOSES_THEM = "a vehicle whose battery is empty does nothing any more"
CORE = (
    Setting("strategy", "any shipped strategy", ("strategy.name", "strategy.parameters"),
            lambda draws, scenario: {"strategy.name": draws.one_of(sorted(strategies()))}, p=0.6),
    Setting("policy", "any of the six policies of the papers", ("communication.policy",),
            choice_of("communication.policy", *sorted(PAPER_POLICIES)), OFTEN),
    Setting("channel", "bernoulli with 0.05 to 0.8, gilbert-elliott, acoustic, matrix or perfect, with settings",
            ("channel.name", "channel.per", "channel.link", "channel.p_good_to_bad", "channel.wind_mps"),
            sampling.channel, OFTEN),
    Setting("size", "1 to 4 copies of a vehicle with sensors, in layers or not", ("fleet",), sampling.size),
    Setting("topology", "links nearly cut: one or some, one way or both, a line, two halves, a star; a network",
            ("channel.name", "channel.per", "channel.link", "channel.network", "channel.nodes"), sampling.topology),
    Setting("site", "where the channel is acoustic: faint sources, links that differ by place, time and receiver",
            ("channel.site", "channel.source_level_db"), sampling.site, p=0.5),
    Setting("speeds", "a vehicle half to twice as fast", ("vehicle.transit_speed_mps", "vehicle.survey_speed_mps"),
            sampling.speeds),
    Setting("turns", "a vehicle that turns and gains speed otherwise",
            ("vehicle.turn_rate_radps", "vehicle.acceleration_mps2"), sampling.steering, SELDOM),
    Setting("sensors", "a vehicle without its sensors", ("vehicle.sensor",), sampling.sensors),
    Setting("energy", "a battery for 1 to 40 min", ("vehicle.energy_j",), sampling.energy, why_unfinished=LOSES_THEM),
    Setting("starts", "a vehicle that starts elsewhere", ("vehicle.start_m",), sampling.starts, SELDOM),
    Setting("social", "a vehicle without the social layer", ("vehicle.social_layer",), sampling.social, SELDOM),
    Setting("lease", "leases of 3 to 100 frames", ("communication.lease_frames",),
            choice_of("communication.lease_frames", 3, 5, 20, 100)),
    Setting("evidence", "who sends an item is not taken to hold it", ("communication.carrier_evidence",),
            choice_of("communication.carrier_evidence", False)),
    Setting("queue", "queues of 3 to 100 items", ("communication.queue_limit",),
            choice_of("communication.queue_limit", 3, 10, 100)),
    Setting("value", "another rule of what goes first", ("communication.value",),
            choice_of("communication.value", "goby", "age", "deadline")),
    Setting("modem", "another modem: rate, size of packets", ("communication.modem",),
            lambda draws, scenario: {"communication.modem": draws.one_of(sorted(modems()))}, SELDOM),
    Setting("range", "0.3 to 2 times the range", ("communication.range_m",),
            lambda draws, scenario: {
                "communication.range_m": round(scenario.communication.range_m * draws.scaled(0.3, 2.0))}, SELDOM),
    Setting("guard", "a guard of 1 to 3 s", ("communication.guard_s",), choice_of("communication.guard_s", 1.0, 3.0),
            SELDOM),
    Setting("checksum", "8, 16 or 32 bits", ("communication.crc_bits",),
            choice_of("communication.crc_bits", 8, 16, 32)),
    Setting("times", "times on the wire to 0.01 to 1 s", ("communication.time_resolution_s",),
            choice_of("communication.time_resolution_s", 0.01, 0.5, 1.0), SELDOM),
    Setting("listening", "the modem's listening is counted", ("communication.count_listening",),
            choice_of("communication.count_listening", True), SELDOM),
    Setting("blackout", "the channel, or a vehicle, is cut off for 10 to 200 s", ("channel.blackout",),
            sampling.blackout),
    Setting("followed", "who needs what follows from groups", ("communication.needs_follow",),
            choice_of("communication.needs_follow", "groups")),
    Setting("priorities", "three attributes more or less urgent", ("communication.needs",),
            sampling.draw_priorities, SELDOM),
    Setting("information", "who knows of the jobs of a group", ("group", "communication.needs_follow"),
            sampling.information, SELDOM),
    Setting("decision", "one or two of period, weights, memory of signals", ("decision",),
            sampling.decision),
    Setting("guidance", "separation of 2 to 12 m, attraction, repulsion", ("guidance",), sampling.guidance, SELDOM),
    Setting("deadline", "a tenth to all of the wait at meetings", ("mission.meeting_deadline_s",),
            sampling.of_mission("meeting_deadline_s", 0.1, 1.0)),
    Setting("patience", "a quarter to four times the patience", ("mission.patience_s",),
            sampling.of_mission("patience_s", 0.25, 4.0), SELDOM),
    Setting("waiting", "blocks wait 20 s, or 2 at most", ("worldmodel.waiting_s", "worldmodel.waiting_blocks"),
            lambda draws, scenario: draws.one_of(({"worldmodel.waiting_s": 20.0}, {"worldmodel.waiting_blocks": 2})),
            SELDOM),
    Setting("sound", "sound at 1400 to 1600 m/s", ("world.sound_speed_mps",),
            choice_of("world.sound_speed_mps", 1400.0, 1450.0, 1600.0), SELDOM),
    Setting("tick", "motion ticks of 0.5 s", ("scenario.tick_s",), choice_of("scenario.tick_s", 0.5), SELDOM),
    Setting("parameters", "a parameter of the strategy, half or twice as much", ("strategy.parameters",),
            sampling.parameter, SELDOM),
)  # fmt: skip
"""Settings of what every scenario has."""
CATALOGUE = (
    *CORE,
    *(
        Setting(trial.name, trial.text, trial.keys, trial.draw, trial.p)
        for feature in features().values()
        for trial in feature.trials
    ),
)
"""Settings in the order in which they are applied and tables show them: those of features come last."""
SETTINGS: dict[str, Setting] = {setting.name: setting for setting in CATALOGUE}


def settings_named(asked: str, given: Sequence[str], strategy: str = "") -> tuple[str, ...]:
    """Settings from which seeds draw.

    Args:
        asked: ``none``, ``all``, or names with commas.
        given: KEY=VALUE that the user has fixed; strategy: that the user has.

    Raises:
        ConfigurationError: there is none of a name, or the user has fixed what is named.

    >>> settings_named("size", ["fleet.size=5"])
    Traceback (most recent call last):
    missions.errors.ConfigurationError: remoras stress: --settings = "size": --set fixes fleet; leave one out
    """
    fixed = [*given, *([f"strategy.name={strategy}"] if strategy else [])]
    free = [setting.name for setting in CATALOGUE if not setting.is_fixed_by(fixed)]
    if asked in (NONE, EVERY):
        return tuple(free) if asked == EVERY else ()
    named = [part.strip() for part in asked.split(",") if part.strip()]
    for name in named:
        if name not in SETTINGS:
            known = [NONE, EVERY, *SETTINGS]
            allowed = f"allowed: {', '.join(known)}{suggestion(name, known)}"
            raise ConfigurationError("remoras stress", [ConfigurationFault("--settings", f'"{name}"', allowed)])
        if name not in free:
            key = next(key for key in SETTINGS[name].keys if Setting("", "", (key,), choice_of("")).is_fixed_by(fixed))
            allowed = f"--{'strategy' if strategy and key.startswith('strategy') else 'set'} fixes {key}; leave one out"
            raise ConfigurationError("remoras stress", [ConfigurationFault("--settings", f'"{name}"', allowed)])
    return tuple(name for name in SETTINGS if name in named)
