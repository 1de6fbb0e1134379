"use strict";
/* Influence signals as arrows between lanes: zoomed out those that a change of activity is owed to, zoomed in all that
   were heard by a vehicle they address. */
(function () {
  const ALL_FROM_PX = 4;

  R.drawSignals = function (pen, facts, layout, scale) {
    const middles = new Map();
    for (const lane of layout.lanes) {
      for (const v of lane.members) if (!middles.has(v) || !lane.head) middles.set(v, lane.y + lane.h / 2 - 4);
    }
    pen.save();
    pen.beginPath();
    pen.rect(scale.left, 0, scale.right - scale.left, layout.height);
    pen.clip();
    if (facts.run.header.slot_s * scale.px_per_s >= ALL_FROM_PX) drawHeard(pen, facts, middles, scale);
    drawHeeded(pen, facts, middles, scale);
    pen.restore();
  };

  function drawHeard(pen, facts, middles, scale) {
    const [low, high] = facts.run.packetsIn(scale.from_s - 5, scale.to_s);
    pen.font = R.FONT;
    pen.textAlign = "left";
    for (let p = low; p < high; p += 1) {
      const packet = facts.run.packets[p];
      for (const signal of packet.signals) {
        for (const to of packet.to) {
          if (to.arrival_s === null || !addresses(facts, signal, to.v, packet.start_s)) continue;
          const from = [scale.x(packet.start_s), middles.get(packet.sender)];
          pen.globalAlpha = 0.7;
          arrow(pen, from, [scale.x(to.arrival_s), middles.get(to.v)], 1, packet.sender);
          pen.globalAlpha = 1;
        }
      }
    }
  }

  /* True if a signal is meant for a role of its group that vehicle `v` holds at that time. */
  function addresses(facts, signal, v, time_s) {
    return facts.held[v].some((row) => row.group === signal.group && signal.addressed.includes(row.role)
      && row.spells.some((spell) => spell.from_s <= time_s && time_s < spell.to_s));
  }

  function drawHeeded(pen, facts, middles, scale) {
    for (let v = 0; v < facts.n; v += 1) {
      for (const decision of facts.decisions[v]) {
        const x = scale.x(decision.time_s);
        if (x < scale.left || x > scale.right || !decision.changed) continue;
        for (const candidate of decision.candidates) {
          if (!candidate.chosen || candidate.source < 0 || !candidate.external) continue;
          if (middles.get(candidate.source) === middles.get(v)) continue;
          const sent_s = R.slotStart(facts, candidate.slot, decision.time_s);
          arrow(pen, [scale.x(sent_s), middles.get(candidate.source)], [x, middles.get(v)], 2, candidate.source);
        }
      }
    }
  }

  /** When a slot opened (s); the given time where the slot is not known. */
  R.slotStart = (facts, slot, time_s) => (slot >= 0 ? facts.run.slotStart_s(slot) : time_s);

  /* In the colour of the sender, lined with paper where it crosses bars. */
  function arrow(pen, [x0, y0], [x1, y1], width, sender) {
    const length = Math.hypot(x1 - x0, y1 - y0);
    if (!(length > 2)) return;
    const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length], head = 4 + 2 * width;
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(x1 - ux * head, y1 - uy * head);
    for (const [colour, wide] of [[R.theme.paper, width + 2], [R.vehicleLook(sender).line, width]]) {
      pen.strokeStyle = pen.fillStyle = colour;
      pen.lineWidth = wide;
      pen.stroke();
    }
    pen.beginPath();
    pen.moveTo(x1, y1);
    pen.lineTo(x1 - ux * head - uy * head / 2, y1 - uy * head + ux * head / 2);
    pen.lineTo(x1 - ux * head + uy * head / 2, y1 - uy * head - ux * head / 2);
    pen.closePath();
    pen.fill();
  }
})();
