"""Real managers on a sea where everything goes wrong: any sequence of losses, delays, deaths and restarts."""

from fleet_radio import POSITION
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from storm import Storm
from storm_lives import DOUBLED, HEARD, LOST, Fate, damaged, late, replayed
from storm_vehicles import creates, maker, maps, schedule_of

from exchange.policies import POLICIES

EPOCHS = 4
WITHSTOOD = frozenset({"replay", "damage", "death", "restart", "store", "parking", "limits", "twins"})
"""What managers withstand, of `replay`, `damage`, `death`, `restart`, `store`, `parking`, `limits`, `twins`."""
FATES: list[Fate] = [HEARD, LOST, LOST, DOUBLED, late(0.2)]
if "replay" in WITHSTOOD:
    FATES += [late(slots) for slots in (1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 20.0)]
    FATES += [replayed(slots) for slots in (1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 16.0)]
if "damage" in WITHSTOOD:
    FATES += [damaged(place, *more) for place, more in enumerate([(), (), (40,), (7, 90), (), (300,), (33, 34)] * 2, 3)]


class StormMachine(RuleBasedStateMachine):
    """Two to five vehicles, any policy, packets of any size; clocks differ by less than the slots leave free."""

    storm: Storm | None = None

    @initialize(
        n_nodes=st.integers(2, 5),
        policy=st.sampled_from(sorted(POLICIES)),
        payload_bytes=st.sampled_from([24, 32, 64]),
        carrier_evidence=st.booleans(),
        offsets=st.lists(st.sampled_from([0.0, 0.2, -0.2]), min_size=5, max_size=5),
        n_absent=st.integers(0, 1),
        crc_bits=st.sampled_from([0, 32]),
        queue_limit=st.sampled_from([None, None, 2]),
    )
    def set_out(
        self,
        n_nodes: int,
        policy: str,
        payload_bytes: int,
        carrier_evidence: bool,
        offsets: list[float],
        n_absent: int,
        crc_bits: int,
        queue_limit: int | None,
    ) -> None:
        self.is_checked = crc_bits > 0
        limits = {"queue_limit": queue_limit} if "limits" in WITHSTOOD else {}
        make = maker(n_nodes, policy, payload_bytes, carrier_evidence, crc_bits, **limits)
        self.storm = Storm(make, schedule_of(n_nodes), offsets[:n_nodes], range(n_nodes - n_absent, n_nodes))
        self.repeats = POLICIES[policy].repeat
        self.cell = 0

    def awake(self, pick: int) -> int | None:
        """One of the vehicles, if it is switched on."""
        node = pick % self.storm.n_nodes
        return node if self.storm.is_alive(node) else None

    @rule(pick=st.integers(0, 4), n=st.sampled_from([1, 1, 2, 7]))
    def map_cells(self, pick: int, n: int) -> None:
        if (node := self.awake(pick)) is not None:
            maps(self.storm, node, *range(self.cell, self.cell + n))
            self.cell += n

    @rule(pick=st.integers(0, 4), x_m=st.integers(0, 50))
    def tell_position(self, pick: int, x_m: int) -> None:
        if (node := self.awake(pick)) is not None:
            self.storm.record(node, (node, POSITION, (float(x_m), 1.0)))

    @rule(pick=st.integers(0, 4))
    def create_an_area(self, pick: int) -> None:
        if (node := self.awake(pick)) is not None and len(self.storm.lives[node].model.own_instances) < 4:
            creates(self.storm, node)

    @rule(fates=st.lists(st.deferred(lambda: st.sampled_from(FATES)), min_size=1, max_size=60))
    def let_time_pass(self, fates: list[Fate]) -> None:
        """What is damaged without a checksum is left out: it cannot be noticed."""
        fates = [fate for fate in fates if self.is_checked or not any(copy.flips for copy in fate)]
        self.storm.run(-(-len(fates) // (self.storm.n_nodes - 1)), fates)

    @rule(pick=st.integers(0, 4))
    def die(self, pick: int) -> None:
        node = self.awake(pick)
        if "death" in WITHSTOOD and node is not None and len(self.storm.all_alive()) > 1:
            self.storm.die(node)

    @rule(pick=st.integers(0, 4), keeps=st.booleans())
    def start(self, pick: int, keeps: bool) -> None:
        node = pick % self.storm.n_nodes
        before = self.storm.lives.get(node)
        if self.storm.is_alive(node) or (before is not None and "restart" not in WITHSTOOD):
            return
        keeps &= "store" in WITHSTOOD
        if before is None or before.epoch + 1 < EPOCHS:
            self.storm.start(node, keeps)

    @rule(pick=st.integers(0, 4), keeps=st.booleans())
    def restart(self, pick: int, keeps: bool) -> None:
        node = self.awake(pick)
        keeps &= "store" in WITHSTOOD
        if "restart" in WITHSTOOD and node is not None and self.storm.lives[node].epoch + 1 < EPOCHS:
            self.storm.restart(node, keeps)

    @rule(pick=st.integers(0, 4))
    def add_a_twin(self, pick: int) -> None:
        """Its memory is that of a first life; others of the number may be in a later one."""
        node = self.awake(pick)
        if "twins" in WITHSTOOD and node is not None and not self.storm.doubled:
            self.storm.forgives_names = True  # when the twin is gone, its items still bear the names
            twin = self.storm.add_twin(node)
            maps(self.storm, twin, 4000, 4001)

    @precondition(lambda self: self.storm is not None and self.storm.now_s > 30.0)
    @rule()
    def calm(self) -> None:
        if "death" not in WITHSTOOD:  # what is kept for one who is not there holds up the rest
            for node in set(range(self.storm.n_nodes)) - set(self.storm.lives):
                self.storm.start(node)
        self.storm.calm(40)
        if self.storm.doubled:
            return
        self.storm.check_agreement(of_all=self.repeats)
        alive = len(self.storm.all_alive())
        if alive > 1 and (alive == self.storm.n_nodes or "parking" in WITHSTOOD):  # who is alone waits for all
            self.storm.check_rest()

    @invariant()
    def law(self) -> None:
        if self.storm is not None:
            self.storm.check()


TestStorm = StormMachine.TestCase
TestStorm.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)
