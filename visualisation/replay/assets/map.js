"use strict";
/* The map: what the mission declares, tracks, vehicles. Everything that does not change from frame to frame is drawn
   once into a hidden canvas, which tracks and work done grow into; only what moves is drawn anew. */
(function () {
  const MARGIN_PX = 14, GLYPH_PX = 8.5, RECENT_S = 300;

  /** Places metres on a box of pixels: whole world in view, y north upwards, same scale both ways. */
  R.Frame = class {
    constructor(world, w, h, zoom = null) {
      const [x0, x1] = world.x_m, [y0, y1] = world.y_m;
      const fit = Math.min((w - 2 * MARGIN_PX) / Math.max(x1 - x0, 1), (h - 2 * MARGIN_PX) / Math.max(y1 - y0, 1));
      this.scale = fit * (zoom ? zoom.factor : 1);
      this.centre = zoom ? [zoom.x, zoom.y] : [(x0 + x1) / 2, (y0 + y1) / 2];
      Object.assign(this, { w, h });
    }

    x(x_m) { return this.w / 2 + (x_m - this.centre[0]) * this.scale; }
    y(y_m) { return this.h / 2 - (y_m - this.centre[1]) * this.scale; }
    metres(x, y) {
      return [this.centre[0] + (x - this.w / 2) / this.scale, this.centre[1] - (y - this.h / 2) / this.scale];
    }
  };

  /** A tile on the page: [x, y, w, h]. */
  R.tileBox = function (frame, tiles, n) {
    const side = tiles.size[n] * frame.scale;
    return [frame.x(tiles.x[n]), frame.y(tiles.y[n]) - side, side, side];
  };

  R.drawWorld = function (pen, frame, facts, withNames = true) {
    const { world } = facts.run;
    pen.fillStyle = R.theme.sea;
    pen.fillRect(0, 0, frame.w, frame.h);
    pen.strokeStyle = R.theme.line;
    pen.lineWidth = 1;
    if (world.x_m && world.y_m) {
      pen.strokeRect(frame.x(world.x_m[0]), frame.y(world.y_m[1]), (world.x_m[1] - world.x_m[0]) * frame.scale,
                     (world.y_m[1] - world.y_m[0]) * frame.scale);
    }
    for (const place of world.places) drawPlace(pen, frame, place);
    if (withNames) drawScaleBar(pen, frame);
  };

  function drawPlace(pen, frame, place) {
    pen.strokeStyle = R.theme.muted;
    const points = place.points_m.map(([x, y]) => [frame.x(x), frame.y(y)]);
    if (!points.length) return;
    pen.lineWidth = 1;
    pen.beginPath();
    if (points.length > 1) {
      points.forEach(([x, y], n) => (n ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      if (place.kind === "outline") pen.closePath();
      pen.stroke();
    } else {
      const [x, y] = points[0];
      pen.moveTo(x - 5, y); pen.lineTo(x + 5, y); pen.moveTo(x, y - 5); pen.lineTo(x, y + 5);
      pen.stroke();
      pen.beginPath();
      pen.arc(x, y, 5, 0, 2 * Math.PI);
      pen.stroke();
    }
  }

  /** Names of places where vehicles leave room for them, with ✓ where the job is done, ? where `mind` has not heard so. */
  R.namePlaces = function (pen, frame, facts, mind, time_s, taken) {
    const done = new Set(facts.run.truth(time_s).places), known = mind ? new Set(mind.places) : done;
    facts.run.world.places.forEach((place, n) => {
      if (!place.points_m.length) return;
      const [x, y] = middleOf(frame, place);
      const text = place.name + (done.has(n) ? (known.has(n) ? " ✓" : " ? done, unknown") : "");
      const colour = done.has(n) && !known.has(n) ? R.theme.belief : R.theme.muted;
      R.placeText(pen, frame, text, x, y, taken, { colour, gap: place.points_m.length > 1 ? 0 : 11, centred: place.points_m.length > 1 });
    });
  };

  /** Where the scale bar stands: no name does. */
  R.scaleBarBox = (frame) => [0, frame.h - 32, R.niceStep(90 / frame.scale, 1) * frame.scale + 46, 32];

  function drawScaleBar(pen, frame) {
    const length_m = R.niceStep(90 / frame.scale, 1);
    const length = length_m * frame.scale, x = 10, y = frame.h - 10;
    pen.strokeStyle = R.theme.ink;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, y - 4); pen.lineTo(x, y); pen.lineTo(x + length, y); pen.lineTo(x + length, y - 4);
    pen.stroke();
    pen.fillStyle = R.theme.ink;
    pen.font = R.FONT;
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    const text = length_m >= 1000 ? length_m / 1000 + " km" : length_m + " m";
    pen.fillText(text, x + 4, y - 4);
    const up = x + length + 16;
    pen.beginPath();
    pen.moveTo(up, y); pen.lineTo(up, y - 16); pen.moveTo(up - 4, y - 11); pen.lineTo(up, y - 16); pen.lineTo(up + 4, y - 11);
    pen.stroke();
    pen.fillText("N", up + 6, y - 2);
  }

  /** Work done in truth between two times, as filled cells. */
  R.drawDone = function (pen, frame, facts, from_s, to_s) {
    R.fillTiles(pen, frame, facts.run.tiles, facts.run.tiles.done_s, from_s, to_s);
  };

  R.fillTiles = function (pen, frame, tiles, times_s, from_s, to_s) {
    pen.fillStyle = R.theme.done;
    for (let n = 0; n < tiles.n; n += 1) {
      if (times_s[n] > from_s && times_s[n] <= to_s) pen.fillRect(...R.tileBox(frame, tiles, n));
    }
  };

  /** What was found, as squares; dashed where `mind` knows nothing of it. */
  R.drawFinds = function (pen, frame, facts, mind, time_s) {
    const { run } = facts;
    const truth = run.truth(time_s);
    pen.lineWidth = 1.5;
    for (const n of truth.finds) {
      const { x, y } = run.finds[n], known = !mind || mind.finds.includes(n);
      const [px, py] = [frame.x(x), frame.y(y)];
      pen.strokeStyle = known ? R.theme.ink : R.theme.belief;
      pen.setLineDash(known ? [] : [2, 2]);
      pen.strokeRect(px - 3.5, py - 3.5, 7, 7);
      pen.setLineDash([]);
    }
  };

  function middleOf(frame, { points_m }) {
    const mean = (axis) => points_m.reduce((sum, point) => sum + point[axis], 0) / points_m.length;
    return [frame.x(mean(0)), frame.y(mean(1))];
  }

  R.drawTrack = function (pen, frame, { t, x, y }, from_s, to_s) {
    let n = Math.max(R.lastAt(t, from_s), 0);
    if (n >= t.length || t[n] > to_s) return;
    pen.beginPath();
    pen.moveTo(frame.x(x[n]), frame.y(y[n]));
    let [lastX, lastY] = [frame.x(x[n]), frame.y(y[n])];
    for (n += 1; n < t.length && t[n] <= to_s; n += 1) {
      const [px, py] = [frame.x(x[n]), frame.y(y[n])];
      /* Points closer than half a pixel add nothing to the line and most of its cost. */
      if (Math.abs(px - lastX) + Math.abs(py - lastY) < 0.5 && n + 1 < t.length && t[n + 1] <= to_s) continue;
      pen.lineTo(px, py);
      [lastX, lastY] = [px, py];
    }
    pen.stroke();
  };

  R.drawTracks = function (pen, frame, facts, from_s, to_s) {
    pen.strokeStyle = R.theme.muted;
    pen.globalAlpha = facts.n > 12 ? 0.3 : 0.5;
    pen.lineWidth = 1;
    for (let v = 0; v < facts.n; v += 1) R.drawTrack(pen, frame, facts.run.track(v), from_s, to_s);
    pen.globalAlpha = 1;
  };

  /** The hidden canvas of one map: it grows with time, and starts anew after a step back or a change of frame. */
  R.Ground = class {
    constructor() { this.canvas = document.createElement("canvas"); this.key = ""; this.until_s = -1; }

    update(frame, facts, time_s, ratio, withNames) {
      const key = [frame.w, frame.h, frame.scale, ...frame.centre, ratio, R.theme.paper].join();
      const pen = this.canvas.getContext("2d");
      if (key !== this.key || time_s < this.until_s) {
        this.key = key;
        this.until_s = -1;
        this.canvas.width = Math.round(frame.w * ratio);
        this.canvas.height = Math.round(frame.h * ratio);
        pen.setTransform(ratio, 0, 0, ratio, 0, 0);
        R.drawWorld(pen, frame, facts, withNames);
      }
      if (time_s > this.until_s) {
        R.drawDone(pen, frame, facts, this.until_s, time_s);
        R.drawTracks(pen, frame, facts, this.until_s, time_s);
        R.drawMarks(pen, frame, facts, this.until_s, time_s);
        this.until_s = time_s;
      }
    }
  };

  /** A vehicle as it is: its shape tells its type, its colour which it is, its mark the role that drives it. */
  R.drawVehicle = function (pen, facts, v, x, y, heading, time_s, size) {
    const { fill, text } = R.vehicleLook(v), bar = facts.drivingAt(v, time_s);
    pen.lineWidth = 1.3;
    R.drawGlyph(pen, x, y, heading, R.shapeOf(facts, v), size, fill, R.theme.ink);
    if (bar) R.drawMarksAt(pen, facts.looks.get(bar.role), [[x, y]], text);
  };

  /** Symbol of a vehicle, pointing where it heads. */
  R.drawGlyph = function (pen, x, y, heading, shape, size, fill, line) {
    pen.save();
    pen.translate(x, y);
    pen.rotate(-heading);
    pen.beginPath();
    if (shape === 0) { pen.moveTo(size * 1.3, 0); pen.lineTo(-size, size * 0.8); pen.lineTo(-size, -size * 0.8); }
    else if (shape === 1) {
      pen.moveTo(size * 1.4, 0); pen.lineTo(size * 0.5, size * 0.8); pen.lineTo(-size, size * 0.8);
      pen.lineTo(-size, -size * 0.8); pen.lineTo(size * 0.5, -size * 0.8);
    } else { pen.moveTo(size * 1.2, 0); pen.lineTo(0, size); pen.lineTo(-size * 1.2, 0); pen.lineTo(0, -size); }
    pen.closePath();
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    pen.strokeStyle = line;
    pen.stroke();
    pen.restore();
  };

  R.shapeOf = function (facts, v) {
    const types = [...new Set(facts.run.vehicles.map((vehicle) => vehicle.type))];
    /* Where there is a surface vehicle it has the hull; else the first type is a triangle. */
    const type = facts.run.vehicles[v].type;
    if (/surface|asv|usv/i.test(type)) return 1;
    const others = types.filter((name) => !/surface|asv|usv/i.test(name));
    return [0, 2, 1][others.indexOf(type) % 3];
  };

  R.glyphSize = (facts) => (facts.n > 24 ? GLYPH_PX - 2 : GLYPH_PX);

  /** Vehicles as they are, crossed out while they are out of the mission; the last minutes of their tracks; names where there is room. */
  R.drawVehicles = function (pen, frame, facts, time_s, { selected = -1, names = true, size = R.glyphSize(facts), taken = [] } = {}) {
    const { run } = facts;
    const states = run.vehicles.map((_, v) => run.at(v, time_s));
    for (let v = 0; v < facts.n; v += 1) {
      pen.lineWidth = 2;
      pen.strokeStyle = R.vehicleLook(v).line;
      if (facts.n <= 12 || v === selected) R.drawTrack(pen, frame, run.track(v), time_s - RECENT_S, time_s);
    }
    for (let v = 0; v < facts.n; v += 1) {
      const x = frame.x(states[v].x), y = frame.y(states[v].y);
      R.drawVehicle(pen, facts, v, x, y, states[v].heading, time_s, size);
      if (v === selected) drawRing(pen, x, y, size + 6);
      if (run.outAt(v, time_s)) R.drawCross(pen, x, y, size + 2, R.theme.ink);
      taken.push([x - size, y - size, 2 * size, 2 * size]);
    }
    if (names) nameVehicles(pen, frame, facts, states, selected, taken);
  };

  function drawRing(pen, x, y, radius) {
    pen.strokeStyle = R.theme.ink;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.stroke();
  }

  R.drawCross = function (pen, x, y, size, colour) {
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(x - size, y - size); pen.lineTo(x + size, y + size);
    pen.moveTo(x - size, y + size); pen.lineTo(x + size, y - size);
    pen.stroke();
  };

  function nameVehicles(pen, frame, facts, states, selected, taken) {
    const order = facts.run.vehicles.map((_, v) => v).sort((a, b) => (b === selected) - (a === selected));
    for (const v of order) {
      const name = facts.run.vehicles[v].name;
      R.placeText(pen, frame, name, frame.x(states[v].x), frame.y(states[v].y), taken,
                  { font: v === selected ? R.BOLD : R.FONT, colour: R.theme.ink, must: v === selected });
    }
  }

  /** Writes a text beside a point where nothing was written before; leaves it out where there is no room. */
  R.placeText = function (pen, frame, text, x, y, taken, { font = R.FONT, colour, must = false, gap = 11, centred = false }) {
    pen.font = font;
    const w = pen.measureText(text).width, h = 14;
    const places = [[gap, -h / 2], [-gap - w, -h / 2], [-w / 2, -gap - h], [-w / 2, gap], [gap, gap - 4],
                    [gap, -gap - h + 4], [-gap - w, gap - 4], [-gap - w, -gap - h + 4]];
    if (centred) places.unshift([-w / 2, -h / 2]);
    const free = places.map(([dx, dy]) => [x + dx, y + dy, w, h])
      .filter((box) => box[0] >= 2 && box[1] >= 2 && box[0] + w <= frame.w - 2 && box[1] + h <= frame.h - 2);
    const box = free.find((candidate) => !taken.some((other) => overlap(candidate, other))) || (must ? free[0] : null);
    if (!box) return;
    taken.push(box);
    pen.globalAlpha = 0.75;
    pen.fillStyle = R.theme.sea;
    pen.fillRect(box[0] - 1, box[1], w + 2, h);
    pen.globalAlpha = 1;
    pen.fillStyle = colour;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.fillText(text, box[0], box[1] + h / 2);
  };

  function overlap(a, b) {
    return a[0] < b[0] + b[2] && b[0] < a[0] + a[2] && a[1] < b[1] + b[3] && b[1] < a[1] + a[3];
  }
})();
