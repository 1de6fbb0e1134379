import copy
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_fleet import (
    AREA_DONE,
    ASV_0,
    AUV,
    AUV_0,
    AUV_1,
    BANNED_FROM,
    BATTERY,
    BAY,
    CLASSIFICATION,
    ECHO,
    EXPLORER,
    INSTANCES,
    LENGTH,
    LOCATION,
    NEAR,
    OBJECT,
    PLAYS_ROLE,
    TBOX,
    WRECK,
    ban,
    block,
    class_uid,
    first_uid_of,
    fleet_model,
    picture,
    sound_blocks,
)

from worldmodel import (
    TYPE_UID,
    Block,
    FactError,
    Instance,
    UnknownNameError,
    Value,
    WorldModel,
    merge,
)


def test_what_is_recorded_is_what_is_stored() -> None:
    model = fleet_model(owner=1)
    change = model.record([(ECHO, LOCATION, (12.3, -4.1)), (AUV_1, BATTERY, 0.777)], now_s=2.04)
    assert change.block == block(1, 0, 20, (ECHO, LOCATION, (12.5, -4.0)), (AUV_1, BATTERY, 0.78))
    assert change.new_latest == change.block.facts
    observation = model.latest(ECHO, LOCATION)
    assert observation is not None
    assert (observation.value, observation.time_s, observation.origin) == ((12.5, -4.0), 2.0, 1)
    assert model.value(AUV_1, BATTERY) == 0.78
    assert model.value(AUV_0, BATTERY, default=1.0) == 1.0
    assert model.block((1, 0, 0)) is model.arrived((1, 0, 0)) is change.block
    assert model.block((1, 0, 1)) is None


def test_the_latest_is_by_time_then_origin_then_sequence_then_position() -> None:
    blocks = [
        block(0, 0, 5, (ECHO, CLASSIFICATION, 0)),
        block(2, 0, 5, (ECHO, CLASSIFICATION, 1)),
        block(1, 1, 5, (ECHO, CLASSIFICATION, 2)),
        block(0, 1, 6, (ECHO, CLASSIFICATION, 3), (ECHO, CLASSIFICATION, 1)),
        block(0, 2, 4, (ECHO, CLASSIFICATION, 2)),
    ]
    in_order = [(0, 2, 0), (0, 0, 0), (1, 1, 0), (2, 0, 0), (0, 1, 0), (0, 1, 1)]
    for arrival in (blocks, blocks[::-1]):
        model = fleet_model()
        merge(model, arrival)
        history = model.history(ECHO, CLASSIFICATION)
        assert [(o.block.origin, o.block.sequence, o.position) for o in history] == in_order
        assert model.latest(ECHO, CLASSIFICATION) == history[-1]


def test_only_facts_that_are_now_the_latest_are_news() -> None:
    model = fleet_model()
    model.record([(ECHO, CLASSIFICATION, 1)], now_s=5.0)
    (change,) = merge(model, [block(1, 0, 30, (ECHO, CLASSIFICATION, 2), (ECHO, LOCATION, (1.0, 1.0)))]).changes
    assert [fact.attribute for fact in change.new_latest] == [LOCATION]
    older = model.record([(ECHO, CLASSIFICATION, 3)], now_s=4.0)  # an observation that comes late is no news
    assert older.new_latest == ()


@given(sound_blocks(), st.randoms())
def test_incremental_latest_is_the_latest_worked_out_from_scratch(blocks: list[Block], random: object) -> None:
    model = fleet_model()
    random.shuffle(blocks)  # type: ignore[attr-defined]
    merge(model, blocks)
    everything = sorted(
        (*b.key, position, fact.subject, fact.attribute)
        for b in (*model.blocks(), *model.statuses())
        for position, fact in enumerate(b.facts)
    )
    for instance in range(model.n_uids):
        for attribute in TBOX.attributes:
            expected = [entry[:5] for entry in everything if entry[5:] == (instance, attribute.uid)]
            history = model.history(instance, attribute.uid)
            assert [(*o.block.key, o.position) for o in history] == expected
            latest = model.latest(instance, attribute.uid)
            assert latest == (history[-1] if history else None)


@given(sound_blocks(), st.sets(st.integers(0, 2), max_size=2))
def test_a_ban_is_the_view_without_an_origin(blocks: list[Block], banned: set[int]) -> None:
    model = fleet_model()
    merge(model, blocks)
    before, version = picture(model), model.version
    ban(model, banned)
    assert model.banned.keys() == banned
    assert [each for each in model.blocks() if each.sequence < 900] == before[1]
    for uid in range(model.n_uids):
        for attribute in (one for one in TBOX.attributes if one.uid != BANNED_FROM):
            kept = [o for o in before[6][uid * len(TBOX.attributes) + attribute.uid] if o.origin not in banned]  # type: ignore[index]
            assert list(model.history(uid, attribute.uid)) == kept
            assert model.latest(uid, attribute.uid) == (kept[-1] if kept else None)
    assert model.version == version + len(banned)


def test_news_from_a_banned_origin_is_no_news() -> None:
    model = fleet_model()
    ban(model, [2])
    (change,) = merge(model, [block(2, 0, 3, (first_uid_of(2), TYPE_UID, WRECK), (ASV_0, BATTERY, 0.5))]).changes
    assert change.new_latest == ()
    assert model.instances_of(WRECK) == ()


def test_instances() -> None:
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


def test_a_vehicle_runs_out_of_uids_only_when_they_are_used() -> None:
    model = fleet_model(owner=2)
    assert [model.new_instance_uid() for _ in range(2)] == [first_uid_of(2), first_uid_of(2) + 1]
    with pytest.raises(FactError, match="origin 2 has created its 2 instances"):
        model.new_instance_uid()


def test_a_vehicle_that_restarts_reuses_neither_sequences_nor_uids() -> None:
    before = fleet_model(owner=1)
    uid = before.new_instance_uid()
    first = before.record([(uid, TYPE_UID, OBJECT)], 1.0).block
    second = before.record([(ECHO, CLASSIFICATION, 1)], 2.0).block
    after = fleet_model(owner=1)
    merge(after, [second, first])  # a peer sends them back
    assert after.new_instance_uid() == uid + 1
    assert after.record([(ECHO, CLASSIFICATION, 2)], 3.0).block.guid == (1, 0, 2)


@pytest.mark.parametrize(
    ("facts", "now_s", "reason"),
    [
        ([(AUV_0, BATTERY, 1.5)], 0.0, r"batteryFraction of instance 0: 1.5 is outside \[0.0, 1.0\]"),
        ([(AUV_0, BATTERY, (1.0, 2.0))], 0.0, "is not a number"),
        ([(AUV_0, 99, 1.0)], 0.0, "attribute 99 is unknown"),
        ([(99, BATTERY, 1.0)], 0.0, "subject 99 is outside"),
        ([(BAY, BATTERY, 1.0)], 0.0, "domain violated: batteryFraction: 3 is a Area, not a Vehicle"),
        ([(BAY, AREA_DONE, EXPLORER)], 0.0, "link to another class"),
        ([(ECHO, NEAR, first_uid_of(1))], 0.0, "instance 9; announce its type first"),
        ([(first_uid_of(1), TYPE_UID, WRECK)], 0.0, "instance 9; announce its type first"),
        (
            [(AUV_0, TYPE_UID, class_uid("ASV"))],
            0.0,
            "type clash: 0 is given the type ASV, which is disjoint with AUV",
        ),
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


def test_state_hash_is_of_the_set_of_blocks() -> None:
    blocks = [block(1, s, 7, (AUV_1, PLAYS_ROLE, EXPLORER)) for s in range(3)]
    models = [fleet_model(owner) for owner in range(3)]
    merge(models[0], blocks)
    merge(models[1], blocks[::-1])
    merge(models[2], blocks[:2])
    assert models[0].state_hash() == models[1].state_hash() != models[2].state_hash()
    other = fleet_model()
    merge(other, [block(1, s, 8, (AUV_1, PLAYS_ROLE, EXPLORER)) for s in range(3)])
    assert other.state_hash() != models[0].state_hash()


def test_models_can_be_copied_and_pickled() -> None:
    model = fleet_model()
    model.record([(AUV_0, BATTERY, 0.5)], 1.0)
    assert picture(pickle.loads(pickle.dumps(model))) == picture(copy.deepcopy(model)) == picture(model)


def test_version_counts_what_goes_in() -> None:
    model = fleet_model()
    merge(model, [block(1, 0, 0, (first_uid_of(1), LENGTH, 3.0))])  # waits
    assert model.version == 0
    merge(model, [block(1, 1, 0, (first_uid_of(1), TYPE_UID, WRECK))])
    assert model.version == 2
