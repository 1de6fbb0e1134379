"""What every driver has to keep to, as one check of a pair of drivers that hear each other.

From a test: call ``check`` with a function that makes such a pair and the pace they wait by; it raises
``AssertionError`` with what is wrong. The way between them may lose, double and reorder packets; it has to carry some.
"""

import math
import time
from collections.abc import Callable
from functools import partial

from exchange.drivers import Driver, Pace

Pair = tuple[Driver, Driver, Pace]
PACKETS = [b"\x00", b"\n\r\x00\xff", bytes(range(64)), b"RMR1"]
"""Bytes that a serial line, a text protocol or an own head may take for something else; 64 is what a modem holds."""
TRIES = 50
PATIENCE_S = 5.0


def check(make: Callable[[], Pair], least_bytes: int = 1) -> None:
    """Check a kind of driver.

    Args:
        make: makes two drivers that hear each other, and the pace they wait by; called several times.
        least_bytes: of a packet that its modem takes; those of the program have 3 and more.
    """
    for holds in (
        partial(carries_packets_whole, least_bytes=least_bytes),
        does_not_hear_itself,
        does_not_wait_for_a_time_that_is_past,
        waits_no_longer_than_it_is_told,
        is_silent_once_it_is_closed,
    ):
        one, other, pace = make()
        holds(one, other, pace)
        one.close()
        other.close()


def _soon_s(pace: Pace) -> float:
    """A time of the mission that comes within a few milliseconds."""
    return pace.now_s + 0.05 if math.isfinite(pace.now_s) else 1.0


def carries_packets_whole(one: Driver, other: Driver, pace: Pace, least_bytes: int = 1) -> None:
    """What is heard is what was sent, bit by bit, later than it was sent."""
    for driver in (one, other):
        assert isinstance(driver, Driver), f"{type(driver).__name__} lacks send, receive or close"
    for data in (packet for packet in PACKETS if len(packet) >= least_bytes):
        for _ in range(TRIES):
            sent_s = pace.now_s if math.isfinite(pace.now_s) else 0.0
            given_back: object = one.send(data, sent_s)  # type: ignore[func-returns-value]  # that is what is asked
            assert given_back is None, "send gives something back"
            heard = list(other.receive(_soon_s(pace)))
            if any(packet.data == data for packet in heard):
                break
        else:
            raise AssertionError(f"{data!r} was never heard in {TRIES} tries")
        for packet in heard:
            assert packet.data in PACKETS, f"{packet.data!r} was heard, and nobody sent it"
            assert 0.0 <= packet.time_s < math.inf, f"heard at {packet.time_s} s"


def does_not_hear_itself(one: Driver, other: Driver, pace: Pace) -> None:
    """A vehicle that heard its own packets would take another for one that speaks as it does."""
    one.send(PACKETS[2], 0.0)
    other.receive(_soon_s(pace))
    assert list(one.receive(_soon_s(pace))) == [], "it hears what it sent"


def does_not_wait_for_a_time_that_is_past(one: Driver, other: Driver, _: Pace) -> None:
    """A node that is behind asks what there is, and goes on."""
    began_s = time.monotonic()
    assert list(one.receive(-1.0)) == []
    assert time.monotonic() - began_s < PATIENCE_S, "it waits although the time is past"


def waits_no_longer_than_it_is_told(one: Driver, other: Driver, pace: Pace) -> None:
    """Nobody sends: at the time that was given, the driver gives nothing."""
    began_s = time.monotonic()
    assert list(one.receive(_soon_s(pace))) == []
    assert time.monotonic() - began_s < PATIENCE_S, "it waits longer than it was told"


def is_silent_once_it_is_closed(one: Driver, other: Driver, pace: Pace) -> None:
    """Closing twice is no fault, and what comes after it does nothing."""
    one.close()
    one.close()
    one.send(PACKETS[0], 0.0)
    assert list(one.receive(_soon_s(pace))) == []
    assert list(other.receive(_soon_s(pace))) == [], "it sends although it is closed"
