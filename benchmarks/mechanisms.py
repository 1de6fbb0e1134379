"""Ablate mechanisms: missions with and without each, paired by seed.

Runs the named mechanisms (default: all) with seeds from 1 on. A row gives the metric, its mean with the mechanism, the
change without it, the 95 % interval (Student's t) of that difference, and the number of equal pairs. A mission that is
not completed counts with its whole duration.

Keys of the scenario disable a mechanism. Without a key, a patch replaces it by a simpler one during the run.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache, partial
from typing import Any
from unittest import mock

from exchange.packets import Transmission
from exchange.policy.acknowledgement import PacketLog
from missions.runs.results import summary
from missions.runs.run import run
from missions.scenarios import load
from missions.statistics import t_half_width
from remoras.executive.decision import motivation
from remoras.fleet.vehicle import Vehicle
from remoras.functional.guidance import Guidance
from remoras.htn import Execution, FactsLike
from remoras.social.workload import Workload, scarce_energy_j
from worldmodel.holdings import Arrivals

RUNS = 20
TIME, CLASSIFIED = "mission_time_s", "mean_classified_s"


@contextmanager
def unheeded() -> Iterator[None]:
    """Vehicles acknowledge, and nobody heeds it: all say for good what they have to say."""
    with mock.patch.object(PacketLog, "learn", return_value=None):
        yield


@contextmanager
def dropped() -> Iterator[None]:
    """Blocks that come before what they rest on are thrown away, though they were acknowledged."""
    with mock.patch.object(Arrivals, "wait", return_value=None):
        yield


@contextmanager
def at_once() -> Iterator[None]:
    """What is said of roles and objectives counts when it is heard, and not at the end of the frame."""
    hear = Vehicle.hear

    def heard(self: Vehicle, data: bytes, now_s: float) -> Any:
        reception = hear(self, data, now_s)
        if reception is not None and self.functional.is_on:
            self._take_effect(now_s)
        return reception

    with mock.patch.object(Vehicle, "hear", heard):
        yield


@contextmanager
def unrepaired() -> Iterator[None]:
    """A step of a plan that fails has the whole plan fail."""

    def fail(self: Execution, place: int, facts: FactsLike) -> bool:
        self.abandon()
        return False

    with mock.patch.object(Execution, "fail", fail):
        yield


@contextmanager
def headlong() -> Iterator[None]:
    """Nobody keeps clear of others."""
    with mock.patch.object(Guidance, "_clear_of", lambda self, neighbours, goal, positions_m: goal):
        yield


@contextmanager
def untold() -> Iterator[None]:
    """Nobody heeds how much energy vehicles say that they have: batteries are as full as by the plan."""

    def by_plan(self: Workload, now_s: float) -> dict[str, float]:
        return scarce_energy_j([self.database[name] for name in self.frugal], {}, now_s, self._until_s)

    with mock.patch.object(Workload, "scarce_energy_j", by_plan):
        yield


@contextmanager
def unplanned() -> Iterator[None]:
    """No plan looks at energy: who has little is given work as who has much, and leaves it when it has to go home."""
    with (
        mock.patch("remoras.social.agreement.scarce_energy_j", return_value={}),
        mock.patch.object(Workload, "scarce_energy_j", return_value={}),
    ):
        yield


@contextmanager
def calls_arrive(delay_s: float = 0.0) -> Iterator[None]:
    """Each call of a packet reaches all vehicles, lost or not, ``delay_s`` after its transmission."""
    speak, hear, consult = Vehicle.speak, Vehicle.hear, Vehicle.consult
    fleet: dict[str, Vehicle] = {}
    under_way: deque[tuple[float, Vehicle, Transmission]] = deque()

    def spoken(self: Vehicle, now_s: float) -> Transmission | None:
        sent = speak(self, now_s)
        if sent is not None and sent.signals:
            under_way.append((now_s, self, sent))
        arrive(now_s)
        return sent

    def heard(self: Vehicle, data: bytes, now_s: float) -> Any:
        with mock.patch.object(self.executive, "hear"):  # calls of the packet itself
            return hear(self, data, now_s)

    def consulted(self: Vehicle, now_s: float) -> None:
        fleet[self.name] = self
        arrive(now_s)
        consult(self, now_s)

    def arrive(now_s: float) -> None:
        while under_way and under_way[0][0] + delay_s <= now_s:
            sent_s, caller, sent = under_way.popleft()
            for vehicle in fleet.values():
                if vehicle is not caller and vehicle.is_alive:
                    deliver(vehicle, caller.name, caller.radio.signals_of(sent), sent.slot, sent_s + delay_s)

    def deliver(vehicle: Vehicle, caller: str, signals: Any, slot: int, now_s: float) -> None:
        shared = vehicle.social.organisation.shared_groups(vehicle.name, caller)
        for role, addressed, value in zip(*signals, strict=True):
            group, _, name = role.rpartition(".")
            if addressed and group in shared:
                vehicle.executive.hear((group, addressed.rpartition(".")[2]), caller, name, value, now_s, slot)

    with mock.patch.multiple(Vehicle, speak=spoken, hear=heard, consult=consulted):
        yield


@contextmanager
def hysteresis() -> Iterator[None]:
    """What is performed moves a vehicle by 0.1 more, however dissatisfied it is."""

    def more(importance: float, stimulus: float, satisfaction: float | None, *rest: Any) -> float:
        value = motivation(importance, stimulus, satisfaction, *rest)
        return value if satisfaction is None or stimulus <= 0.0 else value + 0.1

    with mock.patch("remoras.executive.layer.motivation", more):
        yield


@dataclass(frozen=True)
class Mechanism:
    """A mechanism and how it is taken out.

    Attributes:
        scenario: of the mission that it bears; keys: that hold with it and without.
        out: keys that take it out.
        patch: makes the context in which it is out, if no key takes it out.
        measure: field of the summary, or a milestone.
    """

    scenario: str
    out: tuple[str, ...] = ()
    keys: tuple[str, ...] = ()
    patch: Callable[[], AbstractContextManager[None]] = nullcontext
    measure: str = TIME


HUNT, LIFT, FERRY, MAP = "minehunting-contacts", "recovery-field", "ferry-passage", "mapping-patches"
ESCORT = "escort-lines"
FOR_ALL = ('group.Hunters.information="replicated"', 'communication.needs_follow="all"')
"""All vehicles need all strips."""
CUT = 'channel.link=[{sender="AUV05",receiver="ASV00",per=0.97},{sender="ASV00",receiver="AUV05",per=0.97}]'
"""One vehicle hardly reaches the analyst."""


WEAK = "vehicle.AUV02.energy_j=800000.0"
"""A battery that plans look at: it would not last for the whole duration in transit."""
DRAINED = 'fault=[{kind="drains",vehicle="AUV02",at_s=100,drain_w=500.0}]'
"""That battery is empty after some 1300 s, before its vehicle has mapped what it was to map."""
NETWORK = (
    'channel.name="network"',
    'channel.network="mission-2012"',
    *(
        f'channel.nodes.{vehicle}="{node}"'
        for vehicle, node in zip(("ASV00", "AUV00", "AUV01", "AUV02"), (21, 27, 28, 29), strict=True)
    ),
)
"""The sea of a trial, in which one vehicle hears 2.5 % of what the head says."""

HELP = (
    "strategy.name=plan-and-dispatch",
    "drawn_lines.number=10",
    "drawn_lines.escorted_share=0.5",
    "scenario.duration_s=7200",
)
"""Half of the drawn lines need a second vehicle, as in the study ``help``."""
CALLS = "strategy.parameters.help=calls"


def _fault(kind: str, vehicle: str, at_s: int) -> str:
    return f'fault=[{{kind="{kind}",vehicle="{vehicle}",at_s={at_s}}}]'


MECHANISMS: Mapping[str, Mechanism] = {
    "acknowledgements": Mechanism(HUNT, patch=unheeded, measure=CLASSIFIED),
    "policies": Mechanism(HUNT, ('communication.policy="m-ack"',), measure=CLASSIFIED),
    "priorities": Mechanism(
        HUNT,
        ("communication.needs.hasTargetStrip=20", "communication.needs.hasFloorStrip=20"),
        measure=CLASSIFIED,
    ),
    "needs by groups": Mechanism(HUNT, FOR_ALL, measure=CLASSIFIED),
    "dependencies between blocks": Mechanism(HUNT, patch=dropped, measure=CLASSIFIED),
    "parking": Mechanism(
        HUNT, ("communication.parking=false",), keys=(*FOR_ALL, _fault("lost", "AUV02", 400)), measure=CLASSIFIED
    ),
    "carrier evidence": Mechanism(
        HUNT,
        ("communication.carrier_evidence=false",),
        keys=(*FOR_ALL, 'communication.policy="ack-repeat"'),
        measure=CLASSIFIED,
    ),
    "relaying": Mechanism(MAP, ("communication.relaying=false",), keys=NETWORK),
    "relaying of images": Mechanism(
        HUNT, ("communication.relaying=false",), keys=(*FOR_ALL, 'channel.name="matrix"', CUT), measure=CLASSIFIED
    ),
    "summaries": Mechanism(
        HUNT,
        ("communication.summaries=false",),
        keys=('fault=[{kind="restarts",vehicle="ASV00",at_s=700,until_s=760,memory="lost"}]',),
        measure=CLASSIFIED,
    ),
    "summaries, after silence": Mechanism(
        HUNT,
        ("communication.summaries=false",),
        keys=('channel.blackout=[{from_s=400,until_s=900,vehicle="ASV00"}]',),
        measure=CLASSIFIED,
    ),
    "altruism": Mechanism(LIFT, ("decision.weight_external=0.0",)),
    "dissatisfaction": Mechanism(LIFT, ("decision.tedium_per_s=0.0",)),
    "altruism, escorts": Mechanism(ESCORT, ("decision.weight_external=0.0",)),
    "calls, against calls without loss": Mechanism(ESCORT, patch=calls_arrive, keys=(*HELP, CALLS)),
    "calls, against calls a minute late": Mechanism(ESCORT, patch=partial(calls_arrive, 60.0), keys=(*HELP, CALLS)),
    "calls, against calls five minutes late": Mechanism(
        ESCORT, patch=partial(calls_arrive, 300.0), keys=(*HELP, CALLS)
    ),
    "no help, against calls": Mechanism(ESCORT, (CALLS,), keys=HELP),
    "motivation to continue": Mechanism(ESCORT, ("decision.weight_continuing=0.0",)),
    "no hysteresis": Mechanism(ESCORT, patch=hysteresis),
    "consultation": Mechanism("mapping-rendezvous", patch=at_once, measure="consultation_done"),
    "passing on of calls": Mechanism(FERRY, ("guidance.keeps_calls=true",), keys=("scenario.duration_s=3600.0",)),
    "avoidance": Mechanism(FERRY, patch=headlong, measure="conflicts"),
    "battery fact": Mechanism(MAP, patch=untold, keys=(WEAK, DRAINED)),
    "energy in plans": Mechanism(MAP, patch=unplanned, keys=("vehicle.AUV02.energy_j=100000.0",)),
    "energy in plans, sites": Mechanism(LIFT, patch=unplanned, keys=("vehicle.AUV02.energy_j=100000.0",)),
    "lease": Mechanism(
        MAP,
        ("communication.lease_frames=100000", "communication.false_absence=0.0"),
        keys=(_fault("lost", "AUV02", 600),),
    ),
    "succession": Mechanism(MAP, ("group.Operational.succession=[]",), keys=(_fault("lost", "AUV00", 600),)),
    "repair of plans": Mechanism(
        "pandora-inspection", patch=unrepaired, keys=("fault=[]", "current.surge=[]"), measure="serviced_fraction"
    ),
}
"""By name, in the order of the page."""


def measured(of: Mechanism, seed: int, is_out: bool, more: Sequence[str] = ()) -> float:
    """What one run measures; a time counts with the whole duration where the mission is not completed."""
    keys = (*of.keys, *(of.out if is_out else ()), *more)
    return _measured(of.scenario, keys, of.patch if is_out else nullcontext, of.measure, seed)


@cache
def _measured(
    scenario: str, keys: tuple[str, ...], patch: Callable[[], AbstractContextManager[None]], measure: str, seed: int
) -> float:
    with patch():
        finished = run(load(scenario, [("--set", key) for key in keys]), seed)
    if measure == TIME and not finished.completed:
        return float(finished.scenario.scenario.duration_s)
    for milestone in finished.milestones:
        if milestone.name == measure:
            return milestone.time_s
    return float(summary(finished)[measure])


def row(name: str, n_runs: int, more: Sequence[str] = ()) -> dict[str, Any]:
    """The runs of one mechanism, and what comes of taking it out.

    Args:
        name: of the mechanism; n_runs: pairs, with seeds from 1 on.
        more: keys that are set in all of them.
    """
    of, seeds = MECHANISMS[name], range(1, n_runs + 1)
    with_it = [measured(of, seed, False, more) for seed in seeds]
    without = [measured(of, seed, True, more) for seed in seeds]
    differences = [there - here for here, there in zip(with_it, without, strict=True)]
    half_width = t_half_width(differences) if len(set(differences)) > 1 else 0.0
    mean, change = statistics.fmean(with_it), statistics.fmean(differences)
    return {
        "name": name,
        "scenario": of.scenario,
        "measure": of.measure,
        "with": mean,
        "change": change,
        "interval": (change - half_width, change + half_width),
        "share": change / mean if mean else 0.0,
        "n": n_runs,
        "same": differences.count(0.0),
    }


def main() -> int:
    """Make the runs and print the rows."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mechanisms", description=__doc__)
    parser.add_argument("name", nargs="*", help=f"of {', '.join(MECHANISMS)}")
    parser.add_argument("--runs", type=int, default=RUNS, help="pairs of runs of each, 2 or more")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="set in all runs")
    arguments = parser.parse_args()
    if unknown := sorted(set(arguments.name) - set(MECHANISMS)):
        parser.error(f"unknown mechanism {', '.join(unknown)}: allowed are {', '.join(MECHANISMS)}")
    if arguments.runs < 2:
        parser.error(f"--runs = {arguments.runs}: allowed: 2 or more")
    for name in arguments.name or MECHANISMS:
        of = row(name, arguments.runs, arguments.set)
        low, high = of["interval"]
        print(
            f"{name:<28} {of['scenario']:<22} {of['measure']:<18} {of['with']:9.4g}  without {of['change']:+9.4g} "
            f"({low:.4g} to {high:.4g}; {100.0 * of['share']:+.1f} %)  n {of['n']}, same {of['same']}",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
