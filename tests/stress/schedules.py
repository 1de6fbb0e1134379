"""Schedules: faults and settings of one run, drawn by Hypothesis and read from TOML files."""

from __future__ import annotations

import math
import tempfile
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from itertools import pairwise, permutations
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w
from hypothesis import HealthCheck
from hypothesis import strategies as st

from exchange.channel import loss
from exchange.channel.modems import modems
from exchange.channel.network import shipped
from exchange.policy.policies import PAPER_POLICIES, POLICIES
from missions.errors import ConfigurationError
from missions.files import toml_value
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load
from remoras.strategies import parameters, strategies

CAMPAIGN = {"suppress_health_check": list(HealthCheck)}
"""Settings of Hypothesis for tests that run missions."""
GROUND = "mapping-rendezvous"
SMALL = (
    "area.middle.corners_m=[[50,50],[50,150],[150,150],[150,50]]",
    "area.left.corners_m=[[150,50],[150,150],[250,150],[250,50]]",
    "area.right.corners_m=[[50,150],[50,250],[150,250],[150,150]]",
    'rally_point."operational rally".position_m=[200,200]',
    'rally_point."coordination rally".position_m=[240,240]',
    "communication.lease_frames=10",
    "mission.meeting_deadline_s=360",
    "strategy.name=remoras",
)
"""Three areas of 100 m, so that a run takes a fifth of the time."""

# Kinds of faults ----------------------------------------------------------------------------------

Drawn = st.SearchStrategy[Any]


class Kind(NamedTuple):
    """A kind of faults: keys that are drawn, and whether it may last for good, or happens at a time and is over."""

    keys: Mapping[str, Drawn] = {}
    may_stay: bool = False
    is_sudden: bool = False


def _share(low: float, high: float) -> dict[str, Drawn]:
    return {"share": st.floats(low, high).map(lambda share: round(share, 2))}


def _of(key: str, *values: Any) -> dict[str, Drawn]:
    return {key: st.sampled_from(values)}


LINKS = {
    "loss": Kind(_share(0.1, 0.9)),
    "bursts": Kind(_share(0.2, 0.8) | _of("slots", 8, 20, 60)),
    "partition": Kind(_of("one_way", False, True)),
    "twice": Kind(_share(0.1, 0.6) | _of("slots", 1, 2, 4, 8)),
    "late": Kind(_share(0.1, 0.6) | _of("slots", 0.1, 1, 2, 4, 8)),
    "echo": Kind(_share(0.1, 0.6) | _of("slots", 0.2, 1, 4)),
    "bits": Kind(_share(0.05, 0.5) | _of("bits", 1, 2, 4, 8)),
    "cut": Kind(_share(0.05, 0.5)),
    "forged": Kind(_share(0.05, 0.3)),
}
DECLARED = {
    **dict.fromkeys(("lost", "mute", "deaf", "sensor"), Kind(may_stay=True)),
    "restarts": Kind(_of("memory", "kept", "lost")), "joins": Kind(is_sudden=True),
    "slow": Kind(_of("factor", 0.8, 0.6, 0.4), may_stay=True), "drains": Kind(_of("drain_w", 50.0, 200.0)),
}  # fmt: skip
"""Kinds that a scenario may declare."""
KINDS = {
    **LINKS,
    **DECLARED,
    "clock": Kind(_of("by_s", 0.3, -0.3, 2.0, -2.0, 30.0, -30.0)),
    "random": Kind(_share(0.2, 1.0)),
    "frozen": Kind(),
    "misplaced": Kind(_share(0.1, 1.0), may_stay=True),
    **dict.fromkeys(("forged-role", "forged-objective", "forged-done"), Kind(is_sudden=True)),
    "forged-lead": Kind(_of("term", 1, 2, 64, 65, 128, 254, 255), is_sudden=True),
    "sulks": Kind(_share(0.1, 1.0)),
}
AWAY = frozenset({"lost", "restarts", "joins", "killed"})
OTHERS = {"noise": Kind(_share(0.02, 1.0) | _of("packets", 1, 4, 40)), "foreign": Kind(_share(0.1, 1.0))}
"""What nodes hear beside packets: random bytes, and those of another fleet."""
OF_NODES = {**LINKS, **DECLARED, **OTHERS, "killed": Kind()}
"""Kinds that may befall nodes; one that is killed goes on from its log."""
DAMAGE = frozenset({"bits", "cut", "forged", "noise", "foreign"})
OF_SENSORS = frozenset({"sensor", "random", "frozen"})
WORK = frozenset({"sensor", "drains", "biased"})
"""Kinds under which work may stay undone though no vehicle is to blame."""
FOR_GOOD = " for good"
"""Behind a kind of which a fault lasts for good: less is promised then."""


@dataclass(frozen=True)
class StressFault:
    """One ``[[fault]]``; what a scenario may declare is the same there. ``until_s`` None is for good."""

    kind: str
    at_s: float
    vehicle: str = ""
    peer: str = ""
    until_s: float | None = None
    share: float = 1.0
    slots: float = 1.0
    bits: int = 1
    packets: int = 1
    one_way: bool = False
    by_s: float = 0.0
    by_m: float = 5000.0
    term: int = 1
    memory: str | None = None
    factor: float | None = None
    drain_w: float | None = None

    def holds(self, now_s: float) -> bool:
        """True while it holds."""
        return self.at_s <= now_s < (math.inf if self.until_s is None else self.until_s)

    @property
    def is_permanent(self) -> bool:
        """True if it lasts for good."""
        return self.until_s is None and (KINDS | OF_NODES)[self.kind].may_stay

    def said(self) -> dict[str, Any]:
        """Its keys that are no defaults."""
        return {one.name: value for one in fields(self) if (value := getattr(self, one.name)) != one.default}

    def excludes(self, other: StressFault) -> bool:
        """True if both cannot be in one schedule: the same of one vehicle, or one that is away twice."""
        is_same = bool(self.vehicle) and self.vehicle == other.vehicle
        return is_same and (self.kind == other.kind or {self.kind, other.kind} <= AWAY)


@dataclass(frozen=True)
class Schedule:
    """One run: equal schedules give equal runs, byte for byte.

    Attributes:
        seed: of all draws; heal_s: when what is transient is over; bound_s: end of the run.
        settings: KEY=VALUE of the scenario.
        must_finish: survivors have to complete the mission by the bound; must_end: the run has to be over before it.
    """

    seed: int
    heal_s: float
    bound_s: float
    settings: tuple[str, ...] = SMALL
    fault: tuple[StressFault, ...] = ()
    scenario: str = GROUND
    must_finish: bool = True
    must_end: bool = False

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds of its faults."""
        return frozenset(fault.kind for fault in self.fault)

    def numbered(self) -> Iterator[tuple[int, StressFault]]:
        """Faults with numbers by which their draws are keyed: those of a fault do not depend on the others."""
        for fault in self.fault:
            name = f"{fault.kind} {fault.vehicle} {fault.peer} {fault.at_s}"
            yield sum(ord(letter) * int(31**place) for place, letter in enumerate(name)) % (1 << 31), fault

    def as_toml(self) -> str:
        """The schedule as a file."""
        about = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "fault"}
        return tomli_w.dumps(about | {"fault": [fault.said() for fault in self.fault]})

    def loaded(self) -> Scenario:
        """The scenario of the run, with its quiet time and those of its faults that it may declare."""
        own, quiet_s = _known(self.scenario, self.settings)
        clocks: dict[str, float] = {}
        for fault in self.fault:
            if fault.kind == "clock":
                clocks[fault.vehicle] = clocks.get(fault.vehicle, 0.0) + (fault.by_s if fault.at_s == 0.0 else 0.0)
        given = {"scenario.duration_s": self.bound_s, "scenario.settle_s": quiet_s}
        given |= {f"vehicle.{name}.clock": {"offset_s": off_s or READY_S} for name, off_s in clocks.items()}
        given["fault"] = [*own, *(fault.said() for fault in self.fault if fault.kind in DECLARED)]
        return loaded(self.scenario, (*self.settings, *(f"{key}={toml_value(value)}" for key, value in given.items())))


READY_S = 1e-6
"""Offset of a clock that jumps in the run: its vehicle has a clock of its own from the start."""
NEARLY_CUT = 0.9
"""Share of packets lost from which on a link is nearly cut."""
SETTLE_FRAMES = 960
"""Longest quiet time after the mission: at 80 % loss 38 packets with their answers on the worst link."""


def read_schedule(path: Path) -> Schedule:
    """Read the schedule of a file."""
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    faults = tuple(StressFault(**one) for one in raw.pop("fault", ()))
    return Schedule(**raw | {"settings": tuple(raw["settings"])}, fault=faults)


def loaded(scenario: str, settings: Sequence[str]) -> Scenario:
    """Load a scenario with settings."""
    return load(scenario, [("--set", setting) for setting in settings])


@cache
def _known(scenario: str, settings: tuple[str, ...]) -> tuple[tuple[dict[str, Any], ...], float]:
    """Faults of the scenario itself, and its longest quiet time (s)."""
    own = loaded(scenario, settings)
    faults = tuple(table.model_dump(mode="json", exclude_none=True) for table in own.fault)
    return faults, SETTLE_FRAMES * resolved(own).schedule.frame_s


def befalls(seed: int, fault: int, number: int, receiver: int, share: float) -> bool:
    """True if a fault befalls the packet of a slot, or the reading of a tick, at a receiver."""
    return share >= 1.0 or loss.uniform(seed, PACKETS, fault, number & 0xFFFF, receiver | number >> 16 << 8) < share


PACKETS = 1001
"""`trial` of the draws that say which packets and readings a fault befalls."""

# Settings -----------------------------------------------------------------------------------------

Draw = st.DrawFn


def number(low: float, high: float) -> Drawn:
    """A number with three digits."""
    return st.floats(low, high).map(lambda value: float(f"{value:.3g}"))


def table(name: str, keys: Mapping[str, Drawn], optional: Mapping[str, Drawn] | None = None) -> Drawn:
    """Keys of a table; of those that are optional, one at least."""
    given, some = ({f"{name}.{key}": value for key, value in of.items()} for of in (keys, optional or {}))
    return st.fixed_dictionaries(given, optional=some).filter(bool)


ACOUSTIC = {
    "channel.name": st.just("acoustic"),
    "channel.wind_mps": number(0.0, 15.0),
    "channel.shipping": number(0.0, 1.0),
    "channel.source_level_db": number(105.0, 170.0),
    "channel.fading": st.sampled_from(("bit", "frame", "packet", "none")),
}
SITE = {
    "channel.site.spread_db": number(1.0, 12.0),
    "channel.site.distance_m": number(20.0, 500.0),
    "channel.site.time_h": number(0.02, 2.0),
    "channel.site.receiver_db": st.just(0.0) | number(1.0, 6.0),
}
CHANNELS = st.one_of(
    st.just({"channel.name": "perfect"}),
    table("channel", {"name": st.just("bernoulli"), "per": number(0.05, 0.8)}),
    table("channel", {"name": st.just("gilbert-elliott"), "p_good_to_bad": number(0.02, 0.3),
                      "p_bad_to_good": number(0.05, 0.5), "per_good": number(0.0, 0.2), "per_bad": number(0.5, 1.0)}),
    st.fixed_dictionaries(ACOUSTIC),
    st.fixed_dictionaries(ACOUSTIC | SITE),
)  # fmt: skip


@st.composite
def _topology(draw: Draw, own: Scenario) -> dict[str, Any]:
    """Draw a sea in which links are nearly cut for the whole run, while all vehicles are joined by some path."""
    names = draw(st.permutations(own.names_by_slot))
    fitting = sorted(name for name, network in shipped().items() if len(network.nodes) >= len(names))
    network = draw(st.sampled_from(["", *fitting]))
    if network:
        nodes = dict(zip(names, draw(st.permutations(sorted(shipped()[network].nodes))), strict=False))
        return {"channel.name": "network", "channel.network": network, "channel.nodes": nodes}
    line = {*pairwise(names)}
    beside = [pair for pair in permutations(names, 2) if line.isdisjoint({pair, pair[::-1]})]
    cut = beside if draw(st.booleans()) else draw(st.lists(st.sampled_from(beside), min_size=1, unique=True))
    per = st.just(1.0) | number(NEARLY_CUT, 1.0)
    links = [{"sender": sender, "receiver": receiver, "per": draw(per)} for sender, receiver in cut]
    return {"channel.name": "matrix", "channel.per": draw(number(0.0, 0.3)), "channel.link": links}


def _blackout(own: Scenario) -> Drawn:
    who = st.sampled_from([{}, *({"vehicle": name} for name in own.names_by_slot)])
    made = st.builds(lambda at_s, for_s, whose: {"from_s": at_s, "until_s": at_s + for_s, **whose},
                     number(0.0, 600.0), number(10.0, 200.0), who)  # fmt: skip
    return st.fixed_dictionaries({"channel.blackout": made.map(lambda one: [one])})


def _vehicle(keys: Callable[[Any], Mapping[str, Drawn]]) -> Callable[[Scenario], Drawn]:
    """Keys of one vehicle, of which they may depend."""
    return lambda own: st.sampled_from(own.vehicle).flatmap(lambda one: table(f"vehicle.{one.name}", keys(one)))


def _energy(one: Any) -> Mapping[str, Drawn]:
    """A battery for 1 to 40 min."""
    power_w = one.hotel_w + one.drag_w_per_mps3 * one.survey_speed_mps**3
    return {"energy_j": number(60.0 * power_w, 2400.0 * power_w)}


def _parameter(own: Scenario) -> Drawn:
    """One number of the strategy, half or twice as much."""
    numbers = [one for one in parameters(strategies()[own.strategy.name]) if type(one.default) in (int, float)]
    varied = [(one, type(one.default)(one.default * factor)) for one in numbers for factor in (0.5, 2.0)]
    return st.sampled_from([{f"strategy.parameters.{one.name}": value or 1} for one, value in varied] or [{}])


def _size(own: Scenario) -> Drawn:
    n, sensing = len(own.vehicle), [one.name for one in own.vehicle if one.sensor]
    size = {"size": st.integers(n + 1, n + 4), "copies_of": st.sampled_from(sensing), "layers": st.booleans()}
    return table("fleet", size)


def _information(own: Scenario) -> Drawn:
    """Group facts about jobs are held by leaders."""
    groups = [group.name for group in own.group if any(role.job for role in group.role)]
    held = {f'group."{name}".information': "held by head" for name in groups}
    return st.just({"communication.needs_follow": "groups", **held})


TERMS = {"ttl_s": number(30.0, 600.0), "queue_limit": st.integers(1, 20), "newest_first": st.just(True),
         "blackout_s": number(5.0, 60.0), "acknowledged": st.just(False)}  # fmt: skip


def _need(own: Scenario) -> Drawn:
    """The least urgent facts have delivery requirements."""
    given = dict(own.communication.needs)
    attribute = min(sorted(given), key=given.__getitem__)
    need = {"attribute": attribute, "priority": given.pop(attribute)}
    terms = st.fixed_dictionaries({}, optional=TERMS)
    return terms.map(lambda some: {"need": [need | some], "communication.needs": given})


CHOICES: dict[str, tuple[Any, ...]] = {
    "strategy.name": tuple(sorted(strategies())), "communication.policy": tuple(sorted(PAPER_POLICIES)),
    "communication.lease_frames": (3, 5, 20, 100), "communication.carrier_evidence": (False,),
    "communication.queue_limit": (3, 10, 100), "communication.value": ("goby", "age", "deadline"),
    "communication.modem": tuple(sorted(modems())), "communication.range_m": (300, 1000, 3000),
    "communication.clock_tolerance_s": (1.0, 3.0), "communication.crc_bits": (8, 16, 32),
    "communication.time_resolution_s": (0.01, 0.5, 1.0), "communication.count_listening": (True,),
    "communication.needs_follow": ("groups",), "communication.relaying": (False,), "communication.parking": (False,),
    "communication.needs.mappedCell": (1, 20, 60), "communication.needs.playsRole": (1, 20, 60),
    "mission.meeting_deadline_s": (40.0, 120.0, 360.0), "mission.patience_s": (30.0, 120.0, 480.0),
    "worldmodel.waiting_s": (20.0,), "worldmodel.waiting_blocks": (2,), "scenario.tick_s": (0.5,),
    "world.sound_speed_mps": (1400.0, 1450.0, 1600.0),
}  # fmt: skip
"""Values of single keys."""
DRAWN: dict[str, Callable[[Scenario], Drawn]] = {
    "channel": lambda _: CHANNELS, "topology": _topology, "blackout": _blackout, "size": _size,
    "parameters": _parameter, "information": _information, "need": _need,
    "speeds": _vehicle(lambda one: {
        "transit_speed_mps": number(0.5 * one.transit_speed_mps, 2.0 * one.transit_speed_mps),
        "survey_speed_mps": number(0.5 * one.survey_speed_mps, one.survey_speed_mps)}),
    "turns": _vehicle(lambda _: {"turn_rate_radps": number(0.1, 1.0), "acceleration_mps2": number(0.05, 1.0)}),
    "sensors": _vehicle(lambda _: {"sensor": st.just([])}), "energy": _vehicle(_energy),
    "social": _vehicle(lambda _: {"social_layer": st.just(False)}),
    "starts": _vehicle(lambda _: {"start_m": st.tuples(number(0.0, 300.0), number(0.0, 300.0)).map(list)}),
    "decision": lambda _: table("decision", {}, {
        "period_s": st.sampled_from((1.0, 4.0, 8.0)), "weight_external": st.sampled_from((0.0, 1.0, 4.0)),
        "weight_continuing": st.sampled_from((0.0, 0.3)), "signal_memory_frames": st.sampled_from((1.0, 30.0))}),
    "guidance": lambda _: table("guidance", {}, {
        "separation_m": st.sampled_from((2.0, 5.0, 8.0, 12.0)), "attraction": st.sampled_from((0.0, 1.0, 3.0)),
        "repulsion": st.sampled_from((0.0, 2.0, 5.0))}),
    "current": lambda _: table("current", {}, {
        "east_mps": number(-0.4, 0.4), "north_mps": number(-0.4, 0.4), "shear_depth_m": number(10.0, 60.0),
        "tide_period_h": number(0.2, 12.4), "surge": st.builds(
            lambda at_s, lasts_s: [{"between_s": [at_s, at_s + 60.0], "lasts_s": lasts_s, "east_mps": 0.15}],
            number(0.0, 150.0), number(30.0, 300.0))}),
    "navigation": lambda _: table("navigation", {}, {"drift": number(0.0005, 0.05), "fix_s": number(5.0, 60.0)}),
    "uncertainty": lambda _: table("uncertainty", {}, {"p_miss": number(0.02, 0.5), "speed_spread": number(0.02, 0.3)}),
    "clocks": lambda _: table("communication", {"clocks": st.fixed_dictionaries(
        {"offset_s": number(0.0, 0.2), "drift_ppm": number(0.0, 500.0), "apart_s": st.sampled_from((0.5, 2.0, 5.0)),
         "discipline": st.just(True)})}),
}  # fmt: skip
"""Settings that belong together, and those that depend on the scenario."""
MOST_SETTINGS = 4


@st.composite
def settings(draw: Draw, given: tuple[str, ...] = SMALL) -> tuple[str, ...]:
    """Draw up to four settings beside those given; what the scenario refuses beside the others is left out."""
    own = loaded(GROUND, given)
    for name in draw(st.lists(st.sampled_from([*CHOICES, *DRAWN]), max_size=MOST_SETTINGS, unique=True)):
        found = {name: draw(st.sampled_from(CHOICES[name]))} if name in CHOICES else draw(DRAWN[name](own))
        kept = [line for line in given if line.partition("=")[0] not in found]
        more = (*kept, *(f"{key}={toml_value(one)}" for key, one in found.items()))
        try:
            own = loaded(GROUND, more)
        except ConfigurationError:
            continue
        given = more
    return given


# Schedules ----------------------------------------------------------------------------------------

LEASES, SLACK, LONGEST = 3, 1.5, 8.0
"""Leases of absence, and shares of the time without faults, that survivors have; time of a mission with settings."""
NEAR_S = (-20.0, -6.0, -2.0, -0.5, 0.0, 0.5, 2.0, 6.0)
"""When a targeted fault begins, from a rare moment on."""


class Baseline(NamedTuple):
    """A run without faults.

    Attributes:
        usual_s: its time; completes: whether it completes; spare_s: leases of absence and waits at meetings.
        moments: time (s) and vehicle of what is rare: acts, roles, absences, milestones.
        vehicles: all; sensing: those with sensors.
    """

    usual_s: float
    completes: bool
    spare_s: float
    moments: tuple[tuple[float, str], ...]
    vehicles: tuple[str, ...]
    sensing: tuple[str, ...]


@cache
def baseline(given: tuple[str, ...], most_s: float = math.inf) -> Baseline:
    """Run the mission without faults, for so long at most."""
    own = loaded(GROUND, given)
    spare_s = getattr(own.mission, "meeting_deadline_s", 0.0)
    spare_s += LEASES * own.communication.lease_frames * resolved(own).schedule.frame_s
    duration_s = min(own.scenario.duration_s, round(LONGEST * most_s + spare_s, 1))
    found = run(loaded(GROUND, (*given, f"scenario.duration_s={duration_s}")), seed=1)
    rows = [(row[0], row[1]) for name in ("roles", "organisation", "membership") for row in found.recorder.rows(name)]
    rows += [(stone.time_s, stone.vehicle) for stone in found.milestones]
    moments = tuple(sorted({(at_s, name) for at_s, name in rows if at_s > 0.0}))
    sensing = tuple(one.name for one in own.vehicle if one.sensor)
    return Baseline(found.end_s, found.completed, spare_s, moments, own.names_by_slot, sensing)


def ground_of(given: tuple[str, ...]) -> tuple[Baseline, Baseline]:
    """Run the small mission without faults, and so in the given settings."""
    usual = baseline(SMALL)
    return usual, baseline(given, usual.usual_s)


@st.composite
def faults(draw: Draw, kind: str, ground: Baseline, heal_s: float, staying: str) -> StressFault:
    """Draw one fault of a kind, near a rare moment or at any time, over by ``heal_s`` unless it lasts for good."""
    about, able = (KINDS | OF_NODES)[kind], ground.sensing if kind in OF_SENSORS else ground.vehicles
    near, name = draw(st.sampled_from(((0.0, ""), *ground.moments)))
    after_s = draw(st.sampled_from(NEAR_S)) if near else draw(number(0.0, 0.8 * heal_s))
    at_s = min(max(1.0, round(near + after_s, 1)), round(heal_s - 10.0, 1))
    vehicle = name if name in able and draw(st.booleans()) else draw(st.sampled_from(able))
    keys = {key: draw(values) for key, values in about.keys.items()}
    until_s = None if about.is_sudden else round(draw(st.floats(at_s + 10.0, heal_s)), 1)
    if about.may_stay and vehicle == staying and draw(st.booleans()):
        until_s = None
    if kind in LINKS and kind != "echo":
        peers = st.sampled_from([one for one in ground.vehicles if one != vehicle])
        whose = {"vehicle": vehicle}, {"vehicle": vehicle, "peer": draw(peers)}, {}
        keys |= draw(st.sampled_from(whose if kind != "partition" else whose[:2]))
    else:
        keys["vehicle"] = vehicle
    return StressFault(kind, at_s, until_s=until_s, **keys)


KEY = tempfile.NamedTemporaryFile("w")  # noqa: SIM115  # there as long as this process
KEY.write("00112233445566778899aabbccddeeff")
KEY.flush()
GUARDS = {"key": f"communication.key_file='{KEY.name}'", "checksum": "communication.crc_bits=32", "none": ""}


def node_settings(policy: str, per: float, guard: str) -> tuple[str, ...]:
    """Settings of the small mission for vehicles by themselves."""
    own = "channel.name=bernoulli", f"channel.per={per}", f"communication.policy={policy}", GUARDS[guard]
    return (*SMALL, *filter(None, own))


@st.composite
def node_schedules(draw: Draw, wide: bool = False) -> Schedule:
    """Draw a short schedule for vehicles by themselves, in further settings too if it is to be ``wide``."""
    policy, guard = draw(st.sampled_from(sorted(POLICIES))), draw(st.sampled_from(("key", "key", "checksum", "none")))
    given = node_settings(policy, draw(st.sampled_from((0.0, 0.0, 0.2, 0.4))), guard)
    given = draw(settings(given)) if wide else given
    own, heal_s = loaded(GROUND, given), draw(number(40.0, 100.0))
    ground = Baseline(heal_s, False, 0.0, (), own.names_by_slot, tuple(one.name for one in own.vehicle if one.sensor))
    chosen = draw(st.lists(st.sampled_from(sorted(OF_NODES)), max_size=4))
    return Schedule(draw(st.integers(0, 1 << 20)), heal_s, 600.0, given, draw(_befalling(chosen, ground, heal_s)))


@st.composite
def _befalling(draw: Draw, kinds: Sequence[str], ground: Baseline, heal_s: float) -> tuple[StressFault, ...]:
    """Draw a fault of each kind; only one vehicle is struck for good, and what excludes another is left out."""
    staying, found = draw(st.sampled_from(("", *ground.vehicles))), list[StressFault]()
    for kind in kinds:
        fault = draw(faults(kind, ground, heal_s, staying))
        if not any(fault.excludes(other) for other in found):
            found.append(fault)
    return tuple(sorted(found, key=lambda fault: (fault.at_s, fault.kind, fault.vehicle)))


@st.composite
def schedules(
    draw: Draw, needs: Collection[str] = (), given: st.SearchStrategy[tuple[str, ...]] | None = None
) -> Schedule:
    """Draw a schedule: one to four kinds, one of ``needs`` among them, in settings that are drawn too."""
    chosen = draw(given if given is not None else settings())
    usual, ground = ground_of(chosen)
    heal_s = round(draw(st.floats(0.15, 0.6)) * ground.usual_s + 20.0, 1)
    names = draw(st.lists(st.sampled_from(sorted(KINDS)), max_size=4, unique=True))
    if needs and not set(needs).intersection(names):
        names.append(draw(st.sampled_from(sorted(needs))))
    if any(line.startswith("fleet.size") for line in chosen):
        names = [name for name in names if name != "clock"]
    found = draw(_befalling([name for name in names for _ in range(draw(st.integers(1, 2)))], ground, heal_s))
    permanent = [fault for fault in found if fault.is_permanent]
    factor = min((fault.factor or 0.5 for fault in permanent if fault.kind == "slow"), default=1.0)
    left = max(1, len({*ground.sensing} - {fault.vehicle for fault in permanent})) / max(1, len(ground.sensing))
    bound_s = round(heal_s + SLACK * ground.usual_s / (factor * left) + ground.spare_s, 1)
    may_fail = any("energy_j" in line for line in chosen)
    is_whole = ground.completes and not may_fail
    return Schedule(draw(st.integers(0, 1 << 20)), heal_s, bound_s, chosen, found, GROUND, is_whole, usual.completes)
