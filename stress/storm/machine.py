"""A state machine for Hypothesis: any sequence of what vehicles tell, losses, delays, deaths, restarts and twins.

It needs Hypothesis, which only tests do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from stress.lives import Life
from stress.storm.fates import DOUBLED, HEARD, LOST, Fate, damaged, late, replayed
from stress.storm.storm import Storm

Tell = Callable[[Storm, int | Life, int], None]
"""Lets a vehicle of a storm record something: ``tell(storm, who, number)``; the numbers are those of the calls."""

USUAL_FATES: tuple[Fate, ...] = (
    HEARD, LOST, LOST, DOUBLED, late(0.2),
    *(late(slots) for slots in (1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 20.0)),
    *(replayed(slots) for slots in (1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 16.0)),
)  # fmt: skip
"""Packets heard, lost, twice, late and played again."""
DAMAGED_FATES: tuple[Fate, ...] = tuple(
    damaged(place, *more) for place, more in enumerate([(), (), (40,), (7, 90), (), (300,), (33, 34)] * 2, 3)
)
"""Packets with bits flipped."""
EPOCHS = 24
"""Lives of one number in a storm."""
PICKS = st.integers(0, 63)


# Complex only by the rules of the class inside, which need the arguments: Hypothesis reads rules off a class.
def storm_machine(  # noqa: C901
    storms: st.SearchStrategy[Storm],
    tells: Sequence[Tell],
    agree: Callable[[Storm], bool] = lambda storm: True,
) -> type[RuleBasedStateMachine]:
    """A machine whose storms befall managers of your own; ``machine.TestCase`` is a test.

    A storm is damaged too unless it ``tolerates_damage``: what is damaged without a checksum cannot be noticed.

    Args:
        storms: makes the storm of an example, before anything happens in it.
        tells: what vehicles may tell; of these and of when the machine draws.
        agree: whether all that anybody holds must reach all who live after a calm; else what its origin could say.
    """

    class StormMachine(RuleBasedStateMachine):
        """Any sequence of events in a storm; the law holds after each of them."""

        storm: Storm
        number = 0

        @initialize(storm=storms)
        def set_out(self, storm: Storm) -> None:
            self.storm = storm

        def awake(self, pick: int) -> int | None:
            """One of the vehicles, if it is switched on."""
            node = pick % self.storm.n_nodes
            return node if self.storm.is_alive(node) else None

        @rule(pick=PICKS, tell=st.sampled_from(list(tells)))
        def record(self, pick: int, tell: Tell) -> None:
            if (node := self.awake(pick)) is not None:
                tell(self.storm, node, self.number)
                self.number += 1

        @rule(fates=st.lists(st.sampled_from(USUAL_FATES + DAMAGED_FATES), min_size=1, max_size=60))
        def let_time_pass(self, fates: list[Fate]) -> None:
            fates = [fate for fate in fates if not (self.storm.tolerates_damage and fate in DAMAGED_FATES)]
            self.storm.run(-(-len(fates) // (self.storm.n_nodes - 1)), fates)

        @rule(pick=PICKS)
        def die(self, pick: int) -> None:
            node = self.awake(pick)
            if node is not None and len(self.storm.all_alive()) > 1:
                self.storm.die(node)

        @rule(pick=PICKS, keeps=st.booleans())
        def start(self, pick: int, keeps: bool) -> None:
            node = pick % self.storm.n_nodes
            before = self.storm.lives.get(node)
            if not self.storm.is_alive(node) and (before is None or before.epoch + 1 < EPOCHS):
                self.storm.start(node, keeps)

        @rule(pick=PICKS, keeps=st.booleans())
        def restart(self, pick: int, keeps: bool) -> None:
            node = self.awake(pick)
            if node is not None and self.storm.lives[node].epoch + 1 < EPOCHS:
                self.storm.restart(node, keeps)

        @rule(pick=PICKS)
        def add_a_twin(self, pick: int) -> None:
            """Its memory is that of a first life; others of the number may be in a later one."""
            node = self.awake(pick)
            if node is not None and not self.storm.doubled:
                self.storm.forgives_names = True  # when the twin is gone, its items still bear the names
                tells[0](self.storm, self.storm.add_twin(node), self.number)
                self.number += 1

        @precondition(lambda self: self.storm.now_s > 30.0)
        @rule()
        def calm(self) -> None:
            self.storm.calm(40)
            if self.storm.doubled:
                return
            self.storm.check_agreement(of_all=agree(self.storm))
            if len(self.storm.all_alive()) > 1:  # who is alone waits for all
                self.storm.check_rest()

        @invariant()
        def law(self) -> None:
            self.storm.check()

    return StormMachine
