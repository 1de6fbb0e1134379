"""Ground truth of the mission: charted tiles, recovered object, choreography.

A choreography is an expected pattern of messages, checked at load time and against sent messages. A pattern is a state
machine whose transitions are messages. It is sound if every state is reachable from the first and leads to a final one.
During a run, facts in packets trigger transitions. A message that the state does not allow is a violation, and so is an
overdue one. A fact counts at its first transmission, received or not.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth
from missions.trident.jobs import WORKING
from missions.trident.scenario import ChoreographyTable, MessageTable, TridentScenario
from missions.trident.services import ATTEMPTS, CHARTED, TARGET, Site, Tile
from remoras.mission import FleetView, Milestone
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Row, Table, Unread
from remoras.truth import within_reach

CHOREOGRAPHY = Table("choreography", (
    TIME, VEHICLE, Column("state", "str"), Column("says", "str"), Column("subject", "str"), Column("value", "str"),
    Column("to", "str"), Column("violation", "str"),
))  # fmt: skip
"""Messages with state and successor. Violations keep the state; overdue ones lack a vehicle."""
PLAYING = {"assigned": True, "left": False}
"""Events of the table ``roles`` for begin and end of a role."""
PACKET_TIME, SENDER, ITEM_UIDS = 1, 2, 10
"""Relevant columns of the table ``packets``."""


class StatedFact(NamedTuple):
    """First transmission of a fact, recorded earlier at ``recorded_s``."""

    time_s: float
    vehicle: str
    subject: str
    attribute: str
    value: str
    recorded_s: float


def reachable(arrows: Mapping[str, Iterable[str]], start: Iterable[str]) -> set[str]:
    """Return all nodes reachable along arrows.

    >>> sorted(reachable({"a": ["b"], "c": ["a"]}, ["a"]))
    ['a', 'b']
    """
    found, left = set(start), list(start)
    while left:
        new = set(arrows.get(left.pop(), ())) - found
        found |= new
        left += sorted(new)
    return found


def unsound(
    states: Sequence[str], final: Iterable[str], arrows: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, str]]:
    """Yield unreachable states and dead ends, with an explanation.

    >>> list(unsound(["a", "b", "c"], ["b"], [("a", "b"), ("a", "c")]))
    [('c', 'is a dead end: no message leads from it to a final state, which are b')]
    """
    ahead, back = defaultdict(list), defaultdict(list)
    for state, to in arrows:
        ahead[state].append(to)
        back[to].append(state)
    ends = [state for state in final if state in states]
    there, out = reachable(ahead, states[:1]), reachable(back, ends)
    for state in states:
        if state not in there:
            yield state, f"cannot be reached: no message leads to it from {states[0]}, the first state"
        if state not in out:
            yield (
                state,
                f"is a dead end: no message leads from it to a final state, which are {', '.join(ends) or 'none'}",
            )


class Monitor:
    """Check of one run against a pattern; a pattern without states disables it."""

    def __init__(self, pattern: ChoreographyTable, recorder: Recorder) -> None:
        self._states = {state.name: state for state in pattern.state}
        self._allowed: dict[str, list[MessageTable]] = defaultdict(list)
        for message in pattern.message:
            self._allowed[message.state].append(message)
        self._alphabet = {message.says for message in pattern.message}
        self._items, self._packets, self._roles = map(Unread, (recorder.items, recorder.packets, recorder.roles))
        self._plays: dict[tuple[str, str], list[tuple[float, bool]]] = defaultdict(list)
        self._is_by_role = any(message.by for message in pattern.message)
        self._rows = recorder.rows(CHOREOGRAPHY.name)
        self._unsaid: dict[str, list[StatedFact]] = {}
        self.state = pattern.state[0].name if pattern.state else ""
        self._since_s, self._is_overdue = 0.0, False

    def look(self, now_s: float) -> None:
        """Process transmissions since the last call."""
        if not self.state:
            return
        for uid, origin, _, recorded_s, subject, attribute, value, kind, _ in self._items:
            if attribute in self._alphabet and kind == "told":
                fact = StatedFact(0.0, origin, subject, attribute, value, recorded_s)
                self._unsaid.setdefault(uid.partition(".")[0], []).append(fact)
        if self._is_by_role:
            self._note_roles()
        for packet in self._packets:
            if self._unsaid:
                for said in self._said(packet):
                    self._check_time(said.time_s)
                    self._move(said)
        self._check_time(now_s)

    def _said(self, packet: Row) -> Iterator[StatedFact]:
        for uid in packet[ITEM_UIDS]:
            block = self._unsaid.get(uid)
            if block is not None and block[0].vehicle == packet[SENDER]:
                yield from (fact._replace(time_s=packet[PACKET_TIME]) for fact in self._unsaid.pop(uid))

    def _note_roles(self) -> None:
        for time_s, vehicle, _, role, event in self._roles:
            if event in PLAYING:
                self._plays[vehicle, role].append((time_s, PLAYING[event]))

    def _is_by(self, message: MessageTable, said: StatedFact) -> bool:
        """True if the sender is the required vehicle, or held the required role at recording time."""
        if message.by in ("", said.vehicle):
            return True
        plays = False
        for time_s, begins in self._plays.get((said.vehicle, message.by), ()):
            if time_s > said.recorded_s or (time_s == said.recorded_s and not begins):
                break
            plays = begins
        return plays

    def _move(self, said: StatedFact) -> None:
        allowed = self._allowed[self.state]
        fitting = [message for message in allowed if _fits(message, said) and self._is_by(message, said)]
        said_row = said.time_s, said.vehicle, self.state, said.attribute, said.subject, said.value
        if not fitting:
            expected = "; ".join(_shown(message) for message in allowed) or "nothing"
            self._rows.append((*said_row, self.state, f"not allowed in state {self.state}; allowed: {expected}"))
            return
        self._rows.append((*said_row, fitting[0].to, ""))
        self.state, self._since_s, self._is_overdue = fitting[0].to, said.time_s, False

    def _check_time(self, now_s: float) -> None:
        within_s = self._states[self.state].within_s
        if within_s is None or self._is_overdue or now_s - self._since_s <= within_s:
            return
        self._is_overdue = True
        expected = "; ".join(_shown(message) for message in self._allowed[self.state])
        late = f"overdue: nothing said in state {self.state} for {within_s:g} s; expected: {expected}"
        self._rows.append((self._since_s + within_s, "", self.state, "", "", "", self.state, late))


def _fits(message: MessageTable, said: StatedFact) -> bool:
    return message.says == said.attribute and message.value in ("", said.value)


def _shown(message: MessageTable) -> str:
    value = f" {message.value}" if message.value else ""
    return f"{message.says}{value} by {message.by or 'any vehicle'}"


RECOVERY_SHARE = 0.5
"""Weight of the recovery in the goal; the rest is the map."""


class TridentTruth(JobTruth):
    """Referee of a run."""

    def __init__(self, meeting: Meeting, scenario: TridentScenario, recorder: Recorder, site: Site) -> None:
        super().__init__(meeting, WORKING, recorder)
        self._goal = scenario.mission.goal
        self._recovery = scenario.recovery.name
        self._site = site
        self._n_tiles = len(site.numbers)
        self._monitor = Monitor(scenario.choreography, recorder)
        self._new_tiles, self._attempts = Unread(recorder.rows(CHARTED.name)), Unread(recorder.rows(ATTEMPTS.name))
        self._statements = Unread(recorder.items)
        self._charted: set[Tile] = set()
        self.is_recovered = False
        self._reached: tuple[tuple[object, ...], float] | None = None  # cached reachable fraction with its inputs

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Record events; return True once the goal is reached and the group has gathered."""
        self._take_note(now_s)
        return super().observe(fleet, now_s)

    def _take_note(self, now_s: float) -> None:
        for _, _, column, row in self._new_tiles:
            self._charted.add((column, row))
        for time_s, vehicle, _, does, of, _, succeeded in self._attempts:
            if succeeded:
                self._note_success(time_s, vehicle, does == "handle", of == TARGET)
        for _, origin, _, recorded_s, subject, attribute, *_ in self._statements:
            if attribute == "chosen":
                self.milestones.append(Milestone(recorded_s, "chosen", origin))
            elif attribute == "surveyedBy":  # a survey on request is no objective
                self.note(origin, subject, now_s)
        self._monitor.look(now_s)

    def _note_success(self, time_s: float, vehicle: str, is_handled: bool, is_target: bool) -> None:
        what = ("recovered" if is_target else "mistaken") if is_handled else "held"
        self.milestones.append(Milestone(time_s, what, vehicle))
        self.is_recovered = self.is_recovered or (is_handled and is_target)

    @property
    def charted_fraction(self) -> float:
        """Share of all tiles truly charted."""
        return len(self._charted) / self._n_tiles if self._n_tiles else 1.0

    @property
    def goal_fraction(self) -> float:
        """Weighted share of the requested map and of the recovery."""
        return self._share(self.charted_fraction, self.is_recovered)

    def _share(self, charted: float, is_recovered: bool) -> float:
        mapping = min(1.0, charted / self._goal)
        return (1.0 - RECOVERY_SHARE) * mapping + RECOVERY_SHARE * is_recovered

    @property
    def jobs_done(self) -> Collection[str]:
        """Blocks reported as surveyed, and the recovery once it is real."""
        return {*(self._done - {self._recovery}), *((self._recovery,) if self.is_recovered else ())}

    def reachable_fraction(self, fleet: FleetView) -> float:
        """Share of the goal that the remaining vehicles can still reach."""
        of = tuple([v.able_data for v in fleet.vehicles]), len(self._charted), len(self._done), self.is_recovered
        if self._reached is None or self._reached[0] != of:
            self._reached = of, self._reachable_fraction(fleet)
        return self._reached[1]

    def _reachable_fraction(self, fleet: FleetView) -> float:
        jobs = self._jobs
        within = within_reach(jobs, self._groups, fleet, self.jobs_done)
        able = within_reach({name: jobs[name] for name in jobs if name != self._recovery}, self._groups, fleet, ())
        n_within = sum(block in able for tile, (block, _) in self._site.numbers.items() if tile not in self._charted)
        charted = (len(self._charted) + n_within) / self._n_tiles if self._n_tiles else 1.0
        return self._share(charted, self._recovery in within)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Return the reason of failure."""
        self._monitor.look(now_s)
        reason = super().close(fleet, now_s)
        missing = [] if self.is_recovered else ["the target is not recovered"]
        if self.charted_fraction < self._goal:
            missing.append(f"{self.charted_fraction:.0%} of the site charted of {self._goal:.0%}")
        return "; ".join(text for text in (reason, *missing) if text)
