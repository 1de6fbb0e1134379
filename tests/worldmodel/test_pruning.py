"""Pruning changes only old values: not latest ones, classes, digest, state hash or detection of duplicates."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_fleet import (
    AREA,
    AREA_DONE,
    BAY,
    CELL,
    CLASSIFICATION,
    COMPLETED,
    ECHO,
    LOCATION,
    OBJECT,
    TBOX,
    WRECK,
    any_blocks,
    ban,
    block,
    fleet_model,
)

from worldmodel import TYPE_UID, FactError, PruneRule, WorldModel, merge, tidy

THING = 0
PRUNED = [LOCATION, CLASSIFICATION, CELL, COMPLETED, AREA_DONE]


def prune(model: WorldModel, class_uid: int, attribute: int, before_s: float) -> int:
    """Apply a rule for values older than that; returns how many items it drops."""
    n_items, model.pruning = len(list(model.blocks())), (PruneRule(class_uid, attribute, 0.0),)
    assert tidy(model, before_s) == ()
    return n_items - len(list(model.blocks()))


def answers(model: WorldModel) -> tuple[object, ...]:
    """All answers of a model except old values."""
    uids = range(model.n_uids)
    return (
        model.state_hash(),
        model.digest(),
        [model.latest(uid, a.uid) for uid in uids for a in TBOX.attributes],
        [model.class_mask(uid) for uid in uids],
        [model.instances_of(c.uid) for c in TBOX.classes],
        list(model.statuses()),
    )


@settings(max_examples=80, deadline=None)
@given(any_blocks, any_blocks, st.sampled_from(PRUNED), st.integers(0, 6), st.sets(st.integers(0, 2), max_size=2))
def test_pruning_changes_no_answer_but_old_values(blocks, then, attribute, tick, banned) -> None:
    model, pruned = fleet_model(), fleet_model()
    for one in (model, pruned):
        merge(one, blocks)
    n_pruned = prune(pruned, THING, attribute, tick / 10)
    assert answers(pruned) == answers(model)
    held = {b.guid: b for b in pruned.blocks()}
    gone = [b for b in model.blocks() if b.guid not in held]
    assert len(gone) == n_pruned
    assert all(fact.attribute == attribute for b in gone for fact in b.facts)
    assert all(b.time_s < tick / 10 for b in gone)
    for uid in range(model.n_uids):
        for other in TBOX.attributes:
            kept = tuple(o for o in model.history(uid, other.uid) if o.block not in gone)
            assert pruned.history(uid, other.uid) == kept
    again = [*model.blocks(), *(one.block for one in model.arrivals.waiting.values()), *model.arrivals.refused.values()]
    assert merge(pruned, again) == ((), ())  # known, and refused as before
    known = {b.guid for b in blocks}
    for one in (model, pruned):
        merge(one, [b for b in then if b.guid not in known])
        ban(one, banned)
    assert answers(pruned) == answers(model)


def test_only_the_instances_of_the_class_are_pruned() -> None:
    model = fleet_model()
    merge(model, [block(1, n, n, (ECHO, LOCATION, (float(n), 0.0))) for n in range(3)])
    assert prune(model, WRECK, LOCATION, before_s=9.0) == 0
    merge(model, [block(1, 3, 5, (ECHO, TYPE_UID, WRECK))])
    assert prune(model, WRECK, LOCATION, before_s=9.0) == 2


def test_private_facts_are_not_pruned_and_supersede_nothing() -> None:
    model = fleet_model(owner=1)
    model.record([(ECHO, LOCATION, (0.0, 0.0))], 0.0)
    for x in (1.0, 2.0):
        model.record([(ECHO, LOCATION, (x, 0.0))], x, private=True)
    assert prune(model, OBJECT, LOCATION, before_s=9.0) == 0


def test_tidy_prunes_by_age_according_to_the_rules() -> None:
    model = fleet_model(waiting_s=2.0, pruning=(PruneRule(AREA, CELL, 5.0),))
    for n in range(10):
        model.record([(BAY, CELL, float(n))], float(n))
    merge(model, [block(1, 0, 0, (ECHO, TYPE_UID, WRECK)), block(2, 0, 0, (model.n_uids - 1, LOCATION, (0.0, 0.0)))])
    assert [fault.code.name for fault in tidy(model, 9.0)] == ["TIMED_OUT"]
    assert [o.time_s for o in model.history(BAY, CELL)] == [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]


@pytest.mark.parametrize(
    ("rule", "reason"),
    [
        (PruneRule(99, CELL, 0.0), "class 99 is unknown"),
        (PruneRule(AREA, TYPE_UID, 0.0), "attribute 0; .*values of type, bannedFrom are never pruned"),
        (PruneRule(AREA, TBOX.attribute_named("bannedFrom").uid, 0.0), "values of type, bannedFrom are never pruned"),
        (PruneRule(AREA, 999, 0.0), "attribute 999"),
        (PruneRule(AREA, CELL, -1.0), "older_than_s is -1"),
    ],
)
def test_impossible_prune_rules_are_refused(rule: PruneRule, reason: str) -> None:
    with pytest.raises(FactError, match=reason):
        fleet_model(pruning=(rule,))
