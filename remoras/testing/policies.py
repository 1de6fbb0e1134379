"""Conformance checks of exchange policies and value rules, raising ``AssertionError``."""

import dataclasses
import math
import random
from collections.abc import Callable, Iterator
from itertools import pairwise, permutations

import numpy as np

from exchange.policy.acknowledgement import fields
from exchange.policy.candidates import Moment, QueuePlace, ValueRule, Waiting
from exchange.policy.policies import AckPolicy, header_bits, policy_fault, policy_named
from exchange.study.compiler import as_python, slot_loops
from exchange.study.lanes import COUNT, FALSE_BELIEFS, SOURCE_ACKED, SUM, Ints
from exchange.study.parameters import ExchangeStudy, LoadKind, StudyLoad
from exchange.study.study import REMEMBERED_WORDS, case_of, play
from exchange.wire.codec import Codec
from remoras.plugins import named_object
from remoras.testing.behaviours import passed
from worldmodel import Terms, core_ontology_paths, read_tbox

TBOX = read_tbox(*core_ontology_paths())
SIZES = (2, 3, 5)
N_ITEMS = N_SLOTS = 90
P_LOSS = 0.5
N_TRIALS = 4
SETTLING_FRAMES = 8
"""Frames per header period to settle an item without loss; the paper needs 2."""
ALL = -1


def outcomes(policy: AckPolicy, study: ExchangeStudy) -> Ints:
    """Return the outcomes of the policy study's trials, uncompiled."""
    kind, case = policy.acknowledgement, case_of(study, policy, study.per[0])
    return play(as_python(kind), kind, case, np.zeros((0, study.trials), np.int64))


def loaded(policy: AckPolicy, n_nodes: int, carrier_evidence: bool) -> ExchangeStudy:
    """Return a study with losses, where new items come in any slot."""
    return ExchangeStudy(
        n_nodes, (P_LOSS,), (policy,), N_TRIALS, StudyLoad(LoadKind.POISSON, rate=0.3 / n_nodes), item_bits=1,
        carrier_evidence=carrier_evidence, max_slots=N_SLOTS, queue_items=8, warmup_frames=0, window_frames=10,
    )  # fmt: skip


# Declaration --------------------------------------------------------------------------------------


def check_value(policy: AckPolicy) -> None:
    """Check type and parts of the policy."""
    fault = policy_fault(policy)
    assert fault is None, fault


def check_header_bits(policy: AckPolicy) -> None:
    """Headers are as long as promised, on paper and on the wire."""
    kind = policy.acknowledgement
    for n_nodes in SIZES:
        codec = Codec(TBOX, n_nodes, n_nodes, policy, n_items=N_ITEMS, duration_s=N_SLOTS)
        for frame in range(2 * kind.period_frames):
            for sender in range(n_nodes):
                promised = header_bits(policy, n_nodes, frame, sender)
                where = f"header of node {sender} of {n_nodes} in frame {frame}"
                place = n_nodes, frame % kind.period_frames, sender
                pairs = permutations(range(n_nodes), 2)
                carried = {pair for pair in pairs if kind.carries(*place, *pair)}
                again = {field[:2] for field in fields(kind, *place)}
                assert carried == again, f"{where} differs when ``carries`` is asked again"
                assert header_bits(policy, n_nodes) >= promised, f"{where} is larger than the largest"
                repeated = header_bits(policy, n_nodes, frame + kind.period_frames, sender)
                assert repeated == promised, f"{where} does not repeat after period_frames = {kind.period_frames}"
                size_bits = codec.overhead_bits - header_bits(policy, n_nodes) + promised
                sent = len(codec.encode(sender, ALL, [], (), frame))
                assert sent == -(-size_bits // 8), f"{where} takes another number of bits on the wire than promised"


# Beliefs -------------------------------------------------------------------------------------------


def check_no_false_beliefs(policy: AckPolicy) -> None:
    """Check that under losses no node believes that a peer holds an item it lacks."""
    for n_nodes in SIZES:
        for carrier_evidence in (False, True):
            n_false = outcomes(policy, loaded(policy, n_nodes, carrier_evidence))[:, FALSE_BELIEFS, SUM].sum()
            assert n_false == 0, (
                f"{n_nodes} nodes: in {n_false} slots of {N_TRIALS} trials a node believes that another one holds an "
                "item, which it lacks"
            )


def check_bitwise(policy: AckPolicy) -> None:
    """Check that header bits do not mix: they are nodes in a vehicle, trials in the study."""
    header = policy.acknowledgement.header
    table = 0xFF00, 0xF0F0, 0xCCCC, 0xAAAA
    for bit in range(16):
        alone = header(*(-(word >> bit & 1) for word in table))
        assert header(*table) >> bit & 1 == alone & 1, "a bit of the header depends on other bits of its arguments"


def check_settles(policy: AckPolicy) -> None:
    """Check that without losses the origin soon stops sending its item."""
    n_frames = SETTLING_FRAMES * policy.acknowledgement.period_frames
    for n_nodes in SIZES:
        study = ExchangeStudy(n_nodes, (0.0,), (policy,), trials=1, max_slots=n_frames * n_nodes)
        is_settled = outcomes(policy, study)[0, SOURCE_ACKED, COUNT]
        assert is_settled, f"{n_nodes} nodes, no losses: the item is still sent after {n_frames} frames"


def check_deterministic(policy: AckPolicy) -> None:
    """Check that equal packets yield equal beliefs."""
    first, second = (outcomes(policy, loaded(policy, SIZES[-1], False)) for _ in range(2))
    assert np.array_equal(first, second), "the same packets make other beliefs the second time"


# Compilation ---------------------------------------------------------------------------------------


def check_compiles(policy: AckPolicy) -> None:
    """Check that compiled functions equal interpreted ones; takes seconds the first time."""
    kind, capacity_bits = policy.acknowledgement, 57 * 2 + header_bits(policy, 4)
    for load in (StudyLoad(LoadKind.BATCH, 3), StudyLoad(LoadKind.BATCH, 20), StudyLoad()):
        study = ExchangeStudy(
            4, (0.5,), policies=(policy,), trials=2 if load.items > 1 else 70, load=load, item_bits=57,
            capacity_bits=capacity_bits, seed=7, max_slots=300,
        )  # fmt: skip
        case = case_of(study, policy, p_loss=0.5)
        interpreted, compiled = (
            play(loop, kind, case, np.zeros((REMEMBERED_WORDS, study.trials), np.int64))
            for loop in (as_python(kind), slot_loops([kind], print)[kind])
        )
        assert (interpreted == compiled).all(), "the compiled form comes to other results than the functions as Python"


# All checks ---------------------------------------------------------------------------------------

CHECKS: tuple[Callable[[AckPolicy], None], ...] = (
    check_value,
    check_header_bits,
    check_no_false_beliefs,
    check_bitwise,
    check_settles,
    check_deterministic,
    check_compiles,
)


def conforms(name: str) -> Iterator[str]:
    """Run all checks of a named policy and yield their names."""
    return passed(CHECKS, named_object(name) if ":" in name else policy_named(name))


FRAME_S = 20.0
N_CANDIDATES = 60
N_LATER = 12


def candidates(draw: random.Random, moment: Moment) -> list[Waiting]:
    """Return queued candidates, all queued before the moment."""
    waiting = []
    for _ in range(N_CANDIDATES):
        slots_ago = draw.randrange(40)
        since_s = max(0.0, moment.now_s - FRAME_S * slots_ago - draw.choice([0.0, 3.7]))
        waiting.append(
            Waiting(
                priority=draw.choice([1, 1, 3, 10, 50, 1000]),
                observed_s=max(0.0, since_s - draw.choice([0.0, 0.5, 400.0])),
                since_s=since_s,
                since_slot=max(0, moment.n_slots - slots_ago),
                credit=draw.choice([0, 0, 7, 300]),
                n_sent=draw.choice([0, 0, 1, 2, 30]),
                terms=Terms(draw.choice([math.inf, 30.0, 900.0])),
            )
        )
    return waiting


def check_value_rule(rule: ValueRule, seed: int = 1) -> None:
    """Check name, finite deterministic values, and an order that persists over time."""
    assert isinstance(rule.name, str), f"name is {rule.name!r}, not a text"
    assert rule.name, "name is empty"
    draw = random.Random(seed)
    moment = Moment(2000.0, 100)
    waiting = candidates(draw, moment)
    for item in waiting:
        before = dataclasses.replace(item)
        place, value = rule.place(item), rule.value(item, moment)
        assert item == before, f"it changes what it is asked about: {before} is {item}"
        assert isinstance(value, int | float), f"value gives {value!r}, not a number, for {before}"
        assert math.isfinite(value), f"value gives {value!r}, not a finite number, for {before}"
        assert (rule.place(item), rule.value(item, moment)) == (place, value), (
            f"another answer the second time: {before}"
        )
        assert place is None or isinstance(place, QueuePlace), f"place gives {place!r}, neither a Place nor None"
        assert place is None or math.isfinite(place.rank), f"rank {place.rank} of {before}"
    for step in range(N_LATER):
        later = Moment(moment.now_s + FRAME_S * step, moment.n_slots + step)
        _check_order(rule, waiting, later)


def _check_order(rule: ValueRule, waiting: list[Waiting], moment: Moment) -> None:
    """Check that a higher rank never has a lower value within a group."""
    groups: dict[object, list[tuple[float, float, Waiting]]] = {}
    for item in waiting:
        place = rule.place(item)
        if place is not None:
            groups.setdefault((item.priority, place.group), []).append((place.rank, rule.value(item, moment), item))
    for group, ranked in groups.items():
        ranked.sort(key=lambda member: member[0])
        for (_, value, lower), (_, better, higher) in pairwise(ranked):
            # Rank and value are computed apart: rounding errors are no fault.
            assert value <= better * (1 + 1e-12) + 1e-9, (
                f"group {group} at {moment}: {higher} has the higher rank and the lower value, {better} below {value} "
                f"of {lower}; place has to give None, or other groups"
            )
