"use strict";
// Who knew what when: what every vehicle had heard, its picture of the others and of the work, and what is so in truth.
globalThis.R = globalThis.R || {};

(function () {
  const POSITION = "position"; // attribute of the core vocabulary by which vehicles say where they are
  const STATUS = "status", KEPT = "kept"; // kinds of items: of the first the newest counts, the second is not told
  const SAMPLES = 600;

  R.learn = function (run) {
    const { packets, items } = run;
    run._heard = run.vehicles.map(() => new Float64Array(items.length).fill(Infinity));
    items.forEach((item, n) => {
      if (run._heard[item.origin]) run._heard[item.origin][n] = item.recorded_s;
    });
    const hear = (v, item, time_s) => {
      if (time_s < run._heard[v][item]) run._heard[v][item] = time_s;
    };
    for (const packet of packets) {
      for (const { v, arrival_s } of packet.to) {
        if (arrival_s === null) continue;
        for (const item of packet.items) hear(v, item, arrival_s);
        for (const item of packet.status) hear(v, item, arrival_s);
      }
    }
    const { "heard.vehicle": vehicle, "heard.item": item, "heard.time": time_s } = run.columns;
    if (vehicle) vehicle.forEach((v, n) => hear(v, item[n], time_s[n]));
    run.tiles = tilesOf(run);
    run.world = worldOf(run);
    run.finds = findsOf(run);
    const views = run._rows("organisation");
    run._views = run.vehicles.map((_, v) => changes(views.filter((row) => row.vehicle === v), (row) => row.peer));
    const assignments = run._rows("roles").filter((row) => row.event === "assigned" || row.event === "left");
    run._truth = changes(assignments, (row) => row.vehicle);
    run._news = run.vehicles.map((_, v) => newsOf(run, v));
    run.cost = costOf(run);
  };

  Object.assign(R.Run.prototype, {
    // Time at which v came to know an item; Infinity if it never did.
    heard_s(v, item) {
      return this._heard[v][item];
    },

    // What v took for so: peers where it last heard that they were, who plays what, which places it knew to be done,
    // when it came to know of each tile (Infinity: never), and what it knew of finds.
    mind(v, t) {
      const peers = [];
      this.vehicles.forEach((_, p) => {
        const at = p === v ? -1 : R.lastAt(this._news[v][p].positionHeard_s, t);
        if (at < 0) return;
        const item = this.items[this._news[v][p].positions[at]];
        const [x, y] = positionIn(item);
        peers.push({ v: p, x, y, since_s: item.time_s, heard_s: this._news[v][p].positionHeard_s[at] });
      });
      return {
        peers,
        absent: this.absent(v, t),
        roles: rolesAt(this._views[v], t),
        places: indices(this.world.places, (place) => place.known_s[v] <= t),
        tilesKnown_s: this.tiles.known_s[v],
        finds: indices(this.finds, (find) => this._heard[v][find.item] <= t),
      };
    },

    // The same for what is so; roles are those that each holder takes itself to have.
    truth(t) {
      return {
        peers: this.vehicles.map((_, v) => ({ v, ...this.at(v, t), since_s: t })),
        absent: [],
        roles: rolesAt(this._truth, t),
        places: indices(this.world.places, (place) => place.done_s !== null && place.done_s <= t),
        tilesKnown_s: this.tiles.done_s,
        finds: indices(this.finds, (find) => this.items[find.item].recorded_s <= t),
      };
    },

    // Peers that v took for absent at t.
    absent(v, t) {
      const found = new Set();
      for (const row of this._membership || (this._membership = this._rows("membership"))) {
        if (row.time_s > t) break;
        if (row.vehicle !== v) continue;
        if (row.event === "absent") found.add(row.peer);
        else found.delete(row.peer);
      }
      return [...found].sort((a, b) => a - b);
    },

    // Where v errs on who plays what: {extra, lacking}, each [{v, group, role}].
    disagreements(v, t) {
      const key = (one) => one.v + "\n" + one.group + "\n" + one.role;
      const own = rolesAt(this._views[v], t), so = rolesAt(this._truth, t);
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

  function positionIn(item) {
    return item.facts.find((fact) => fact.attribute === POSITION).value;
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
      const saysWhere = (item) => item.facts.some((fact) => fact.attribute === POSITION && fact.subject === name);
      const newest = newer(run, heard), positions = newer(run, heard.filter(([, n]) => saysWhere(run.items[n])));
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

  // Role assignments as they come and go: {times_s, rows, at, held}; `at` and `held` remember the last answer.
  function changes(rows, holder) {
    const meant = rows.map((row) => ({ ...row, v: holder(row), isHeld: row.event === "assigned" }));
    return { times_s: meant.map((row) => row.time_s), rows: meant, at: -1, held: new Map() };
  }

  function rolesAt(of, t) {
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

  // Squares of the places: {x, y, size, place: west, south, side, index of the place; done_s, doneBy; known_s[v]}.
  function tilesOf(run) {
    const { "tiles.column": column, "tiles.row": row } = run.columns;
    const n = column.length;
    const tiles = {
      n, x: new Float64Array(n), y: new Float64Array(n), size: new Float64Array(n), place: new Int32Array(n),
      done_s: new Float64Array(n).fill(Infinity), doneBy: new Int32Array(n).fill(-1),
      known_s: run.vehicles.map(() => new Float64Array(n).fill(Infinity)),
    };
    const numbers = new Map(); // of the fact that says that a tile is done: the first tile of its place, and how many
    let first = 0;
    run.about.world.places.forEach((place, p) => {
      if (!place.tiles) return;
      for (let tile = first; tile < first + place.tiles.n; tile++) {
        tiles.place[tile] = p;
        tiles.size[tile] = place.tiles.size_m;
        tiles.x[tile] = column[tile] * place.tiles.size_m;
        tiles.y[tile] = row[tile] * place.tiles.size_m;
      }
      numbers.set(place.tiles.attribute + "\n" + place.name, [first, place.tiles.n]);
      first += place.tiles.n;
    });
    const { "done.tile": done, "done.time": done_s, "done.vehicle": doneBy } = run.columns;
    done.forEach((tile, at) => {
      if (done_s[at] >= tiles.done_s[tile]) return;
      tiles.done_s[tile] = done_s[at];
      tiles.doneBy[tile] = doneBy[at];
    });
    run.items.forEach((item, n) => {
      for (const fact of item.facts) {
        const place = numbers.get(fact.attribute + "\n" + fact.subject);
        if (!place || fact.value >= place[1]) continue;
        for (let v = 0; v < run.vehicles.length; v++) {
          const tile = place[0] + fact.value;
          if (run._heard[v][n] < tiles.known_s[v][tile]) tiles.known_s[v][tile] = run._heard[v][n];
        }
      }
    });
    return tiles;
  }

  // When the facts that say that a job is done were first recorded, and when each vehicle knew.
  function doneOf(run, key) {
    const done = { done_s: null, known_s: new Float64Array(run.vehicles.length).fill(Infinity) };
    if (!key) return done;
    run.items.forEach((item, n) => {
      if (!item.facts.some((fact) => fact.attribute === key[0] && fact.subject === key[1])) return;
      if (done.done_s === null || item.recorded_s < done.done_s) done.done_s = item.recorded_s;
      run.vehicles.forEach((_, v) => {
        done.known_s[v] = Math.min(done.known_s[v], run._heard[v][n]);
      });
    });
    return done;
  }

  function worldOf(run) {
    const { x_m, y_m, places, jobs } = run.about.world;
    return {
      x_m, y_m, layers: run.layers,
      places: places.map((place) => ({
        name: place.name,
        kind: place.outline_m.length > 1 ? "outline" : "point",
        what: place.kind,
        points_m: place.outline_m,
        hasTiles: Boolean(place.tiles),
        isJob: Boolean(place.done),
        ...doneOf(run, place.done),
      })),
      jobs: jobs.map((job) => ({ name: job.name, ...doneOf(run, job.done) })),
    };
  }

  // What somebody found somewhere and said so: [{item, subject, attribute, x, y}], each the first time that it was said.
  function findsOf(run) {
    const found = new Map();
    run.items.forEach((item, n) => {
      if (item.kind === STATUS) return;
      for (const { subject, attribute, value } of item.facts) {
        const key = item.origin + "\n" + subject + "\n" + attribute;
        if (Array.isArray(value) && !found.has(key)) found.set(key, { item: n, subject, attribute, x: value[0], y: value[1] });
      }
    });
    return [...found.values()];
  }

  // When each piece of work was done, and when each vehicle knew: tiles, jobs done as a whole, jobs that came up.
  function workOf(run) {
    const { tiles, vehicles } = run;
    const work = [];
    for (let tile = 0; tile < tiles.n; tile++) {
      work.push({ done_s: tiles.done_s[tile], known_s: vehicles.map((_, v) => tiles.known_s[v][tile]) });
    }
    for (const place of run.world.places) {
      if (place.isJob && !place.hasTiles) work.push({ done_s: place.done_s === null ? Infinity : place.done_s, known_s: place.known_s });
    }
    const cameUp = new Set(run.finds.map((find) => find.subject));
    for (const job of run.world.jobs) {
      if (job.done_s !== null || cameUp.has(job.name)) {
        work.push({ done_s: job.done_s === null ? Infinity : job.done_s, known_s: job.known_s });
      }
    }
    return work;
  }

  // {t, truth, known_mean, agree}: shares 0..1 over time; truth and known_mean are empty where no work is declared.
  function costOf(run) {
    const end_s = Math.max(run.header.end_s, 1);
    const t = Array.from({ length: SAMPLES + 1 }, (_, n) => (n * end_s) / SAMPLES);
    const work = workOf(run), width = Math.max(1, run.vehicles.length);
    const done_s = work.map((one) => one.done_s).sort((a, b) => a - b);
    const known_s = work.flatMap((one) => Array.from(one.known_s)).sort((a, b) => a - b);
    const share = (sorted, total) => (total ? t.map((at) => (R.lastAt(sorted, at) + 1) / total) : []);
    return {
      t,
      n_work: work.length,
      truth: share(done_s, work.length),
      known_mean: run.items.length ? share(known_s, work.length * width) : [],
      agree: agreementOf(run, t),
    };
  }

  // Share of the vehicles that see all roles as their holders do, at each of the times; a view is wrong by the number of
  // assignments in which it differs, which changes by one with each event of either.
  function agreementOf(run, t) {
    if (!run.has("organisation")) return [];
    const truth = new Set(), views = run.vehicles.map(() => new Set()), wrong = run.vehicles.map(() => 0);
    const key = (row) => row.v + "\n" + row.group + "\n" + row.role;
    const set = (of, one, isHeld) => (isHeld ? of.add(one) : of.delete(one));
    const events = run._truth.rows.map((row) => ({ row, view: -1 }));
    run._views.forEach((view, v) => view.rows.forEach((row) => events.push({ row, view: v })));
    events.sort((a, b) => a.row.time_s - b.row.time_s);
    const apply = ({ row, view }) => {
      const one = key(row);
      const of = view < 0 ? truth : views[view];
      if (of.has(one) === row.isHeld) return;
      set(of, one, row.isHeld);
      run.vehicles.forEach((_, v) => {
        if (view < 0 || view === v) wrong[v] += truth.has(one) === views[v].has(one) ? -1 : 1;
      });
    };
    let next = 0;
    return t.map((at) => {
      while (next < events.length && events[next].row.time_s <= at) apply(events[next++]);
      return wrong.filter((n) => n === 0).length / Math.max(1, wrong.length);
    });
  }
})();
