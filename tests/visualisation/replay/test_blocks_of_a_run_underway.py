"""The data of a run that is underway come in blocks; put together they are those of the whole run."""

import base64
from collections.abc import Sequence
from pathlib import Path

import pytest
from replayed import asked, data_of
from test_payload import LOOK

from missions.runs.results import MemoryResults
from missions.runs.run import Run
from missions.runs.setup import resolved
from missions.runs.underway import Underway, Watch
from missions.scenarios import load
from visualisation.replay.payload import Payload

JOIN = """async ([whole], texts) => {
  let data = null;
  for (const text of texts) data = R.joined(data, await R.unpacked(text));
  const look = LOOK, run = new R.Run(data);
  const all = ({ header, items, packets, faults, milestones, layers, world, tiles, cost }) => (
    { header, items, packets, faults, milestones, layers, world, cost,
      tiles: { ...tiles, known_s: tiles.known_s.map((one) => [...one]) } }
  );
  const tracks = (of, wanted) => of.vehicles.map((_, v) => wanted.map((name) => [...of.track(v)[name]]));
  const socially = (of) => [-1, ...of.vehicles.keys()].map((v) => [0.5, 1].map((share) => {
    const t = share * of.header.end_s, plans = v < 0 ? [] : of.plansOf(v, t);
    return [of.organisation(v, t), of.changes(v, t, Infinity), plans.map((plan) => of.tasksOf(plan, t))];
  }));
  const bars = (of) => of.vehicles.map((_, v) => of.bars(v));
  return [run, whole].map((of) => [
    all(of), look([of]), tracks(of, ["t", "x", "y", "heading", "speed"]), bars(of), socially(of),
    tracks(of, ["energy"]),
  ]);
}""".replace("LOOK", f"({LOOK})")
"""Asks of the blocks, and of the whole, for all that there is."""


def followed(settings: Sequence[str], every: Sequence[int], scenario: str) -> tuple[list[bytes], Run]:
    """Blocks of a run, taken after so many steps each time, in turn; and the finished run."""
    setup = resolved(load(scenario, [("--set", one) for one in settings]))
    underway = Underway(setup, 3)
    watch, mission = Watch(underway), setup.mission
    payload = Payload(mission.places, mission.jobs.values(), setup.strategy.declaration.communicates)
    blocks = [payload.block(watch.news(underway.summary("")))]
    while underway.is_running:
        for _ in range(every[len(blocks) % len(every)]):
            if underway.is_running:
                underway.step()
        if underway.is_running:
            blocks.append(payload.block(watch.news(underway.summary(""))))
    finished = underway.finish()
    blocks.append(payload.block(watch.news(MemoryResults(finished).summary)))
    return blocks, finished


@pytest.mark.parametrize(
    ("scenario", "settings"),
    [
        ("mapping-rendezvous", ["channel.per=0.6", "scenario.duration_s=900"]),
        ("mapping-rendezvous", ['fault=[{kind="lost",vehicle="AUV01",at_s=100}]', "scenario.duration_s=300"]),
        ("mapping-rendezvous", ["vehicle.AUV01.energy_j=4000", "scenario.duration_s=300"]),
        ("mapping-patches", ["fleet.size=12", "channel.per=0.3", "scenario.duration_s=300"]),
        ("mapping-rendezvous", ["strategy.name=oracle", "scenario.duration_s=300"]),
    ],
)
def test_blocks_put_together_are_the_whole_run(scenario: str, settings: list[str], tmp_path: Path) -> None:
    blocks, finished = followed(settings, (1, 7, 100), scenario)
    assert len(blocks) > 5
    texts = [base64.b64encode(block).decode() for block in blocks]
    joined, whole = asked([data_of(MemoryResults(finished))], JOIN, tmp_path, texts, ["join.js"])
    assert joined[:-1] == whole[:-1]
    step_j = max(max(one) for (one,) in whole[-1]) / 4096 + 1  # blocks keep energies to steps of their own
    for (one,), (other,) in zip(joined[-1], whole[-1], strict=True):
        assert one == pytest.approx(other, abs=step_j)


def test_a_block_that_does_not_follow_is_refused(tmp_path: Path) -> None:
    blocks, finished = followed(["scenario.duration_s=60"], (10,), "mapping-rendezvous")
    texts = [base64.b64encode(blocks[number]).decode() for number in (0, 2)]
    tried = f"(runs, texts) => ({JOIN})(runs, texts).catch((error) => error.message)"
    said = asked([data_of(MemoryResults(finished))], tried, tmp_path, texts, ["join.js"])
    assert said == "block 2 does not follow"
