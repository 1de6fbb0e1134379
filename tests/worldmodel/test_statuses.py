"""Statuses, of which the newest remain, and private blocks: neither is part of the shared state."""

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from small_fleet import (
    AUV_0,
    AUV_1,
    BATTERY,
    ECHO,
    LOCATION,
    POSITION,
    TBOX,
    block,
    codes,
    first_uid_of,
    fleet_model,
    picture,
)

from worldmodel import STATUS, TYPE_UID, Block, Value, WorldModel, merge

EMPTY = fleet_model().state_hash()
_FACTS = st.sampled_from(
    [
        (AUV_0, BATTERY, 0.25),
        (AUV_0, BATTERY, 0.5),
        (AUV_1, BATTERY, 0.25),
        (AUV_0, POSITION, (1.0, 2.0)),
        (AUV_0, POSITION, (2.0, 1.0)),
    ]
)
statuses = st.lists(
    st.builds(
        lambda origin, tick, facts, epoch: block(origin, STATUS, tick, *facts, epoch=epoch),
        st.integers(0, 2),
        st.integers(0, 2),
        st.lists(_FACTS, min_size=1, max_size=3),
        st.integers(0, 1),
    ),
    max_size=10,
)


def merged(blocks: list[Block]) -> WorldModel:
    model = fleet_model()
    for each in blocks:
        assert not merge(model, [each]).faults
    return model


@settings(max_examples=100, deadline=None)
@given(statuses, st.randoms(use_true_random=False))
def test_newest_status_of_each_slot_and_origin_remains_in_any_order(blocks: list[Block], rng: random.Random) -> None:
    model = merged(blocks)
    newest: dict[tuple[int, int, int], tuple[float, int, Value]] = {}
    for each in blocks:
        for fact in each.facts:
            slot = (fact.subject, fact.attribute, each.origin)
            said = (each.time_s, each.epoch, fact.value)
            newest[slot] = max(said, newest.get(slot, said))  # type: ignore[type-var]
    held = {
        (b.facts[0].subject, b.facts[0].attribute, b.origin): (b.time_s, b.epoch, b.facts[0].value)
        for b in model.statuses()
    }
    assert held == newest
    assert (model.state_hash(), model.digest(), list(model.blocks())) == (EMPTY, {}, [])
    again = blocks + blocks[: len(blocks) // 2]
    rng.shuffle(again)
    assert picture(merged(again)) == picture(model)
    assert merge(model, blocks).changes == ()


def test_newer_status_of_one_origin_is_not_new_if_another_is_later() -> None:
    model = fleet_model()
    merge(model, [block(1, STATUS, 9, (AUV_1, BATTERY, 0.5)), block(2, STATUS, 3, (AUV_1, BATTERY, 0.9))])
    for tick, level, is_news in ((6, 0.8, False), (7, 0.7, False), (12, 0.4, True)):
        (change,) = merge(model, [block(2, STATUS, tick, (AUV_1, BATTERY, level))]).changes
        assert change.new_latest == (change.block.facts if is_news else ())
        assert model.value(AUV_1, BATTERY) == (level if is_news else 0.5)
    assert [(o.origin, o.value) for o in model.history(AUV_1, BATTERY)] == [(1, 0.5), (2, 0.4)]


def test_status_of_unknown_instance_is_dropped_and_may_be_received_again() -> None:
    tug = first_uid_of(1)
    status = block(1, STATUS, 0, (tug, BATTERY, 0.5))
    model = fleet_model()
    assert codes(merge(model, [status]).faults) == ["UNKNOWN_INSTANCE"]
    assert not model.arrivals.waiting
    assert codes(merge(model, [block(1, STATUS, 0, (ECHO, BATTERY, 0.5))]).faults) == ["DOMAIN"]
    merge(model, [block(1, 0, 0, (tug, TYPE_UID, TBOX.class_named("AUV").uid))])
    assert len(merge(model, [status]).changes) == 1
    assert model.value(tug, BATTERY) == 0.5


def test_status_is_removed_with_the_class_it_depends_on() -> None:
    tug = first_uid_of(1)
    model = fleet_model()
    creating = block(1, 0, 0, (tug, TYPE_UID, TBOX.class_named("AUV").uid))
    merge(model, [creating, block(1, STATUS, 0, (tug, BATTERY, 0.5)), block(1, STATUS, 0, (AUV_0, BATTERY, 0.5))])
    other = next(
        candidate
        for x in range(100)
        if model.content(candidate := block(1, 0, 0, (ECHO, LOCATION, (float(x), 0.0)))) < model.content(creating)
    )
    merge(model, [other])
    assert model.value(tug, BATTERY) is None
    assert model.value(AUV_0, BATTERY) == 0.5


def test_statuses_and_private_blocks_leave_no_gaps_in_item_numbers() -> None:
    model = fleet_model(owner=1)
    kinds = []
    for n in range(9):
        facts: list[tuple[int, int, Value]] = [(AUV_1, BATTERY, n / 10)] if n % 3 == 0 else [(ECHO, LOCATION, (n, 1.0))]
        kinds.append(model.record(facts, float(n), private=n % 3 == 1).block.sequence)
    assert kinds == [STATUS, -2, 0, STATUS, -3, 1, STATUS, -4, 2]
    assert model.digest() == {(1, 0): (2, 0)}
    assert [b.sequence for b in model.blocks()] == [0, 1, 2]
    assert [b.sequence for b in model.private_blocks()] == [-2, -3, -4]
    assert len(model.history(ECHO, LOCATION)) == 6  # it knows all that it has recorded
