"""Negotiators of a group over a scripted exchange of statements, without a fleet.

Facts that the exchange acknowledges (roles, jobs that are done) are repeated until they get through; of all others the
latest on a subject is what counts, and it is lost unless it gets through at once. The jobs may be of any kind.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from samples import auv

from missions.mapping.jobs import SurveyJob
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.strategy import Heard, Negotiator, Situation, Statable, Strategy, adapt_roles, ask
from remoras.testing.sample_worlds import ROLES, Visit
from remoras.work import Job, Outlook, Point, Work, precedence

ROUND_S = 10.0
RALLY_M = (0.0, 0.0)

Lost = Callable[[int, str, str], bool]
"""(round, sender, receiver) -> is what is sent then lost?"""


def never(number: int, sender: str, receiver: str) -> bool:
    """Lose nothing."""
    return False


def surveys(squares_m: Sequence[Point]) -> list[Job]:
    """Surveys of squares of 100 m, by their south-western corners."""
    return [
        SurveyJob(f"job {n}", ((x, y), (x, y + 100.0), (x + 100.0, y + 100.0), (x + 100.0, y)))
        for n, (x, y) in enumerate(squares_m)
    ]


def visits(places_m: Sequence[Point]) -> list[Job]:
    """Visits in any order."""
    return [Visit(f"job {n}", place_m) for n, place_m in enumerate(places_m)]


def ordered_visits(places_m: Sequence[Point]) -> list[Job]:
    """Visits of which every second one needs the one before it; the third of them needs the first too."""
    needs = {n: (f"job {n - 1}",) for n in range(1, len(places_m), 2)} | {2: ("job 0",)}
    return [Visit(f"job {n}", place_m, needs=needs.get(n, ())) for n, place_m in enumerate(places_m)]


KINDS_OF_JOBS: dict[str, Callable[[Sequence[Point]], list[Job]]] = {
    "surveys": surveys,
    "visits": visits,
    "ordered visits": ordered_visits,
}
"""Jobs of several kinds, made of places: a strategy divides them alike."""


@dataclass
class Member:
    """Knowledge and actions of one vehicle."""

    negotiator: Negotiator | None
    organisation: Organisation
    position_m: Point
    positions_m: dict[str, Point] = field(default_factory=dict)
    heard_s: dict[str, float] = field(default_factory=dict)
    heard: list[Heard] = field(default_factory=list)
    unheard: list[tuple[str, Heard]] = field(default_factory=list)  # acknowledged facts on their way, by receiver
    done: set[str] = field(default_factory=set)
    planned_on: frozenset[str] = frozenset()  # of the jobs that others need, those known done when it planned last
    at: tuple[str, float] | None = None  # job, and when it will have been done
    way: tuple[float, Point, Point] = (0.0, RALLY_M, RALLY_M)  # since when, from where and whereto it is at the job
    finished: list[str] = field(default_factory=list)


class Team:
    """Vehicles that do jobs; each is at the jobs of its roles one after another, the oldest first."""

    def __init__(self, strategy: Strategy, starts_m: Sequence[Point], jobs: Sequence[Job], lost: Lost) -> None:
        roles = tuple(RoleSpecification(f"Role{n}", 1, 1, job=job.name) for n, job in enumerate(jobs))
        head = RoleSpecification("Head", 1, 1, head=True, founding=True)
        self.group = Group("Team", (head, RoleSpecification("Hand", 1, founding=True), *roles), "rally")
        self.database = AUVDatabase(
            tuple(
                auv(
                    f"AUV{n:02d}",
                    start_m=start_m,
                    playable_roles=("Head" if n == 0 else "Hand", *(role.name for role in roles)),
                )
                for n, start_m in enumerate(starts_m)
            )
        )
        self.jobs = {job.name: job for job in jobs}
        self.too_early: list[str] = []
        """Jobs that somebody began before what they need was done."""
        self._strategy, self._lost, self._round = strategy, lost, 0
        organisation = strategy.form(self.database, [self.group])
        for assignment in strategy.adapt(Work(self.group, organisation, self.database, self.jobs)):
            organisation, _ = organisation.assign(assignment.vehicle, assignment.group, assignment.role)
        self.members = {
            name: Member(strategy.negotiator(name, self.group), organisation, data.start_m)
            for name, data in self.database.items()
        }

    @property
    def done(self) -> bool:
        """True once all jobs are done."""
        return set(self.finished) == set(self.jobs)

    @property
    def finished(self) -> Counter[str]:
        """How often each job was done."""
        return Counter(job for member in self.members.values() for job in member.finished)

    def run(self, rounds: int) -> None:
        """Let all negotiate for so many rounds."""
        for _ in range(rounds):
            self.round()

    def round(self) -> None:
        """One TDMA frame: all send, receive what is not lost, and continue."""
        self._round += 1
        now_s = ROUND_S * self._round
        told = {name: self._stated(name, member, now_s) for name, member in self.members.items()}
        for name, member in self.members.items():
            told[name] += self._planned(name, member, now_s)
            told[name] += self._progress(name, member, now_s)
        declaration = self._strategy.declaration
        if not declaration.tells:
            return
        for name, sender in self.members.items():
            sender.unheard += [(r, h) for h in told[name] if self._is_kept(h) for r in self.members if r != name]
            for receiver, member in self.members.items():
                if receiver != name and not (declaration.communicates and self._lost(self._round, name, receiver)):
                    due = [heard for to, heard in sender.unheard if to == receiver]
                    sender.unheard = [(to, heard) for to, heard in sender.unheard if to != receiver]
                    member.heard_s[name], member.positions_m[name] = now_s, sender.position_m
                    for heard in due + [heard for heard in told[name] if not self._is_kept(heard)]:
                        self._hear(member, heard)

    def _work(self, name: str, member: Member) -> Work:
        positions_m = {**member.positions_m, name: member.position_m}
        return Work(self.group, member.organisation, self.database, self.jobs, frozenset(member.done), positions_m)

    def _stated(self, name: str, member: Member, now_s: float) -> list[Heard]:
        if member.negotiator is None:
            return []
        heard, member.heard = tuple(member.heard), []
        work = self._work(name, member)
        situation = Situation(now_s, self._round, work, RALLY_M, heard, dict(member.heard_s))
        told = []
        for statement in ask(self._strategy.name, member.negotiator, situation).statements:
            for fact in statement.facts:
                self._take(member, fact)
            if statement.told:
                told.append(Heard(name, now_s, statement.facts))
        return told

    def _planned(self, name: str, member: Member, now_s: float) -> list[Heard]:
        """The head plans anew, as a social layer does, when a job is done that others need."""
        needed = frozenset(job for _, job in precedence(self.group, self.jobs)) & member.done
        if needed == member.planned_on or name not in member.organisation.heads("Team"):
            return []
        member.planned_on = needed
        told = []
        for role in adapt_roles(self._strategy, self._work(name, member)):
            fact = role.vehicle, "playsRole", self.group.path(role.role)
            self._take(member, fact)
            told.append(Heard(name, now_s, (fact,)))
        return told

    def _progress(self, name: str, member: Member, now_s: float) -> list[Heard]:
        """Continue the current job; report a finished one."""
        held = [
            role.job
            for role in self.group.roles
            if role.job not in (None, *member.done) and member.organisation.plays(name, "Team", role.name)
        ]
        told = []
        if member.at is not None:
            since_s, (from_x_m, from_y_m), (x_m, y_m) = member.way
            gone = min(1.0, (now_s - since_s) / (member.at[1] - since_s)) if member.at[1] > since_s else 1.0
            member.position_m = from_x_m + gone * (x_m - from_x_m), from_y_m + gone * (y_m - from_y_m)
        if member.at is not None and member.at[0] in held and member.at[1] <= now_s:
            job = member.at[0]
            member.finished.append(job)
            member.done.add(job)
            held.remove(job)
            told.append(Heard(name, now_s, ((job, self.jobs[job].done[0], name),)))
        if member.at is None or member.at[0] not in held:
            member.at = None
            if held:
                begun = self.jobs[held[0] or ""]
                if not set(self.finished).issuperset(begun.needs):
                    self.too_early.append(begun.name)
                then = begun.after(Outlook(now_s, member.position_m), self.database[name])
                assert then is not None
                member.at, member.way = (begun.name, then.free_s), (now_s, member.position_m, then.position_m)
            else:
                member.position_m = RALLY_M
        return told

    def _hear(self, member: Member, heard: Heard) -> None:
        member.heard.append(heard)
        for fact in heard.facts:
            self._take(member, fact)

    def _take(self, member: Member, fact: Statable) -> None:
        subject, attribute, value = fact
        if attribute in ROLES:
            group, _, role = str(value).partition(".")
            change = member.organisation.assign if attribute == "playsRole" else member.organisation.leave_role
            member.organisation, _ = change(subject, group, role)
        elif self._is_done(fact):
            member.done.add(subject)

    def _is_done(self, fact: Statable) -> bool:
        return fact[0] in self.jobs and self.jobs[fact[0]].done == (fact[1], fact[0])

    def _is_kept(self, heard: Heard) -> bool:
        return heard.facts[0][1] in ROLES or self._is_done(heard.facts[0])
