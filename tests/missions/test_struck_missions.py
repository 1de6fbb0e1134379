"""Missions under attack: damaged packets, vehicles that restart or are cut off. They end, and no belief is false."""

import random
from collections.abc import Sequence
from pathlib import Path

import pytest
from small_mission import Raw, run_varied

from exchange.acoustics.channel import Arrival, Channel
from missions.runs.assembly import assemble, channel_of
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load


class Striking:
    """A channel that turns one bit of one packet, if any, and notes the sizes of all (bits)."""

    def __init__(self, channel: Channel, number: int = -1, bit: int = 0) -> None:
        self._channel, self._number, self._bit = channel, number, bit
        self.sizes_bits: list[int] = []

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        arrivals = self._channel.transmit(slot, sender, data, now_s, positions_m)
        self.sizes_bits.append(8 * len(data))
        if len(self.sizes_bits) - 1 != self._number:
            return arrivals
        turned = int.from_bytes(data) ^ 1 << self._bit
        return [arrival._replace(data=turned.to_bytes(len(data))) for arrival in arrivals]


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "n", "seed"), [("ack", 1, 2), ("mps-ack-repeat", 15, 3)])
def test_no_flipped_bit_holds_up_a_mission(policy: str, n: int, seed: int):
    """With one bit turned none ends more than two frames (15 s) later than without, or not at all."""
    scenario = load("mapping-rendezvous", [("", "channel.per=0.4"), ("", f"communication.policy={policy}")])
    calm, draws = Striking(channel_of(resolved(scenario), seed)), random.Random(seed)
    usual_s = run(scenario, seed, channel=calm).end_s
    for _ in range(n):
        number = draws.randrange(len(calm.sizes_bits))
        bit = draws.randrange(calm.sizes_bits[number])
        struck = run(scenario, seed, channel=Striking(channel_of(resolved(scenario), seed), number, bit))
        assert struck.completed, (number, bit)
        assert struck.end_s - usual_s <= 15.0, (number, bit)


@pytest.mark.slow
@pytest.mark.parametrize(("memory", "policy"), [("kept", "ack"), ("lost", "mps-ack-repeat")])
def test_a_mission_ends_although_a_vehicle_restarts(tmp_path: Path, memory: str, policy: str):
    """The head of all is off from 300 to 360 s."""

    def strike(raw: Raw) -> None:
        raw["fault"] = [{"kind": "restarts", "vehicle": "ASV00", "at_s": 300.0, "until_s": 360.0, "memory": memory}]

    run = run_varied(tmp_path, strike, "channel.per=0.4", f"communication.policy={policy}")
    assert run.n_false_beliefs == 0
    assert run.completed, run.reason


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["ack", "mps-ack-repeat"])
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
