"""A damaged time of one position report: it hid the truth until its hour came, and is refused."""

import pytest

from exchange.channel.channel import Arrival, Channel
from exchange.packets import Fragment
from missions.runs.assembly import channel_of
from missions.runs.run import Run, run
from missions.runs.setup import Setup, resolved
from missions.scenarios import load

BIT = 1 << 15
"""Of a time in tenths of a second: 3276.8 s, not set in the time of a report before that. An age has no such bit, so a
packet of which the report's whole time was told stands for the damaged one."""
AT_S = 900.0
SENDER = 3
NO_GUARD = "communication.clock_tolerance_s=14400"
"""So long is the mission at most: no fact is of the future."""


class Flipping:
    """A channel that changes one bit of the time of the first position report of one vehicle after a time."""

    def __init__(self, channel: Channel, setup: Setup) -> None:
        self._channel, self._codec, self._schedule = channel, setup.codec, setup.schedule
        self._position = setup.tbox.attribute_named("position").uid
        self.n_flipped = 0

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: list[tuple[float, float]]
    ) -> list[Arrival]:
        start_s = self._schedule.start_s(slot)
        told = self._codec.decode(data, slot // self._schedule.n_nodes, start_s).packet
        if now_s >= AT_S and sender == SENDER and not self.n_flipped:
            fragments = [self._flipped(one) for one in told.fragments]
            data = self._codec.encode(
                sender, told.rows, fragments, told.signals, told.frame, told.epoch, start_s, told.summary
            )
            self.n_flipped = 1
        return self._channel.transmit(slot, sender, data, now_s, positions_m)

    def _flipped(self, fragment: Fragment) -> Fragment:
        if fragment.facts[0].attribute != self._position:
            return fragment
        return fragment._replace(time_s=(round(10 * fragment.time_s) ^ BIT) / 10)


def mission(*settings: str, flips: bool) -> Run:
    chosen = ("strategy.name=cbba", "channel.per=0.2", *settings)
    scenario = load("mapping-rendezvous", [("--set", one) for one in chosen])
    setup = resolved(scenario)
    channel = Flipping(channel_of(setup, 1), setup)
    finished = run(scenario, 1, channel if flips else None)
    assert channel.n_flipped == flips
    return finished


@pytest.mark.slow
def test_one_damaged_time_no_longer_delays_the_mission() -> None:
    """The mission ends within a TDMA frame of when it would. Without the guard the head believes AUV02 to be where it
    was: its group waits for its meeting until the deadline of 900 s."""
    sound = mission(flips=False)
    guarded = mission(flips=True)
    assert sound.completed
    assert guarded.completed
    assert abs(guarded.end_s - sound.end_s) <= sound.setup.schedule.frame_s
    refused = [row for row in guarded.recorder.faults if row[2] == "bad packet"]
    assert refused
    assert all("from the future" in row[3] for row in refused)
    assert mission(NO_GUARD, flips=True).end_s >= sound.end_s + 800.0
