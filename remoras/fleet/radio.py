"""Radio of a vehicle: merges received packets, offers facts to the exchange manager.

Position outliers: a report is suspected if its distance from the last one exceeds ``SLACK_M`` plus ``MARGIN`` times the
distance at the peer's top speed. The margin covers faster vehicles and currents, the slack fixes and rounding. A
suspected report is set aside. If the next one fits it rather than the last accepted one, both are accepted. So a
flipped bit costs one report, and a true jump is believed one report later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol

from exchange.arithmetic import distance, length
from exchange.manager.manager import ExchangeManager
from exchange.packets import InfluenceSignal, ItemUid, Met, Reception, Transmission, name_of
from remoras.beliefs import Beliefs, Fact
from remoras.fleet.run_log import RadioLog
from remoras.organisation import Group, Organisation
from remoras.picture import Peers
from remoras.recorder import Content, Recorder, content_of
from remoras.strategy import Declaration
from remoras.work import Point
from worldmodel import STATUS, Block, Change, FaultCode, Needs, PropertyValue, TBox, merge, tidy

JOB = "Job"
"""Class of the core ontology; facts about jobs are new information for the mission."""
SUSPECTED = "suspected position"
"""Kind of fault for a position set aside; the name of the status ends its detail."""
GIVEN_UP = frozenset({FaultCode.TIMED_OUT, FaultCode.CROWDED_OUT})
"""Faults with which the world model discards a block."""
STRANGER = "its packets are refused: it uses another TBox or other field widths, or one was damaged on the way"


class Signalling(NamedTuple):
    """Role whose holders send influence signals, and the roles of its group they address."""

    group: str
    role: str
    addressed: tuple[str, ...]


class RenewedNeeds(Needs, Protocol):
    """Information needs that may change during the mission."""

    def renew(self, organisation: Organisation) -> bool:
        """Use another view of the organisation; return whether needs have changed."""


class HeardPacket(NamedTuple):
    """Result of one received packet; ``signals`` are influence signals, -128..127, by role."""

    reception: Reception
    emitter: str = ""
    changes: tuple[Change, ...] = ()
    signals: tuple[tuple[Signalling, int], ...] = ()


def _news_attributes(tbox: TBox) -> frozenset[int]:
    job = next((ontology_class.uid for ontology_class in tbox.classes if ontology_class.name == JOB), None)
    return frozenset(a.uid for a in tbox.attributes if job is not None and tbox.is_a(a.domain, job))


def note_position(peers: Peers, name: str, position_m: Point) -> None:
    """Record a newer position of a vehicle, and the previous one if it has moved."""
    before_m = peers.positions_m.get(name)
    if before_m is not None and before_m != position_m:
        peers.before_m[name] = before_m
    peers.positions_m[name] = position_m
    peers.n_positions[name] = peers.n_positions.get(name, 0) + 1


class Radio:
    """Sending and receiving of one vehicle; only this class writes ``peers``."""

    def __init__(
        self,
        names: Sequence[str],
        groups: Iterable[Group],
        declaration: Declaration,
        manager: ExchangeManager,
        beliefs: Beliefs,
        peers: Peers,
        recorder: Recorder,
        needs: RenewedNeeds | None = None,
        top_speeds_mps: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        self.manager = manager
        self.log = RadioLog(names, beliefs, manager, recorder)
        self.needs = needs
        self.communicates = declaration.communicates
        self.influences = declaration.influences
        self.is_heard = declaration.tells  # peers get its facts
        self._lacking: set[int] = set()  # instances that pending blocks depend on
        self._names = names
        self._beliefs = beliefs
        self._me = names[beliefs.model.owner]
        self._peers = peers
        peers.links = self.log.links
        self._position = beliefs.model.tbox.attribute_named("position").uid
        self._jumps = Jumps(self._position, top_speeds_mps)
        self._news = _news_attributes(beliefs.model.tbox)
        self._contents = tuple(content_of(kind, declaration.messages) for kind in beliefs.model.tbox.attributes)
        self._bits = recorder.bits
        self._signalling = {
            beliefs.uid(group.path(role.name)): Signalling(group.name, role.name, role.influences)
            for group in groups
            for role in group.roles
        }
        self._roles = {(signal.group, signal.role): uid for uid, signal in self._signalling.items()}
        self._unheard: dict[tuple[str, ItemUid], set[str]] = {}  # by (vehicle, item): roles assigned in the item

    def tidy(self, now_s: float) -> None:
        """Discard blocks pending too long and old values; record missing instances once."""
        model = self._beliefs.model
        for fault in tidy(model, now_s) if model.pruning or model.arrivals.waiting or model.arrivals.dropped else ():
            self.log.fault(now_s, f"dropped block: {fault.code}", fault.detail)
            self.manager.give_up([fault.guid])
        if not model.arrivals.waiting and not self._lacking:
            return
        lacking = {instance.uid: instance for instance in model.lacking()}
        for uid in sorted(lacking.keys() - self._lacking):
            lacked = lacking[uid]
            owner = "" if lacked.origin is None else f" of {self._names[lacked.origin]}"
            self.log.fault(now_s, "lacking", f"instance {uid}{owner}; blocks that wait for it: {len(lacked.guids)}")
        self._lacking = set(lacking)

    # Out -----------------------------------------------------------------------------------------

    def tells(self, facts: Iterable[Fact], is_sent: bool = True) -> bool:
        """Return whether facts are sent to peers; ``is_sent`` False keeps them to this vehicle."""
        return is_sent and self.communicates and self.manager.is_of_use(facts)

    def tell(self, change: Change, who: Callable[[Change], Mapping[str, set[str]]], now_s: float) -> None:
        """Offer an own block, unless private; ``who``: receivers that must acknowledge, with roles."""
        block = change.block
        if block.sequence < STATUS:
            self.log.facts(block, name_of(block), "kept", now_s)
            return
        if block.sequence == STATUS:
            self.log.facts(block, name_of(block), "status", now_s)
        addressed = {} if block.sequence == STATUS else who(change)
        for fragment in self.manager.offer([change], [self._names.index(name) for name in addressed]):
            uid = fragment.uid
            self.log.facts(fragment, str(uid), "told", now_s)
            self.log.item(now_s, uid, "observed")
            if addressed:
                self._unheard |= {(name, uid): set(roles) for name, roles in addressed.items()}
                self._note_unheard()

    def signals_of(self, sent: Transmission) -> tuple[list[str], list[str], list[int]]:
        """Return the influence signals of a packet: roles, addressed roles, values -128..127."""
        roles, addressed, values = [], [], []
        for signal in sent.signals:
            group, role, to = self._signalling[signal.role]
            for receiver in to or ("",):
                roles.append(f"{group}.{role}")
                addressed.append(receiver and f"{group}.{receiver}")
                values.append(signal.value)
        return roles, addressed, values

    def speak(self, signals: Iterable[tuple[tuple[str, str], int]], now_s: float) -> Transmission | None:
        """Return the packet for the own slot, or None; ``signals``: satisfaction by (group, role)."""
        queue = self.manager.queue
        offered = []
        for role, value in signals:
            self.log.recorder.satisfaction.append((now_s, self._me, *role, value))
            offered.append(InfluenceSignal(self._roles[role], value))
        if offered:
            self.manager.offer_signals(offered)
        sent = self.manager.packet_to_send(now_s)
        self._count_bits(sent)
        if queue.unsaid or queue.expired:
            self.log.unsent(queue, sent.slot, now_s)
        self.log.sent(sent, now_s)
        return sent

    def _count_bits(self, sent: Transmission) -> None:
        counts = self._bits
        rest = sent.size_bits - sent.signals_bits
        counts[Content.SIGNALS] += sent.signals_bits
        for attribute, size_bits in sent.fragments:
            counts[self._contents[attribute]] += size_bits
            rest -= size_bits
        counts[Content.HEADERS] += rest

    # In ------------------------------------------------------------------------------------------

    def hear(self, data: bytes, now_s: float) -> HeardPacket:
        """Process a received packet."""
        reception = self.manager.receive(data, now_s)
        if reception.met is not Met.USUAL or reception.conflict is not None:
            self.log.met(reception, now_s)
        if reception.fault is not None:
            self.log.fault(now_s, "bad packet", reception.fault)
            refusal = self._names[reception.sender], reception.slot, reception.fault
            self.log.recorder.refused.append((now_s, self._me, *refusal))
            if reception.is_stranger:
                self.log.fault(now_s, "another definition", f"{self._names[reception.sender]}: {STRANGER}")
            return HeardPacket(reception)
        for uid in reception.items:
            self.log.item(now_s, uid, "received")
        for fragment in reception.aside:
            self.log.item(now_s, fragment.uid, "set aside")
        aside = [fact for fragment in reception.aside for fact in fragment.facts] if reception.aside else ()
        if self._unheard and reception.beliefs:
            for peer, uid in reception.beliefs:
                self._unheard.pop((self._names[peer], uid), None)
            self._note_unheard()
        if reception.settled:
            self.log.acknowledged(reception.settled, now_s)
        emitter = self._names[reception.sender]
        self._peers.heard_s[emitter], self._peers.heard_slots[emitter] = now_s, reception.slot
        for node, spoke_s in reception.told:
            self._peers.note_word(self._names[node], spoke_s)
        for block in reception.blocks if reception.told else ():
            if block.sequence == STATUS and block.origin != reception.sender:
                self._peers.note_report(self._names[block.origin], min(block.time_s, now_s))
        blocks = [block for block in reception.blocks if block.sequence != STATUS or not self._jumps_away(block, now_s)]
        changes = self._merged(blocks, now_s, aside)
        known = self._signalling
        signals = tuple([(known[role], value) for role, value in reception.signals if role in known])
        return HeardPacket(reception, emitter, changes, signals)

    def _jumps_away(self, status: Block, now_s: float) -> bool:
        if far := self._jumps.suspected(status):
            self.log.fault(now_s, SUSPECTED, f"{self._names[status.origin]}: {far}; {name_of(status)}")
        return bool(far)

    def regroup(self, organisation: Organisation, now_s: float) -> tuple[Change, ...]:
        """Apply needs of a new organisation; merge blocks set aside that are needed now."""
        if self.needs is None or not self.needs.renew(organisation):
            return ()
        renewal = self.manager.renew(now_s)
        for uid in renewal.items:
            self.log.item(now_s, uid, "received")
        self.log.acknowledged(renewal.settled, now_s)
        self.log.expired(renewal.unneeded, now_s)
        return self._merged(renewal.blocks, now_s)

    def _merged(self, blocks: Sequence[Block], now_s: float, aside: Iterable[PropertyValue] = ()) -> tuple[Change, ...]:
        merged = merge(self._beliefs.model, blocks, now_s, checked=True)  # by the codec, once for all receivers
        for fault in merged.faults:
            self.log.fault(now_s, f"refused block: {fault.code}", fault.detail)
            if fault.code in GIVEN_UP:
                self.manager.give_up([fault.guid])
        for facts in (aside, *[change.block.facts for change in merged.changes]):
            for fact in facts:
                if fact.attribute in self._news:
                    self._peers.last_news_s = now_s
        return merged.changes

    def note(self, changes: Sequence[Change]) -> None:
        """Record the newest positions, from any origin."""
        for _, latest in changes:
            for subject, attribute, value, _ in latest:
                if attribute == self._position:
                    note_position(self._peers, self._beliefs.name(subject), value)  # type: ignore[arg-type]

    def _note_unheard(self) -> None:
        unheard: dict[str, set[str]] = {}
        for (name, _), roles in self._unheard.items():
            unheard.setdefault(name, set()).update(roles)
        self._peers.unheard = unheard


SLACK_M = 50.0
"""Distance (m) by which any report may deviate."""
MARGIN = 2.0
"""Factor on the distance at top speed."""


class PositionReport(NamedTuple):
    """Reported position of a vehicle at a time."""

    time_s: float
    x_m: float
    y_m: float


class Jumps:
    """Filter for position outliers in reports, of vehicles (uids) with a top speed.

    >>> from worldmodel import PropertyValue
    >>> jumps = Jumps(3, {1: 2.0})
    >>> def said(time_s, x_m): return Block(1, -1, time_s, (PropertyValue(1, 3, (x_m, 0.0)),))
    >>> [jumps.suspected(said(7.0 * n, x_m)) for n, x_m in enumerate((0.0, 500.0, 14.0, 21.0))]
    ['', '500 m from where it was 7 s before', '', '']
    >>> [not jumps.suspected(said(7.0 * n, x_m)) for n, x_m in enumerate((0.0, 900.0, 910.0), 4)]
    [True, False, True]
    """

    def __init__(self, position: int, top_speeds_mps: Mapping[int, float]) -> None:
        self._position = position
        self._top_speeds_mps = top_speeds_mps
        self._last: dict[int, PositionReport] = {}
        self._aside: dict[int, PositionReport] = {}

    def suspected(self, block: Block) -> str:
        """Return the jump of a status to set aside, as text; empty if none."""
        origin, _, time_s, facts, _ = block
        for fact in facts:
            if fact.attribute == self._position:
                break
        else:
            return ""
        subject, _, value, _ = fact
        if subject != origin or subject not in self._top_speeds_mps:
            return ""
        now = PositionReport(time_s, *value)  # type: ignore[misc]
        last, aside = self._last.get(subject), self._aside.get(subject)
        if last is not None and now.time_s < last.time_s:
            return ""
        # Relayed reports arrive repeatedly: a copy confirms nothing.
        is_next = aside is None or aside.time_s < now.time_s
        if (
            last is None
            or abs(now.x_m - last.x_m) + abs(now.y_m - last.y_m) <= SLACK_M  # usual case
            or self._fits(subject, last, now)
            or (is_next and aside and self._fits(subject, aside, now))
        ):
            self._last[subject] = now
            if is_next and aside:
                del self._aside[subject]
            return ""
        if is_next:
            self._aside[subject] = now
        return f"{distance(last[1:], now[1:]):.0f} m from where it was {now.time_s - last.time_s:g} s before"

    def _fits(self, vehicle: int, earlier: PositionReport, later: PositionReport) -> bool:
        reach_m = SLACK_M + MARGIN * self._top_speeds_mps[vehicle] * abs(later.time_s - earlier.time_s)
        east_m, north_m = later.x_m - earlier.x_m, later.y_m - earlier.y_m
        return abs(east_m) + abs(north_m) <= reach_m or length(east_m, north_m) <= reach_m
