"""A trial: one run of the real fleet under a schedule, checked by invariants."""

from __future__ import annotations

import hashlib
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

from stress import invariants_of_knowledge as knowledge
from stress import invariants_of_runs as runs
from stress.fault_injection import FaultyChannel, Wrapping, forged_statement, forger, is_found_out, stranger
from stress.invariants import END, EVENT, TICK, Heard, Invariant, Scene
from stress.schedules import DAMAGE, DECLARED, FOR_GOOD, Schedule, StressFault, loaded

from exchange.channel.channel import Channel
from missions.errors import ConfigurationError
from missions.runs.assembly import assemble, channel_of
from missions.runs.results import summary
from missions.runs.run import Root, result_of, run, settled_of
from missions.runs.setup import Setup, resolved, world_model
from remoras.process import rare_collections
from remoras.recorder import Row

INVARIANTS: tuple[type[Invariant], ...] = (
    runs.NoException, knowledge.TrueBeliefs, knowledge.Recorded, knowledge.Remembered,
    knowledge.OneContent, knowledge.NewestCounts, knowledge.Past, knowledge.SoundPackets, knowledge.KnowledgeAgreement,
    knowledge.Rest, knowledge.OnlyAuthorised, knowledge.Cardinality, runs.SeparationKept, runs.Follows,
    runs.Finishes, runs.Ends,
)  # fmt: skip
CHECKED_BITS = 32
"""Checksums of so many bits let one damaged packet in four thousand million pass."""
CERTAIN_SEEDS = range(1, 9)
"""Seeds with which a mission has to complete without faults, to be one that is not decided by chance."""


@dataclass(frozen=True)
class Outcome:
    """Result of a trial.

    Attributes:
        broken: name of the first invariant that did not hold, time (s) and text; None if all that are promised did.
        judged: invariants that are promised under the schedule; happened: kinds of faults that changed anything.
        digest: of all tables and figures; tables: rows by name, of a fleet.
    """

    schedule: Schedule
    broken: tuple[str, float, str] | None
    judged: tuple[str, ...]
    happened: frozenset[str]
    completed: bool
    end_s: float
    digest: str
    tables: Mapping[str, list[Row]] = field(default_factory=dict)


class _Trial:
    def __init__(self, schedule: Schedule, invariants: Iterable[type[Invariant]]) -> None:
        self.schedule, self.broken, self.happened = schedule, None, Counter[str]()
        self.setup, self.seed = resolved(schedule.loaded()), Root(schedule.seed)
        self.channel = faulty_channel(self.setup, schedule, channel_of(self.setup, self.seed), self.happened)
        self.fleet = assemble(self.setup, self.seed, self.channel)
        self.scene = Scene(
            self.setup, schedule, self.fleet, effective_kinds(schedule, self.setup), self.channel.carried
        )
        left_out = {*(() if schedule.must_finish else ("finishes",)), *(() if schedule.must_end else ("ends",))}
        effective = self.scene.effective
        self.promised = [one() for one in invariants if one.name not in left_out and not one.not_under & effective]
        Wrapping(self.scene, self._listen, self.happened)
        self.sudden = sorted(_moments(schedule), key=lambda moment: moment[0])

    def run(self) -> Outcome:
        """Run the schedule until its end, or until something does not hold."""
        fleet = self.fleet
        with rare_collections():  # until the fleet is let go of: before, all that it holds would be searched
            try:
                while fleet.running and self.broken is None:
                    while self.sudden and self.sudden[0][0] <= fleet.now_s:
                        self._let_happen(*self.sudden.pop(0)[1:])
                    fleet.step()
                    self._check(TICK)
                if self.broken is None:
                    self._rest()
            except ConfigurationError:
                raise
            except Exception as error:
                if __file__ == (where := traceback.extract_tb(error.__traceback__)[-1]).filename:
                    raise
                self._break("exceptions", f"{type(error).__name__}: {error} in {where.filename}:{where.lineno}")
            recorder = fleet.recorder
            happened = {kind for kind, n in self.happened.items() if n}
            happened |= {row[2] for row in recorder.faults if row[2] in DECLARED and row[2] in self.schedule.kinds}
            happened |= {one.kind for one in self.schedule.fault if one.kind == "clock" and one.at_s == 0.0}
            tables = {name: list(recorder.rows(name)) for name in sorted(recorder.tables)}
            content = [*tables.items()], [*self.scene.summary.items()]
            digest = hashlib.sha256(repr(content).encode()).hexdigest()[:20]
            end_s = fleet.now_s if fleet.running else fleet.ended_s
            judged = tuple(one.name for one in self.promised)
            fleet.close()
        return Outcome(self.schedule, self.broken, judged, frozenset(happened), fleet.completed, end_s, digest, tables)

    def _rest(self) -> None:
        """Let the exchange go on undisturbed, and check the end."""
        scene, fleet, self.channel.is_calm = self.scene, self.fleet, True
        for _, fault, by_s in self.sudden:
            if fault.kind == "clock" and fault.holds(fleet.now_s):  # it would be set back after the mission
                self._let_happen(fault, by_s)
        settled = settled_of(self.setup, fleet)
        scene.heard = None
        for vehicle in fleet.vehicles:
            scene.lives[vehicle.name].is_alive = vehicle.is_alive
        scene.finished = result_of(self.setup, self.seed, fleet, 0.0, settled)
        scene.summary = summary(scene.finished)
        scene.rested = None if settled is None else settled.complete
        for moment in (EVENT, TICK, END):
            self._check(moment)

    def _listen(self, heard: Heard) -> None:
        self.scene.heard = heard
        self._check(EVENT)

    def _check(self, moment: str) -> None:
        for one in self.promised:
            if self.broken is None and one.moment == moment and (text := one.broken(self.scene)) is not None:
                self._break(one.name, text)

    def _break(self, name: str, text: str) -> None:
        self.broken = self.broken or (name, self.fleet.now_s, text)

    def _let_happen(self, fault: StressFault, by_s: float) -> None:
        """Let a sudden fault befall its vehicle; a clock jumps by so much."""
        fleet, vehicle = self.fleet, self.fleet.named(fault.vehicle)
        if fault.kind == "clock":
            fleet.clocks[vehicle.data.node].set_by(by_s)
            fleet.traffic.await_slot(vehicle.data.node)  # as after any setting of a clock
            self.happened["clock"] += 1
        elif vehicle.is_alive and (said := forged_statement(fault, vehicle, self.scene)) is not None:
            self.happened[fault.kind] += 1
            self.scene.forged.append((said.issuer, said.about, said.kind))
            vehicle.conclude(said.facts, fleet.shown_s(vehicle))


def faulty_channel(setup: Setup, schedule: Schedule, calm: Channel, happened: Counter[str]) -> FaultyChannel:
    """A channel with the faults of a schedule."""
    model, framing = world_model(setup, 0), setup.scenario.communication
    forge = forger(setup.codec, setup.schedule, model)
    if framing.key_file:  # whoever has no key makes noise
        forge = lambda data, slot, draw: data[:-1] + bytes([data[-1] ^ (1 + draw % 255)])  # noqa: E731
    nodes = {data.name: data.node for data in setup.database.values()}
    foreign = stranger(model.tbox, setup.schedule, framing.crc_bits, bool(framing.key_file))
    return FaultyChannel(calm, schedule, setup.schedule, forge, foreign, happened, nodes)


def judge(schedule: Schedule, invariants: Sequence[type[Invariant]] = INVARIANTS) -> Outcome:
    """Run a schedule; where survivors do not finish, ask whether they would without faults, whatever the seed."""
    outcome = _Trial(schedule, invariants).run()
    if outcome.broken is not None and outcome.broken[0] == "finishes" and schedule.fault:
        alone = _Trial(replace(schedule, fault=()), [runs.Finishes]).run()
        if alone.broken is not None or not _always_completes(schedule.scenario, schedule.settings):
            judged = tuple(name for name in outcome.judged if name != "finishes")
            return replace(outcome, broken=None, judged=judged)
    return outcome


@cache
def _always_completes(scenario: str, settings: tuple[str, ...]) -> bool:
    own = loaded(scenario, settings)
    return all(run(own, seed).completed for seed in CERTAIN_SEEDS)


def effective_kinds(schedule: Schedule, setup: Setup) -> frozenset[str]:
    """Kinds of faults against which nothing protects packets, or finds out what is false; also those for good."""
    communication = setup.scenario.communication
    kinds = {*schedule.kinds, *(table.kind for table in setup.scenario.fault)}
    if communication.key_file:
        kinds -= DAMAGE
    if communication.crc_bits >= CHECKED_BITS:
        kinds -= DAMAGE - {"forged", "foreign"}
    if is_found_out(setup.mission.jobs.values(), setup.strategy.declaration):
        kinds -= {"forged-done"}
    return frozenset(kinds | {fault.kind + FOR_GOOD for fault in schedule.fault if fault.is_permanent})


def _moments(schedule: Schedule) -> Iterator[tuple[float, StressFault, float]]:
    """When a sudden fault befalls its vehicle, and by how much its clock jumps then."""
    for fault in schedule.fault:
        if fault.kind.startswith("forged-"):
            yield fault.at_s, fault, 0.0
        elif fault.kind == "clock":
            if fault.at_s > 0.0:
                yield fault.at_s, fault, fault.by_s
            if fault.until_s is not None:
                yield fault.until_s, fault, -fault.by_s
