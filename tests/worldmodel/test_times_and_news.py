"""Values as of a time, slices of history, what an origin said since, and news; with bans, and for the same cost."""

import pytest
from small_fleet import (
    AUV_0,
    BANNED_FROM,
    BATTERY,
    ECHO,
    LOCATION,
    OBJECT,
    TYPE_UID,
    WRECK,
    ban,
    block,
    class_uid,
    fleet_model,
)

from worldmodel import Block, FactError, PropertyValue, merge


def test_news_come_once_of_an_instance_and_of_a_class() -> None:
    model = fleet_model()
    of_echo = model.subscriptions.add(LOCATION, instance=ECHO)
    of_objects = model.subscriptions.add(LOCATION, class_uid=OBJECT)
    of_wrecks = model.subscriptions.add(LOCATION, class_uid=WRECK)
    wreck = model.new_instance_uid()
    model.record([(ECHO, LOCATION, (1.0, 2.0))], 1.0)
    model.record([(wreck, TYPE_UID, WRECK), (wreck, LOCATION, (3.0, 4.0))], 2.0)
    assert [o.value for o in model.news(of_echo)] == [(1.0, 2.0)]
    assert [o.value for o in model.news(of_objects)] == [(1.0, 2.0), (3.0, 4.0)]  # a wreck is an object
    assert [o.value for o in model.news(of_wrecks)] == [(3.0, 4.0)]
    assert model.news(of_objects) == ()
    model.subscriptions.remove(of_echo)
    with pytest.raises(FactError, match="subscribe here first"):
        model.news(of_echo)
    with pytest.raises(FactError, match="exactly one of the two"):
        model.subscriptions.add(LOCATION)
    with pytest.raises(FactError, match=r"class 999 is unknown; allowed: 0\.\."):
        model.subscriptions.add(LOCATION, class_uid=999)


def test_statuses_are_news_and_banned_ones_are_not() -> None:
    model = fleet_model()
    levels = model.subscriptions.add(BATTERY, class_uid=class_uid("Vehicle"))
    merge(model, [Block(1, -1, 3.0, (PropertyValue(AUV_0, BATTERY, 0.5),))])
    assert [o.value for o in model.news(levels)] == [0.5]
    ban(model, [1])
    merge(model, [Block(1, -1, 4.0, (PropertyValue(AUV_0, BATTERY, 0.4),))])
    assert model.news(levels) == ()


def test_a_ban_from_a_time_leaves_what_was_said_before() -> None:
    model = fleet_model()
    told = [block(2, n, 10 * n, (ECHO, LOCATION, (float(n), 0.0))) for n in range(4)]  # at 0, 1, 2 and 3 s
    merge(model, told)
    ban(model, [2], from_s=2.0)
    assert [o.value for o in model.history(ECHO, LOCATION)] == [(0.0, 0.0), (1.0, 0.0)]
    change = model.record([(2, BANNED_FROM, 1048575.0)], 200.0)
    assert [o.time_s for o in model.history(ECHO, LOCATION)] == [0.0, 1.0, 2.0, 3.0]
    assert PropertyValue(ECHO, LOCATION, (3.0, 0.0)) in change.new_latest  # it is the latest again
    assert model.banned == {}
