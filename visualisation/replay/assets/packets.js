"use strict";
/* Packets on the map. By slot they are wave fronts that travel; otherwise links that fade: whole if heard, broken by a
   cross near the receiver if lost, by a ring around it if it collided, by a square if it arrived and was refused. Where more links fade than the eye can tell apart, only the newest are drawn whole;
   of those before, a loss remains as a stub with its cross at the receiver, and what was heard is left out. */
(function () {
  const FADE_S = 0.25, FLIGHT_S = 3, SHORT_OF_PX = 16, STUB_PX = 10, MOST_WHOLE = 30, MOST_LINKS = 150;

  /** Links of what is in the water, or was lately, the newest first: [{packet, to, age: 0 new to 1 faded, isWhole}]. Of
      links from one vehicle to another that end alike the newest is meant; `selected` leaves those from and to it. */
  R.linksAt = function (facts, clock, selected) {
    const { run } = facts, time_s = clock.t, waves = clock.pace === "slot";
    const fade_s = waves ? 1.2 * run.header.slot_s : Math.max(run.header.frame_s, clock.playing ? clock.rate * FADE_S : 0);
    const [low, high] = run.packetsIn(time_s - fade_s - FLIGHT_S, time_s);
    const links = [], seen = new Set();
    for (let p = high - 1; p >= low; p -= 1) {
      const packet = run.packets[p];
      for (const to of packet.to) {
        if (facts.n > 8 && selected >= 0 && to.v !== selected && packet.sender !== selected) continue;
        const age_s = time_s - (waves ? facts.arrival_s(packet, to) : packet.start_s);
        const key = [packet.sender, to.v, to.arrival_s === null].join();
        if (age_s < 0 || age_s > fade_s || seen.has(key)) continue;
        if (links.length === MOST_LINKS) return links;
        seen.add(key);
        links.push({ packet, to, age: fade_s ? age_s / fade_s : 0, isWhole: links.length < MOST_WHOLE });
      }
    }
    return links;
  };

  /** Draws what is in the water, or was lately; losses on top. */
  R.drawPackets = function (pen, frame, facts, clock, selected) {
    const { run } = facts, time_s = clock.t;
    if (clock.pace === "slot") {
      const [low, high] = run.packetsIn(time_s - 1.2 * run.header.slot_s - FLIGHT_S, time_s);
      for (const packet of run.packets.slice(low, high)) {
        drawWave(pen, frame, facts, packet, point(facts, frame, packet.sender, packet.start_s), time_s);
      }
    }
    const isHeard = ({ to }) => to.arrival_s !== null, links = R.linksAt(facts, clock, selected).reverse();
    for (const link of [...links.filter((one) => isHeard(one) && one.isWhole), ...links.filter((one) => !isHeard(one))]) {
      const { packet, to, age, isWhole } = link;
      pen.globalAlpha = 1 - 0.85 * age;
      const from = point(facts, frame, packet.sender, packet.start_s);
      R.drawLink(pen, from, point(facts, frame, to.v, packet.start_s), isHeard(link), isWhole, to.why);
    }
    pen.globalAlpha = 1;
  };

  function point(facts, frame, v, time_s) {
    const state = facts.run.at(v, time_s);
    return [frame.x(state.x), frame.y(state.y)];
  }

  /** A link from one point to another: a line that arrives, or one that ends in a cross short of the receiver, of which
      the last part may be enough. */
  R.drawLink = function (pen, [x0, y0], [x1, y1], heard, isWhole = true, why = "lost") {
    const length = Math.hypot(x1 - x0, y1 - y0);
    if (length < 4) return;
    const short = heard ? 0 : Math.min(SHORT_OF_PX, length / 2), drawn = isWhole ? length : Math.min(length, short + STUB_PX);
    const before = (px) => [x1 - (x1 - x0) * px / length, y1 - (y1 - y0) * px / length];
    pen.strokeStyle = heard ? R.theme.ink : R.theme.loss;
    pen.lineWidth = heard ? 1.5 : 1.2;
    pen.setLineDash(heard || !isWhole ? [] : [5, 4]);
    pen.beginPath();
    pen.moveTo(...before(drawn));
    pen.lineTo(...before(short));
    pen.stroke();
    pen.setLineDash([]);
    if (!heard) drawEnd(pen, ...before(short), why);
  };

  /* How a link ends that was sent in vain: a cross; with a ring, another packet was there; a square is a closed door. */
  function drawEnd(pen, x, y, why) {
    pen.strokeStyle = R.theme.loss;
    pen.lineWidth = 1.6;
    if (why === "refused") { pen.strokeRect(x - 4, y - 4, 8, 8); return; }
    R.drawCross(pen, x, y, 4, R.theme.loss);
    if (why !== "collided") return;
    pen.beginPath();
    pen.arc(x, y, 7, 0, 2 * Math.PI);
    pen.stroke();
  }

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
