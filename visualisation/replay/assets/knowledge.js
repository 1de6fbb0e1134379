"use strict";
// Who knew what when: what every vehicle had heard, its picture of the others and of the work, and what is so in truth.
// work.js says what there is to do.
globalThis.R = globalThis.R || {};

(function () {
  const POSITION = "position"; // attribute of the core vocabulary by which vehicles say where they are
  const STATUS = "status", KEPT = "kept"; // kinds of items: of the first the newest counts, the second is not told

  R.learn = function (run) {
    run._heard = heardOf(run);
    run._byFact = byFact(run);
    const views = run._rows("organisation").filter((row) => row.event === "assigned" || row.event === "left");
    const ofVehicle = (rows, v) => rows.filter((row) => row.vehicle === v);
    run._views = run.vehicles.map((_, v) => changes(ofVehicle(views, v), "assigned", (row) => row.peer));
    const assignments = run._rows("roles").filter((row) => row.event === "assigned" || row.event === "left");
    run._truth = changes(assignments, "assigned", (row) => row.vehicle);
    const membership = run._rows("membership");
    run._absences = run.vehicles.map((_, v) => changes(ofVehicle(membership, v), "absent", (row) => row.peer));
    run._news = run.vehicles.map((_, v) => newsOf(run, v));
  };

  Object.assign(R.Run.prototype, {
    // Time at which v came to know an item; Infinity if it never did.
    heard_s(v, item) {
      return this._heard[v][item];
    },

    // Items with facts of an attribute of a subject, in the order in which they were recorded.
    itemsAbout(attribute, subject) {
      return this._byFact.get(attribute + "\n" + subject) || [];
    },

    // What v took for so: peers where it last heard that they were, who plays what, which places it knew to be done,
    // when it came to know of each tile (Infinity: never), and what it knew of finds.
    mind(v, t) {
      const peers = [];
      this.vehicles.forEach((_, p) => {
        const at = p === v ? -1 : R.lastAt(this._news[v][p].positionHeard_s, t);
        if (at < 0) return;
        const item = this.items[this._news[v][p].positions[at]];
        const [x, y] = positionOf(this.vehicles[p].name, item);
        peers.push({ v: p, x, y, since_s: item.time_s });
      });
      return {
        peers,
        absent: this.absent(v, t),
        roles: heldAt(this._views[v], t),
        places: indices(this.world.places, (place) => place.known_s[v] <= t),
        tilesKnown_s: this.tiles.known_s[v],
        finds: indices(this.finds, (find) => this._heard[v][find.item] <= t),
      };
    },

    // Which places are done in truth, and what has been found.
    truth(t) {
      return {
        places: indices(this.world.places, (place) => place.done_s !== null && place.done_s <= t),
        finds: indices(this.finds, (find) => this.items[find.item].recorded_s <= t),
      };
    },

    // Who plays what at t, as v sees it, or as every vehicle sees itself: [{v, group, role}].
    rolesAt(v, t) {
      return heldAt(v < 0 ? this._truth : this._views[v], t);
    },

    // Peers that v took for absent at t.
    absent(v, t) {
      return heldAt(this._absences[v], t).map((one) => one.v).sort((a, b) => a - b);
    },

    // Where v errs on who plays what: {extra, lacking}, each [{v, group, role}]; those out of the mission play nothing.
    disagreements(v, t) {
      const key = (one) => one.v + "\n" + one.group + "\n" + one.role;
      const inside = (roles) => roles.filter((one) => !this.outAt(one.v, t));
      const own = inside(heldAt(this._views[v], t));
      const so = inside(heldAt(this._truth, t));
      const ownKeys = new Set(own.map(key)), soKeys = new Set(so.map(key));
      return { extra: own.filter((one) => !soKeys.has(key(one))), lacking: so.filter((one) => !ownKeys.has(key(one))) };
    },

    // {age_s, lacking}, each [v][peer]: age of the newest that v knows from peer, and how many items of it v lacks.
    matrix(t) {
      const told = this._told || (this._told = toldOf(this));
      const age_s = this.vehicles.map((_, v) => this._news[v].map((news, p) => {
        if (p === v) return 0;
        const at = R.lastAt(news.newestHeard_s, t);
        return at < 0 ? Infinity : t - news.newest_s[at];
      }));
      const lacking = this.vehicles.map((_, v) => this._news[v].map((news, p) => (
        p === v ? 0 : R.lastAt(told[p], t) - R.lastAt(news.toldHeard_s, t)
      )));
      return { age_s, lacking };
    },
  });

  // Of every vehicle the times at which it came to know each item: its own as it recorded them, others from packets.
  // What it set aside, since it had no need of it, it knows from when it took it up.
  function heardOf(run) {
    const heard = run.vehicles.map(() => new Float64Array(run.items.length).fill(Infinity));
    const hear = (v, item, time_s) => {
      if (time_s < heard[v][item]) heard[v][item] = time_s;
    };
    run.items.forEach((item, n) => {
      if (heard[item.origin]) heard[item.origin][n] = item.recorded_s;
    });
    if (!run.about.by_packets) knowAtOnce(run, hear);
    const aside = run.vehicles.map(() => new Set());
    (run.columns["aside.vehicle"] || []).forEach((v, n) => aside[v].add(run.columns["aside.item"][n]));
    for (const packet of run.packets) {
      for (const { v, arrival_s } of packet.to) {
        if (arrival_s === null) continue;
        for (const item of packet.items) if (!aside[v].has(item)) hear(v, item, arrival_s);
        for (const item of packet.status) hear(v, item, arrival_s);
      }
    }
    const { "heard.vehicle": vehicle, "heard.item": item, "heard.time": time_s } = run.columns;
    if (vehicle) vehicle.forEach((v, n) => hear(v, item[n], time_s[n]));
    waitForAllParts(run, heard);
    return heard;
  }

  // Without packets every vehicle knows at once what any has told, until it is without energy; they act by their nodes.
  function knowAtOnce(run, hear) {
    const ended_s = run.vehicles.map(() => Infinity);
    for (const fault of run.faults) if (fault.kind === "energy") ended_s[fault.vehicle] = fault.time_s;
    run.items.forEach((item, n) => {
      if (item.kind === KEPT) return;
      const node = run.vehicles[item.origin].node;
      run.vehicles.forEach((vehicle, v) => {
        const isOn = item.recorded_s < ended_s[v] || (item.recorded_s === ended_s[v] && node < vehicle.node);
        if (isOn) hear(v, n, item.recorded_s);
      });
    });
  }

  // What does not fit one packet is known when its last part has been heard.
  function waitForAllParts(run, heard) {
    const blocks = new Map();
    run.items.forEach((item, n) => {
      if (item.kind === STATUS) return;
      if (!blocks.has(item.block)) blocks.set(item.block, []);
      blocks.get(item.block).push(n);
    });
    for (const parts of blocks.values()) {
      if (parts.length === 1) continue;
      for (const of of heard) {
        const last_s = Math.max(...parts.map((n) => of[n]));
        for (const n of parts) of[n] = last_s;
      }
    }
  }

  // Items by the attribute and the subject of their facts; see itemsAbout.
  function byFact(run) {
    const found = new Map();
    run.items.forEach((item, n) => {
      for (const { attribute, subject } of item.facts) {
        const key = attribute + "\n" + subject;
        if (!found.has(key)) found.set(key, []);
        found.get(key).push(n);
      }
    });
    return found;
  }

  // Where an item says that a vehicle is; undefined if it does not.
  function positionOf(name, item) {
    const said = item.facts.find((fact) => fact.attribute === POSITION && fact.subject === name);
    return said && said.value;
  }

  function indices(list, holds) {
    const found = [];
    list.forEach((one, n) => {
      if (holds(one)) found.push(n);
    });
    return found;
  }

  // Times at which v heard something newer of every peer than all before: of its position, of anything; and all items.
  function newsOf(run, v) {
    const news = run.vehicles.map(() => ({ heard: [] }));
    run.items.forEach((item, n) => {
      const heard_s = run._heard[v][n];
      if (heard_s < Infinity && news[item.origin]) news[item.origin].heard.push([heard_s, n]);
    });
    return news.map(({ heard }, p) => {
      heard.sort((a, b) => a[0] - b[0] || run.items[a[1]].time_s - run.items[b[1]].time_s);
      const name = run.vehicles[p].name;
      const newest = newer(run, heard), positions = newer(run, heard.filter(([, n]) => positionOf(name, run.items[n])));
      return {
        newestHeard_s: newest.heard_s,
        newest_s: newest.items.map((n) => run.items[n].time_s),
        positionHeard_s: positions.heard_s,
        positions: positions.items,
        toldHeard_s: heard.filter(([, n]) => isTold(run.items[n])).map(([heard_s]) => heard_s),
      };
    });
  }

  function isTold(item) {
    return item.kind !== STATUS && item.kind !== KEPT;
  }

  // Of items in the order in which they were heard, those that are newer than all before.
  function newer(run, heard) {
    const found = { heard_s: [], items: [] };
    let last_s = -Infinity;
    for (const [heard_s, n] of heard) {
      if (run.items[n].time_s < last_s) continue;
      last_s = run.items[n].time_s;
      found.heard_s.push(heard_s);
      found.items.push(n);
    }
    return found;
  }

  // For every vehicle the times at which it recorded items that it tells, in order.
  function toldOf(run) {
    const told = run.vehicles.map(() => []);
    for (const item of run.items) if (told[item.origin] && isTold(item)) told[item.origin].push(item.recorded_s);
    return told.map((times_s) => times_s.sort((a, b) => a - b));
  }

  // What comes by one event and goes by any other, such as role assignments: `at` and `held` remember the last answer.
  function changes(rows, coming, holder) {
    const meant = rows.map((row) => ({ ...row, v: holder(row), isHeld: row.event === coming }));
    return { times_s: meant.map((row) => row.time_s), rows: meant, at: -1, held: new Map() };
  }

  function heldAt(of, t) {
    const until = R.lastAt(of.times_s, t);
    if (until < of.at) {
      of.at = -1;
      of.held = new Map();
    }
    while (of.at < until) {
      const { v, group, role, isHeld } = of.rows[++of.at];
      const key = v + "\n" + group + "\n" + role;
      if (isHeld) of.held.set(key, { v, group, role });
      else of.held.delete(key);
    }
    return [...of.held.values()];
  }
})();
