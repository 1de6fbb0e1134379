"""Invariants of merging, with pending and contradicting blocks and reused GUIDs."""

from itertools import permutations
from pathlib import Path

import pytest
from small_fleet import (
    AREAS,
    AUV_0,
    BATTERY,
    BAY,
    CELL,
    ECHO,
    LENGTH,
    LOCATION,
    NEAR,
    PIPELINE,
    WRECK,
    WRECKS,
    block,
    codes,
    first_uid_of,
    fleet_model,
)

from worldmodel import (
    STATUS,
    TYPE_UID,
    Block,
    FactError,
    Lacking,
    WorldModel,
    core_ontology_paths,
    expire,
    merge,
    ontology_path,
    read_tbox,
)

NEW = first_uid_of(1)


def test_attribute_of_owl_thing_waits_for_its_instance_too(tmp_path: Path) -> None:
    own = tmp_path / "own.ttl"
    own.write_text(
        """@prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
        <https://example.org/own> a owl:Ontology . <https://example.org/own#seen> a owl:DatatypeProperty ;
        rdfs:domain owl:Thing ; rdfs:range <http://www.w3.org/2001/XMLSchema#boolean> ."""
    )
    tbox = read_tbox(*core_ontology_paths(), ontology_path("bans"), AREAS, WRECKS, own)
    model = fleet_model(tbox=tbox)
    seen = tbox.attribute_named("seen").uid
    assert merge(model, [block(1, 0, 0, (BAY, seen, True))]).changes
    assert merge(model, [block(2, 0, 0, (NEW, seen, True))]).changes == ()
    assert len(model.arrivals.waiting) == 1


def test_next_merge_returns_blocks_that_a_local_record_released() -> None:
    model = fleet_model(owner=0)
    merge(model, [block(2, 0, 1, (ECHO, LENGTH, 30.0)), block(2, 1, 1, (ECHO, LENGTH, 31.0), (ECHO, NEAR, AUV_0))])
    assert model.arrivals.refused.keys() == {(2, 0, 1)}
    change = model.record([(ECHO, TYPE_UID, WRECK)], 2.0)
    assert change.block.guid == (0, 0, 0)
    assert model.value(ECHO, LENGTH) == 30.0
    assert [c.block.guid for c in merge(model, []).changes] == [(2, 0, 0)]
    assert merge(model, []).changes == ()


def smaller(than: Block, model: WorldModel) -> Block:
    """A block with the GUID of another, and a smaller digest, about nothing but the echo."""
    candidates = (block(than.origin, than.sequence, 0, (ECHO, LOCATION, (float(x), 0.0))) for x in range(1000))
    return next(one for one in candidates if model.content(one) < model.content(than))


@pytest.mark.parametrize("is_other", [False, True])
def test_replaced_creation_removes_exactly_the_blocks_that_need_it(is_other: bool) -> None:
    """The creation is replaced, or one of another class: blocks that rest on it leave, no others."""
    model = fleet_model()
    creating = block(1, 5001, 7, (NEW, TYPE_UID, WRECK))
    merge(model, [creating, block(2, 0, 0, (NEW, LENGTH, 3.0)), block(2, 1, 0, (ECHO, TYPE_UID, WRECK))])
    merge(model, [block(1, n, n, (BAY, CELL, float(n)), (AUV_0, BATTERY, 0.5)) for n in range(100)])
    assert model.value(NEW, LENGTH) == 3.0
    news = block(1, 5000, 0, (NEW, TYPE_UID, PIPELINE)) if is_other else smaller(creating, model)
    merge(model, [news])
    assert model.value(NEW, LENGTH) is None
    assert model.class_mask(NEW) >> PIPELINE & 1 == is_other
    assert model.class_mask(ECHO) >> WRECK & 1
    assert sorted(model.arrivals.refused) == ([(1, 0, 5001), (2, 0, 0)] if is_other else [])
    assert list(model.arrivals.waiting) == ([] if is_other else [(2, 0, 0)])


# Facts of the future, and blocks that wait ---------------------------------------------------------


def test_block_of_a_future_time_has_not_arrived() -> None:
    model = fleet_model()
    late = block(1, 0, 111, (ECHO, LOCATION, (1.0, 1.0)))  # 11.1 s
    sound = block(1, 0, 11, (ECHO, LOCATION, (2.0, 2.0)))
    status = block(1, STATUS, 111, (AUV_0, BATTERY, 0.5))
    assert codes(merge(model, [late, status], now_s=10.0).faults) == ["FUTURE", "FUTURE"]
    assert (model.digest(), list(model.statuses())) == ({}, [])
    assert len(merge(model, [sound], now_s=10.0).changes) == 1
    assert model.value(ECHO, LOCATION) == (2.0, 2.0)
    assert len(merge(model, [block(1, 1, 110, (BAY, CELL, 1.0))], now_s=10.0).changes) == 1  # tolerance: 1 s


def test_lacking_lists_missing_instances_with_origin_and_waiting_time() -> None:
    model = fleet_model()
    merge(model, [block(2, 0, 0, (NEW, LENGTH, 3.0))], now_s=5.0)
    merge(model, [block(0, 0, 0, (ECHO, NEAR, NEW)), block(2, 1, 0, (NEW, LENGTH, 4.0))], now_s=8.0)
    merge(model, [block(2, 2, 0, (ECHO, LENGTH, 3.0))])  # nobody said when it came: it was recorded at 0.0 s
    assert model.lacking() == (
        Lacking(ECHO, None, ((2, 0, 2),)),
        Lacking(NEW, 1, ((0, 0, 0), (2, 0, 0), (2, 0, 1))),
    )
    merge(model, [block(1, 0, 0, (NEW, TYPE_UID, WRECK))], now_s=21.0)
    assert [(one.uid, one.guids) for one in model.lacking()] == [(ECHO, ((2, 0, 2),))]


def test_expired_block_is_discarded_and_may_be_received_again() -> None:
    model = fleet_model(waiting_s=60.0)
    waiting = [block(2, 0, 0, (NEW, LENGTH, 3.0)), block(2, 1, 0, (NEW, LENGTH, 4.0))]
    merge(model, waiting[:1], now_s=5.0)
    merge(model, waiting[1:], now_s=6.0)
    assert expire(model, 65.0) == ()
    faults = expire(model, 65.5)
    assert codes(faults) == ["TIMED_OUT"]
    assert (faults[0].guid, model.digest()) == ((2, 0, 0), {(2, 0): (-1, 0b10)})
    assert not model.has_arrived((2, 0, 0))
    assert expire(model, 65.5) == ()
    merge(model, waiting[:1], now_s=66.0)
    assert model.digest() == {(2, 0): (1, 0)}
    merge(model, [block(1, 0, 0, (NEW, TYPE_UID, WRECK))], now_s=67.0)
    assert [o.value for o in model.history(NEW, LENGTH)] == [3.0, 4.0]
    assert expire(model, 1000.0) == ()


def test_oldest_waiting_block_of_an_origin_is_dropped_above_the_bound() -> None:
    model = fleet_model(waiting_blocks=2)
    for n in range(3):
        faults = merge(model, [block(2, 2 - n, 0, (NEW, LENGTH, 3.0 + n))], now_s=5.0 + n).faults
        assert codes(faults) == ["CROWDED_OUT"] * (n == 2)
    assert faults[0].guid == (2, 0, 2)
    merge(model, [block(0, 0, 0, (NEW, LENGTH, 3.0))], now_s=9.0)  # each origin has a bound of its own
    assert sorted(model.arrivals.waiting) == [(0, 0, 0), (2, 0, 0), (2, 0, 1)]
    assert model.digest() == {(0, 0): (0, 0), (2, 0): (1, 0)}
    with pytest.raises(FactError, match="waiting_blocks is 0; allowed: 1 or more"):
        fleet_model(waiting_blocks=0)


# Classes with two parents ----------------------------------------------------------------------------

MINES = """
@prefix ex: <https://example.org/mines#> . @prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
ex:Hulk a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest .
ex:Hazard a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest .
ex:MinedHulk a owl:Class ; rdfs:subClassOf ex:Hulk , ex:Hazard .
ex:charge a owl:DatatypeProperty ; rdfs:domain ex:Hazard ; rdfs:range xsd:double ;
    rm:minimum 0 ; rm:maximum 100 ; rm:resolution 1 .
"""


def test_fact_waits_if_a_second_class_of_its_subject_may_follow(tmp_path: Path) -> None:
    """A hulk is no hazard, but it may yet be a mined hulk, which is one."""
    (tmp_path / "mines.ttl").write_text(MINES, encoding="utf-8")
    tbox = read_tbox(*core_ontology_paths(), tmp_path / "mines.ttl")
    hulk, mined = (tbox.class_named(name).uid for name in ("Hulk", "MinedHulk"))
    blocks = [
        block(0, 0, 0, (0, TYPE_UID, hulk)),
        block(1, 0, 1, (0, tbox.attribute_named("charge").uid, 3.0)),
        block(2, 0, 2, (0, TYPE_UID, mined)),
    ]
    for order in permutations(blocks):
        model = WorldModel(tbox, 0, [], n_origins=3, run_time_instances_per_origin=1)
        faults = [fault for each in order for fault in merge(model, [each]).faults]
        assert not faults
        assert model.value(0, blocks[1].facts[0].attribute) == 3.0
