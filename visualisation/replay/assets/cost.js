"use strict";
/* What the losses cost: done in truth, done as the mean vehicle knows, share of vehicles that agree who plays what. */
(function () {
  const LEFT_PX = 46, RIGHT_PX = 14, TOP_PX = 46, FOOT_PX = 26;
  const SERIES = [
    ["truth", "truly done", (theme) => theme.ink, [], 2],
    ["known_mean", "done, mean knowledge of a vehicle", (theme) => theme.belief, [7, 3], 2],
    ["agree", "vehicles with a correct view of roles", (theme) => theme.muted, [2, 3], 1.5],
  ];

  R.costScale = (facts, w) => new R.TimeScale(0, Math.max(facts.end_s, 1), LEFT_PX, w - RIGHT_PX);

  R.drawCost = function (pen, facts, time_s, w, h) {
    const { cost } = facts.run;
    const scale = R.costScale(facts, w);
    const y = (share) => h - FOOT_PX - share * (h - FOOT_PX - TOP_PX);
    drawGrid(pen, scale, y, h);
    drawPrice(pen, cost, scale, y);
    for (const [key, , colour, dash, width] of SERIES) if (cost[key].length) drawSteps(pen, cost.t, cost[key], scale, y, colour(R.theme), dash, width);
    drawNow(pen, cost, scale, y, time_s, h);
    drawKey(pen, cost, w, time_s);
  };

  function drawGrid(pen, scale, y, h) {
    pen.font = R.FONT;
    pen.fillStyle = R.theme.muted;
    pen.strokeStyle = R.theme.line;
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    pen.beginPath();
    for (const share of [0, 0.25, 0.5, 0.75, 1]) {
      pen.moveTo(scale.left, y(share));
      pen.lineTo(scale.right, y(share));
      pen.fillText(`${100 * share} %`, scale.left - 6, y(share));
    }
    pen.stroke();
    R.drawTimes(pen, scale, h - FOOT_PX / 2);
  }

  /* The gap between what is done and what is known of it is the price of the losses. */
  function drawPrice(pen, cost, scale, y) {
    if (!cost.truth.length || !cost.known_mean.length) return;
    pen.globalAlpha = 0.3;
    pen.fillStyle = R.theme.loss;
    pen.beginPath();
    tracePath(pen, cost.t, cost.truth, scale, y);
    for (let n = cost.t.length - 1; n >= 0; n -= 1) {
      const until = n + 1 < cost.t.length ? cost.t[n + 1] : scale.to_s;
      pen.lineTo(scale.x(until), y(cost.known_mean[n]));
      pen.lineTo(scale.x(cost.t[n]), y(cost.known_mean[n]));
    }
    pen.closePath();
    pen.fill();
    pen.globalAlpha = 1;
  }

  function tracePath(pen, times, values, scale, y) {
    for (let n = 0; n < times.length; n += 1) {
      const x = scale.x(times[n]);
      if (n) pen.lineTo(x, y(values[n - 1])); else pen.moveTo(x, y(values[0]));
      pen.lineTo(x, y(values[n]));
    }
    if (times.length) pen.lineTo(scale.right, y(values[times.length - 1]));
  }

  function drawSteps(pen, times, values, scale, y, colour, dash, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    tracePath(pen, times, values, scale, y);
    pen.stroke();
    pen.setLineDash([]);
  }

  function drawNow(pen, cost, scale, y, time_s, h) {
    const x = scale.x(time_s);
    pen.strokeStyle = R.theme.ink;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x, TOP_PX - 6);
    pen.lineTo(x, h - FOOT_PX);
    pen.stroke();
    for (const [key, , colour] of SERIES) {
      const value = valueAt(cost, key, time_s);
      if (value === null) continue;
      pen.fillStyle = colour(R.theme);
      pen.beginPath();
      pen.arc(x, y(value), 3.5, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  /** How late the mean vehicle learns of a piece of work, on average over the work done (s); null without work. */
  R.lateness_s = function ({ t, truth, known_mean }) {
    const last = truth.length - 1;
    if (last < 1 || !known_mean.length || !truth[last]) return null;
    let gap_s = 0;
    for (let n = 0; n < last; n += 1) gap_s += (truth[n] - known_mean[n]) * (t[n + 1] - t[n]);
    return gap_s / truth[last];
  };

  function valueAt(cost, key, time_s) {
    const at = R.lastAt(cost.t, time_s);
    return at < 0 || !cost[key].length ? null : cost[key][at];
  }

  function drawKey(pen, cost, w, time_s) {
    let x = 12, y = 14;
    pen.font = R.FONT;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    const entry = (text, draw) => {
      const width = pen.measureText(text).width + 48;
      if (x + width > w) { x = 12; y += 18; }
      draw(x, y);
      pen.fillStyle = R.theme.ink;
      pen.fillText(text, x + 32, y);
      x += width;
    };
    for (const [key, name, colour, dash, width] of SERIES) {
      if (!cost[key].length) continue;
      const value = valueAt(cost, key, time_s);
      entry(name + (value === null ? "" : ` ${Math.round(100 * value)} %`), (left, top) => {
        pen.strokeStyle = colour(R.theme);
        pen.lineWidth = width;
        pen.setLineDash(dash);
        pen.beginPath();
        pen.moveTo(left, top);
        pen.lineTo(left + 26, top);
        pen.stroke();
        pen.setLineDash([]);
      });
    }
    const late_s = R.lateness_s(cost);
    if (late_s === null) return;
    entry(`cost of losses: information on work ${R.seconds(late_s)} late on average`, (left, top) => {
      pen.globalAlpha = 0.3;
      pen.fillStyle = R.theme.loss;
      pen.fillRect(left, top - 6, 26, 12);
      pen.globalAlpha = 1;
    });
  }
})();
