"""Beliefs: facts by name, out of the world model."""

from pathlib import Path

import pytest

from remoras.beliefs import Beliefs
from worldmodel import Instance, UnknownNameError, WorldModel, core_ontology_paths, merge, read_tbox

VOCABULARY = Path(__file__).parents[2] / "missions" / "mapping" / "vocabulary.ttl"
TBOX = read_tbox(*core_ontology_paths(), VOCABULARY)
NAMED = [("AUV", "AUV00"), ("AUV", "AUV01"), ("Group", "Operational"), ("Area", "middle"), ("Mission", "AreaMapping")]
INSTANCES = tuple(Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(NAMED))


def beliefs(owner: int = 0) -> Beliefs:
    model = WorldModel(TBOX, owner, INSTANCES, n_origins=2, run_time_instances_per_origin=0)
    return Beliefs(model)


def test_what_nobody_has_said_is_the_default() -> None:
    held = beliefs()
    assert held.get(("hasMission", "Operational")) is None
    assert held.get(("hasMission", "Operational"), "none yet") == "none yet"


def test_links_are_given_by_name() -> None:
    held = beliefs()
    held.model.record([held.fact("Operational", "hasMission", "AreaMapping")], 1.0)
    assert held.get(("hasMission", "Operational")) == "AreaMapping"


def test_numbers_are_given_as_the_wire_has_them() -> None:
    """The battery is kept to a hundredth."""
    held = beliefs()
    held.model.record([held.fact("AUV01", "batteryFraction", 0.504)], 1.0)
    assert held.get(("batteryFraction", "AUV01")) == 0.5


def test_the_latest_observation_is_believed_in_whatever_order_it_comes() -> None:
    author = beliefs(owner=1)
    old, new = (
        author.model.record([author.fact("middle", "areaDone", name)], time_s).block
        for name, time_s in (("AUV01", 1.0), ("AUV00", 2.0))
    )
    for order in ((old, new), (new, old)):
        held = beliefs()
        for block in order:
            merge(held.model, [block])
        assert held.get(("areaDone", "middle")) == "AUV00"


def test_keys_name_what_is_now_believed_otherwise() -> None:
    author, held = beliefs(owner=1), beliefs()
    old = author.model.record([author.fact("middle", "areaDone", "AUV01")], 1.0).block
    new = author.model.record(
        [author.fact("middle", "areaDone", "AUV00"), author.fact("AUV01", "batteryFraction", 0.5)], 2.0
    ).block
    assert held.keys_of(merge(held.model, [new]).changes) == {("areaDone", "middle"), ("batteryFraction", "AUV01")}
    assert held.keys_of(merge(held.model, [old]).changes) == set()  # old news change no belief


def test_names_and_uids() -> None:
    held = beliefs()
    assert [held.name(uid) for uid in range(5)] == [name for _, name in NAMED]
    assert [held.uid(name) for _, name in NAMED] == list(range(5))
    assert held.name(99) == "instance 99"


def test_a_name_that_does_not_exist_is_a_mistake_of_the_programmer() -> None:
    held = beliefs()
    with pytest.raises(UnknownNameError, match="Operationl"):
        held.get(("hasMission", "Operationl"))
    with pytest.raises(UnknownNameError, match="hasMision"):
        held.get(("hasMision", "Operational"))
