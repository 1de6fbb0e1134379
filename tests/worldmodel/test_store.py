"""Invariants of the store: equal to a plain list of blocks, in any order, restored or not."""

import copy
import pickle
from itertools import chain

from hypothesis import given, settings
from hypothesis import strategies as st
from small_fleet import BANNED_FROM, TBOX, any_blocks, ban, check, fleet_model, picture, sound_blocks

from worldmodel import Block, WorldModel, expire, merge
from worldmodel.merge import CheckResult


def merged(*batches: list[Block]) -> WorldModel:
    model = fleet_model()
    for batch in batches:
        merge(model, batch)
    return model


def everything(model: WorldModel) -> list[Block]:
    """All blocks that have arrived, whether in, waiting or refused: a peer passes on these."""
    return [*model.blocks(), *(one.block for one in model.arrivals.waiting.values()), *model.arrivals.refused.values()]


@settings(max_examples=80, deadline=None)
@given(any_blocks, st.randoms(use_true_random=False), st.integers(1, 4), st.sets(st.integers(0, 2), max_size=2))
def test_the_same_blocks_make_the_same_model(blocks, rng, n_packets, banned) -> None:
    """In any order, split and repeated in any way, passed on by another vehicle, or copied."""
    model = merged(blocks)
    again = blocks + rng.choices(blocks, k=len(blocks)) if blocks else []
    rng.shuffle(again)
    parts = [again[i::n_packets] for i in range(n_packets)]
    others = [merged(*parts), merged(everything(merged(*parts[1:])), parts[0])]
    before = picture(model)
    assert [picture(other) for other in others] == [before] * 2
    assert merge(model, everything(model)).changes == ()
    assert picture(model) == before
    for each in (model, *others):
        ban(each, banned)
    copies = (*others, copy.deepcopy(model), pickle.loads(pickle.dumps(model)))
    assert [picture(other) for other in copies] == [picture(model)] * 4


@settings(max_examples=60, deadline=None)
@given(any_blocks)
def test_every_block_is_stored_waiting_or_refused_as_checks_require(blocks: list[Block]) -> None:
    model = merged(blocks)
    assert all(check(model, b) == CheckResult() for b in model.blocks())
    assert all(check(model, b).faults for b in model.arrivals.refused.values())
    assert all(check(model, one.block) != CheckResult() for one in model.arrivals.waiting.values())
    said = {
        (origin, epoch, sequence)
        for (origin, epoch), (highest, mask) in model.digest().items()
        for sequence in range(highest + 1 + mask.bit_length())
        if sequence <= highest or mask >> (sequence - highest - 1) & 1
    }
    assert said == {b.guid for b in everything(model)} == {b.guid for b in blocks}
    assert all(model.has_arrived(guid) for guid in said)


@settings(max_examples=60, deadline=None)
@given(any_blocks, any_blocks, st.randoms(use_true_random=False))
def test_expiring_and_receiving_waiting_blocks_again_gives_the_same_model(first, then, rng) -> None:
    model = fleet_model()
    merge(model, first, now_s=10.0)
    forgotten: list[Block] = []
    while waiting := [
        one.block for one in model.arrivals.waiting.values()
    ]:  # without what they created, others may wait in turn
        assert {fault.guid for fault in expire(model, 10_000.0)} == {b.guid for b in waiting}
        forgotten += waiting
    again = [*forgotten, *then]
    rng.shuffle(again)
    merge(model, again, now_s=10_000.0)
    others = [b for b in first if b not in forgotten]
    assert picture(model) == picture(merged(others, again))


@settings(deadline=None)
@given(
    sound_blocks(),
    st.randoms(use_true_random=False),
    st.sets(st.integers(0, 2), max_size=2),
    st.floats(0, 1),
    st.floats(0, 1),
)
def test_a_model_answers_as_a_list_of_blocks(blocks, rng, banned, one_s, other_s) -> None:
    """Sound blocks all go in; histories, slices of them and latest values are those of the list, without the banned."""
    rng.shuffle(blocks)
    model = fleet_model()
    outcomes = [merge(model, [each]) for each in blocks]
    told = [change.block for outcome in outcomes for change in outcome.changes]
    assert not any(outcome.faults for outcome in outcomes)
    assert sorted(b.guid for b in told if b.is_item) == sorted(b.guid for b in blocks if b.is_item)
    assert not model.arrivals.waiting
    listed = sorted(
        (*b.key, position, fact.subject, fact.attribute)
        for b in chain(model.blocks(), model.statuses())
        for position, fact in enumerate(b.facts)
    )
    ban(model, banned)
    assert model.banned.keys() == banned
    for uid in range(model.n_uids):
        for attribute in (one.uid for one in TBOX.attributes if one.uid != BANNED_FROM):
            history = list(model.history(uid, attribute))
            said = [(*o.block.key, o.position) for o in history]
            assert said == [each[:5] for each in listed if each[5:] == (uid, attribute) and each[1] not in banned]
            assert model.latest(uid, attribute) == (history[-1] if history else None)
            part = model.history(uid, attribute, since_s=one_s, until_s=other_s)
            assert list(part) == [o for o in history if one_s <= o.time_s <= other_s]
            assert (len(part), list(reversed(part))) == (len(list(part)), list(part)[::-1])
