"""A trial: one run of the real fleet under a schedule, watched by invariants."""

from __future__ import annotations

import hashlib
import time
import traceback
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from missions.errors import ConfigurationError, ConfigurationFault
from missions.fault import kind_of_row
from missions.runs.assembly import assemble, channel_of
from missions.runs.root import Root
from missions.runs.run import result_of, run, settled_of
from missions.runs.setup import Setup, resolved
from missions.runs.summary import summary
from missions.scenarios import load
from missions.scenarios.parts import strategy_of
from remoras.collecting import rare_collections
from remoras.errors import PluginError
from remoras.recorder import Recorder
from stress.forging import forger
from stress.invariants.ending import Ends, Finishes, NoException, SameDigest
from stress.invariants.seam import Heard, Invariant, Moment, Scene
from stress.kinds import ENDING, FOR_GOOD, kind_of
from stress.minds import BrokenStrategy, forged_act, is_found_out
from stress.rigging import Rigging
from stress.schedule import Schedule, StressFault
from stress.sea import RoughSea
from stress.steering import Instant, instants_of
from stress.witness import Witness

CHECKED_BITS = 32
"""Checksums of so many bits let one damaged packet in four thousand million pass."""
EVENTS_SHOWN = 12
CERTAIN_SEEDS = 8
"""Seeds with which a mission has to complete without faults, to be one that is not decided by chance."""
STATED = frozenset({"forged-role", "forged-objective", "forged-done", "forged-lead"})


@dataclass(frozen=True)
class Broken:
    """An invariant that did not hold.

    Attributes:
        invariant: its name; time_s: when; text: what was wrong.
        before: the last events until then.
    """

    invariant: str
    time_s: float
    text: str
    before: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What came of a trial.

    Attributes:
        schedule: that was run.
        broken: the first invariant that did not hold; None if all that are promised did.
        judged: names of the invariants that are promised under the schedule; not_promised: of the others.
        happened: how often each kind of its faults has changed anything.
        recovered: how often vehicles went each way of recovery.
        completed: the mission is complete; end_s: when that was, or when the run was broken off.
        digest: of all tables and figures.
        wall_s: what it took on this machine.
        not_promised: names of the invariants that were not asked.
        instants: when something rare was under way, of a run without faults.
    """

    schedule: Schedule
    broken: Broken | None
    judged: tuple[str, ...]
    happened: Mapping[str, int]
    recovered: Mapping[str, int]
    completed: bool
    end_s: float
    digest: str
    wall_s: float
    not_promised: tuple[str, ...] = ()
    instants: tuple[Instant, ...] = ()

    @property
    def seed(self) -> int:
        """Of the schedule."""
        return self.schedule.stress.seed


@dataclass
class _Trial:
    schedule: Schedule
    invariants: Sequence[Invariant]
    happened: Counter[str] = field(default_factory=Counter)
    broken: Broken | None = None

    def run(self) -> Outcome:
        """Run the schedule until its end, or until something does not hold."""
        began = time.perf_counter()
        scenario = self.schedule.scenario()
        strategy = None
        if not ENDING.isdisjoint(self.schedule.kinds):
            strategy = BrokenStrategy(strategy_of(scenario), self.schedule, self.happened)
        setup = resolved(scenario, strategy)
        seed = Root(self.schedule.stress.seed)
        self.setup, self.seed, self.sea = setup, seed, self._sea(setup, seed)
        fleet = self.fleet = assemble(setup, seed, self.sea)
        effective = effective_kinds(self.schedule, setup)
        self.scene = Scene(setup, self.schedule, fleet, Witness(), {}, effective)
        about = self.schedule.stress
        left_out = {*(() if about.must_finish else (Finishes.name,)), *(() if about.must_end else (Ends.name,))}
        asked = [invariant for invariant in self.invariants if invariant.name not in left_out]
        promised = [promise for promise in asked if promise.not_under.isdisjoint(effective)]
        self.at_events, self.at_ticks, self.at_the_end = (
            [promise for promise in promised if promise.moment == moment] for moment in Moment
        )
        Rigging(self.scene, self._listen, self.happened)
        self.sudden = sorted(_moments(self.schedule), key=lambda moment: moment[0])
        with rare_collections():  # until the fleet is let go of: before, all that it holds would be searched
            self._sail()
            outcome = self._outcome([promise.name for promise in promised if promise.name != SameDigest.name], began)
        names = [
            invariant.name for invariant in self.invariants if invariant.name not in (*outcome.judged, SameDigest.name)
        ]
        return replace(outcome, not_promised=tuple(names))

    def _sea(self, setup: Setup, seed: int) -> RoughSea:
        """The sea of the fleet."""
        nodes = {data.name: data.node for data in setup.database.values()}

        forge = forger(setup.codec, setup.schedule, lambda: self.fleet.vehicles[0].beliefs.model)
        if setup.scenario.communication.key_file:
            forge = _without_key
        return RoughSea(channel_of(setup, seed), self.schedule, setup.schedule, forge, self.happened, nodes)

    def _sail(self) -> None:
        """Step the fleet to its end, and let it rest."""
        fleet = self.fleet
        try:
            while fleet.running and self.broken is None:
                while self.sudden and self.sudden[0][0] <= fleet.now_s:
                    self._let_happen(*self.sudden.pop(0)[1:])
                fleet.step()
                self._look(self.at_ticks)
            if self.broken is None:
                self._rest()
        except ConfigurationError:
            raise
        except Exception as error:  # whatever leaves a vehicle is what is looked for
            if _is_own(error):
                raise
            is_meant = isinstance(error, PluginError) and any(self.happened[kind] for kind in ENDING)
            if not is_meant or f"strategy {self.setup.strategy.name}" not in str(error):
                self._break(NoException.name, _said(error))
        self.scene.heard = None

    def _rest(self) -> None:
        """Let the exchange go on undisturbed, and look at how all ended."""
        fleet = self.fleet
        self.sea.is_calm = True
        for _, fault, by_s in self.sudden:
            if fault.kind == "clock" and fault.holds(fleet.now_s):  # what would be set back after the mission
                self._let_happen(fault, by_s)
        settled = settled_of(self.setup, fleet)
        self.scene.heard = None
        for vehicle in fleet.vehicles:
            self.scene.lives[vehicle.name].is_alive = vehicle.is_alive
        finished = result_of(self.setup, self.seed, fleet, 0.0, settled)
        self.scene.rested = None if settled is None else settled.complete
        self.scene.finished, self.scene.summary = finished, summary(finished)
        for promised in (self.at_events, self.at_ticks, self.at_the_end):
            self._look(promised)

    def _look(self, promised: Iterable[Invariant]) -> None:
        """Ask the invariants of a moment."""
        for promise in promised:
            if self.broken is not None:
                return
            try:
                text = promise.broken(self.scene)
            except Exception as error:  # it may be somebody else's
                raise ConfigurationError(
                    "remoras stress",
                    [ConfigurationFault("--invariant", promise.name, f"its broken raised {_said(error)}")],
                ) from error
            if text is not None:
                self._break(promise.name, text)

    def _listen(self, heard: Heard) -> None:
        self.scene.heard = heard
        self._look(self.at_events)

    def _break(self, name: str, text: str) -> None:
        now_s = self.fleet.now_s
        self.broken = self.broken or Broken(name, now_s, text, tuple(last_events(self.fleet.recorder, now_s)))

    def _let_happen(self, fault: StressFault, by_s: float) -> None:
        """Let a sudden fault befall its vehicle; a clock jumps by so much."""
        fleet = self.fleet
        vehicle = next(vehicle for vehicle in fleet.vehicles if vehicle.name == fault.vehicle)
        if fault.kind == "clock":
            fleet.clocks[vehicle.data.node].set_by(by_s)
            fleet.traffic.await_slot(vehicle.data.node)  # as after any setting of a clock
            self.happened["clock"] += 1
            return
        if not vehicle.is_alive:
            return
        setup = self.setup
        act = forged_act(fault, vehicle, setup.mission, self.scene.witness, setup.agreement.organisation)
        if act is not None:
            self.happened[fault.kind] += 1
            self.scene.forged.append((act.issuer, act.about, act.kind))
            vehicle.conclude(act.facts, fleet.shown_s(vehicle))

    def _outcome(self, judged: Sequence[str], began: float) -> Outcome:
        fleet, recorder = self.fleet, self.fleet.recorder
        outcome = Outcome(
            self.schedule,
            self.broken,
            tuple(judged),
            dict(self.happened + Counter(_declared(self.schedule, recorder))),
            dict(recoveries(recorder)),
            fleet.completed,
            fleet.now_s if fleet.running else fleet.ended_s,
            digest_of(recorder, self.scene.summary),
            round(time.perf_counter() - began, 3),
            instants=() if self.schedule.fault else instants_of(recorder, fleet.truth.milestones, fleet.ended_s),
        )
        fleet.close()
        return outcome


def run_trial(schedule: Schedule, invariants: Sequence[type[Invariant]]) -> Outcome:
    """Run a schedule.

    Where survivors do not finish, it is asked whether they would without faults, in this seed and in others.

    Args:
        schedule: what befalls the fleet.
        invariants: that are looked at; each run makes objects of its own.

    Raises:
        ConfigurationError: the schedule contradicts its scenario, or an invariant raises.
    """
    outcome = _Trial(schedule, [invariant() for invariant in invariants]).run()
    if outcome.broken is None or outcome.broken.invariant != Finishes.name or not schedule.fault:
        return outcome
    alone = _Trial(schedule.with_faults(()), [Finishes()]).run()
    if alone.broken is None and _always_completes(schedule.stress.scenario, tuple(schedule.overrides)):
        return outcome
    judged = tuple(name for name in outcome.judged if name != Finishes.name)
    return replace(outcome, broken=None, judged=judged, not_promised=(*outcome.not_promised, Finishes.name))


@lru_cache(maxsize=32)
def _always_completes(scenario: str, changes: tuple[tuple[str, str], ...]) -> bool:
    """True if a mission is complete without faults whatever its seed, as far as some show: else it is one of chance."""
    own = load(scenario, changes)
    return all(run(own, seed).completed for seed in range(1, CERTAIN_SEEDS + 1))


def repeated(schedule: Schedule, invariants: Sequence[type[Invariant]]) -> Outcome:
    """Run a schedule twice: besides all else, both runs must give the same tables."""
    first, second = run_trial(schedule, invariants), run_trial(schedule, invariants)
    judged = (*first.judged, SameDigest.name)
    broken = first.broken
    if broken is None and first.digest != second.digest:
        broken = Broken(SameDigest.name, first.end_s, f"one run gives {first.digest}, another {second.digest}")
    return replace(first, broken=broken, judged=judged, wall_s=first.wall_s + second.wall_s)


def effective_kinds(schedule: Schedule, setup: Setup) -> frozenset[str]:
    """Kinds of a schedule and its scenario against which nothing protects its packets, or finds out what is false.

    With them is what they put at risk, see ``missions.fault.Danger``.
    """
    communication = setup.scenario.communication
    kinds = {*schedule.kinds, *dangers_of(table.kind for table in setup.scenario.fault)}
    if communication.key_file:
        kinds -= {"bits", "cut", "forged"}
    if communication.crc_bits >= CHECKED_BITS:
        kinds -= {"bits", "cut"}
    if is_found_out(setup.mission.jobs.values(), setup.strategy.declaration):
        kinds -= {"forged-done"}
    return frozenset(kinds | {danger + FOR_GOOD for danger in dangers_of(fault.kind for fault in schedule.permanent)})


def dangers_of(kinds: Iterable[str]) -> Iterator[str]:
    """Kinds, and what they put at risk."""
    for kind in kinds:
        declared = kind_of(kind).declared
        yield from (kind, *(() if declared is None else declared.DANGERS))


def digest_of(recorder: Recorder, figures: Mapping[str, Any]) -> str:
    """Digest of all tables and figures of a run."""
    found = hashlib.sha256()
    for name in sorted(recorder.tables):
        rows = recorder.rows(name)
        found.update(f"{name} {len(rows)}".encode())
        for values in zip(*rows, strict=True):
            if set(map(type, values)) == {float}:
                found.update(array("d", values))
            else:
                found.update(repr(values).encode())
    found.update(repr(list(figures.items())).encode())
    return found.hexdigest()[:20]


def recoveries(recorder: Recorder) -> Counter[str]:
    """How often vehicles noticed that something was wrong, or went on all the same, by way."""
    found = Counter(row[2] for row in recorder.faults if kind_of_row(row[2]) is None)
    found.update(row[3] for row in recorder.peers)
    found.update(f"taken for {row[3]}" for row in recorder.membership)
    found.update(f"refused act: {row[-1]}" for row in recorder.organisation if row[5] == "refused")
    found.update(f"step {row[-3]}" for row in recorder.plans if row[-3] in ("failed", "dropped"))
    return found


def last_events(recorder: Recorder, until_s: float) -> Iterator[str]:
    """The last rows of a run that say what happened, in words."""
    rows: list[tuple[float, str]] = []
    for table in ("faults", "refused", "peers", "membership", "roles", "organisation"):
        rows += [(row[0], f"{table}: " + " ".join(map(str, row[1:]))) for row in recorder.rows(table)[-EVENTS_SHOWN:]]
    for row in recorder.packets[-EVENTS_SHOWN:]:
        rows.append((row[1], f"packet: {row[2]} in slot {row[0]} to {', '.join(row[6]) or 'nobody'}"))
    shown = sorted(row for row in rows if row[0] <= until_s)[-EVENTS_SHOWN:]
    return (f"{time_s:.1f} s {text}" for time_s, text in shown)


def _moments(schedule: Schedule) -> Iterator[tuple[float, StressFault, float]]:
    """When a sudden fault befalls its vehicle, and by how much its clock jumps then."""
    for fault in schedule.fault:
        if fault.kind in STATED:
            yield fault.at_s, fault, 0.0
        elif fault.kind == "clock":
            if fault.at_s > 0.0:
                yield fault.at_s, fault, fault.by_s
            if fault.until_s is not None:
                yield fault.until_s, fault, -fault.by_s


def _declared(schedule: Schedule, recorder: Recorder) -> dict[str, int]:
    """How often the faults that the scenario declares have begun, and clocks that are off from the start."""
    own = {fault.kind for fault in schedule.fault if kind_of(fault.kind).is_of_scenario}
    begun = Counter(row[2] for row in recorder.faults if row[2] in own and row[3] != "over")
    begun["clock"] = sum(fault.kind == "clock" and fault.at_s == 0.0 for fault in schedule.fault)
    return +begun


def _without_key(data: bytes, slot: int, draw: int) -> bytes:
    """What one who has no key makes of a packet."""
    return data[:-1] + bytes([data[-1] ^ (1 + draw % 255)])


def _is_own(error: BaseException) -> bool:
    """True if an exception was raised by this package, not by a vehicle."""
    frames = traceback.extract_tb(error.__traceback__)
    return bool(frames) and Path(__file__).parent in Path(frames[-1].filename).parents


def _said(error: BaseException) -> str:
    """An exception in one line, with where it came from."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f" in {frames[-1].filename.rpartition('/')[2]}:{frames[-1].lineno}" if frames else ""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}{where}"
