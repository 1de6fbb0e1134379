"""Missions under attack: damaged packets, vehicles that restart or are cut off. They end, and no belief is false."""

import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
from sampling import sampled
from small_mission import Raw, run_varied

from exchange.acoustics.channel import Arrival, Channel
from missions.runs.assembly import assemble, channel_of
from missions.runs.run import Run, run
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
    return run(scenario, seed, channel=channel), channel


def held_up(policy: str, n: int, seed: int) -> list[str]:
    """Of n runs with one bit turned, those that end more than two frames (15 s) later than without, or not at all."""
    settings = ["channel.per=0.4", f"communication.policy={policy}"]
    scenario = load("mapping-rendezvous", [("--set", one) for one in settings])
    usual, channel = flown(scenario, seed)
    draws, found = random.Random(seed), []
    for _ in range(n):
        number = draws.randrange(len(channel.sizes_bits))
        bit = draws.randrange(channel.sizes_bits[number])
        run, _ = flown(scenario, seed, number, bit)
        if not run.completed or run.end_s - usual.end_s > 15.0:
            found.append(f"packet {number}, bit {bit}: {run.reason} {run.end_s - usual.end_s:+g} s")
    return found


@pytest.mark.slow
def test_a_flipped_bit_holds_up_no_mission():
    assert held_up("ack", 1, seed=2) == []


@pytest.mark.slow
@pytest.mark.parametrize("policy", sampled(["ack", "mps-ack-repeat"], "mps-ack-repeat"))
def test_no_flipped_bit_holds_up_a_mission(policy: str):
    assert held_up(policy, 15, seed=3) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("memory", "policy", "vehicle"),
    [
        ("lost", "mps-ack-repeat", "AUV01"),
        ("kept", "ack", "ASV00"),
        *(
            pytest.param(memory, policy, vehicle, marks=pytest.mark.slow)
            for memory in ("lost", "kept")
            for policy in ("ack", "mps-ack-repeat")
            for vehicle in ("AUV01", "ASV00")
        ),
    ],
)
def test_a_mission_ends_although_a_vehicle_restarts(tmp_path: Path, memory: str, policy: str, vehicle: str):
    """It is off from 300 to 360 s."""

    def strike(raw: Raw) -> None:
        raw["fault"] = [{"kind": "restarts", "vehicle": vehicle, "at_s": 300.0, "until_s": 360.0, "memory": memory}]

    run = run_varied(tmp_path, strike, "channel.per=0.4", f"communication.policy={policy}")
    assert run.n_false_beliefs == 0
    assert run.completed, run.reason


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["ack", pytest.param("mps-ack-repeat", marks=pytest.mark.slow)])
@pytest.mark.parametrize("kinds", [["lost"], ["mute", "deaf"]], ids=["lost", "out of touch"])
def test_a_mission_ends_although_one_of_four_is_cut_off(tmp_path: Path, policy: str, kinds: list[str]):
    """From 200 s on for good; or it hears nobody, and nobody it, until 900 s."""

    def strike(raw: Raw) -> None:
        over = {} if kinds == ["lost"] else {"until_s": 900.0}
        raw["fault"] = [{"kind": kind, "vehicle": "AUV02", "at_s": 200.0, **over} for kind in kinds]

    run = run_varied(tmp_path, strike, "channel.per=0.4", f"communication.policy={policy}")
    assert run.n_false_beliefs == 0
    assert run.completed, run.reason


def test_who_begins_anew_takes_jobs_whatever_it_said_before() -> None:
    """Cut off, it says that it takes none, which the others hear; then it begins anew, and says that it does."""
    faults = (
        '{kind="deaf",vehicle="AUV01",at_s=30,until_s=205}',
        '{kind="restarts",vehicle="AUV01",at_s=180,until_s=200,memory="lost"}',
    )
    settings = [("--set", f"fault=[{','.join(faults)}]"), ("--set", "communication.lease_frames=10")]
    fleet = assemble(resolved(load("mapping-rendezvous", settings)), seed=1)
    found = []
    for time_s in (170.0, 300.0):
        while fleet.now_s < time_s:
            fleet.step()
        found.append([v.name for v in fleet.vehicles if "AUV01" in v.social.standing.takes_no_jobs])
    fleet.close()
    assert found == [["ASV00", "AUV00", "AUV02"], []]
