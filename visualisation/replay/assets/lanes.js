"use strict";
/* One lane per vehicle over time: driving role as a labelled bar, held roles as thin rows, milestones as flags, and the
   strip of receptions. What does not depend on the clock is drawn once per window of time. */
(function () {
  const HEAD_PX = 188, NARROW_HEAD_PX = 112, NARROW_PX = 800, AXIS_PX = 38, RIGHT_PX = 12, FLAG_PX = 7;
  const WAITING = "waiting";
  const ROOMY = { h: 62, flag: 13, bar: 17, held: 3, rows: 4 };
  const TIGHT = { h: 42, flag: 0, bar: 16, held: 3, rows: 3 };

  /** Where times stand in the lanes. */
  R.TimeScale = class {
    constructor(from_s, to_s, left, right) {
      Object.assign(this, { from_s, to_s, left, right, px_per_s: (right - left) / Math.max(to_s - from_s, 1e-6) });
    }

    x(time_s) { return this.left + (time_s - this.from_s) * this.px_per_s; }
    time(x) { return this.from_s + (x - this.left) / this.px_per_s; }
  };

  R.AXIS_PX = AXIS_PX;
  R.laneScale = (from_s, to_s, w) => new R.TimeScale(from_s, to_s, w < NARROW_PX ? NARROW_HEAD_PX : HEAD_PX, w - RIGHT_PX);

  /** Lanes with their places: {lanes: [{..., y, h}], look, height} for a box of that height. */
  R.layLanes = function (facts, open, selected, room_px) {
    const lanes = facts.lanes(open, selected);
    const look = lanes.length * ROOMY.h + AXIS_PX <= room_px ? ROOMY : TIGHT;
    const spare = Math.max(0, room_px - AXIS_PX - lanes.length * look.h);
    const h = look.h + Math.min(look === ROOMY ? 14 : 8, Math.floor(spare / Math.max(lanes.length, 1)));
    lanes.forEach((lane, n) => { lane.y = AXIS_PX + n * h; lane.h = h; });
    return { lanes, look, height: AXIS_PX + lanes.length * h };
  };

  R.drawLanes = function (pen, facts, layout, scale, { w, h, scroll, selected }) {
    pen.fillStyle = R.theme.paper;
    pen.fillRect(0, 0, w, h);
    pen.save();
    pen.beginPath();
    pen.rect(0, AXIS_PX, w, h - AXIS_PX);
    pen.clip();
    pen.translate(0, -scroll);
    for (const lane of layout.lanes) {
      if (lane.y + lane.h < scroll + AXIS_PX || lane.y > scroll + h) continue;
      drawLane(pen, facts, lane, layout.look, scale, w, selected);
    }
    R.drawSignals(pen, facts, layout, scale);
    pen.restore();
    R.drawAxis(pen, facts, scale, w);
  };

  function drawLane(pen, facts, lane, look, scale, w, selected) {
    if (lane.v === selected && !lane.head) {
      pen.fillStyle = R.theme.panel;
      pen.fillRect(0, lane.y, w, lane.h);
    }
    pen.strokeStyle = R.theme.line;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(0, lane.y + lane.h - 0.5);
    pen.lineTo(w, lane.y + lane.h - 0.5);
    pen.stroke();
    drawHead(pen, facts, lane, selected, look, scale.left);
    pen.save();
    pen.beginPath();
    pen.rect(scale.left, lane.y, scale.right - scale.left + 6, lane.h);
    pen.clip();
    const barY = lane.y + look.flag + 2;
    if (lane.head && !lane.folded) pen.globalAlpha = 0.4;
    if (lane.head) drawShares(pen, facts, lane, scale, barY, look.bar + look.rows * look.held);
    else drawRoles(pen, facts, lane.v, look, scale, barY);
    const stripY = barY + look.bar + look.rows * look.held + 3;
    R.drawStrip(pen, facts, lane.members, scale, stripY, lane.y + lane.h - stripY - 3);
    pen.globalAlpha = 1;
    if (!lane.head) drawChanges(pen, facts, lane.v, scale, barY + look.bar);
    if (!lane.head) drawFlags(pen, facts, lane, look, scale, barY);
    pen.restore();
  }

  const headTop = (look) => (look === ROOMY ? 19 : 13);

  function drawHead(pen, facts, lane, selected, look, room) {
    const x = 8, top = lane.y + headTop(look);
    pen.fillStyle = R.theme.ink;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.font = R.BOLD;
    if (lane.head) {
      pen.fillText(R.fitted(pen, `${lane.folded ? "▸" : "▾"} ${R.plural(lane.members.length, lane.role)}${lane.waits ? ", waiting" : ""}`, room - 14), x, top);
    } else {
      pen.lineWidth = 1.2;
      R.drawGlyph(pen, x + 6, top, 0, R.shapeOf(facts, lane.v), 5, R.vehicleLook(lane.v).fill, R.theme.ink);
      pen.fillText(R.fitted(pen, facts.run.vehicles[lane.v].name, room - 34), x + 18, top);
      if (lane.v === selected) { pen.fillStyle = R.theme.ink; pen.fillRect(0, lane.y, 4, lane.h - 1); }
    }
    pen.font = R.FONT;
    pen.fillStyle = R.theme.muted;
    for (const [n, text] of headNotes(facts, lane, look, room).entries()) {
      pen.fillText(R.fitted(pen, text, room - 12), x, top + 17 * (n + 1));
    }
  }

  function headNotes(facts, lane, look, room) {
    if (lane.head) return [];
    const share = facts.heardShare(lane.v), spell = facts.longestSilence(lane.v);
    const heard = share === null ? "nothing sent to it" : `received ${Math.round(100 * share)} %`;
    if (look !== ROOMY) return [heard + (spell ? `, gap ≤ ${R.seconds(spell.to_s - spell.from_s)}` : "")];
    if (room <= NARROW_HEAD_PX) return [heard, spell ? `gap ≤ ${R.seconds(spell.to_s - spell.from_s)}` : ""];
    return [heard + " of packets", spell ? `gaps of up to ${R.seconds(spell.to_s - spell.from_s)}` : "no long gaps"];
  }

  /** What the vehicles of folded lanes do now, under their names: "26 waiting, 4 Cartographers". */
  R.noteFolded = function (pen, facts, layout, time_s, { room, h, scroll }) {
    pen.font = R.FONT;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    for (const lane of layout.lanes) {
      const y = lane.y - scroll + headTop(layout.look) + 17;
      if (!lane.head || y < AXIS_PX || y > h) continue;
      const count = new Map();
      for (const v of lane.members) {
        const spell = facts.drivingAt(v, time_s), text = spell ? spell.role : WAITING;
        count.set(text, (count.get(text) || 0) + 1);
      }
      const parts = [...count].sort((a, b) => b[1] - a[1]).map(([text, n]) => (text === WAITING ? `${n} ${text}` : R.plural(n, text)));
      pen.fillStyle = R.theme.paper;
      pen.fillRect(6, y - 7, room - 8, 14);
      pen.fillStyle = R.theme.muted;
      pen.fillText(R.fitted(pen, parts.join(", "), room - 12), 8, y);
    }
  };

  /** "26 Performers"; one is "1 Performer". */
  R.plural = (count, noun) => `${count} ${noun}${count === 1 || noun.endsWith("s") || noun === "no role" ? "" : "s"}`;

  function drawRoles(pen, facts, v, look, scale, y) {
    const rows = facts.held[v].slice(0, look.rows), own = R.vehicleLook(v);
    rows.forEach((row, n) => {
      const top = y + look.bar + 1 + n * look.held;
      for (const spell of row.spells) {
        const [left, right] = clipped(scale, spell.from_s, spell.to_s);
        if (right <= left) continue;
        pen.strokeStyle = own.line;
        pen.lineWidth = look.held - 1;
        pen.setLineDash(facts.looks.get(row.role).dash);
        pen.beginPath();
        pen.moveTo(left, top + (look.held - 1) / 2);
        pen.lineTo(right, top + (look.held - 1) / 2);
        pen.stroke();
        pen.setLineDash([]);
      }
    });
    pen.font = R.FONT;
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    const narrow = new Map();
    for (const bar of facts.driving[v]) {
      if (bar.to_s < scale.from_s || bar.from_s > scale.to_s) continue;
      const [left, right] = clipped(scale, bar.from_s, bar.to_s);
      const w = Math.max(right - left, right >= left ? 1 : 0);
      /* Bars of less than a pixel would cost a call each and add nothing; one per pixel and role is enough. */
      if (w <= 1) {
        const key = Math.round(left) + bar.role;
        if (narrow.has(key)) continue;
        narrow.set(key, true);
      }
      if (w <= 0) continue;
      R.fillRole(pen, facts.looks.get(bar.role), own, left, y, w, look.bar);
      pen.fillStyle = R.theme.paper;
      if (w > 3) pen.fillRect(right - 1, y, 1, look.bar);
      const flags = facts.flags[v].map(({ time_s }) => scale.x(time_s));
      const room = w > 24 ? R.besideFlags(left, right, flags, pen.measureText(bar.text).width) : [left, left];
      const text = R.fitted(pen, bar.text, room[1] - room[0]);
      if (!text) continue;
      pen.fillStyle = own.fill;
      pen.fillRect(room[0] - 2, y + 1, pen.measureText(text).width + 4, look.bar - 2);
      pen.fillStyle = own.text;
      pen.fillText(text, room[0], y + look.bar / 2 + 0.5);
    }
  }

  /** From where to where a text of some width may stand on a bar, so that no flag or pole (ascending) covers it: where it
      has room first, else where there is most. */
  R.besideFlags = function (left, right, flags, width) {
    let widest = [left, left], from = left + 4;
    for (const x of [...flags.filter((one) => one > left - FLAG_PX && one < right), Infinity]) {
      const to = Math.min(x, right) - 4;
      if (to - from >= width) return [from, to];
      if (to - from > widest[1] - widest[0]) widest = [from, to];
      from = Math.max(from, x + FLAG_PX + 4);
    }
    return widest;
  };

  /* Where the vehicle chose anew: places to click for the reasons. */
  function drawChanges(pen, facts, v, scale, y) {
    pen.fillStyle = R.theme.ink;
    pen.strokeStyle = R.theme.paper;
    pen.lineWidth = 1;
    let last = -Infinity;
    for (const { time_s, changed } of facts.decisions[v]) {
      const x = scale.x(time_s);
      if (!changed || x < scale.left || x > scale.right || x - last < 2) continue;
      last = x;
      pen.beginPath();
      pen.moveTo(x, y - 5); pen.lineTo(x + 3.5, y + 1); pen.lineTo(x - 3.5, y + 1);
      pen.closePath();
      pen.stroke();
      pen.fill();
    }
  }

  const clipped = (scale, from_s, to_s) => [Math.max(scale.x(from_s), scale.left), Math.min(scale.x(to_s), scale.right)];

  /* A folded lane: how many of its vehicles each role drives, as stacked columns of grey with the marks of the roles. */
  function drawShares(pen, facts, lane, scale, y, h) {
    const step = 4, marked = new Map();
    for (let x = scale.left; x < scale.right; x += step) {
      const time_s = scale.time(x + step / 2);
      if (time_s < 0 || time_s > facts.end_s) continue;
      const count = new Map();
      for (const v of lane.members) {
        const bar = facts.drivingAt(v, time_s);
        if (bar) count.set(bar.role, (count.get(bar.role) || 0) + 1);
      }
      let bottom = y + h;
      for (const role of facts.looks.keys()) {
        const part = h * (count.get(role) || 0) / lane.members.length;
        if (!part) continue;
        pen.fillStyle = R.theme.neutral;
        pen.fillRect(x, bottom - part, step, part);
        pen.fillStyle = R.theme.paper;
        pen.fillRect(x, bottom - part, step, 1);
        if (part >= 8 && Math.round((x - scale.left) / step) % 3 === 1) {
          if (!marked.has(role)) marked.set(role, []);
          for (let down = bottom - 4; down >= bottom - part + 4; down -= 9) marked.get(role).push([x + step / 2, down]);
        }
        bottom -= part;
      }
    }
    for (const [role, points] of marked) R.drawMarksAt(pen, facts.looks.get(role), points, R.theme.ink);
    pen.strokeStyle = R.theme.line;
    pen.lineWidth = 1;
    pen.strokeRect(scale.left, y + 0.5, scale.right - scale.left, h);
  }

  function drawFlags(pen, facts, lane, look, scale, barY) {
    let free = scale.left;
    pen.font = R.FONT;
    for (const { time_s, text } of facts.flags[lane.v]) {
      const x = scale.x(time_s);
      if (x < scale.left || x > scale.right) continue;
      /* Below the text of the flag before, if there is one. */
      const top = look.flag && x >= free ? lane.y + 2 : barY;
      free = R.drawFlag(pen, x, top, barY + look.bar, look.flag && x >= free ? text : "", free, scale.right);
    }
  }

  /** A flag on a pole from `top` to `foot`; its text where there is room, right of the pole or left of it. */
  R.drawFlag = function (pen, x, top, foot, text, free, right) {
    pen.strokeStyle = pen.fillStyle = R.theme.ink;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, top);
    pen.lineTo(x, foot);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(x, top); pen.lineTo(x + FLAG_PX, top + 4); pen.lineTo(x, top + 8);
    pen.closePath();
    pen.fill();
    if (!text) return Math.max(free, x + 10);
    const w = pen.measureText(text).width;
    pen.textBaseline = "top";
    pen.textAlign = "left";
    if (x + 10 + w <= right && x >= free) { pen.fillText(text, x + 10, top); return x + w + 16; }
    if (x - 5 - w >= free) { pen.fillText(text, x - 5 - w, top); return x + 10; }
    return Math.max(free, x + 10);
  };

  function ticks(scale) {
    const step = R.niceStep(scale.to_s - scale.from_s, (scale.right - scale.left) / 90), found = [];
    for (let t = Math.ceil(scale.from_s / step) * step; t <= scale.to_s + 1e-9; t += step) {
      const x = Math.round(scale.x(t)) + 0.5;
      found.push({ x, text: x < scale.right - 14 ? R.seconds(t, step < 1 ? 1 : 0) : "" });
    }
    return found;
  }

  /** Times of a chart in a line at height `y`. */
  R.drawTimes = function (pen, scale, y) {
    pen.textAlign = "center";
    for (const { x, text } of ticks(scale)) if (text) pen.fillText(text, x, y);
  };

  /** The moment of the clock on the axis; a time of the axis that it would cover in part is wiped out whole. */
  R.drawMoment = function (pen, scale, time_s, w) {
    pen.font = R.BOLD;
    const text = R.seconds(time_s), half = pen.measureText(text).width / 2 + 5;
    const middle = Math.min(Math.max(scale.x(time_s), scale.left + half), w - half);
    pen.font = R.FONT;
    pen.fillStyle = R.theme.paper;
    for (const tick of ticks(scale)) {
      const room = pen.measureText(tick.text).width / 2 + 2;
      if (Math.abs(tick.x - middle) < room + half) pen.fillRect(tick.x - room, AXIS_PX - 20, 2 * room, 15);
    }
    pen.fillStyle = R.theme.ink;
    pen.fillRect(middle - half, AXIS_PX - 18, 2 * half, 17);
    pen.font = R.BOLD;
    pen.fillStyle = R.theme.paper;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(text, middle, AXIS_PX - 9);
  };

  /** Time axis with the milestones of groups and of the whole fleet above it. */
  R.drawAxis = function (pen, facts, scale, w) {
    pen.fillStyle = R.theme.paper;
    pen.fillRect(0, 0, w, AXIS_PX);
    pen.strokeStyle = R.theme.muted;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(scale.left, AXIS_PX - 0.5);
    pen.lineTo(scale.right, AXIS_PX - 0.5);
    pen.font = R.FONT;
    pen.fillStyle = R.theme.muted;
    pen.textAlign = "center";
    pen.textBaseline = "bottom";
    for (const { x, text } of ticks(scale)) {
      pen.moveTo(x, AXIS_PX - 5);
      pen.lineTo(x, AXIS_PX);
      if (text) pen.fillText(text, x, AXIS_PX - 5);
    }
    pen.stroke();
    let free = scale.left;
    const flags = facts.run.milestones.filter(({ vehicle }) => vehicle < 0)
      .map(({ time_s, name, group }) => ({ x: scale.x(time_s), text: R.words(name) + (group ? ": " + group : "") }))
      .filter(({ x }) => x >= scale.left && x <= scale.right);
    for (const { x, text } of flags) {
      const next = flags.find((other) => other.x > x + 1); // its pole ends the room of this text
      free = R.drawFlag(pen, x, 2, 14, text, free, next ? next.x - 3 : scale.right);
    }
  };
})();
