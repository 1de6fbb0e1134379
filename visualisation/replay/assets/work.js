"use strict";
// What there is to do, when it was done, when each vehicle knew of it, and what the losses cost.
globalThis.R = globalThis.R || {};

(function () {
  const STATUS = "status"; // kind of items of which the newest value counts
  const SAMPLES = 600;

  R.survey = function (run) {
    run.tiles = tilesOf(run);
    run.world = worldOf(run);
    run.finds = findsOf(run);
    run.jobs = jobsOf(run);
    run.cost = costOf(run);
  };

  // Squares of the places: {x, y, size, place: west, south, side, index of the place; done_s; known_s[v]}.
  function tilesOf(run) {
    const { "tiles.column": column, "tiles.row": row } = run.columns;
    const n = column.length;
    const tiles = {
      n, x: new Float64Array(n), y: new Float64Array(n), size: new Float64Array(n), place: new Int32Array(n),
      done_s: new Float64Array(n).fill(Infinity),
      known_s: run.vehicles.map(() => new Float64Array(n).fill(Infinity)),
    };
    let first = 0;
    run.about.world.places.forEach((place, p) => {
      if (!place.tiles) return;
      for (let tile = first; tile < first + place.tiles.n; tile++) {
        tiles.place[tile] = p;
        tiles.size[tile] = place.tiles.size_m;
        tiles.x[tile] = column[tile] * place.tiles.size_m;
        tiles.y[tile] = row[tile] * place.tiles.size_m;
      }
      knowTiles(run, tiles, place, first);
      first += place.tiles.n;
    });
    const { "done.tile": done, "done.time": done_s } = run.columns;
    done.forEach((tile, at) => { tiles.done_s[tile] = Math.min(tiles.done_s[tile], done_s[at]); });
    return tiles;
  }

  // When each vehicle knew of the tiles of a place, of which the first is tile `first`.
  function knowTiles(run, tiles, place, first) {
    const { attribute, n } = place.tiles;
    for (const item of run.itemsAbout(attribute, place.name)) {
      for (const fact of run.items[item].facts) {
        if (fact.attribute !== attribute || fact.subject !== place.name || !(fact.value < n)) continue;
        tiles.known_s.forEach((known_s, v) => {
          known_s[first + fact.value] = Math.min(known_s[first + fact.value], run.heard_s(v, item));
        });
      }
    }
  }

  // When the facts that say that a job is done were first recorded, and when each vehicle knew.
  function doneOf(run, key) {
    const done = { done_s: null, known_s: new Float64Array(run.vehicles.length).fill(Infinity) };
    for (const n of key ? run.itemsAbout(...key) : []) {
      const { recorded_s } = run.items[n];
      if (done.done_s === null || recorded_s < done.done_s) done.done_s = recorded_s;
      run._heard.forEach((heard_s, v) => {
        done.known_s[v] = Math.min(done.known_s[v], heard_s[n]);
      });
    }
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

  // Jobs that are no areas of tiles: [{name, done_s, known_s, cameUp_s}]. cameUp_s: when somebody first said where one
  // lies that has no place of its own; Infinity if nobody did, and then the record has nothing but its name.
  function jobsOf(run) {
    const said_s = (name) => run.finds.filter((find) => find.subject === name).map((find) => run.items[find.item].recorded_s);
    const placed = run.world.places.filter((place) => place.isJob && !place.hasTiles);
    return [...placed.map((place) => ({ ...place, cameUp_s: 0 })),
            ...run.world.jobs.map((job) => ({ ...job, cameUp_s: Math.min(...said_s(job.name), job.done_s === null ? Infinity : job.done_s) }))];
  }

  // What somebody found somewhere and said so: [{item, subject, attribute, x, y}], each as it was said first.
  function findsOf(run) {
    const found = new Map();
    run.items.forEach((item, n) => {
      if (item.kind === STATUS) return;
      for (const { subject, attribute, value } of item.facts) {
        const key = item.origin + "\n" + subject + "\n" + attribute;
        if (!Array.isArray(value) || found.has(key)) continue;
        found.set(key, { item: n, subject, attribute, x: value[0], y: value[1] });
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
    return [...work, ...run.jobs.filter((job) => job.cameUp_s < Infinity).map(asWork)];
  }

  function asWork({ done_s, known_s }) {
    return { done_s: done_s === null ? Infinity : done_s, known_s };
  }

  // {t, truth, known_mean, agree}: shares 0..1 over time; truth and known_mean are empty where no work is declared. Of
  // the vehicles those count that are in the mission.
  function costOf(run) {
    const end_s = Math.max(run.header.end_s, 1);
    const t = Array.from({ length: SAMPLES + 1 }, (_, n) => (n * end_s) / SAMPLES);
    const work = workOf(run), inside = t.map((at) => insideAt(run, at));
    const done_s = work.map((one) => one.done_s).sort((a, b) => a - b);
    const known_s = run.vehicles.map((_, v) => work.map((one) => one.known_s[v]).sort((a, b) => a - b));
    const mean = (at, those) => those.reduce((sum, v) => sum + R.lastAt(known_s[v], at) + 1, 0) / Math.max(1, those.length);
    const share = (sorted, total) => (total ? t.map((at) => (R.lastAt(sorted, at) + 1) / total) : []);
    return {
      t,
      n_work: work.length,
      truth: share(done_s, work.length),
      known_mean: run.items.length && work.length ? t.map((at, n) => mean(at, inside[n]) / work.length) : [],
      agree: agreementOf(run, t, inside),
    };
  }

  // Vehicles that are in the mission at a time.
  function insideAt(run, at) {
    return run.vehicles.map((_, v) => v).filter((v) => !run.outAt(v, at));
  }

  // Share of the vehicles that see all roles of their peers as these do, at each of the times; a view is wrong of a holder by
  // the number of assignments in which it differs, which changes by one with each event of either.
  function agreementOf(run, t, inside) {
    if (!run.has("organisation")) return [];
    const truth = new Set(), views = run.vehicles.map(() => new Set()), wrong = run.vehicles.map(() => run.vehicles.map(() => 0));
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
        if (view < 0 || view === v) wrong[v][row.v] += truth.has(one) === views[v].has(one) ? -1 : 1;
      });
    };
    let next = 0;
    return t.map((at, n) => {
      while (next < events.length && events[next].row.time_s <= at) apply(events[next++]);
      const right = inside[n].filter((v) => inside[n].every((holder) => !wrong[v][holder]));
      return right.length / Math.max(1, inside[n].length);
    });
  }
})();
