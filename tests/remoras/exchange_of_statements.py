"""Negotiators that talk to each other without vehicles, sea or packets: a scripted exchange of what they state.

Facts that the exchange acknowledges (roles, finished areas) are repeated until they get through; of all others the
latest on a subject is what counts, and it is lost unless it gets through at once.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from samples import auv

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.strategies.allocation import Outlook, after
from remoras.strategy import Evidence, Fact, Heard, Negotiator, Situation, Strategy
from remoras.work import Point

ROUND_S = 10.0
ACKNOWLEDGED = ("playsRole", "leftRole", "areaDone")
RALLY_M = (0.0, 0.0)

Lost = Callable[[int, str, str], bool]
"""(round, sender, receiver) -> is what is sent then lost?"""


def never(number: int, sender: str, receiver: str) -> bool:
    return False


@dataclass
class Member:
    """What one vehicle knows and does."""

    negotiator: Negotiator
    organisation: Organisation
    position_m: Point
    positions_m: dict[str, Point] = field(default_factory=dict)
    heard_s: dict[str, float] = field(default_factory=dict)
    heard: list[Heard] = field(default_factory=list)
    unheard: list[tuple[str, Heard]] = field(default_factory=list)  # acknowledged facts on their way, by receiver
    done: set[str] = field(default_factory=set)
    at: tuple[str, float] | None = None  # area, and when it will have been surveyed
    mapped: list[str] = field(default_factory=list)


class Team:
    """Vehicles that survey 100 m squares; each is at the areas of its roles one after another, the oldest first."""

    def __init__(self, strategy: Strategy, starts_m: Sequence[Point], squares_m: Sequence[Point], lost: Lost) -> None:
        areas = {f"square {n}": _square(corner_m) for n, corner_m in enumerate(squares_m)}
        roles = tuple(RoleSpecification(f"Role{n}", 1, 1, area=area) for n, area in enumerate(areas))
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
        self._corners_m, self._lost, self._round = areas, lost, 0
        organisation = strategy.form(self.database, [self.group])
        evidence = Evidence(self.database, {}, areas, frozenset())
        for one in strategy.adapt(self.group, organisation, evidence):
            organisation, _ = organisation.assign(one.vehicle, one.group, one.role)
        self.members: dict[str, Member] = {}
        for name, data in self.database.items():
            negotiator = strategy.negotiator(name, self.group)
            assert negotiator is not None
            self.members[name] = Member(negotiator, organisation, data.start_m)

    @property
    def done(self) -> bool:
        return {area for member in self.members.values() for area in member.mapped} == set(self._corners_m)

    @property
    def mapped(self) -> Counter[str]:
        """How often each area was surveyed."""
        return Counter(area for member in self.members.values() for area in member.mapped)

    def at_one_area(self) -> int:
        """Vehicles that are at an area at which another one is too."""
        at = Counter(member.at[0] for member in self.members.values() if member.at is not None)
        return sum(n for n in at.values() if n > 1)

    def run(self, rounds: int) -> None:
        for _ in range(rounds):
            self.round()

    def round(self) -> None:
        """One TDMA frame: all state something, all that is not lost is heard, all move on."""
        self._round += 1
        now_s = ROUND_S * self._round
        told = {name: self._stated(name, member, now_s) for name, member in self.members.items()}
        for name, member in self.members.items():
            told[name] += self._survey(name, member, now_s)
        for name, sender in self.members.items():
            sender.unheard += [(r, h) for h in told[name] if _kept(h) for r in self.members if r != name]
            for receiver, member in self.members.items():
                if receiver != name and not self._lost(self._round, name, receiver):
                    due = [heard for to, heard in sender.unheard if to == receiver]
                    sender.unheard = [(to, heard) for to, heard in sender.unheard if to != receiver]
                    member.heard_s[name], member.positions_m[name] = now_s, sender.position_m
                    for heard in due + [heard for heard in told[name] if not _kept(heard)]:
                        self._hear(member, heard)

    def _stated(self, name: str, member: Member, now_s: float) -> list[Heard]:
        positions_m = {**member.positions_m, name: member.position_m}
        evidence = Evidence(self.database, positions_m, self._corners_m, frozenset(member.done))
        heard, member.heard = tuple(member.heard), []
        situation = Situation(now_s, self._round, member.organisation, evidence, RALLY_M, heard, dict(member.heard_s))
        told = []
        for statement in member.negotiator.negotiate(situation).statements:
            for fact in statement.facts:
                self._take(member, fact)
            if statement.told:
                told.append(Heard(name, now_s, statement.facts))
        return told

    def _survey(self, name: str, member: Member, now_s: float) -> list[Heard]:
        """Go on with the area at hand; what is finished is told."""
        held = [
            role.area
            for role in self.group.roles
            if role.area not in (None, *member.done) and member.organisation.plays(name, "Team", role.name)
        ]
        told = []
        if member.at is not None and member.at[0] in held and member.at[1] <= now_s:
            area = member.at[0]
            member.mapped.append(area)
            member.done.add(area)
            held.remove(area)
            told.append(Heard(name, now_s, ((area, "areaDone", name),)))
        if member.at is None or member.at[0] not in held:
            member.at = None
            if held:
                then = after(Outlook(now_s, member.position_m), self.database[name], self._corners_m[held[0] or ""])
                assert then is not None
                member.at, member.position_m = (held[0] or "", then.free_s), then.position_m
            else:
                member.position_m = RALLY_M
        return told

    def _hear(self, member: Member, heard: Heard) -> None:
        member.heard.append(heard)
        for fact in heard.facts:
            self._take(member, fact)

    @staticmethod
    def _take(member: Member, fact: Fact) -> None:
        subject, attribute, value = fact
        if attribute == "areaDone":
            member.done.add(subject)
        elif attribute in ("playsRole", "leftRole"):
            group, _, role = str(value).partition(".")
            change = member.organisation.assign if attribute == "playsRole" else member.organisation.leave_role
            member.organisation, _ = change(subject, group, role)


def _kept(heard: Heard) -> bool:
    return heard.facts[0][1] in ACKNOWLEDGED


def _square(corner_m: Point) -> tuple[Point, ...]:
    x, y = corner_m
    return ((x, y), (x, y + 100.0), (x + 100.0, y + 100.0), (x + 100.0, y))
