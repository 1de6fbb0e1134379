"use strict";
/* Tables of the mission's own: their rows as marks on the map, as flags in the lanes where they are few, and in a panel
   as chart and list. Nothing here knows a mission; a table says it all by its columns. */
(function () {
  const MARK_PX = 3.5, DOT_PX = 3, NEAR_PX = 8, MOST_LISTED = 60, CHART_PX = 150;
  const LEFT_PX = 64, RIGHT_PX = 14, TOP_PX = 20, FOOT_PX = 20;

  const FAINTEST = 0.08, STRONGEST = 0.8;
  const looks = new WeakMap();

  /* What is drawn of a table, found once: {column, its first of numbers or -1; low and high of it; hasPlaces}. */
  function lookOf(layer) {
    if (!looks.has(layer)) {
      const column = layer.columns.findIndex(({ kind }) => kind !== "text");
      const numbers = column < 0 ? [] : layer.rows.map((row) => row.values[column]).filter((value) => value !== null);
      const [low, high] = numbers.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
      looks.set(layer, { column, low, high, hasPlaces: layer.rows.some((row) => row.x !== null) });
    }
    return looks.get(layer);
  }

  /* How strongly a row is drawn, 0..1: the more, the stronger. */
  function strength({ values }, { column, low, high }) {
    return high > low && values[column] !== null ? FAINTEST + (STRONGEST - FAINTEST) * (values[column] - low) / (high - low) : FAINTEST;
  }

  /** Rows of all tables between two times, where they say that they are or their vehicle was. */
  R.drawMarks = function (pen, frame, facts, from_s, to_s) {
    pen.strokeStyle = pen.fillStyle = R.theme.ink;
    pen.lineWidth = 1.2;
    for (const layer of facts.run.layers) {
      const { isEvents } = layer, look = lookOf(layer);
      for (const row of layer.rows) {
        if (row.x === null || row.time_s <= from_s || row.time_s > to_s) continue;
        const x = frame.x(row.x), y = frame.y(row.y);
        if (isEvents) drawMark(pen, x, y);
        else {
          pen.globalAlpha = strength(row, look);
          pen.fillRect(x - DOT_PX / 2, y - DOT_PX / 2, DOT_PX, DOT_PX);
          pen.globalAlpha = 1;
        }
      }
    }
  };

  function drawMark(pen, x, y) {
    pen.beginPath();
    pen.moveTo(x, y - MARK_PX); pen.lineTo(x + MARK_PX, y); pen.lineTo(x, y + MARK_PX); pen.lineTo(x - MARK_PX, y);
    pen.closePath();
    pen.stroke();
  }

  /** Entries for the legend of the map: [{text, draw(pen, x, y)}]. */
  R.markEntries = function (facts) {
    return facts.run.layers.filter((layer) => lookOf(layer).hasPlaces).map((layer) => {
      const { column, low, high } = lookOf(layer), name = R.words(layer.name);
      if (layer.isEvents) return { text: name, draw: (pen, x, y) => { pen.strokeStyle = R.theme.ink; pen.lineWidth = 1.2; drawMark(pen, x + 6, y); } };
      const unit = column < 0 ? "" : layer.columns[column].unit;
      const range = !(low <= high) ? "" : ` ${R.plain(low, "")} to ${R.plain(high, unit)}`;
      return { text: name + range, draw: (pen, x, y) => { pen.fillStyle = R.theme.ink; pen.fillRect(x + 4, y - 2, DOT_PX, DOT_PX); } };
    });
  };

  /** What the mark under a point of the map says; empty where there is none. */
  R.markTip = function (facts, frame, time_s, x, y) {
    let best = null, least = NEAR_PX;
    for (const layer of facts.run.layers) {
      for (const row of layer.rows) {
        if (row.x === null || row.time_s > time_s) continue;
        const off = Math.hypot(frame.x(row.x) - x, frame.y(row.y) - y);
        if (off <= least) [best, least] = [{ layer, row }, off];
      }
    }
    return best ? `${R.words(best.layer.name)} · ${sayRow(facts, best.row)}` : "";
  };

  function sayRow(facts, row) {
    const who = row.vehicle >= 0 ? facts.run.vehicles[row.vehicle].name : "";
    return [who, row.text, R.seconds(row.time_s)].filter(Boolean).join(" · ");
  }

  /** The panel: which table, its number over time, and its rows so far, newest first. */
  R.TablesPanel = class {
    constructor(body, view) {
      Object.assign(this, { body, view });
      const head = R.make("div", "row");
      this.choice = R.make("select");
      this.choice.setAttribute("aria-label", "Table");
      view.run.layers.forEach((layer, n) => this.choice.append(new Option(R.words(layer.name), String(n))));
      this.choice.value = String(view.tableAt);
      this.choice.addEventListener("change", () => { view.tableAt = Number(this.choice.value); this.paint(); });
      this.note = R.make("span", "note");
      head.append(this.choice, this.note);
      this.chartBox = R.make("div", "chart");
      this.chartBox.style.height = CHART_PX + "px";
      this.rows = R.make("div");
      body.append(head, this.chartBox, this.rows);
      this.chart = new R.Sheet(this.chartBox, "Numbers of the table over time", (pen, w, h) => this.drawChart(pen, w, h));
    }

    get layer() { return this.view.run.layers[this.view.tableAt]; }

    paint() {
      const { view, layer } = this, { run, selected } = view, time_s = view.app.clock.t;
      const isShown = (row) => row.time_s <= time_s && (selected < 0 || row.vehicle < 0 || row.vehicle === selected);
      const rows = layer.rows.filter(isShown);
      const who = selected >= 0 && layer.rows.some((row) => row.vehicle >= 0) ? ` of ${run.vehicles[selected].name}` : "";
      this.note.textContent = `${rows.length} ${rows.length === 1 ? "row" : "rows"}${who} so far` + (layer.total > layer.rows.length ? `; the page holds the first ${layer.rows.length} of ${layer.total}` : "");
      this.chartBox.hidden = !(lookOf(layer).low <= lookOf(layer).high);
      if (!this.chartBox.hidden) this.chart.paint();
      const go = (row) => () => view.app.go(row.time_s, row.vehicle < 0 ? null : run.vehicles[row.vehicle].name);
      const cells = ({ values }) => layer.columns.map((column, n) => [column.kind === "text" ? values[n] : R.plain(values[n], "")]);
      const heads = layer.columns.map(({ name, unit }) => R.words(name) + (unit && unit !== "1" ? ` (${unit})` : ""));
      const hasVehicles = layer.rows.some((row) => row.vehicle >= 0), nameOf = (v) => (v < 0 ? "" : run.vehicles[v].name);
      const lines = rows.slice(-MOST_LISTED).reverse()
        .map((row) => [[R.seconds(row.time_s, 1), "", go(row)], ...(hasVehicles ? [[nameOf(row.vehicle)]] : []), ...cells(row)]);
      this.rows.replaceChildren(R.table(["time", ...(hasVehicles ? ["vehicle"] : []), ...heads], lines));
    }

    /* One line per vehicle, that of the selected one strong. */
    drawChart(pen, w, h) {
      const { facts, selected, app } = this.view, { layer } = this, { column, low, high } = lookOf(layer);
      if (!(low <= high)) return;
      const scale = new R.TimeScale(0, Math.max(facts.end_s, 1), LEFT_PX, w - RIGHT_PX);
      const y = (value) => h - FOOT_PX - (high > low ? (value - low) / (high - low) : 0.5) * (h - FOOT_PX - TOP_PX);
      drawFrame(pen, layer.columns[column], scale, y, [low, high], h);
      const vehicles = [...new Set(layer.rows.map((row) => row.vehicle))].sort((a, b) => (a === selected) - (b === selected));
      for (const v of vehicles) {
        pen.strokeStyle = v === selected || v < 0 ? R.theme.ink : R.theme.muted;
        pen.lineWidth = v === selected ? 2 : 1;
        pen.globalAlpha = selected < 0 || v === selected || v < 0 ? 1 : 0.4;
        pen.beginPath();
        layer.rows.filter((row) => row.vehicle === v && row.values[column] !== null).forEach((row, n) => {
          if (n) pen.lineTo(scale.x(row.time_s), y(row.values[column])); else pen.moveTo(scale.x(row.time_s), y(row.values[column]));
        });
        pen.stroke();
      }
      pen.globalAlpha = 1;
      pen.strokeStyle = R.theme.ink;
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(scale.x(app.clock.t), TOP_PX - 4);
      pen.lineTo(scale.x(app.clock.t), h - FOOT_PX);
      pen.stroke();
    }
  };

  function drawFrame(pen, { name, unit }, scale, y, [low, high], h) {
    pen.font = R.FONT;
    pen.fillStyle = R.theme.muted;
    pen.strokeStyle = R.theme.line;
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    pen.fillText(R.words(name) + (unit && unit !== "1" ? ` (${unit})` : ""), LEFT_PX, 8);
    pen.textAlign = "right";
    pen.beginPath();
    for (const value of low < high ? [low, high] : [low]) {
      pen.moveTo(scale.left, y(value));
      pen.lineTo(scale.right, y(value));
      pen.fillText(R.plain(value, ""), scale.left - 6, y(value));
    }
    pen.stroke();
    R.drawTimes(pen, scale, h - FOOT_PX / 2);
  }
})();
