"use strict";
globalThis.R = globalThis.R || {};
/* Colours and marks. A colour is a vehicle, the same as in the figures: `R.VEHICLE_FILLS` are those of
   visualisation/colours.py. A role is its label and its mark, once on the icon of the vehicle that it drives, again and
   again on the bar in its lane. What a vehicle believes is hollow, work done is pale, loss is red; ink is what is so. */
(function () {
  R.FONT = "12px system-ui, 'DejaVu Sans', sans-serif";
  R.BOLD = "bold 12px system-ui, 'DejaVu Sans', sans-serif";

  const THEMES = {
    light: { paper: "#ffffff", panel: "#f4f6f8", ink: "#15191e", muted: "#57616c", line: "#cfd6dd", sea: "#fbfcfd",
             belief: "#9a3f72", warn: "#a84a00", loss: "#c0002b", done: "#bfe5d9", neutral: "#dde3e9" },
    dark: { paper: "#12171d", panel: "#1a212a", ink: "#edf1f5", muted: "#a3afbb", line: "#35414d", sea: "#151b22",
            belief: "#e39cc4", warn: "#ff9250", loss: "#ff6a78", done: "#1b4d40", neutral: "#3a4652" },
  };
  /* Texts in the colour of belief and loss need more contrast than lines; hence `belief` and `warn`. */
  R.theme = THEMES.light;

  /** Takes "light" or "dark", for canvas and style sheet alike. */
  R.setTheme = function (name) {
    R.theme = THEMES[name];
    const root = document.documentElement;
    root.dataset.theme = name;
    root.style.colorScheme = name;
    for (const [key, value] of Object.entries(R.theme)) root.style.setProperty("--" + key, value);
  };

  const DARK = "#10151b", LIGHT = "#ffffff", TILE_PX = 8, LEAST_CONTRAST = 3;

  /* Relative luminance of a colour, and the contrast of two (WCAG 2.1). */
  function luminance(colour) {
    const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255)
      .map((part) => (part <= 0.04045 ? part / 12.92 : Math.pow((part + 0.055) / 1.055, 2.4)));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  }
  R.contrast = function (one, other) {
    const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };

  /** Colour of vehicle `v`, of a text on it, and of a thin line of it, which at night is lighter where it has to be. */
  R.vehicleLook = function (v) {
    const fill = R.VEHICLE_FILLS[v % R.VEHICLE_FILLS.length];
    const text = R.contrast(fill, DARK) > R.contrast(fill, LIGHT) ? DARK : LIGHT;
    let line = fill;
    for (let share = 0.1; R.theme === THEMES.dark && R.contrast(line, R.theme.sea) < LEAST_CONTRAST; share += 0.1) line = lightened(fill, share);
    return { fill, text, line };
  };

  function lightened(colour, share) {
    const parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
    return "#" + parts.map((part) => Math.round(part + share * (255 - part)).toString(16).padStart(2, "0")).join("");
  }

  /* Marks of roles around (0, 0), within 3 px, as paths; `solid` ones are filled, the others stroked. `sign` is the mark
     in a text, `dash` the line of a role that is held and does not drive. */
  const line = (...ends) => (pen, x, y) => {
    for (const [x0, y0, x1, y1] of ends) { pen.moveTo(x + x0, y + y0); pen.lineTo(x + x1, y + y1); }
  };
  const circle = (radius) => (pen, x, y) => { pen.moveTo(x + radius, y); pen.arc(x, y, radius, 0, 2 * Math.PI); };
  R.MARKS = [
    { sign: "●", solid: true, path: circle(2.3), dash: [] },
    { sign: "╱", path: line([-2.6, 2.6, 2.6, -2.6]), dash: [10, 3] },
    { sign: "│", path: line([0, -3, 0, 3]), dash: [2, 2] },
    { sign: "○", path: circle(2.4), dash: [6, 2, 2, 2] },
    { sign: "╲", path: line([-2.6, -2.6, 2.6, 2.6]), dash: [5, 5] },
    { sign: "─", path: line([-3, 0, 3, 0]), dash: [2, 6] },
    { sign: "+", path: line([-3, 0, 3, 0], [0, -3, 0, 3]), dash: [12, 2, 2, 2, 2, 2] },
    { sign: "■", solid: true, path: (pen, x, y) => pen.rect(x - 2, y - 2, 4, 4), dash: [4, 1] },
  ];

  /** Marks of roles by name, the same in all runs: the n-th role to appear, first run first, has the n-th mark. */
  R.roleLooks = function (runs) {
    const looks = new Map();
    for (const role of runs.flatMap(rolesOf)) if (!looks.has(role)) looks.set(role, R.MARKS[looks.size % R.MARKS.length]);
    return looks;
  };

  function rolesOf(run) {
    const first = run.vehicles.flatMap((_, v) => run.bars(v).map((bar) => [bar.from_s, bar.role]));
    return first.sort((a, b) => a[0] - b[0] || (a[1] < b[1] ? -1 : a[1] > b[1] ? 1 : 0)).map(([, role]) => role);
  }

  /** Draws the mark of a role at points, in one go. */
  R.drawMarksAt = function (pen, mark, points, colour) {
    pen.beginPath();
    for (const [x, y] of points) mark.path(pen, x, y);
    pen.lineWidth = 1.5;
    pen.strokeStyle = pen.fillStyle = colour;
    if (mark.solid) pen.fill(); else pen.stroke();
  };

  /** Fills a box with a colour, and with the mark of a role again and again. */
  R.fillRole = function (pen, mark, { fill, text }, x, y, w, h) {
    pen.fillStyle = fill;
    pen.fillRect(x, y, w, h);
    if (w < TILE_PX || h < TILE_PX) return;
    const points = [];
    for (let down = y + h / 2 - Math.floor(h / 2 / TILE_PX - 0.5) * TILE_PX; down <= y + h - TILE_PX / 2; down += TILE_PX) {
      for (let at = x + TILE_PX / 2; at <= x + w - TILE_PX / 2; at += TILE_PX) points.push([at, down]);
    }
    pen.globalAlpha = 0.45;
    R.drawMarksAt(pen, mark, points, text);
    pen.globalAlpha = 1;
  };

  /** Strokes diagonals x + y = k * step through a box; neighbouring boxes meet without a seam. */
  R.hatch = function (pen, x, y, w, h, step) {
    pen.beginPath();
    R.addHatch(pen, x, y, w, h, step);
    pen.stroke();
  };

  /** Adds those diagonals to the path, so that many boxes cost one stroke. */
  R.addHatch = function (pen, x, y, w, h, step) {
    for (let sum = Math.ceil((x + y) / step) * step; sum < x + y + w + h; sum += step) {
      const left = Math.max(x, sum - y - h), right = Math.min(x + w, sum - y);
      if (right <= left) continue;
      pen.moveTo(left, sum - left);
      pen.lineTo(right, sum - right);
    }
  };

  /** `text` cut with an ellipsis to `room` pixels; empty where not even three letters fit. */
  R.fitted = function (pen, text, room) {
    if (pen.measureText(text).width <= room) return text;
    let cut = text;
    while (cut.length > 3 && pen.measureText(cut + "…").width > room) cut = cut.slice(0, -1);
    return cut.length > 3 || pen.measureText(cut + "…").width <= room ? cut.trimEnd() + "…" : "";
  };

  /** "1906 s" with a narrow space between thousands, and tenths where they matter; no line breaks within. */
  R.seconds = function (time_s, digits = 0) {
    const text = Math.abs(time_s).toFixed(digits).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f");
    return (time_s < 0 ? "−" : "") + text + "\u00a0s";
  };

  /** A step 1, 2 or 5 times a power of ten, of which about `n` fit into `span`. */
  R.niceStep = function (span, n) {
    const raw = Math.max(span, 1e-9) / Math.max(n, 1);
    const power = Math.pow(10, Math.floor(Math.log10(raw)));
    return [1, 2, 5, 10].find((m) => m * power >= raw) * power;
  };
})();
