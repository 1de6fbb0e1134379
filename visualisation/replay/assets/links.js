"use strict";
// What vehicles take the links between them to lose, which silent peers they do without, what they refused. Nothing here
// knows the document.
globalThis.R = globalThis.R || {};

(function () {
  const HEARD_AGAIN = "heard again", ANEW = "begins anew", CONFLICT = "slot conflict";
  const OTHERS = [HEARD_AGAIN, ANEW, CONFLICT]; // other events are reasons to declare a peer absent

  // Adds to a run: refusals, rows {time_s, vehicle, sender, slot, reason}; contacts, rows {time_s, vehicle, peer, event, text};
  // parked; and what the methods below answer from.
  R.connect = function (run) {
    run.refusals = run._rows("refused");
    run.contacts = run._rows("peers").map((row) => ({ ...row, text: textOf(run, row) }));
    run.parked = parkedOf(run);
    run._links = linksOf(run);
  };

  Object.assign(R.Run.prototype, {
    // Whether a vehicle declares a peer absent at t, after a long silence.
    isParked(v, peer, t) {
      return this.parked.some((one) => one.v === v && one.peer === peer && one.from_s <= t && t < one.to_s);
    },

    // {incoming, outgoing}: what a vehicle takes the links from and to a peer to lose at t, each {p_loss, n} or null.
    linkAt(v, peer, t) {
      const last = (direction) => {
        const { time_s, rows } = this._links.get([v, peer, direction].join()) || { time_s: [], rows: [] };
        return rows[R.lastAt(time_s, t)] || null;
      };
      return { incoming: last("incoming"), outgoing: last("outgoing") };
    },
  });

  // What a vehicle notes of a peer, in words.
  function textOf(run, { peer, event }) {
    const name = peer >= 0 ? run.vehicles[peer].name : "?";
    if (!OTHERS.includes(event)) return "declares absent: " + name;
    if (event === HEARD_AGAIN) return "receives " + name + " again";
    return event === CONFLICT ? "two send as " + name : name + " " + event;
  }

  // [{v, peer, from_s, to_s}]: spells in which a vehicle declares a peer absent.
  function parkedOf(run) {
    const spells = [], open = new Map();
    for (const { event, vehicle, peer, time_s } of run.contacts) {
      const key = [vehicle, peer].join();
      if (!OTHERS.includes(event) && !open.has(key)) {
        open.set(key, { v: vehicle, peer, from_s: time_s, to_s: Infinity });
        spells.push(open.get(key));
      } else if ((event === HEARD_AGAIN || event === ANEW) && open.has(key)) {
        open.get(key).to_s = time_s;
        open.delete(key);
      }
    }
    return spells;
  }

  // Estimates of links in order of time, by vehicle, peer and direction: {time_s, rows: [{p_loss, n}]}.
  function linksOf(run) {
    const found = new Map();
    for (const { time_s, vehicle, peer, direction, p_loss, n } of run._rows("links")) {
      const key = [vehicle, peer, direction].join();
      if (!found.has(key)) found.set(key, { time_s: [], rows: [] });
      found.get(key).time_s.push(time_s);
      found.get(key).rows.push(p_loss === null ? null : { p_loss, n });
    }
    return found;
  }
})();
