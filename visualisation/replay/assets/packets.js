"use strict";
/* Packets on the map. By slot they are wave fronts that travel; otherwise links that fade: whole if heard, broken by a
   cross near the receiver if lost. */
(function () {
  const FADE_S = 0.25, MOST_LINKS = 300, SHORT_OF_PX = 16;

  /** Draws what is in the water, or was lately; `selected` leaves only packets from and to that vehicle. */
  R.drawPackets = function (pen, frame, facts, clock, selected) {
    const time_s = clock.t;
    const waves = clock.pace === "slot";
    const fade_s = waves ? 1.2 * facts.run.header.slot_s : Math.max(facts.run.header.frame_s, clock.playing ? clock.rate * FADE_S : 0);
    const [low, high] = facts.run.packetsIn(time_s - fade_s - 3, time_s);
    let room = MOST_LINKS;
    for (let p = Math.min(high, facts.run.packets.length) - 1; p >= low && room > 0; p -= 1) {
      const packet = facts.run.packets[p];
      if (packet.start_s > time_s) continue;
      const from = point(facts, frame, packet.sender, packet.start_s);
      if (waves) drawWave(pen, frame, facts, packet, from, time_s);
      for (const to of packet.to) {
        if (facts.n > 8 && selected >= 0 && to.v !== selected && packet.sender !== selected) continue;
        const age_s = time_s - (waves ? facts.arrival_s(packet, to) : packet.start_s);
        if (age_s < 0 || age_s > fade_s) continue;
        pen.globalAlpha = 1 - 0.85 * age_s / fade_s;
        R.drawLink(pen, from, point(facts, frame, to.v, packet.start_s), to.arrival_s !== null);
        room -= 1;
      }
    }
    pen.globalAlpha = 1;
  };

  function point(facts, frame, v, time_s) {
    const state = facts.run.at(v, time_s);
    return [frame.x(state.x), frame.y(state.y)];
  }

  /** A link from one point to another: a line that arrives, or one that ends in a cross short of the receiver. */
  R.drawLink = function (pen, [x0, y0], [x1, y1], heard) {
    const length = Math.hypot(x1 - x0, y1 - y0);
    if (length < 4) return;
    const short = heard ? 0 : Math.min(SHORT_OF_PX, length / 2);
    const [endX, endY] = [x1 - (x1 - x0) * short / length, y1 - (y1 - y0) * short / length];
    pen.strokeStyle = heard ? R.theme.ink : R.VERMILLION;
    pen.lineWidth = heard ? 1.5 : 1.2;
    pen.setLineDash(heard ? [] : [5, 4]);
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(endX, endY);
    pen.stroke();
    pen.setLineDash([]);
    if (!heard) R.drawCross(pen, endX, endY, 4, R.VERMILLION);
  };

  /* The packet as a ring in the water: its head left at the start, its tail when the sender fell silent. */
  function drawWave(pen, frame, facts, packet, [x, y], time_s) {
    const reach_m = facts.run.header.range_m || Infinity;
    const head_m = Math.min((time_s - packet.start_s) * facts.sound_mps, reach_m);
    const tail_m = Math.max((time_s - packet.end_s) * facts.sound_mps, 0);
    if (tail_m >= head_m) return;
    const head = head_m * frame.scale, tail = tail_m * frame.scale;
    pen.globalAlpha = 0.09;
    pen.strokeStyle = R.theme.ink;
    pen.lineWidth = head - tail;
    pen.beginPath();
    pen.arc(x, y, (head + tail) / 2, 0, 2 * Math.PI);
    pen.stroke();
    pen.globalAlpha = 0.8;
    pen.lineWidth = 1.5;
    for (const radius of head_m < reach_m ? [head, tail] : [tail]) {
      if (radius <= 0) continue;
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }
})();
