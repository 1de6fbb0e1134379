"use strict";
// The data of a run as the page holds them: base64 of raw deflate of a length, a JSON head, and columns of numbers.
// visualisation/replay/columns.py writes them. Nothing here knows the document.
globalThis.R = globalThis.R || {};

(function () {
  const FORM = 1;

  async function inflated(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  function bytesOf(base64) {
    const text = atob(base64.trim());
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes;
  }

  // Numbers of up to 53 bits, longer ones rounded: so products instead of shifts, which JavaScript has for 32 bits only.
  function unpack(bytes, start, count, order, step) {
    const values = new Float64Array(count);
    let at = start;
    for (let i = 0; i < count; i++) {
      const isNegative = bytes[at] % 2 === 1;
      let word = 0, scale = 1, byte;
      do {
        byte = bytes[at++];
        word += (byte & 127) * scale;
        scale *= 128;
      } while (byte > 127);
      values[i] = isNegative ? -(word + 1) / 2 : word / 2;
    }
    for (let n = 0; n < order; n++) {
      for (let i = 1; i < count; i++) values[i] += values[i - 1];
    }
    if (step !== 1) for (let i = 0; i < count; i++) values[i] *= step;
    return { values, end: at };
  }

  // text: base64. Returns {about, columns}: the JSON head, and Float64Arrays by name.
  R.unpacked = async function (text) {
    const bytes = await inflated(bytesOf(text));
    const length = new DataView(bytes.buffer).getUint32(0, true);
    const about = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    if (about.form !== FORM) throw new Error("data of form " + about.form + "; this page reads form " + FORM);
    const columns = {};
    let at = 4 + length;
    for (const [name, count, order, step] of about.columns) {
      const { values, end } = unpack(bytes, at, count, order, step);
      columns[name] = values;
      at = end;
    }
    return { about, columns };
  };

  // text: base64. Returns the run, see model.js.
  R.decode = async function (text) {
    return new R.Run(await R.unpacked(text));
  };
})();
