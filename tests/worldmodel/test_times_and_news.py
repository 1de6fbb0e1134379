"""Values as of a time, slices of history, news of watched properties; also with exclusions, at equal cost."""

from small_fleet import (
    AUV_0,
    BANNED_FROM,
    BATTERY,
    ECHO,
    LOCATION,
    ban,
    block,
    fleet_model,
)

from worldmodel import Block, PropertyValue, merge


def test_news_of_watched_properties_are_returned_once() -> None:
    model = fleet_model()
    model.watched.add((ECHO, LOCATION))
    model.record([(ECHO, LOCATION, (1.0, 2.0))], 1.0)
    model.record([(AUV_0, BATTERY, 0.5)], 2.0)
    assert [o.value for o in model.take_news()] == [(1.0, 2.0)]
    assert model.take_news() == []


def test_statuses_are_news_unless_their_origin_is_banned() -> None:
    model = fleet_model()
    model.watched.add((AUV_0, BATTERY))
    merge(model, [Block(1, -1, 3.0, (PropertyValue(AUV_0, BATTERY, 0.5),))])
    assert [o.value for o in model.take_news()] == [0.5]
    ban(model, [1])
    merge(model, [Block(1, -1, 4.0, (PropertyValue(AUV_0, BATTERY, 0.4),))])
    assert model.take_news() == []


def test_ban_from_a_time_keeps_earlier_facts() -> None:
    model = fleet_model()
    told = [block(2, n, 10 * n, (ECHO, LOCATION, (float(n), 0.0))) for n in range(4)]  # at 0, 1, 2 and 3 s
    merge(model, told)
    ban(model, [2], from_s=2.0)
    assert [o.value for o in model.history(ECHO, LOCATION)] == [(0.0, 0.0), (1.0, 0.0)]
    change = model.record([(2, BANNED_FROM, 1048575.0)], 200.0)
    assert [o.time_s for o in model.history(ECHO, LOCATION)] == [0.0, 1.0, 2.0, 3.0]
    assert PropertyValue(ECHO, LOCATION, (3.0, 0.0)) in change.new_latest  # it is the latest again
    assert model.banned == {}
