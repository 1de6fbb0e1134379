import pytest
from small_fleet import (
    AREA_DONE,
    AUV,
    AUV_0,
    AUV_1,
    BATTERY,
    BAY,
    CLASSIFICATION,
    ECHO,
    EXPLORER,
    INSTANCES,
    LOCATION,
    NEAR,
    OBJECT,
    TBOX,
    WRECK,
    block,
    class_uid,
    first_uid_of,
    fleet_model,
    picture,
)

from worldmodel import TYPE_UID, FactError, Instance, UnknownNameError, Value, WorldModel, merge


def test_record_stores_and_returns_the_quantised_block() -> None:
    model = fleet_model(owner=1)
    change = model.record([(ECHO, LOCATION, (12.3, -4.1)), (AUV_1, BATTERY, 0.777)], now_s=2.04)
    assert change.block == block(1, 0, 20, (ECHO, LOCATION, (12.5, -4.0)), (AUV_1, BATTERY, 0.78))
    assert change.new_latest == change.block.facts
    observation = model.latest(ECHO, LOCATION)
    assert (observation.value, observation.time_s, observation.origin) == ((12.5, -4.0), 2.0, 1)
    assert model.value(AUV_1, BATTERY) == 0.78
    assert model.value(AUV_0, BATTERY, default=1.0) == 1.0
    assert model.block((1, 0, 0)) is model.arrived((1, 0, 0)) is change.block
    assert model.block((1, 0, 1)) is None


def test_only_facts_that_become_the_latest_value_count_as_new() -> None:
    model = fleet_model()
    model.record([(ECHO, CLASSIFICATION, 1)], now_s=5.0)
    (change,) = merge(model, [block(1, 0, 30, (ECHO, CLASSIFICATION, 2), (ECHO, LOCATION, (1.0, 1.0)))]).changes
    assert [fact.attribute for fact in change.new_latest] == [LOCATION]
    older = model.record([(ECHO, CLASSIFICATION, 3)], now_s=4.0)  # an observation that comes late is no news
    assert older.new_latest == ()


def test_instances_are_found_by_name_class_and_uid() -> None:
    model = fleet_model(owner=1)
    assert model.instance_named("bay").uid == BAY
    assert [i.name for i in model.instances_of(class_uid("Vehicle"))] == ["auv-0", "auv-1", "asv-0"]
    assert [i.name for i in model.instances_of(AUV)] == ["auv-0", "auv-1"]
    uid = model.new_instance_uid()
    assert uid == first_uid_of(1)
    assert model.instance(uid) is None
    model.record([(uid, TYPE_UID, OBJECT), (uid, LOCATION, (1.0, 2.0))], now_s=1.0)
    assert model.instance(uid) == Instance(uid, OBJECT, f"ObjectOfInterest-{uid}")
    model.record([(uid, TYPE_UID, WRECK)], now_s=2.0)
    assert model.instance(uid) == Instance(uid, OBJECT, f"ObjectOfInterest-{uid}")  # created as; refined since
    assert [i.uid for i in model.instances_of(WRECK)] == [uid]
    assert [i.uid for i in model.instances_of(OBJECT)] == [ECHO, uid]
    assert model.instance(-1) is model.instance(model.n_uids) is None
    assert [model.owner_of(u) for u in (0, uid, model.n_uids - 1, model.n_uids)] == [None, 1, 2, None]
    with pytest.raises(UnknownNameError, match="did you mean 'auv-0'"):
        model.instance_named("auv0")


@pytest.mark.parametrize(
    ("facts", "now_s", "reason"),
    [
        ([(AUV_0, BATTERY, 1.5)], 0.0, r"batteryFraction of instance 0: 1.5 is outside \[0.0, 1.0\]"),
        ([(AUV_0, BATTERY, (1.0, 2.0))], 0.0, "is not a number"),
        ([(AUV_0, 99, 1.0)], 0.0, "attribute 99 is unknown"),
        ([(99, BATTERY, 1.0)], 0.0, "subject 99 is outside"),
        ([(BAY, BATTERY, 1.0)], 0.0, "domain violated: batteryFraction: 3 is a Area, not a Vehicle"),
        ([(BAY, AREA_DONE, EXPLORER)], 0.0, "link to another class"),
        ([(ECHO, NEAR, first_uid_of(1))], 0.0, "instance 9 is unknown"),
        ([(first_uid_of(1), TYPE_UID, WRECK)], 0.0, "instance 9 is unknown"),
        ([(AUV_0, TYPE_UID, class_uid("ASV"))], 0.0, "type clash: 0 is given the type ASV, which is disjoint with AUV"),
        ([(AUV_0, BATTERY, 1.0)], -1.0, "now_s is -1.0"),
        ([(AUV_0, BATTERY, 1.0)], float("nan"), "now_s is nan"),
        ([], 0.0, "a block needs at least one fact"),
    ],
)
def test_misuse_is_refused_and_leaves_no_trace(facts: list[tuple[int, int, Value]], now_s: float, reason: str) -> None:
    model = fleet_model()
    before = picture(model)
    with pytest.raises(FactError, match=reason):
        model.record([(ECHO, LOCATION, (0.0, 0.0))] * bool(facts) + facts, now_s)
    assert picture(model) == before
    assert model.record([(ECHO, LOCATION, (0.0, 0.0))], 0.0).block.sequence == 0


def test_bad_arguments_are_refused() -> None:
    twice = (Instance(0, AUV, "a"), Instance(2, 99, "a"))
    with pytest.raises(FactError) as caught:
        WorldModel(TBOX, 0, twice, n_origins=1)
    assert len(str(caught.value).splitlines()) == 3  # uid, class, name
    with pytest.raises(FactError, match=r"owner 3 is not an origin; allowed: 0\.\.2"):
        WorldModel(TBOX, 3, INSTANCES, n_origins=3)
    with pytest.raises(FactError, match="time_resolution_s"):
        WorldModel(TBOX, 0, INSTANCES, 0.0, n_origins=1)
    with pytest.raises(FactError, match="run_time_instances_per_origin is -1"):
        WorldModel(TBOX, 0, INSTANCES, n_origins=1, run_time_instances_per_origin=-1)
