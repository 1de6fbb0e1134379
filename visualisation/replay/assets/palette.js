"use strict";
globalThis.R = globalThis.R || {};
/* Colours and patterns. The colours are those of Okabe and Ito, as in visualisation/style.py.
   One colour has one meaning: blue, sky blue and yellow (with a pattern) are roles, green is work done, purple is what a
   vehicle believes, orange is an influence signal, vermilion is loss and its price; ink is what is so. */
(function () {
  const BLUE = "#0072B2", SKY_BLUE = "#56B4E9", YELLOW = "#F0E442";
  R.GREEN = "#009E73";
  R.PURPLE = "#CC79A7";
  R.ORANGE = "#E69F00";
  R.VERMILLION = "#D55E00";
  R.FONT = "12px system-ui, 'DejaVu Sans', sans-serif";
  R.BOLD = "bold 12px system-ui, 'DejaVu Sans', sans-serif";

  const THEMES = {
    light: { paper: "#ffffff", panel: "#f4f6f8", ink: "#15191e", muted: "#57616c", line: "#cfd6dd", sea: "#fbfcfd",
             belief: "#9a3f72", warn: "#a84a00", done: "#bfe5d9", neutral: "#dde3e9" },
    dark: { paper: "#12171d", panel: "#1a212a", ink: "#edf1f5", muted: "#a3afbb", line: "#35414d", sea: "#151b22",
            belief: "#e39cc4", warn: "#ff9250", done: "#1b4d40", neutral: "#3a4652" },
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
    for (const key of ["GREEN", "PURPLE", "ORANGE", "VERMILLION"]) {
      root.style.setProperty("--" + key.toLowerCase(), R[key]);
    }
  };

  const FILLS = [[SKY_BLUE, "#10202c"], [BLUE, "#ffffff"], [YELLOW, "#24220a"]];
  const PATTERNS = ["plain", "rising", "dots", "bars"];

  /** Looks of roles by name, the same in all runs: the n-th role to appear, first run first, has the n-th colour and pattern. */
  R.roleLooks = function (runs) {
    const looks = new Map();
    for (const role of runs.flatMap(rolesOf)) {
      if (looks.has(role)) continue;
      const n = looks.size;
      const [fill, text] = FILLS[n % FILLS.length];
      looks.set(role, { fill, text, pattern: PATTERNS[Math.floor(n / FILLS.length) % PATTERNS.length] });
    }
    return looks;
  };

  function rolesOf(run) {
    const first = run.vehicles.flatMap((_, v) => run.bars(v).map((bar) => [bar.from_s, bar.role]));
    return first.sort((a, b) => a[0] - b[0] || (a[1] < b[1] ? -1 : a[1] > b[1] ? 1 : 0)).map(([, role]) => role);
  }

  /** Fills a box with the colour and pattern of a role. */
  R.fillRole = function (pen, look, x, y, w, h) {
    pen.fillStyle = look ? look.fill : R.theme.neutral;
    pen.fillRect(x, y, w, h);
    if (!look || look.pattern === "plain" || w < 6 || h < 6) return;
    pen.globalAlpha = 0.28;
    pen.strokeStyle = pen.fillStyle = look.text;
    pen.lineWidth = 1;
    if (look.pattern === "rising") R.hatch(pen, x, y, w, h, 8);
    if (look.pattern === "bars") for (let at = x + 3; at < x + w; at += 6) pen.fillRect(at, y, 1, h);
    if (look.pattern === "dots") {
      for (let at = x + 3; at < x + w - 1; at += 6) for (let up = y + 3; up < y + h - 1; up += 6) pen.fillRect(at, up, 2, 2);
    }
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
