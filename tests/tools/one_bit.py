"""Does one flipped bit matter? A mission is flown again and again, each time with one bit of one packet turned.

    python tests/tools/one_bit.py mapping-rendezvous 200 --per 0.4 --policy ack

Bits are drawn among all that are sent before the mission ends without damage; every receiver hears the damaged packet.
A line for each run that ends more than two TDMA frames later, or does not complete; the exit status is 1 if there is
one.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from exchange.acoustics.channel import Arrival, Channel
from missions.runs.assembly import channel_of
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.scenario import Scenario


@dataclass
class DamagingChannel:
    """A channel that turns one bit of one packet.

    Attributes:
        channel: which carries the packets.
        number: of the packet whose bit is turned, in the order of their sending.
        bit: which, counted round the packet.
        sizes_bits: of the packets sent, which it notes.
    """

    channel: Channel
    number: int = -1
    bit: int = 0

    def __post_init__(self) -> None:
        self.sizes_bits: list[int] = []

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """The arrivals of the channel, damaged if it is the turn of this packet."""
        arrivals = self.channel.transmit(slot, sender, data, now_s, positions_m)
        self.sizes_bits.append(8 * len(data))
        if len(self.sizes_bits) - 1 != self.number:
            return arrivals
        damaged = bytearray(data)
        byte, place = divmod(self.bit % (8 * len(data)), 8)
        damaged[byte] ^= 128 >> place
        return [arrival._replace(data=bytes(damaged)) for arrival in arrivals]


def flown(scenario: Scenario, seed: int, number: int = -1, bit: int = 0) -> tuple[Run, DamagingChannel]:
    """The run of a scenario with one bit turned, and the channel that did so; none if ``number`` is -1."""
    channel = DamagingChannel(channel_of(resolved(scenario), seed), number, bit)
    return run_scenario(scenario, seed, channel=channel), channel


def main() -> int:
    """Fly the missions; the number of those that one bit held up is the exit status, or 1."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario")
    parser.add_argument("runs", type=int)
    parser.add_argument("--per", default="0.4")
    parser.add_argument("--policy", default="ack")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", action="append", default=[])
    given = parser.parse_args()
    settings = [f"channel.per={given.per}", f"communication.policy={given.policy}", *given.set]
    scenario = load(given.scenario, [("--set", one) for one in settings])
    usual, channel = flown(scenario, given.seed)
    frame_s = resolved(scenario).schedule.frame_s
    print(f"undamaged: {usual.end_s:g} s, a frame is {frame_s:.2f} s", flush=True)
    draws = random.Random(given.seed)
    n_bad = 0
    for _ in range(given.runs):
        number = draws.randrange(len(channel.sizes_bits))
        bit = draws.randrange(channel.sizes_bits[number])
        run, _ = flown(scenario, given.seed, number, bit)
        late_s = run.end_s - usual.end_s
        if not run.completed or late_s > 2 * frame_s:
            n_bad += 1
            print(f"packet {number}, bit {bit}: {run.reason}, {late_s:+g} s", flush=True)
    print(f"{n_bad} of {given.runs} runs held up")
    return min(n_bad, 1)


if __name__ == "__main__":
    sys.exit(main())
