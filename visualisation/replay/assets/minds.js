"use strict";
/* "Four minds": one small map per vehicle, each as that vehicle takes the world to be. */
(function () {
  const TITLE_PX = 18, GAP_PX = 8, MOST = 16;

  /** Which vehicles get a small map, and where: [{v, x, y, w, h}]. */
  R.layMinds = function (facts, w, h, selected) {
    const all = facts.run.vehicles.map((_, v) => v);
    const shown = all.length <= MOST ? all : [...new Set([selected, ...all])].filter((v) => v >= 0).slice(0, MOST);
    const { x_m, y_m } = facts.extent;
    const sizes = shown.map((_, n) => {
      const columns = n + 1, rows = Math.ceil(shown.length / columns);
      const cw = (w - GAP_PX * (columns + 1)) / columns, ch = (h - GAP_PX * (rows + 1)) / rows;
      return { columns, cw, ch, scale: Math.min(cw / (x_m[1] - x_m[0]), (ch - TITLE_PX) / (y_m[1] - y_m[0])) };
    });
    const { columns, cw, ch } = sizes.reduce((best, size) => (size.scale > best.scale ? size : best), sizes[0]);
    return shown.map((v, n) => ({ v, x: GAP_PX + (n % columns) * (cw + GAP_PX),
                                  y: GAP_PX + Math.floor(n / columns) * (ch + GAP_PX), w: cw, h: ch }));
  };

  R.drawMinds = function (pen, facts, time_s, w, h, selected) {
    for (const place of R.layMinds(facts, w, h, selected)) {
      const mind = facts.run.mind(place.v, time_s);
      const wrong = R.disagreements(facts, place.v, time_s);
      drawMind(pen, facts, time_s, place, mind, wrong, place.v === selected);
    }
  };

  function drawMind(pen, facts, time_s, { v, x, y, w, h }, mind, wrong, selected) {
    const unheard = R.unheardTiles(facts, mind, time_s).length;
    pen.font = R.BOLD;
    pen.fillStyle = R.theme.ink;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    const name = R.fitted(pen, facts.run.vehicles[v].name, w / 2);
    const nameW = pen.measureText(name).width;
    pen.fillText(name, x, y + TITLE_PX / 2);
    pen.font = R.FONT;
    pen.fillStyle = wrong.length ? R.theme.warn : R.theme.muted;
    pen.textAlign = "right";
    const long = (wrong.length ? `≠ ${wrong.length} wrong roles` : "roles agree") + (unheard ? `, ${unheard} unknown` : "");
    const room = w - nameW - 10;
    const note = pen.measureText(long).width <= room ? long : wrong.length ? `≠ ${wrong.length}` : "✓";
    pen.fillText(R.fitted(pen, note, room), x + w, y + TITLE_PX / 2);
    pen.save();
    pen.translate(x, y + TITLE_PX);
    pen.beginPath();
    pen.rect(0, 0, w, h - TITLE_PX);
    pen.clip();
    const frame = new R.Frame(facts.extent, w, h - TITLE_PX);
    R.drawWorld(pen, frame, facts, false);
    R.fillTiles(pen, frame, facts.run.tiles, mind.tilesKnown_s, -1, time_s);
    R.drawUnheard(pen, frame, facts, mind, time_s, 5);
    R.drawGhosts(pen, frame, facts, v, mind, time_s, [], 4);
    const own = facts.run.at(v, time_s);
    R.drawVehicle(pen, facts, v, frame.x(own.x), frame.y(own.y), own.heading, time_s, 7);
    pen.restore();
    pen.strokeStyle = selected ? R.theme.ink : R.theme.line;
    pen.lineWidth = selected ? 2 : 1;
    pen.strokeRect(x, y + TITLE_PX, w, h - TITLE_PX);
  }
})();
