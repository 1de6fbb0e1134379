"""World models written as rows and read back."""

import math

import pytest
from small_fleet import (
    AREA_DONE,
    ASV_0,
    AUV_0,
    AUV_1,
    BATTERY,
    BAY,
    CELL,
    CLASSIFICATION,
    COMPLETED,
    ECHO,
    INSTANCES,
    LENGTH,
    LOCATION,
    N_ORIGINS,
    SURVEY,
    TBOX,
    WRECK,
    block,
    first_uid_of,
    fleet_model,
    picture,
)

from worldmodel import (
    TYPE_UID,
    Keeping,
    Lacking,
    SnapshotError,
    WorldModel,
    core_ontology_paths,
    expire,
    merge,
    models_from,
    read_tbox,
    rows_of,
)


def again(model: WorldModel) -> WorldModel:
    (read,) = models_from(rows_of({"auv-1": model}), TBOX).values()
    return read


def test_a_row_says_by_name_what_a_vehicle_knows() -> None:
    model = fleet_model(owner=2)
    said = [(BAY, AREA_DONE, ASV_0), (ECHO, LOCATION, (3.26, 4.0)), (ECHO, CLASSIFICATION, 1), (AUV_0, BATTERY, 0.333)]
    model.record([*said, (SURVEY, COMPLETED, True), (ECHO, TYPE_UID, WRECK)], 12.34)
    merge(model, [block(0, 3, 20, (first_uid_of(0), LENGTH, 2.0))], now_s=7.0)
    rows = list(rows_of({"asv-0": model}))
    assert rows == [row for row in rows if row.vehicle == "asv-0"]
    known = [row[2:] for row in rows if row.kind == "known"]
    assert known == [
        (BAY, 2, 0, 0, 0, 12.3, 0.0, "bay", "areaDone", "2 asv-0", ""),
        (ECHO, 2, 0, 0, 1, 12.3, 0.0, "echo", "location", "POINT (3.5 4.0)", ""),
        (ECHO, 2, 0, 0, 2, 12.3, 0.0, "echo", "classification", "wreck", ""),
        (AUV_0, 2, 0, 0, 3, 12.3, 0.0, "auv-0", "batteryFraction", "0.33", ""),
        (SURVEY, 2, 0, 0, 4, 12.3, 0.0, "survey", "missionCompleted", "true", ""),
        (ECHO, 2, 0, 0, 5, 12.3, 0.0, "echo", "type", "Wreck", ""),
    ]
    assert [row[2:] for row in rows if row.kind == "waiting"] == [
        (first_uid_of(0), 0, 0, 3, 0, 2.0, 7.0, "", "length", "2.0", ""),
    ]
    common = [row[2:] for row in rows if row.kind == "common"]
    assert common[BAY] == (BAY, -1, 0, BAY, 0, 0.0, 0.0, "bay", "type", "Area", "")


def test_rows_that_make_no_world_model_are_refused() -> None:
    model = fleet_model()
    model.record([(BAY, CELL, 5.0)], 1.0)
    rows = list(rows_of({"auv-0": model}))
    with pytest.raises(SnapshotError, match="'auv-0' cannot be read: it was made with the ontology"):
        models_from(rows, read_tbox(*core_ontology_paths()))
    with pytest.raises(SnapshotError, match="it lacks the setting ontology"):
        models_from(rows[1:], TBOX)
    for column, value, reason in [
        ("value", "half", "could not convert string to float"),
        ("value", "0.555", "the checks do not agree that block \\(0, 0, 0\\) is known"),
        ("time_s", math.nan, "the checks do not agree"),
        ("attribute", "mappedCel", "did you mean 'mappedCell'"),
        ("kind", "knwon", "'knwon' is not a valid RowKind"),
    ]:
        with pytest.raises(SnapshotError, match=reason):
            models_from([*rows[:-1], rows[-1]._replace(**{column: value})], TBOX)


def test_who_restarts_with_its_memory_counts_on() -> None:
    model = WorldModel(
        TBOX,
        1,
        INSTANCES,
        n_origins=N_ORIGINS,
        run_time_instances_per_origin=2,
        epoch=3,
        keeping=Keeping(clock_tolerance_s=5.0, waiting_s=60.0, waiting_blocks=7),
    )
    uid = model.new_instance_uid()  # taken and not announced yet
    model.record([(BAY, CELL, 1.0)], 1.0)
    model.record([(BAY, CELL, 2.0)], 1.0, private=True)
    model.record([(AUV_1, BATTERY, 0.5)], 1.0)
    merge(model, [block(0, 0, 0, (uid, LENGTH, 2.0))], now_s=4.0)
    read = again(model)
    assert picture(read) == picture(model)
    assert list(read.private_blocks()) == list(model.private_blocks())
    assert (read.epoch, read.clock_tolerance_s) == (3, 5.0)
    assert read.new_instance_uid() != uid
    assert read.record([(BAY, CELL, 3.0)], 2.0).block.guid == (1, 3, 1)
    assert read.record([(BAY, CELL, 4.0)], 2.0, private=True).block.guid == (1, 3, -3)
    assert read.lacking(10.0) == model.lacking(10.0) == (Lacking(uid, 1, 6.0, ((0, 0, 0),)),)
    assert len(expire(read, 64.5)) == 1
    assert read.arrivals.waiting_blocks == 7
