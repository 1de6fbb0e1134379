"""The radio of a vehicle: what it tells its peers, and what it makes of what it hears.

The exchange manager turns blocks into packets and back. The radio stands around it: it merges what was heard into the
world model, notes where the peers are and when they were heard, keeps in mind which of them have not yet heard of the
roles that this vehicle gave out, and records the walk of every item.

Positions that cannot be: a peer is farther from where it was than it can have gone.

A report is suspected if its distance from the last one exceeds ``SLACK_M`` and ``MARGIN`` times what the peer's top
speed allows for the time between them; the margin is for faster vehicles than their data say and for currents, the
slack for what a fix corrects and for rounding. It is set aside. If the next one fits it, not the one before, both were
right and the one before was wrong. So a flipped bit costs one report, and a true jump is believed one report later. A
report that others relay comes more than once, and late: a copy confirms nothing, and of what is older nothing is asked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol

from exchange.arithmetic import distance, length
from exchange.manager import ExchangeManager
from exchange.packets import Fragment, InfluenceSignal, ItemUid, Met, Reception, Transmission, name_of
from remoras.beliefs import Beliefs, Fact
from remoras.contents import Content, content_of
from remoras.organisation import Group, Organisation
from remoras.picture import Peers
from remoras.recorder import Recorder
from remoras.run_log import Contacts, note_acknowledged, note_expired, note_slot
from remoras.strategy import Declaration
from remoras.work import Point
from worldmodel import STATUS, Block, Change, FaultCode, Needs, PropertyValue, TBox, merge, tidy
from worldmodel.valuetext import uncertainty_as_text

JOB = "Job"
"""Class of the core ontology; what a peer says of a job is news of the mission."""
SUSPECTED = "suspected position"
"""Kind of the faults by which a position was set aside; the name of the status ends the detail."""
GIVEN_UP = frozenset({FaultCode.TIMED_OUT, FaultCode.CROWDED_OUT})
"""Faults by which the world model forgets a block that it had."""
STRANGER = "its packets are refused: it uses another TBox or other field widths, or one was damaged on the way"
_new = tuple.__new__  # makes a named tuple of a tuple, in half the time


class Signalling(NamedTuple):
    """A role whose holders send influence signals, and the roles of its group that these address."""

    group: str
    role: str
    addressed: tuple[str, ...]


class RenewedNeeds(Needs, Protocol):
    """Who needs what, where that may change during the mission."""

    def renew(self, organisation: Organisation) -> bool:
        """Answer by what has been heard so far, and another view of the organisation; True if needs have changed."""
        ...


class HeardPacket(NamedTuple):
    """What came of one packet.

    Attributes:
        reception: what the exchange manager says of it.
        emitter: name of the vehicle that sent it.
        changes: of the world model.
        signals: influence signals of the emitter, -128..127, by the role that each speaks of.
    """

    reception: Reception
    emitter: str = ""
    changes: tuple[Change, ...] = ()
    signals: tuple[tuple[Signalling, int], ...] = ()


def _news_attributes(tbox: TBox) -> frozenset[int]:
    """Attributes of jobs: a fact of these is news of the mission."""
    job = next((ontology_class.uid for ontology_class in tbox.classes if ontology_class.name == JOB), None)
    return frozenset(a.uid for a in tbox.attributes if job is not None and tbox.is_a(a.domain, job))


def note_position(peers: Peers, name: str, position_m: Point) -> None:
    """Note a newer position of a vehicle, and where it was before, if it has moved.

    Args:
        peers: the part of the picture that has them.
        name: of the vehicle.
        position_m: where it is.
    """
    before_m = peers.positions_m.get(name)
    if before_m is not None and before_m != position_m:
        peers.before_m[name] = before_m
    peers.positions_m[name] = position_m
    peers.n_positions[name] = peers.n_positions.get(name, 0) + 1


class Radio:
    """Sends and receives for one vehicle.

    Args:
        names: of all vehicles, in the order of the nodes.
        groups: whose roles send influence signals.
        declaration: of the strategy: whether vehicles send at all, and whether they send influence signals.
        manager: packs and unpacks.
        beliefs: of this vehicle, into whose world model blocks are merged.
        peers: the part of the picture that is written here and nowhere else.
        recorder: takes the rows of items, signals and faults.
        needs: by which the manager judges, where they may change.
        top_speeds_mps: of the vehicles by node, by which positions that cannot be are told.

    """

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
        self._contacts = Contacts(names, beliefs.model.owner, manager)
        self.needs = needs
        self.communicates = declaration.communicates
        self.influences = declaration.influences
        self.is_heard = declaration.tells  # others know what it tells
        self._lacking: set[int] = set()  # instances that blocks are known to wait for
        self._names = names
        self._beliefs = beliefs
        self._me = names[beliefs.model.owner]
        self._peers = peers
        peers.links = self._contacts.links
        self._recorder = recorder
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
        self._roles = {(one.group, one.role): uid for uid, one in self._signalling.items()}
        self._unheard: dict[tuple[str, ItemUid], set[str]] = {}  # by vehicle and item: roles given out in the item

    def record_into(self, recorder: Recorder) -> None:
        """Let another take the rows of items, signals and faults from now on."""
        self._recorder = recorder

    def tidy(self, now_s: float) -> None:
        """Give up blocks that have waited too long, and old values; note once what others wait for."""
        model = self._beliefs.model
        for fault in tidy(model, now_s) if model.pruning or model.arrivals.waiting or model.arrivals.dropped else ():
            self._record_fault(now_s, f"dropped block: {fault.code}", fault.detail)
            self.manager.give_up([fault.guid])
        if not model.arrivals.waiting and not self._lacking:
            return
        lacking = {instance.uid: instance for instance in model.lacking(now_s)}
        for uid in sorted(lacking.keys() - self._lacking):
            one = lacking[uid]
            whose = "" if one.origin is None else f" of {self._names[one.origin]}"
            self._record_fault(now_s, "lacking", f"instance {uid}{whose}; blocks that wait for it: {len(one.guids)}")
        self._lacking = set(lacking)

    # Out -----------------------------------------------------------------------------------------

    def tells(self, facts: Iterable[Fact], told: bool = True) -> bool:
        """True if a block of these facts goes to the peers; else this vehicle keeps it to itself.

        Args:
            facts: to be recorded.
            told: False if they are for this vehicle alone.
        """
        return told and self.communicates and self.manager.is_of_use(facts)

    def tell(self, change: Change, who: Callable[[Change], Mapping[str, set[str]]], now_s: float) -> None:
        """Let a block of this vehicle's own go to the peers, in the slots to come; a private one is noted, no more.

        Args:
            who: gives, by vehicle that has to hear of a block, the roles that the block gives it; asked of items only,
                not of status.
        """
        block = change.block
        if block.sequence < STATUS:
            self._record_facts(block, name_of(block), "kept", now_s)
            return
        if block.sequence == STATUS:
            self._record_facts(block, name_of(block), "status", now_s)
        addressed = {} if block.sequence == STATUS else who(change)
        for fragment in self.manager.offer([change], [self._names.index(name) for name in addressed]):
            uid = fragment.uid
            self._record_facts(fragment, str(uid), "told", now_s)
            self._record_item(now_s, uid, "observed")
            if addressed:
                self._unheard |= {(name, uid): set(roles) for name, roles in addressed.items()}
                self._note_unheard()

    def signals_of(self, sent: Transmission) -> tuple[list[str], list[str], list[int]]:
        """Influence signals of a packet, one for each role addressed: role spoken of, role addressed, -128..127."""
        roles, addressed, values = [], [], []
        for signal in sent.signals:
            group, role, to = self._signalling[signal.role]
            for receiver in to or ("",):
                roles.append(f"{group}.{role}")
                addressed.append(receiver and f"{group}.{receiver}")
                values.append(signal.value)
        return roles, addressed, values

    def speak(self, signals: Iterable[tuple[tuple[str, str], int]], now_s: float) -> Transmission | None:
        """The packet for the own slot, with satisfactions -128..127 by (group, role); None if the fleet sends none."""
        queue = self.manager.queue
        offered = []
        for role, value in signals:
            self._recorder.satisfaction.append((now_s, self._me, *role, value))
            offered.append(_new(InfluenceSignal, (self._roles[role], value)))
        if offered:
            self.manager.offer_signals(offered)
        sent = self.manager.packet_to_send(now_s)
        self._count_bits(sent)
        if queue.unsaid or queue.expired:
            note_slot(self._recorder, self._me, queue, sent.slot, now_s)
        contacts = self._contacts
        if sent.noticed or sent.slot % contacts.period >= contacts.due_from:
            contacts.sent(sent, now_s, self._recorder)
        return sent

    def _count_bits(self, sent: Transmission) -> None:
        """Count the bits of a packet by their contents.

        A fragment counts as what its first fact is, with the bits that delimit and name it. Headers are the rest: those
        of packets, with the acknowledgements, and what fills the last byte.
        """
        counts = self._bits
        rest = sent.size_bits - sent.signals_bits
        counts[Content.SIGNALS] += sent.signals_bits
        for attribute, size_bits in sent.fragments:
            counts[self._contents[attribute]] += size_bits
            rest -= size_bits
        counts[Content.HEADERS] += rest

    # In ------------------------------------------------------------------------------------------

    def hear(self, data: bytes, now_s: float) -> HeardPacket:
        """Take in a packet."""
        reception = self.manager.receive(data, now_s)
        if reception.met is not Met.USUAL or reception.conflict is not None:
            self._contacts.heard(reception, now_s, self._recorder)
        if reception.fault is not None:
            self._record_fault(now_s, "bad packet", reception.fault)
            said = self._names[reception.sender], reception.slot, reception.fault
            self._recorder.refused.append((now_s, self._me, *said))
            if reception.is_stranger:
                self._record_fault(now_s, "another definition", f"{self._names[reception.sender]}: {STRANGER}")
            return HeardPacket(reception)
        for uid in reception.items:
            self._record_item(now_s, uid, "received")
        for fragment in reception.aside:
            self._record_item(now_s, fragment.uid, "set aside")
        aside = [fact for fragment in reception.aside for fact in fragment.facts] if reception.aside else ()
        if self._unheard and reception.beliefs:
            for peer, uid in reception.beliefs:
                self._unheard.pop((self._names[peer], uid), None)
            self._note_unheard()
        if reception.settled:
            note_acknowledged(self._recorder, self._names, self._beliefs.model, reception.settled, now_s)
        emitter = self._names[reception.sender]
        self._peers.heard_s[emitter] = now_s
        for node, spoke_s in reception.told:
            self._peers.note_word(self._names[node], spoke_s)
        for block in reception.blocks if reception.told else ():
            if block.sequence == STATUS and block.origin != reception.sender:
                self._peers.note_report(self._names[block.origin], min(block.time_s, now_s))
        blocks = reception.blocks
        jumps: list[tuple[Block, Jump]] = []
        for block in blocks:
            if block.sequence == STATUS and (jump := self._jumps.suspected(block)):
                jumps.append((block, jump))
        changes = self._merged(self._without(jumps, blocks, now_s) if jumps else blocks, now_s, aside)
        known = self._signalling
        signals = tuple([(known[role], value) for role, value in reception.signals if role in known])
        return _new(HeardPacket, (reception, emitter, changes, signals))

    def _without(self, jumps: Sequence[tuple[Block, Jump]], blocks: Iterable[Block], now_s: float) -> list[Block]:
        """The blocks without those by which a peer has jumped; these are told of, and set aside."""
        for block, jump in jumps:
            far = f"{jump.distance_m:.0f} m from where it was {jump.after_s:g} s before; {name_of(block)}"
            self._record_fault(now_s, SUSPECTED, f"{self._names[block.origin]}: {far}")
        aside = {id(block) for block, _ in jumps}
        return [block for block in blocks if id(block) not in aside]

    def regroup(self, organisation: Organisation, now_s: float) -> tuple[Change, ...]:
        """Tell and keep what this view of the organisation asks for; what was set aside and is needed now goes in."""
        if self.needs is None or not self.needs.renew(organisation):
            return ()
        renewal = self.manager.renew(now_s)
        for uid in renewal.items:
            self._record_item(now_s, uid, "received")
        note_acknowledged(self._recorder, self._names, self._beliefs.model, renewal.settled, now_s)
        note_expired(self._recorder, self._me, renewal.unneeded, now_s)
        return self._merged(renewal.blocks, now_s)

    def _merged(self, blocks: Sequence[Block], now_s: float, aside: Iterable[PropertyValue] = ()) -> tuple[Change, ...]:
        """What blocks change, and see whether anything is news of the mission: work goes on, whomever it concerns.

        Args:
            blocks: heard.
            now_s: the time (s).
            aside: facts that were heard, and are not kept.
        """
        merged = merge(self._beliefs.model, blocks, now_s, judged=True)  # by the codec
        for fault in merged.faults:
            self._record_fault(now_s, f"refused block: {fault.code}", fault.detail)
            if fault.code in GIVEN_UP:
                self.manager.give_up([fault.guid])
        for facts in (aside, *[change.block.facts for change in merged.changes]):
            for fact in facts:
                if fact.attribute in self._news:
                    self._peers.last_news_s = now_s
        return merged.changes

    def note(self, changes: Sequence[Change]) -> None:
        """Keep the newest positions, whoever said them."""
        for _, latest in changes:
            for subject, attribute, value, _ in latest:
                if attribute == self._position:
                    note_position(self._peers, self._beliefs.name(subject), value)  # type: ignore[arg-type]

    def _note_unheard(self) -> None:
        unheard: dict[str, set[str]] = {}
        for (name, _), roles in self._unheard.items():
            unheard.setdefault(name, set()).update(roles)
        self._peers.unheard = unheard

    # Recording -----------------------------------------------------------------------------------

    def _record_facts(self, of: Block | Fragment, name: str, kind: str, now_s: float) -> None:
        """A row for each fact of what this vehicle recorded."""
        append, as_text = self._recorder.items.append, self._beliefs.as_text
        for fact in of.facts:
            append((name, self._me, of.time_s, now_s, *as_text(fact), kind, uncertainty_as_text(fact)))

    def _record_item(self, now_s: float, uid: ItemUid, event: str) -> None:
        self._recorder.knowledge.append((now_s, self._me, str(uid), self._names[uid.origin], event))

    def _record_fault(self, now_s: float, kind: str, detail: str) -> None:
        self._recorder.faults.append((now_s, self._me, kind, detail))


SLACK_M = 50.0
"""What a report may be off in any case."""
MARGIN = 2.0
"""How many times farther than by its top speed a vehicle may seem to have gone."""
_new = tuple.__new__  # makes a named tuple of a tuple, in half the time


class PositionReport(NamedTuple):
    """Where a vehicle said it was at a time."""

    time_s: float
    x_m: float
    y_m: float


class Jump(NamedTuple):
    """A suspected report: how far it is from the last one (m), and how much later (s)."""

    distance_m: float
    after_s: float


class Jumps:
    """Watches what peers say of their own positions.

    Args:
        position: uid of the attribute.
        top_speeds_mps: of each vehicle, by its uid; of others nothing is suspected.

    >>> from worldmodel import PropertyValue
    >>> jumps = Jumps(3, {1: 2.0})
    >>> def said(time_s, x_m): return Block(1, -1, time_s, (PropertyValue(1, 3, (x_m, 0.0)),))
    >>> [jumps.suspected(said(7.0 * n, x_m)) for n, x_m in enumerate((0.0, 500.0, 14.0, 21.0))]
    [None, Jump(distance_m=500.0, after_s=7.0), None, None]
    >>> [jumps.suspected(said(7.0 * n, x_m)) is None for n, x_m in enumerate((0.0, 900.0, 910.0), 4)]
    [True, False, True]
    >>> [jumps.suspected(said(7.0 * n, x_m)) is None for n, x_m in ((7, 100.0), (7, 100.0), (5, 900.0))]
    [False, False, True]
    """

    def __init__(self, position: int, top_speeds_mps: Mapping[int, float]) -> None:
        self._position = position
        self._top_speeds_mps = top_speeds_mps
        self._last: dict[int, PositionReport] = {}
        self._aside: dict[int, PositionReport] = {}

    def suspected(self, block: Block) -> Jump | None:
        """The jump that a status makes of a vehicle, if it is one that no vehicle makes; it is to be set aside."""
        origin, _, time_s, facts, _ = block
        for fact in facts:
            if fact.attribute == self._position:
                break
        else:
            return None
        subject, _, value, _ = fact
        if subject != origin or subject not in self._top_speeds_mps:
            return None
        now = _new(PositionReport, (time_s, *value))  # type: ignore[misc]
        last, aside = self._last.get(subject), self._aside.get(subject)
        if last is not None and now.time_s < last.time_s:
            return None
        is_next = aside is None or aside.time_s < now.time_s
        if (
            last is None
            or abs(now.x_m - last.x_m) + abs(now.y_m - last.y_m) <= SLACK_M  # mostly it is near
            or self._fits(subject, last, now)
            or (is_next and aside and self._fits(subject, aside, now))
        ):
            self._last[subject] = now
            if is_next and aside:
                del self._aside[subject]
            return None
        if is_next:
            self._aside[subject] = now
        return Jump(distance(last[1:], now[1:]), now.time_s - last.time_s)

    def _fits(self, vehicle: int, one: PositionReport, other: PositionReport) -> bool:
        """True if the vehicle can have made both reports."""
        reach_m = SLACK_M + MARGIN * self._top_speeds_mps[vehicle] * abs(other.time_s - one.time_s)
        east_m, north_m = other.x_m - one.x_m, other.y_m - one.y_m
        return abs(east_m) + abs(north_m) <= reach_m or length(east_m, north_m) <= reach_m
