"use strict";
/* Who has news of whom: a row per vehicle that knows, a column per vehicle that is known. The darker, the older. */
(function () {
  const LEFT_PX = 78, TOP_PX = 44, FOOT_PX = 40, STEPS_FRAMES = [2, 6, 20, 60];

  /** Squares of the matrix: {size, x(v), y(v)}. */
  R.layMatrix = function (facts, w, h) {
    const size = Math.max(4, Math.min(56, Math.floor(Math.min((w - LEFT_PX - 8) / facts.n, (h - TOP_PX - FOOT_PX) / facts.n))));
    const across = Math.min(96, Math.floor((w - LEFT_PX - 8) / facts.n));
    return { size, across, x: (v) => LEFT_PX + v * across, y: (v) => TOP_PX + v * size };
  };

  const strength = (age_s, frame_s) => STEPS_FRAMES.filter((n) => age_s > n * frame_s).length / STEPS_FRAMES.length;

  R.drawMatrix = function (pen, facts, time_s, w, h, selected) {
    const { age_s, lacking } = facts.run.matrix(time_s);
    const frame_s = facts.run.header.frame_s || 10;
    const place = R.layMatrix(facts, w, h);
    pen.textBaseline = "middle";
    drawNames(pen, facts, place, selected);
    for (let v = 0; v < facts.n; v += 1) {
      for (let peer = 0; peer < facts.n; peer += 1) {
        const [x, y] = [place.x(peer), place.y(v)];
        if (peer === v) {
          pen.strokeStyle = R.theme.line;
          pen.lineWidth = 1;
          if (place.size > 8) R.hatch(pen, x, y, place.across - 1, place.size - 1, 6);
          continue;
        }
        drawSquare(pen, place, x, y, age_s[v][peer], lacking[v][peer], frame_s);
        if (facts.run.isParked(v, peer, time_s)) drawParked(pen, place, x, y);
      }
    }
    drawKey(pen, facts, frame_s, w, h);
  };

  function drawSquare(pen, place, x, y, age_s, lacking, frame_s) {
    const never = !Number.isFinite(age_s);
    const strong = never ? 1 : strength(age_s, frame_s);
    pen.fillStyle = R.theme.neutral;
    pen.fillRect(x, y, place.across - 1, place.size - 1);
    pen.globalAlpha = 0.9 * strong;
    pen.fillStyle = R.theme.belief;
    pen.fillRect(x, y, place.across - 1, place.size - 1);
    pen.globalAlpha = 1;
    if (never && place.size > 8) { pen.strokeStyle = R.theme.ink; pen.lineWidth = 1; R.hatch(pen, x, y, place.across - 1, place.size - 1, 6); }
    if (place.size < 30) {
      /* Too small for words: a dot says that items are lacking. */
      if (lacking && place.size >= 5) { pen.fillStyle = R.theme.ink; pen.fillRect(x + place.across / 2 - 2, y + place.size / 2 - 2, 3, 3); }
      return;
    }
    /* A text stands on whatever of the wash is behind it: in its darker half on paper's colour. */
    pen.fillStyle = strong > 0.5 ? R.theme.paper : R.theme.ink;
    pen.font = R.BOLD;
    pen.textAlign = "center";
    const middle = x + place.across / 2, age = never ? "never" : R.seconds(age_s);
    pen.fillText(R.fitted(pen, age, place.across - 4), middle, y + place.size / 2 - (place.size > 36 ? 8 : 0));
    pen.font = R.FONT;
    if (place.size > 36 && lacking) pen.fillText(R.fitted(pen, `lacks ${lacking}`, place.across - 4), middle, y + place.size / 2 + 9);
  }

  /* A frame of a square says that the one does without the other, who is silent for too long. */
  function drawParked(pen, place, x, y) {
    pen.strokeStyle = R.theme.loss;
    pen.lineWidth = place.size > 12 ? 3 : 1.5;
    pen.strokeRect(x + 1.5, y + 1.5, place.across - 4, place.size - 4);
  }

  function drawNames(pen, facts, place, selected) {
    const every = Math.max(1, Math.ceil(15 / place.size)), everyAcross = Math.max(1, Math.ceil(58 / place.across));
    pen.fillStyle = R.theme.muted;
    pen.font = R.FONT;
    pen.textAlign = "left";
    const framed = facts.run.parked.length ? "; framed: declared absent" : "";
    pen.fillText("row: receiver; column: sender" + framed, LEFT_PX, 10);
    facts.run.vehicles.forEach((vehicle, v) => {
      pen.font = v === selected ? R.BOLD : R.FONT;
      pen.fillStyle = v === selected ? R.theme.ink : R.theme.muted;
      pen.textAlign = "right";
      if (v % every === 0 || v === selected) pen.fillText(R.fitted(pen, vehicle.name, LEFT_PX - 12), LEFT_PX - 6, place.y(v) + place.size / 2);
      pen.textAlign = "left";
      if (v % everyAcross === 0) pen.fillText(R.fitted(pen, vehicle.name, place.across * everyAcross - 4), place.x(v) + 2, TOP_PX - 12);
    });
  }

  function drawKey(pen, facts, frame_s, w, h) {
    const y = h - 20;
    pen.font = R.FONT;
    pen.textAlign = "left";
    let x = LEFT_PX;
    [0, ...STEPS_FRAMES].forEach((frames, n) => {
      pen.fillStyle = R.theme.neutral;
      pen.fillRect(x, y - 7, 14, 14);
      pen.globalAlpha = 0.9 * n / STEPS_FRAMES.length;
      pen.fillStyle = R.theme.belief;
      pen.fillRect(x, y - 7, 14, 14);
      pen.globalAlpha = 1;
      pen.fillStyle = R.theme.muted;
      const text = n ? "> " + R.seconds(frames * frame_s) : "newer";
      pen.fillText(text, x + 18, y);
      x += 30 + pen.measureText(text).width;
    });
    if (x + 60 < w) pen.fillText(facts.n > 12 ? "dot: lacks items" : "age of information", x, y);
  }

  /** The square under a point: {v, peer}, or null. */
  R.hitMatrix = function (facts, w, h, x, y) {
    const place = R.layMatrix(facts, w, h);
    const peer = Math.floor((x - place.x(0)) / place.across), v = Math.floor((y - place.y(0)) / place.size);
    return peer >= 0 && v >= 0 && peer < facts.n && v < facts.n ? { v, peer } : null;
  };
})();
