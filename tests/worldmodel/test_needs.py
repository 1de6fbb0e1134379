import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_fleet import ASV_0, AUV, AUV_0, BATTERY, POSITION, TBOX, class_uid, first_uid_of, fleet_model

from worldmodel import InformationNeed, Instance, NeedError, NeedsIndex, PropertyValue

VEHICLE = class_uid("Vehicle")


def told(instance: int, attribute: int) -> PropertyValue:
    return PropertyValue(instance, attribute, 0.0)


needs = st.builds(
    lambda attribute, priority, uid, of_class: InformationNeed(
        attribute, priority, **({"class_uid": uid} if of_class else {"instance": uid})
    ),
    st.sampled_from([POSITION, BATTERY]),
    st.integers(1, 4),
    st.sampled_from([AUV_0, ASV_0, AUV, VEHICLE]),
    st.booleans(),
)


def is_about(need: InformationNeed, instance: Instance) -> bool:
    if need.class_uid is None:
        return need.instance == instance.uid
    return TBOX.is_a(instance.class_uid, need.class_uid)


@given(st.dictionaries(st.integers(0, 3), st.lists(needs, max_size=4), max_size=4))
def test_index_equals_evaluation_of_each_need(by_peer: dict[int, list[InformationNeed]]) -> None:
    model = fleet_model()
    index = NeedsIndex(TBOX, by_peer)
    for instance in model.common_instances:
        for attribute in (POSITION, BATTERY):
            matching = [
                (peer, need.priority)
                for peer, asked in by_peer.items()
                for need in asked
                if need.attribute == attribute and is_about(need, instance)
            ]
            expected = (sum(1 << p for p in {p for p, _ in matching}), max((q for _, q in matching), default=0))
            assert index.wanted(told(instance.uid, attribute), instance.class_uid)[:2] == expected


def test_invalid_needs_are_refused() -> None:
    with pytest.raises(NeedError, match="exactly one"):
        InformationNeed(POSITION, 1)
    with pytest.raises(NeedError, match="priority is 0; allowed: 1 or more"):
        InformationNeed(POSITION, 0, instance=first_uid_of(0))
    with pytest.raises(NeedError, match="peer 2 needs attribute 99"):
        NeedsIndex(TBOX, {2: (InformationNeed(99, 1, instance=0),)})
    with pytest.raises(NeedError, match="peer 2 needs class 99"):
        NeedsIndex(TBOX, {2: (InformationNeed(POSITION, 1, class_uid=99),)})
