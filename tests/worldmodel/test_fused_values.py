"""Fused estimates in SPARQL: equal to ``worldmodel.fused``, without further terms."""

import pytest
from small_fleet import CLASSIFICATION, ECHO, LOCATION, TBOX, ban, block, fleet_model

from worldmodel import WorldModel, fused, merge
from worldmodel.rdf.sparql import query

ASKED = (
    "SELECT ?value ?sigma ?t WHERE { GRAPH run:fused { run:instance-%d sit:hasPropertyValue ?e . ?e sit:ofAttribute %s"
    " ; sit:dataValue ?value ; sit:standardUncertainty|sit:probability ?sigma ; sit:timestamp ?t } }"
    " ORDER BY DESC(?sigma)"
)
PLACE = ASKED % (ECHO, "rm:location")


def three_looks() -> WorldModel:
    """Three vehicles have seen the echo."""
    model = fleet_model()
    looks = ((0.0, 2.0, 1.0), (4.0, 0.0, 2.0), (1.0, 1.0, 0.5))
    for origin, (x_m, y_m, sigma_m) in enumerate(looks):
        merge(model, [block(origin, 0, 10 * origin, (ECHO, LOCATION, (x_m, y_m), sigma_m))])  # type: ignore[arg-type]
    return model


def test_estimate_in_sparql_equals_fused_value_and_deviation() -> None:
    model = three_looks()
    expected = fused(TBOX.attributes[LOCATION], model.history(ECHO, LOCATION))
    ((value, sigma, time_s),) = query(model, PLACE)[1]
    x_m, y_m = expected.value  # type: ignore[misc]
    assert value == f"POINT ({x_m} {y_m})"
    assert (sigma, time_s) == (expected.uncertainty, expected.time_s)


def test_estimate_names_its_sources_without_a_banned_vehicle() -> None:
    model = three_looks()
    origins = "SELECT ?by WHERE { GRAPH run:fused { ?e sit:ofAttribute rm:location ; sit:origin ?by } } ORDER BY ?by"
    assert [by for (by,) in query(model, origins)[1]] == ["auv-0", "auv-1", "asv-0"]
    before = query(model, PLACE)[1]
    ban(model, [1])
    assert [by for (by,) in query(model, origins)[1]] == ["auv-0", "asv-0"]
    assert query(model, PLACE)[1] != before


def test_a_symbol_has_an_estimate_for_each_hypothesis() -> None:
    model = fleet_model()
    first, second = TBOX.attributes[CLASSIFICATION].symbols[:2]
    for origin, (symbol, p) in enumerate(((0, 0.9), (1, 0.6))):
        merge(model, [block(origin, 0, origin, (ECHO, CLASSIFICATION, symbol, p))])  # type: ignore[arg-type]
    rows = query(model, ASKED % (ECHO, "rm:classification"))[1]
    expected = fused(TBOX.attributes[CLASSIFICATION], model.history(ECHO, CLASSIFICATION))
    assert [row[1] for row in rows] == [share for _, share in expected.probabilities]
    assert rows[0][0] == first
    assert second in {row[0] for row in rows}
    assert sum(share for _, share, _ in rows) == pytest.approx(1.0)


def test_a_number_with_an_exponent_is_found() -> None:
    """One without is a decimal, which rdflib compares by its digits: 0.9 is not the double that is next to it."""
    model = fleet_model()
    for origin, p in enumerate((0.9, 0.6)):
        merge(model, [block(origin, 0, origin, (ECHO, CLASSIFICATION, 1, p))])  # type: ignore[arg-type]
    told = "SELECT ?p WHERE { ?f sit:origin ?by ; sit:probability ?p FILTER(?p IN (0.9e0, 0.6e0)) } ORDER BY ?p"
    assert query(model, told)[1] == [(0.6,), (0.9,)]
