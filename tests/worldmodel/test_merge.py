"""The merge laws of notes/worldmodel.md, section 6, over blocks that wait, clash and use GUIDs twice."""

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from small_fleet import (
    AUV,
    AUV_0,
    BATTERY,
    ECHO,
    LENGTH,
    LOCATION,
    NEAR,
    OBJECT,
    PIPELINE,
    WRECK,
    any_blocks,
    block,
    check,
    codes,
    first_uid_of,
    fleet_model,
    picture,
    sound_blocks,
)

from worldmodel import TYPE_UID, Block, WorldModel, merge
from worldmodel.checks import CheckResult

NEW = first_uid_of(1)


def merged(*batches: list[Block]) -> WorldModel:
    model = fleet_model()
    for batch in batches:
        merge(model, batch)
    return model


def everything(model: WorldModel) -> list[Block]:
    """All blocks that have arrived, whether in, waiting or refused: what a peer can pass on."""
    return [*model.blocks(), *model.arrivals.waiting.values(), *model.arrivals.refused.values()]


@settings(max_examples=150, deadline=None)
@given(any_blocks, st.randoms(use_true_random=False), st.integers(1, 4))
def test_any_order_any_splitting_any_repetition(blocks: list[Block], rng: random.Random, n_packets: int) -> None:
    expected = picture(merged(blocks))
    again = blocks + rng.choices(blocks, k=len(blocks)) if blocks else []
    rng.shuffle(again)
    assert picture(merged(*(again[i::n_packets] for i in range(n_packets)))) == expected


@settings(max_examples=60, deadline=None)
@given(any_blocks, any_blocks, any_blocks)
def test_merge_is_a_join(a: list[Block], b: list[Block], c: list[Block]) -> None:
    ab = merged(a, b)
    assert picture(merged(b, a)) == picture(ab)  # commutative
    assert picture(merged(everything(ab), c)) == picture(merged(a, everything(merged(b, c))))  # associative
    before, version = picture(ab), ab.version
    assert merge(ab, everything(ab)).changes == ()  # idempotent
    assert (picture(ab), ab.version) == (before, version)


@settings(max_examples=60, deadline=None)
@given(any_blocks)
def test_what_is_in_passes_the_checks_and_what_is_not_does_not(blocks: list[Block]) -> None:
    model = merged(blocks)
    assert all(check(model, b) == CheckResult() for b in model.blocks())
    assert all(check(model, b).faults for b in model.arrivals.refused.values())
    assert all(check(model, b) != CheckResult() for b in model.arrivals.waiting.values())
    assert {b.guid for b in everything(model)} == {b.guid for b in blocks}


@settings(max_examples=60, deadline=None)
@given(sound_blocks(), st.randoms(use_true_random=False))
def test_sound_blocks_all_go_in_and_stay_in(blocks: list[Block], rng: random.Random) -> None:
    rng.shuffle(blocks)
    model = fleet_model()
    told: list[Block] = []
    for each in blocks:
        outcome = merge(model, [each])
        assert not outcome.faults
        told += [change.block for change in outcome.changes]
        assert all(model.block(b.guid) == b for b in told if b.is_item)
    items = sorted(b.guid for b in blocks if b.is_item)
    assert sorted(b.guid for b in told if b.is_item) == items
    assert not model.arrivals.waiting


def test_a_block_waits_for_instances_whatever_they_wait_for_themselves() -> None:
    chain = [
        block(2, 0, 0, (ECHO, NEAR, NEW), (ECHO, LOCATION, (1.0, 1.0))),
        block(0, 0, 0, (NEW, TYPE_UID, WRECK)),
        block(1, 0, 0, (NEW, TYPE_UID, OBJECT), (NEW, NEAR, NEW + 1)),
        block(1, 1, 0, (NEW + 1, TYPE_UID, WRECK)),
    ]
    model = fleet_model()
    for waiting in chain[:-1]:
        assert merge(model, [waiting]).changes == ()
    assert model.latest(ECHO, LOCATION) is None
    assert model.instance(NEW) is None
    assert model.block((2, 0, 0)) is None
    assert model.arrived((2, 0, 0)) == chain[0]
    changes = merge(model, chain[-1:]).changes
    assert [change.block for change in changes] == [chain[i] for i in (3, 2, 1, 0)]
    assert model.value(ECHO, NEAR) == NEW


def test_links_in_a_ring_go_in_together_when_they_are_one_block() -> None:
    ring = block(
        1,
        0,
        0,
        (NEW, TYPE_UID, WRECK),
        (NEW, NEAR, NEW + 1),
        (NEW + 1, TYPE_UID, WRECK),
        (NEW + 1, NEAR, NEW),
    )
    assert len(merge(fleet_model(), [ring]).changes) == 1


def test_a_local_record_sets_waiting_blocks_free_and_the_next_merge_tells() -> None:
    model = fleet_model(owner=0)
    merge(
        model,
        [block(2, 0, 1, (ECHO, LENGTH, 30.0)), block(2, 1, 1, (ECHO, LENGTH, 31.0), (ECHO, NEAR, AUV_0))],
    )
    assert model.arrivals.refused.keys() == {(2, 0, 1)}
    change = model.record([(ECHO, TYPE_UID, WRECK)], 2.0)
    assert change.block.guid == (0, 0, 0)
    assert model.value(ECHO, LENGTH) == 30.0
    assert [c.block.guid for c in merge(model, []).changes] == [(2, 0, 0)]
    assert merge(model, []).changes == ()


def test_two_contents_under_one_guid() -> None:
    contents = [block(2, 0, 0, (AUV_0, BATTERY, level)) for level in (0.5, 0.6)]
    for arrival in (contents, contents[::-1]):
        model = fleet_model()
        assert merge(model, arrival[:1]).faults == ()
        assert codes(merge(model, arrival[1:]).faults) == ["GUID_CONFLICT"]
        assert model.block((2, 0, 0)) == min(contents, key=model.content)
        assert len(model.history(AUV_0, BATTERY)) == 1


def test_what_rested_on_a_replaced_block_leaves_with_it() -> None:
    model = fleet_model()
    creating = block(1, 0, 0, (NEW, TYPE_UID, WRECK))
    other = next(
        candidate
        for level in range(101)
        if model.content(candidate := block(1, 0, 0, (AUV_0, BATTERY, level / 100))) < model.content(creating)
    )
    merge(model, [creating, block(2, 0, 0, (NEW, LENGTH, 3.0))])
    assert model.value(NEW, LENGTH) == 3.0
    outcome = merge(model, [other])
    assert [change.block for change in outcome.changes] == [other]
    assert model.value(NEW, LENGTH) is None
    assert model.arrivals.waiting.keys() == {(2, 0, 0)}


def test_an_origin_that_contradicts_itself_is_held_to_what_it_said_first() -> None:
    said = [block(1, 0, 5, (NEW, TYPE_UID, WRECK)), block(1, 1, 3, (NEW, TYPE_UID, PIPELINE))]
    for arrival in (said, said[::-1]):
        model = fleet_model()
        faults = [fault for each in arrival for fault in merge(model, [each]).faults]
        assert codes(faults) == ["TYPE_CLASH"]
        assert (faults[0].origin, faults[0].sequence) == (1, 1)
        assert [o.value for o in model.history(NEW, TYPE_UID)] == [WRECK]


def test_faults_never_raise_and_are_told_once() -> None:
    model = fleet_model()
    bad = block(1, 0, 0, (AUV_0, TYPE_UID, OBJECT), (ECHO, TYPE_UID, AUV))
    assert codes(merge(model, [bad, bad]).faults) == ["TYPE_CLASH", "TYPE_CLASH"]  # two facts, told once
    assert merge(model, [bad]).faults == ()
