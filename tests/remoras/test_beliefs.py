"""Beliefs: facts by name, read from the world model."""

import pytest

from remoras.beliefs import Beliefs
from remoras.sensor import SELF, Observation
from worldmodel import Instance, UnknownNameError, WorldModel, core_ontology_paths, merge, read_tbox

TBOX = read_tbox(*core_ontology_paths())
NAMED = [("AUV", "AUV00"), ("AUV", "AUV01"), ("Group", "Operational"), ("Job", "middle"), ("Mission", "AreaMapping")]
INSTANCES = tuple(Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(NAMED))


def beliefs(owner: int = 0, n_found: int = 0) -> Beliefs:
    model = WorldModel(TBOX, owner, INSTANCES, n_origins=2, run_time_instances_per_origin=n_found)
    return Beliefs(model)


def test_an_unknown_name_raises_a_programming_error() -> None:
    held = beliefs()
    with pytest.raises(UnknownNameError, match="Operationl"):
        held.get(("hasMission", "Operationl"))
    with pytest.raises(UnknownNameError, match="hasMision"):
        held.get(("hasMision", "Operational"))


# What sensors find --------------------------------------------------------------------------------

WRECK = Observation(((SELF, "location", (10.0, 20.0)), (SELF, "classification", "wreck")), found="ObjectOfInterest")


def test_a_detection_becomes_an_instance_that_peers_resolve_by_name() -> None:
    """Vehicle 1 has the uids behind the five common instances and the two of vehicle 0: its first one is 7."""
    finder, peer = beliefs(owner=1, n_found=2), beliefs(owner=0, n_found=2)
    block = finder.model.record(finder.facts_of(WRECK), 1.0).block
    merge(peer.model, [block])
    for held in (finder, peer):
        assert held.name(7) == "ObjectOfInterest-7"
        assert held.get(("location", "ObjectOfInterest-7")) == (10.0, 20.0)
        assert held.get(("classification", "ObjectOfInterest-7")) == "wreck"
    later = finder.model.record([finder.fact("ObjectOfInterest-7", "classification", "pipeline")], 2.0)
    assert finder.keys_of([later]) == {("classification", "ObjectOfInterest-7")}
    assert finder.by_name(later.block.facts[0]) == ("ObjectOfInterest-7", "classification", "pipeline")


@pytest.mark.parametrize("name", ["ObjectOfInterest-6", "AUV-0", "Job-99"])
def test_a_name_in_the_form_of_a_detection_is_unknown(name: str) -> None:
    with pytest.raises(UnknownNameError):
        beliefs(n_found=2).uid(name)


# Derived values -----------------------------------------------------------------------------------


def test_a_derived_value_is_computed_again_once_a_fact_that_it_read_changes() -> None:
    """A mission is given, then the job is done: only the latter was read. A kept value counts as read all the same."""
    held, n_derived = beliefs(), 0

    def derive() -> int:
        nonlocal n_derived
        n_derived += 1
        return len(held.values(("knownDone", "middle")))

    held.values(("hasMission", "Operational"))
    held.take_read()
    changes = [(), (held.fact("Operational", "hasMission", "AreaMapping"),), (held.fact("middle", "knownDone", True),)]
    found = []
    for facts in changes:
        if facts:
            held.model.record(facts, 1.0)
            held.note()
        changed = held.take_changed()
        values = {held.derived("done", derive) for _ in range(2)}
        found.append((values, n_derived, held.take_read() == changed, len(changed)))
    assert found == [({0}, 1, False, 0), ({0}, 1, False, 1), ({1}, 2, True, 1)]
