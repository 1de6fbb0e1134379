import pytest
from small_fleet import (
    AMPHORA,
    AREA_DONE,
    ASV_0,
    AUV,
    AUV_0,
    BATTERY,
    BAY,
    CELL,
    CLASSIFICATION,
    ECHO,
    EXPLORER,
    LENGTH,
    NEAR,
    OBJECT,
    PIPELINE,
    POSITION,
    WRECK,
    block,
    check,
    codes,
    first_uid_of,
    fleet_model,
)

from worldmodel import STATUS, TYPE_UID, Block, PropertyValue, Value, merge

NEW = first_uid_of(1)  # in the range of origin 1, which sends all blocks here

FORM = {
    "UNKNOWN_ATTRIBUTE": [(AUV_0, 99, 1.0), (AUV_0, -1, 1.0)],
    "UNKNOWN_INSTANCE": [(-1, BATTERY, 0.5), (999, BATTERY, 0.5), (BAY, AREA_DONE, 999)],
    "UNKNOWN_CLASS": [(NEW, TYPE_UID, 999)],
    "VALUE_KIND": [(AUV_0, BATTERY, (1.0, 2.0)), (AUV_0, BATTERY, True), (BAY, AREA_DONE, 1.0), (AUV_0, POSITION, 1.0)],
    "VALUE_RANGE": [(AUV_0, BATTERY, 1.01), (AUV_0, POSITION, (0.0, 10000.5)), (ECHO, CLASSIFICATION, 4)],
    "VALUE_GRID": [(AUV_0, BATTERY, 0.333), (AUV_0, POSITION, (0.0, 0.3)), (BAY, CELL, 1.5)],
}
FIT = {
    "DOMAIN": [(BAY, BATTERY, 0.5), (AUV_0, LENGTH, 3.0)],
    "LINK_CLASS": [(BAY, AREA_DONE, EXPLORER), (ECHO, NEAR, AUV_0)],
    "TYPE_CLASH": [(AUV_0, TYPE_UID, OBJECT), (BAY, TYPE_UID, AUV)],
}


@pytest.mark.parametrize(("code", "fact"), [(c, f) for c, facts in (FORM | FIT).items() for f in facts])
def test_block_with_a_faulty_fact_is_refused_whole(code: str, fact: tuple[int, int, Value]) -> None:
    model = fleet_model()
    result = check(model, block(1, 0, 0, (ECHO, CLASSIFICATION, 0), fact))
    assert codes(result.faults) == [code]
    assert result.missing == ()
    merged = merge(model, [block(1, 0, 0, (ECHO, CLASSIFICATION, 0), fact)])
    assert merged.faults == result.faults
    assert not merged.changes
    assert model.latest(ECHO, CLASSIFICATION) is None  # the whole block or nothing
    assert (model.arrived((1, 0, 0)) is not None) == (code in FIT)


@pytest.mark.parametrize(
    ("bad", "code"),
    [
        (Block(3, 0, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5),)), "UNKNOWN_ORIGIN"),
        (Block(-1, 0, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5),)), "UNKNOWN_ORIGIN"),
        (Block(0, 1 << 20, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5),)), "BAD_SEQUENCE"),
        (Block(1, -2, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5),)), "BAD_SEQUENCE"),  # private to another
        (Block(0, STATUS, 0.0, (PropertyValue(ECHO, CLASSIFICATION, 1),)), "BAD_SEQUENCE"),  # is no status
        (Block(0, 0, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5),), 256), "BAD_EPOCH"),
        (Block(0, 0, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5),), -1), "BAD_EPOCH"),
        (Block(0, 0, 0.0, (PropertyValue(AUV_0, BATTERY, 0.5, 0.1),)), "VALUE_KIND"),
        (Block(0, 0, -0.1, (PropertyValue(AUV_0, BATTERY, 0.5),)), "BAD_TIME"),
        (Block(0, 0, 0.05, (PropertyValue(AUV_0, BATTERY, 0.5),)), "BAD_TIME"),
        (Block(0, 0, float("inf"), (PropertyValue(AUV_0, BATTERY, 0.5),)), "BAD_TIME"),
        (Block(0, 0, float("nan"), (PropertyValue(AUV_0, BATTERY, 0.5),)), "BAD_TIME"),
        (Block(0, 0, 0.0, ()), "NO_FACTS"),
    ],
)
def test_faulty_block_is_refused_and_not_recorded(bad: Block, code: str) -> None:
    model = fleet_model()
    (fault,) = check(model, bad).faults
    assert fault.code.name == code
    assert fault.guid == bad.guid
    merge(model, [bad])
    assert not model.has_arrived(bad.guid)
    assert model.digest() == {}


@pytest.mark.parametrize(("attribute", "sound", "equal"), [(BATTERY, 1.0, True), (POSITION, (1.0, 0.0), (True, False))])
def test_value_of_wrong_kind_is_refused_after_an_equal_value_of_the_right_kind(attribute, sound, equal) -> None:
    assert sound == equal
    model = fleet_model()
    for value, found in [(sound, []), (equal, ["VALUE_KIND"]), (sound, [])]:
        assert codes(check(model, block(1, 0, 0, (AUV_0, attribute, value))).faults) == found


def test_check_reports_every_faulty_fact_of_a_block() -> None:
    facts = [fact for facts in FORM.values() for fact in facts]
    assert len(check(fleet_model(), block(1, 0, 0, *facts)).faults) == len(facts)


@pytest.mark.parametrize(
    ("facts", "missing"),
    [
        ([(ASV_0, BATTERY, 0.5)], ()),
        ([(NEW, LENGTH, 3.0)], (NEW,)),
        ([(ECHO, NEAR, NEW)], (NEW,)),
        ([(ECHO, LENGTH, 3.0)], (ECHO,)),  # an object of interest may yet turn out a wreck
        ([(ECHO, NEAR, ECHO)], (ECHO,)),
        ([(NEW, TYPE_UID, WRECK), (NEW, LENGTH, 3.0)], ()),
        ([(NEW, LENGTH, 3.0), (NEW, TYPE_UID, WRECK)], ()),
        ([(ECHO, TYPE_UID, WRECK), (ECHO, NEAR, ECHO)], ()),
        ([(NEW + 2, TYPE_UID, WRECK)], (NEW + 2,)),  # of origin 2, which must create it first
        ([(NEW, TYPE_UID, WRECK), (NEW + 1, TYPE_UID, WRECK), (NEW, NEAR, NEW + 1), (NEW + 1, NEAR, NEW)], ()),
    ],
)
def test_check_lists_instances_that_facts_need(facts: list[tuple[int, int, Value]], missing: tuple[int, ...]) -> None:
    result = check(fleet_model(), block(1, 0, 0, *facts))
    assert (result.faults, result.missing) == ((), missing)


def test_type_may_become_a_subclass_or_superclass_but_no_disjoint_class() -> None:
    model = fleet_model()
    merge(model, [block(1, 0, 0, (NEW, TYPE_UID, WRECK)), block(0, 0, 0, (NEW, TYPE_UID, OBJECT))])
    assert [o.value for o in model.history(NEW, TYPE_UID)] == [OBJECT, WRECK]
    disjoint = check(model, block(2, 0, 0, (NEW, TYPE_UID, PIPELINE)))
    assert "which is disjoint with Wreck" in disjoint.faults[0].detail
    stranger = check(model, block(2, 0, 0, (NEW, TYPE_UID, AMPHORA)))
    assert "which is neither above nor below Wreck" in stranger.faults[0].detail
    itself = check(model, block(1, 1, 0, (NEW + 1, TYPE_UID, WRECK), (NEW + 1, TYPE_UID, PIPELINE)))
    assert codes(itself.faults) == ["TYPE_CLASH"]
