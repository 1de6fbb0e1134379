"use strict";
/* A pen that writes SVG. It answers to the calls of a canvas context that the drawing functions use, so that the same
   function draws the picture on the screen and in the file. */
(function () {
  const HIDDEN = document.createElement("canvas").getContext("2d");
  const KEYS = ["fillStyle", "strokeStyle", "lineWidth", "globalAlpha", "font", "textAlign", "textBaseline", "lineCap",
                "lineJoin"];
  const ANCHORS = { left: "start", start: "start", center: "middle", right: "end", end: "end" };
  const RISES = { middle: 4.2, top: 10.5, bottom: -2.5, alphabetic: 0 };

  const round = (x) => String(Math.round(x * 100) / 100);
  const escape = (text) => String(text).replace(/[&<>"']/g, (c) => "&#" + c.charCodeAt(0) + ";")
    .replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f\ufffe\uffff]/g, "\ufffd");

  R.SvgPen = class {
    constructor() {
      this.parts = [];
      this.stack = [];
      this.clips = 0;
      this.path = "";
      this.dash = [];
      this.depth = 0;
      Object.assign(this, { fillStyle: "#000", strokeStyle: "#000", lineWidth: 1, globalAlpha: 1, font: R.FONT,
                            textAlign: "left", textBaseline: "alphabetic", lineCap: "butt", lineJoin: "miter" });
    }

    save() {
      const state = { dash: this.dash, depth: this.depth };
      for (const key of KEYS) state[key] = this[key];
      this.stack.push(state);
    }

    restore() {
      const state = this.stack.pop();
      if (!state) return;
      while (this.depth > state.depth) this.leave();
      Object.assign(this, state);
    }

    enter(attributes) { this.parts.push(`<g ${attributes}>`); this.depth += 1; }
    leave() { this.parts.push("</g>"); this.depth -= 1; }
    translate(x, y) { this.enter(`transform="translate(${round(x)} ${round(y)})"`); }
    rotate(angle) { this.enter(`transform="rotate(${round(angle * 180 / Math.PI)})"`); }
    setLineDash(dash) { this.dash = dash; }

    beginPath() { this.path = ""; }
    moveTo(x, y) { this.path += `M${round(x)} ${round(y)}`; }
    lineTo(x, y) { this.path += `${this.path ? "L" : "M"}${round(x)} ${round(y)}`; }
    closePath() { this.path += "Z"; }
    rect(x, y, w, h) { this.path += `M${round(x)} ${round(y)}h${round(w)}v${round(h)}h${round(-w)}Z`; }

    arc(x, y, radius, from, to) {
      const at = (angle) => `${round(x + radius * Math.cos(angle))} ${round(y + radius * Math.sin(angle))}`;
      const half = (from + to) / 2, large = to - from > 2 * Math.PI ? 1 : 0;
      const curve = (angle) => `A${round(radius)} ${round(radius)} 0 ${large} ${to > from ? 1 : 0} ${at(angle)}`;
      this.path += `${this.path ? "L" : "M"}${at(from)}${curve(half)}${curve(to)}`;
    }

    paint(fill, stroke) {
      let text = `fill="${fill}"`;
      if (stroke) {
        text += ` stroke="${stroke}" stroke-width="${round(this.lineWidth)}" stroke-linecap="${this.lineCap}"`;
        if (this.dash.length) text += ` stroke-dasharray="${this.dash.map(round).join(" ")}"`;
      }
      return this.globalAlpha < 1 ? text + ` opacity="${round(this.globalAlpha)}"` : text;
    }

    fill() { if (this.path) this.parts.push(`<path d="${this.path}" ${this.paint(this.fillStyle, "")}/>`); }
    stroke() { if (this.path) this.parts.push(`<path d="${this.path}" ${this.paint("none", this.strokeStyle)}/>`); }

    clip() {
      const id = "c" + ++this.clips;
      this.parts.push(`<clipPath id="${id}"><path d="${this.path}"/></clipPath>`);
      this.enter(`clip-path="url(#${id})"`);
    }

    box(x, y, w, h, paint) {
      if (w < 0) { x += w; w = -w; }
      if (h < 0) { y += h; h = -h; }
      this.parts.push(`<rect x="${round(x)}" y="${round(y)}" width="${round(w)}" height="${round(h)}" ${paint}/>`);
    }

    fillRect(x, y, w, h) { this.box(x, y, w, h, this.paint(this.fillStyle, "")); }
    strokeRect(x, y, w, h) { this.box(x, y, w, h, this.paint("none", this.strokeStyle)); }
    clearRect() { /* A new file is empty. */ }

    fillText(text, x, y) {
      const bold = this.font.startsWith("bold") ? ' font-weight="bold"' : "";
      const size = /(\d+(?:\.\d+)?)px/.exec(this.font);
      const rise = RISES[this.textBaseline] || 0;
      this.parts.push(`<text x="${round(x)}" y="${round(y + rise)}" font-size="${size ? size[1] : 12}"${bold} ` +
        `text-anchor="${ANCHORS[this.textAlign] || "start"}" ${this.paint(this.fillStyle, "")}>${escape(text)}</text>`);
    }

    measureText(text) { HIDDEN.font = this.font; return HIDDEN.measureText(text); }

    /** The whole file, `w` by `h` pixels, with the facts of the run as its description. */
    text(w, h, about) {
      while (this.depth) this.leave();
      return `<svg xmlns="http://www.w3.org/2000/svg" width="${w}" height="${h}" viewBox="0 0 ${w} ${h}" ` +
        `font-family="system-ui, 'DejaVu Sans', sans-serif"><desc>${escape(about)}</desc>\n${this.parts.join("\n")}\n</svg>\n`;
    }
  };

  /** A canvas that keeps `draw(pen, w, h)`; `paint()` draws it on the screen, `record(pen)` into a file. */
  R.Sheet = class {
    constructor(parent, label, draw) {
      this.canvas = document.createElement("canvas");
      this.canvas.className = "sheet";
      this.canvas.setAttribute("role", "img");
      this.canvas.setAttribute("aria-label", label);
      this.canvas.sheet = this;
      parent.append(this.canvas);
      this.draw = draw;
      this.w = this.h = 0;
    }

    /** Fits the canvas to its box on the page; true if the size changed. */
    fit() {
      const ratio = globalThis.devicePixelRatio || 1;
      const w = this.canvas.clientWidth, h = this.canvas.clientHeight;
      if (w === this.w && h === this.h && ratio === this.ratio) return false;
      [this.w, this.h, this.ratio] = [w, h, ratio];
      this.canvas.width = Math.max(1, Math.round(w * ratio));
      this.canvas.height = Math.max(1, Math.round(h * ratio));
      return true;
    }

    paint() {
      this.fit();
      if (!this.w || !this.h) return;
      const pen = this.canvas.getContext("2d");
      pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      pen.clearRect(0, 0, this.w, this.h);
      this.draw(pen, this.w, this.h);
    }

    record(pen) { if (this.w && this.h) this.draw(pen, this.w, this.h); }
  };
})();
