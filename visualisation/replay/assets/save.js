"use strict";
/* The view as SVG, the clip as video. The SVG is drawn by the same functions as the screen, and the texts of the page are
   set where the browser has set them. */
(function () {
  const CLIP_FPS = 30, CHUNK_MS = 250, WAIT_MS = 100, MOST_WAITS = 80;

  /** The page below `root` as SVG: boxes, texts and canvases where they stand. */
  R.pageSvg = function (root, about) {
    const pen = new R.SvgPen(), origin = root.getBoundingClientRect();
    pen.fillStyle = R.theme.paper;
    pen.fillRect(0, 0, origin.width, origin.height);
    recordElement(pen, root, origin);
    return pen.text(Math.round(origin.width), Math.round(origin.height), about);
  };

  function recordElement(pen, element, origin) {
    const style = getComputedStyle(element), box = element.getBoundingClientRect();
    if (style.display === "none" || style.visibility === "hidden" || !box.width || !box.height) return;
    const [x, y] = [box.left - origin.left, box.top - origin.top];
    pen.save();
    if (element.sheet) {
      pen.translate(x, y);
      pen.beginPath();
      pen.rect(0, 0, box.width, box.height);
      pen.clip();
      element.sheet.record(pen);
    } else {
      recordBox(pen, style, x, y, box);
      if (/auto|hidden|scroll/.test(style.overflowY)) { pen.beginPath(); pen.rect(x, y, box.width, box.height); pen.clip(); }
      for (const child of element.childNodes) {
        if (child.nodeType === Node.TEXT_NODE) recordText(pen, child, style, origin);
        else if (child.nodeType === Node.ELEMENT_NODE) recordElement(pen, child, origin);
      }
    }
    pen.restore();
  }

  const isClear = (colour) => /^(transparent|rgba\(.*, 0\))$/.test(colour);

  function recordBox(pen, style, x, y, { width, height }) {
    if (!isClear(style.backgroundColor)) { pen.fillStyle = style.backgroundColor; pen.fillRect(x, y, width, height); }
    const edges = [["Top", x, y, x + width, y], ["Right", x + width, y, x + width, y + height],
                   ["Bottom", x, y + height, x + width, y + height], ["Left", x, y, x, y + height]];
    for (const [side, x0, y0, x1, y1] of edges) {
      const edge_px = parseFloat(style[`border${side}Width`]);
      if (!edge_px || style[`border${side}Style`] === "none") continue;
      pen.strokeStyle = style[`border${side}Color`];
      pen.lineWidth = edge_px;
      pen.beginPath();
      pen.moveTo(x0, y0);
      pen.lineTo(x1, y1);
      pen.stroke();
    }
  }

  /* A text node becomes one text per line, as the browser broke it. */
  function recordText(pen, node, style, origin) {
    const text = node.data;
    if (!text.trim()) return;
    pen.font = `${Number(style.fontWeight) > 500 ? "bold " : ""}${style.fontSize} sans-serif`;
    pen.fillStyle = style.color;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    const range = document.createRange();
    let start = 0, top = null, box = null;
    const put = (end) => { if (box && text.slice(start, end).trim()) pen.fillText(text.slice(start, end).trim(), box.left - origin.left, (box.top + box.bottom) / 2 - origin.top); };
    for (let n = 0; n < text.length; n += 1) {
      range.setStart(node, n);
      range.setEnd(node, n + 1);
      const letter = range.getBoundingClientRect();
      if (!letter.width) continue;
      if (top === null || Math.abs(letter.top - top) > letter.height / 2) { put(n); start = n; top = letter.top; box = letter; }
    }
    put(text.length);
  }

  R.download = function (name, blob) {
    const link = document.createElement("a");
    link.download = name;
    link.href = URL.createObjectURL(blob);
    link.click();
    /* The browser reads the file after this call. */
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };

  /** Records maps and lanes into a video until `stop()`. */
  R.Clip = class {
    constructor(app) {
      this.app = app;
      this.canvas = document.createElement("canvas");
      this.draw();
      const type = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((one) => MediaRecorder.isTypeSupported(one));
      this.recorder = new MediaRecorder(this.canvas.captureStream(CLIP_FPS), type ? { mimeType: type, videoBitsPerSecond: 6e6 } : {});
      this.parts = [];
      this.recorder.addEventListener("dataavailable", (event) => { if (event.data.size) this.parts.push(event.data); });
      this.recorder.start(CHUNK_MS);
    }

    static get possible() { return typeof MediaRecorder === "function" && Boolean(HTMLCanvasElement.prototype.captureStream); }

    /** One frame: the canvases where they stand, and the facts of the run with the time on top. */
    draw() {
      const root = this.app.stage, origin = root.getBoundingClientRect();
      const w = 2 * Math.round(origin.width / 2), h = 2 * Math.round(origin.height / 2);
      if (this.canvas.width !== w) this.canvas.width = w;
      if (this.canvas.height !== h) this.canvas.height = h;
      const pen = this.canvas.getContext("2d");
      pen.fillStyle = R.theme.paper;
      pen.fillRect(0, 0, w, h);
      for (const canvas of root.querySelectorAll("canvas")) {
        const box = canvas.getBoundingClientRect();
        if (box.width) pen.drawImage(canvas, box.left - origin.left, box.top - origin.top, box.width, box.height);
      }
      pen.fillStyle = R.theme.ink;
      pen.font = R.BOLD;
      pen.textBaseline = "top";
      for (const view of this.app.views) {
        const box = view.root.getBoundingClientRect();
        const text = `${R.seconds(this.app.clock.t, 1)} · ${R.factsText(view.run)}`;
        pen.fillText(R.fitted(pen, text, box.width - 16), box.left - origin.left + 8, 8);
      }
    }

    /** Ends the clip; resolves to its blob, which is empty if the browser could not encode. */
    async stop() {
      /* A slow encoder has nothing to show yet for a short clip; it needs frames and time for the first of them. */
      for (let n = 0; n < MOST_WAITS && !this.parts.length; n += 1) {
        this.draw();
        await new Promise((resolve) => { setTimeout(resolve, WAIT_MS); });
      }
      return new Promise((resolve) => {
        this.recorder.addEventListener("stop", () => resolve(new Blob(this.parts, { type: this.recorder.mimeType })), { once: true });
        this.recorder.stop();
      });
    }
  };
})();
