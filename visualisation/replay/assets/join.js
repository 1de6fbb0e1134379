"use strict";
// Blocks of the data of a run that is underway, put together: each has the rows that have come since the one before.
// visualisation/replay/payload.py writes them. Nothing here knows the document.
globalThis.R = globalThis.R || {};

(function () {
  const HEARD = 2; // outcome of a packet that was heard, as in model.js

  // The data so far, as R.unpacked returns them, with one more block. A first block begins anew.
  R.joined = function (before, block) {
    const { about } = block;
    if (about.part === 0) return block;
    if (!before || about.part !== before.about.part + 1) throw new Error("block " + about.part + " does not follow");
    const columns = { ...before.columns };
    for (const [name, values] of Object.entries(block.columns)) columns[name] = joined(columns[name], values);
    const width = about.vehicles.length;
    joinTracks(columns, before, block);
    if (block.columns["packets.delay"]) columns["packets.delay"] = joinedDelays(before.columns, block.columns, width);
    return {
      about: {
        ...about,
        columns: [...before.about.columns, ...about.columns.filter(([name]) => !(name in before.columns))],
        texts: before.about.texts.concat(about.texts),
        track_rows: sums(before.about.track_rows, about.track_rows),
        world: { ...about.world, layers: joinedLayers(before.about.world.layers, about.world.layers) },
      },
      columns,
    };
  };

  function joined(first, second) {
    if (!first || !second.length) return first || second;
    const all = new Float64Array(first.length + second.length);
    all.set(first);
    all.set(second, first.length);
    return all;
  }

  function sums(first, second) {
    return (second || first).map((count, n) => count + (second && first ? first[n] : 0));
  }

  // A table may have been declared since.
  function joinedLayers(first, second) {
    const rows = new Map(first.map(({ name, n }) => [name, n]));
    return second.map((layer) => ({ ...layer, n: layer.n + (rows.get(layer.name) || 0) }));
  }

  // Tracks stand vehicle after vehicle.
  function joinTracks(columns, before, block) {
    for (const name of Object.keys(block.columns).filter((one) => one.startsWith("track."))) {
      columns[name] = spliced(before.columns[name], before.about.track_rows, block.columns[name], block.about.track_rows);
    }
  }

  // Delays stand by sender, receiver and time.
  function joinedDelays(before, block, width) {
    return spliced(before["packets.delay"], heardBy(before, width), block["packets.delay"], heardBy(block, width));
  }

  // How many packets each vehicle heard of each, sender after sender.
  function heardBy({ "packets.sender": sender, "packets.outcome": outcome }, width) {
    const counts = new Array(width * width).fill(0);
    outcome.forEach((became, at) => {
      if (became === HEARD) counts[sender[Math.floor(at / width)] * width + (at % width)] += 1;
    });
    return counts;
  }

  // Two columns of as many runs, of so many values each: every run of the first with that of the second behind it.
  function spliced(first, firstCounts, second, secondCounts) {
    const all = new Float64Array(first.length + second.length);
    let a = 0, b = 0;
    firstCounts.forEach((count, n) => {
      all.set(first.subarray(a, a + count), a + b);
      a += count;
      all.set(second.subarray(b, b + secondCounts[n]), a + b);
      b += secondCounts[n];
    });
    return all;
  }
})();
