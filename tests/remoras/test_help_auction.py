"""Auction of help: whom a vehicle that waits recruits, and that no two of them wait for each other."""

from collections.abc import Collection, Mapping

from hypothesis import given, settings
from hypothesis import strategies as st
from samples import auv, database

from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.help_auction import BIDDING_ROUNDS, MEMORY_ROUNDS, HelpAuction
from remoras.strategy import Heard, Move, Negotiator, Situation, Waits
from remoras.testing.sample_worlds import Visit
from remoras.work import Work

NAMES = tuple(f"AUV0{n}" for n in range(4))
TEAM = Group(
    "Team",
    (
        RoleSpecification("Hand", 1, founding=True),
        *(RoleSpecification(f"Lifter{n}", 1, 1, job=f"{n}") for n in range(4)),
    ),
)
FLEET = database(
    *(auv(name, node=n, playable_roles=("Hand", *(f"Lifter{n}" for n in range(4)))) for n, name in enumerate(NAMES))
)
Shares = Mapping[tuple[str, str], float]
"""Share of a caller's wait that a vehicle ends, by (vehicle, caller)."""


class Idle(Negotiator):
    def negotiate(self, situation: Situation) -> Move:
        assert all(message.facts[0][1] == "playsRole" for message in situation.heard)
        return Move(until_news=True)


class Auctions:
    """A team of which some members hold a job and wait; a lost packet is lost to all."""

    def __init__(self, holders: Collection[str], shares: Shares) -> None:
        self.parts: dict[str, Negotiator] = {name: HelpAuction(name, TEAM, Idle()) for name in NAMES}
        self.helping: dict[str, set[str]] = {name: set() for name in NAMES}
        self._holders, self._shares = holders, shares
        self._round, self._told = 0, list[Heard]()
        held = [RoleAssignment("Team", f"Lifter{name[-1]}", name) for name in holders]
        hands = [RoleAssignment("Team", "Hand", name) for name in NAMES]
        jobs = {str(n): Visit(str(n), (100.0 * n, 0.0)) for n in range(4)}
        self._work = Work(TEAM, Organisation.of([TEAM], [*hands, *held]), FLEET, jobs)

    def step(self, silent: Collection[str] = (), waiting: Collection[str] | None = None) -> None:
        """Let all negotiate once; a vehicle that helps does not wait at its own job."""
        self._round += 1
        told = list[Heard]()
        for name, part in self.parts.items():
            waits = name in (self._holders if waiting is None else waiting) and not self.helping[name]
            own = (("Team", f"Lifter{name[-1]}"),) if waits else ()
            ended = lambda caller, role, name=name: self._shares.get((name, caller), 0.0)  # noqa: E731
            heard = tuple(message for message in self._told if message.issuer != name)
            situation = Situation(
                7.0 * self._round, self._round, self._work, None, heard, {}, waits=Waits({}, own, ended)
            )
            move = part.negotiate(situation)
            assert not move.until_news
            self.helping[name] = {caller for caller, _ in move.helping}
            told += [Heard(name, situation.now_s, one.facts) for one in move.statements if name not in silent]
        self._told = told


def test_the_vehicle_that_ends_most_of_the_wait_helps() -> None:
    team = Auctions(["AUV01"], {("AUV00", "AUV01"): 0.3, ("AUV02", "AUV01"): 0.8, ("AUV03", "AUV01"): 0.5})
    for _ in range(BIDDING_ROUNDS + 2):
        team.step()
    assert team.helping == {"AUV00": set(), "AUV01": set(), "AUV02": {"AUV01"}, "AUV03": set()}


def test_a_winner_that_falls_silent_is_replaced() -> None:
    team = Auctions(["AUV01"], {("AUV00", "AUV01"): 0.3, ("AUV02", "AUV01"): 0.8})
    for _ in range(BIDDING_ROUNDS + 2):
        team.step()
    for _ in range(MEMORY_ROUNDS + BIDDING_ROUNDS + 2):
        team.step(silent=["AUV02"])
    assert team.helping["AUV00"] == {"AUV01"}


def test_help_lasts_while_the_job_goes_on_and_no_longer() -> None:
    team = Auctions(["AUV01"], {("AUV02", "AUV01"): 0.8})
    for _ in range(BIDDING_ROUNDS + 2):
        team.step()
    for _ in range(3 * MEMORY_ROUNDS):  # it works with its helper
        team.step(waiting=())
    assert team.helping["AUV02"] == {"AUV01"}
    for _ in range(2 * MEMORY_ROUNDS):  # it is lost
        team.step(silent=["AUV01"], waiting=())
    assert team.helping["AUV02"] == set()


shares = st.dictionaries(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)), st.floats(0.1, 1.0))


@settings(max_examples=50, deadline=None)
@given(st.sets(st.sampled_from(NAMES)), shares, st.lists(st.sets(st.sampled_from(NAMES)), min_size=40, max_size=40))
def test_no_vehicles_leave_their_jobs_for_each_other(holders: set[str], ends: Shares, lost: list[set[str]]) -> None:
    """All may wait, whatever is lost: who helps, helps a vehicle of an earlier name or has no job that waits."""
    team = Auctions(holders, ends)
    for silent in lost:
        team.step(silent)
        for helper, callers in team.helping.items():
            assert helper not in holders or all(caller < helper for caller in callers)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.sets(st.sampled_from(NAMES), max_size=2), min_size=12, max_size=12))
def test_each_award_is_for_one_vehicle_once_packets_arrive(lost: list[set[str]]) -> None:
    """An early loss may have awarded another vehicle, which is told no more."""
    team = Auctions(["AUV03"], {(name, "AUV03"): 0.4 + 0.1 * n for n, name in enumerate(NAMES)})
    for silent in lost:
        team.step(silent)
    for _ in range(2 * MEMORY_ROUNDS):
        team.step()
    assert sum("AUV03" in callers for callers in team.helping.values()) == 1
