"""Arrows of influence signals in the lanes."""

from pathlib import Path

from replayed import asked

ARROWS = """() => {
  R.VEHICLE_FILLS = ["#0072B2"];
  const spells = [{ from_s: 0, to_s: 100 }], role = "Performer";
  const held = [[], [{ group: "one", role, spells }], [{ group: "other", role, spells }], []];
  const packet = {
    start_s: 10, sender: 0, to: [1, 2, 3].map((v) => ({ v, arrival_s: 11 })),
    signals: [{ group: "one", role: "Leader", addressed: [role], value: -5 }],
  };
  const run = { header: { slot_s: 2 }, packets: [packet], packetsIn: () => [0, 1] };
  const facts = { run, n: 4, held, decisions: [[], [], [], []] };
  const layout = { height: 200, lanes: [0, 1, 2, 3].map((v) => ({ v, members: [v], y: 50 * v, h: 50 })) };
  const scale = { from_s: 0, to_s: 100, left: 0, right: 1000, px_per_s: 10, x: (t) => 10 * t };
  const tips = [];
  const call = (_, name) => (...given) => { if (name === "moveTo") tips.push(given); };
  const pen = new Proxy({}, { get: call, set: () => true });
  R.drawSignals(pen, facts, layout, scale);
  return tips;
}"""


def test_a_signal_goes_to_who_holds_its_role_in_its_group(tmp_path: Path) -> None:
    """From the sender's lane at 10 s to the receiver's: a role of that name in another group is not meant."""
    assert asked([], ARROWS, tmp_path, more=("palette.js", "signals.js")) == [[100, 21], [110, 71]]
