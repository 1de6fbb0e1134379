"use strict";
/* What got through to a vehicle: per slot a tick up if heard, hollow if it was refused; a hollow tick down if lost, full
   if it collided; density when zoomed out; spells of silence hatched. */
(function () {
  const TICK_FROM_PX = 3, BUCKET_PX = 4;

  /** Draws the strips of `members` as one, in a box of the lane; `scale` gives the time axis. */
  R.drawStrip = function (pen, facts, members, scale, y, h) {
    const middle = y + Math.round(h * 0.55);
    if (members.length === 1) for (const spell of facts.silences[members[0]]) drawSilence(pen, spell, scale, y, h);
    const slot_px = facts.run.header.slot_s * scale.px_per_s;
    if (slot_px >= TICK_FROM_PX && members.length === 1) drawTicks(pen, facts, members[0], scale, y, middle, h);
    else drawDensity(pen, facts, members, scale, y, middle, h);
    pen.strokeStyle = R.theme.muted;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(scale.left, middle + 0.5);
    pen.lineTo(scale.right, middle + 0.5);
    pen.stroke();
    if (members.length === 1) for (const spell of facts.silences[members[0]]) nameSilence(pen, spell, scale, y, h);
  };

  function edges({ from_s, to_s }, scale) {
    return [Math.max(scale.x(from_s), scale.left), Math.min(scale.x(to_s), scale.right)];
  }

  function drawSilence(pen, spell, scale, y, h) {
    const [left, right] = edges(spell, scale);
    if (right - left < 1.5) return;
    pen.fillStyle = R.theme.neutral;
    pen.fillRect(left, y, right - left, h);
    pen.strokeStyle = R.theme.muted;
    pen.lineWidth = 1;
    R.hatch(pen, left, y, right - left, h, 5);
  }

  function nameSilence(pen, spell, scale, y, h) {
    const [left, right] = edges(spell, scale);
    pen.font = R.FONT;
    const text = "gap " + R.seconds(spell.to_s - spell.from_s), w = pen.measureText(text).width;
    if (right - left < w + 10 || h < 14) return;
    pen.fillStyle = R.theme.paper;
    pen.fillRect((left + right - w) / 2 - 3, y + h / 2 - 7, w + 6, 14);
    pen.fillStyle = R.theme.ink;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(text, (left + right) / 2, y + h / 2 + 0.5);
  }

  function drawTicks(pen, facts, v, scale, y, middle, h) {
    const { heard, lost, collided, refused, sent } = facts.receptions[v];
    const other = new Set([...collided, ...refused]);
    const { packets } = facts.run;
    const slot_px = facts.run.header.slot_s * scale.px_per_s;
    const w = Math.max(1.5, Math.min(slot_px * 0.4, 6));
    const up = middle - y - 1, down = y + h - middle - 2;
    const each = (numbers, paint) => {
      for (let n = firstFrom(facts.run, numbers, scale.from_s); n < numbers.length; n += 1) {
        const x = scale.x(packets[numbers[n]].start_s);
        if (x > scale.right) break;
        if (x >= scale.left) paint(x);
      }
    };
    pen.fillStyle = R.theme.ink;
    each(heard, (x) => pen.fillRect(x, middle - up, w, up));
    pen.strokeStyle = R.theme.loss;
    pen.lineWidth = 1;
    each(lost.filter((p) => !other.has(p)), (x) => pen.strokeRect(x + 0.5, middle + 1.5, Math.max(w - 1, 1), down));
    each(refused, (x) => pen.strokeRect(x + 0.5, middle - up + 0.5, Math.max(w - 1, 1), up - 1));
    pen.fillStyle = R.theme.loss;
    each(collided, (x) => pen.fillRect(x, middle + 1, w, down + 1));
    pen.fillStyle = R.theme.muted;
    each(sent, (x) => { pen.beginPath(); pen.arc(x + w / 2, middle, 2.5, 0, 2 * Math.PI); pen.fill(); });
  }

  /* First of the numbers of packets, which ascend, whose packet starts at or after a time. */
  const firstFrom = (run, numbers, time_s) => R.lastAt(numbers, run.packetsIn(time_s, time_s)[0] - 1) + 1;

  /* Per bucket the share heard as a bar upwards and the share lost as an outline downwards. */
  function drawDensity(pen, facts, members, scale, y, middle, h) {
    const n = Math.max(1, Math.ceil((scale.right - scale.left) / BUCKET_PX));
    const count = { heard: new Float64Array(n), lost: new Float64Array(n) };
    for (const v of members) {
      for (const outcome of ["heard", "lost"]) {
        const numbers = facts.receptions[v][outcome];
        for (let k = firstFrom(facts.run, numbers, scale.from_s); k < numbers.length; k += 1) {
          const bucket = Math.floor((scale.x(facts.run.packets[numbers[k]].start_s) - scale.left) / BUCKET_PX);
          if (bucket >= n) break;
          if (bucket >= 0) count[outcome][bucket] += 1;
        }
      }
    }
    const up = middle - y - 1, down = y + h - middle - 2;
    pen.fillStyle = R.theme.ink;
    pen.strokeStyle = R.theme.loss;
    pen.lineWidth = 1;
    pen.beginPath();
    for (let bucket = 0; bucket < n; bucket += 1) {
      const all = count.heard[bucket] + count.lost[bucket];
      if (!all) continue;
      const x = scale.left + bucket * BUCKET_PX;
      const heard = up * count.heard[bucket] / all;
      pen.fillRect(x, middle - heard, BUCKET_PX - 1, heard);
      pen.moveTo(x, middle + 1.5 + down * count.lost[bucket] / all);
      pen.lineTo(x + BUCKET_PX, middle + 1.5 + down * count.lost[bucket] / all);
    }
    pen.stroke();
  }
})();
