"""Missions under attack: damaged packets, vehicles that restart or are cut off. They end, and no belief is false."""

import random
from collections import Counter
from collections.abc import Sequence

import pytest
from recorded import flown

from exchange.channel.channel import Arrival, Channel
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
def test_no_flipped_bit_holds_up_a_mission() -> None:
    """With one bit turned none ends more than two frames (15 s) later than without, or not at all."""
    seed, policy = 3, "communication.policy=mps-ack-repeat"
    scenario = load("mapping-rendezvous", [("", "channel.per=0.4"), ("", policy)])
    calm, draws = Striking(channel_of(resolved(scenario), seed)), random.Random(seed)
    usual_s = run(scenario, seed, channel=calm).end_s
    for _ in range(2):
        number = draws.randrange(len(calm.sizes_bits))
        bit = draws.randrange(calm.sizes_bits[number])
        struck = run(scenario, seed, channel=Striking(channel_of(resolved(scenario), seed), number, bit))
        assert struck.completed, (number, bit)
        assert struck.end_s - usual_s <= 15.0, (number, bit)


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
        found.append([v.name for v in fleet.vehicles if "AUV01" in v.social.takes_no_jobs])
    fleet.close()
    assert found == [["ASV00", "AUV00", "AUV02"], []]


BACK_S = 340.0


@pytest.mark.slow
def test_the_next_observations_of_a_restarted_vehicle_reach_all() -> None:
    """Before there were epochs on the air, its next 20 observations were stored by nobody, and acknowledged by all."""
    fault = f"fault=[{{kind='restarts',vehicle='AUV01',at_s=300,until_s={BACK_S},memory='lost'}}]"
    finished = flown("mapping-rendezvous", "channel.per=0.4", "communication.policy=ack", fault, seed=7)
    rows = finished.recorder.knowledge
    told = [row[2] for row in rows if row[1] == "AUV01" and row[4] == "observed" and row[0] >= BACK_S][:20]
    received = Counter(row[2] for row in rows if row[4] == "received" and row[1] != "AUV01" and row[2] in set(told))
    assert len(told) == 20
    assert [received[uid] for uid in told] == [3] * 20
    assert all(uid.startswith("2.e1-") for uid in told)
    assert finished.n_false_beliefs == 0
    assert finished.completed
    anew = {row[1] for row in finished.recorder.peers if row[2:] == ("AUV01", "begins anew")}
    assert anew == {"AUV00", "AUV02", "ASV00"}
