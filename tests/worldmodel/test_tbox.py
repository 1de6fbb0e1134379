import pickle
from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest
from small_fleet import AREAS, LENGTH, TBOX, WRECK, WRECKS

from worldmodel import OntologyError, UnknownNameError, core_ontology_paths, ontology_path, read_tbox
from worldmodel.ontology import graph_of

CORE = read_tbox(*core_ontology_paths())


def test_a_users_file_extends_the_core() -> None:
    assert TBOX.attributes[LENGTH].domain == WRECK
    assert TBOX.hash != CORE.hash
    with pytest.raises(UnknownNameError, match=r"allowed: ASV, AUV, .*; did you mean 'Wreck'"):
        TBOX.class_named("Wrek")
    with pytest.raises(LookupError, match="did you mean 'position'"):
        TBOX.attribute_named("positon")


def test_hash_does_not_depend_on_the_order_of_files_or_triples(tmp_path: Path) -> None:
    paths = [*core_ontology_paths(), ontology_path("bans"), AREAS, WRECKS]
    assert read_tbox(*reversed(paths)) == TBOX
    assert read_tbox(*reversed(paths)).hash == TBOX.hash
    turned = tmp_path / "turned.ttl"
    turned.write_text("\n".join(sorted(graph_of(TBOX).serialize(format="nt").splitlines(), reverse=True)))
    assert read_tbox(turned).hash == TBOX.hash


def test_hash_depends_on_compiled_terms_and_not_on_labels(tmp_path: Path) -> None:
    finer = tmp_path / "finer.ttl"
    finer.write_text(WRECKS.read_text().replace("rm:resolution 0.1", "rm:resolution 0.2"))
    labelled = tmp_path / "labelled.ttl"
    labelled.write_text(WRECKS.read_text() + 'ex:Wreck rdfs:label "wreck"@en .\n')
    assert read_tbox(*core_ontology_paths(), ontology_path("bans"), AREAS, finer).hash != TBOX.hash
    assert read_tbox(*core_ontology_paths(), ontology_path("bans"), AREAS, labelled).hash == TBOX.hash


def test_tbox_is_immutable_and_pickling_keeps_tables_and_files() -> None:
    with pytest.raises(FrozenInstanceError):
        CORE.classes = ()  # type: ignore[misc]
    before = len(pickle.dumps(CORE))
    n_triples = len(graph_of(CORE))
    copy = pickle.loads(pickle.dumps(CORE))
    assert (copy, copy.hash, hash(copy)) == (CORE, CORE.hash, hash(CORE))
    assert len(pickle.dumps(CORE)) == before  # the graph does not travel
    assert len(graph_of(copy)) == n_triples


def test_missing_files_are_all_named(tmp_path: Path) -> None:
    (tmp_path / "latin.ttl").write_bytes(b"# \xe9\n")
    with pytest.raises(OntologyError) as caught:
        read_tbox(tmp_path / "none.ttl", tmp_path / "latin.ttl")
    assert len(caught.value.faults) == 2
    assert "none.ttl" in str(caught.value)
    assert pickle.loads(pickle.dumps(caught.value)).faults == caught.value.faults
