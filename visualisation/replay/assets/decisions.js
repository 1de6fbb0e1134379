"use strict";
// Decisions of vehicles, the causes that missions/why.py states of them, and what happened in order.
globalThis.R = globalThis.R || {};

(function () {
  const EPSILON_S = 1e-6;
  const FIRST_SETTINGS = ["strategy.name", "communication.policy", "channel.name", "channel.per", "seed"];

  R.explain = function (run) {
    run._decisions = decisionsOf(run);
    run._answers = answersOf(run);
    run.events = eventsOf(run);
  };

  Object.assign(R.Run.prototype, {
    // [{time_s, candidates: [{label, group, role, objective, activities, stimulus, own, external, motivation, source,
    // slot, chosen, bestMean}]}]: written when what stands to choice, or the choice, changed. The mean is that
    // of the best combination with the candidate. What is vital comes before all else: no combination is weighed for it.
    decisions(v) {
      return this._decisions[v];
    },

    // [{text, time_s, vehicle, slot}]: why v did what it did at t; slot -1 without one.
    why(v, t) {
      return this._answers[v].findLast((one) => one.from_s <= t + EPSILON_S)?.lines || [];
    },
  });

  function decisionsOf(run) {
    const found = run.vehicles.map(() => []);
    for (const row of run._rows("decisions")) {
      const own = found[row.vehicle];
      if (!own) continue;
      const last = own[own.length - 1], of = row.role && run.roleName(row.group, row.role), label = row.activities + (of && ` (${of})`);
      const isFirst = (one) => one.label === label && one.group === row.group && one.objective === row.objective && one.argument === row.argument;
      if (!last || last.time_s !== row.time_s) own.push({ time_s: row.time_s, candidates: [] });
      else if (isFirst(last.candidates[0])) last.candidates = []; // it has decided anew at the same time
      own[own.length - 1].candidates.push({
        label,
        group: row.group, role: row.role, objective: row.objective, argument: row.argument, activities: row.activities,
        stimulus: row.stimulus, own: row.own, external: row.external, motivation: row.own + row.external,
        source: row.source, slot: row.slot, chosen: row.chosen === 1, bestMean: row.best_mean,
      });
    }
    return found;
  }

  // By vehicle: [{from_s, lines}], each until the next.
  function answersOf(run) {
    const column = (name) => run.columns[name] || [];
    const lines = Array.from(column("line.text"), (text, n) => ({
      text: run.text(text), time_s: run.columns["line.time"][n], vehicle: run.columns["line.vehicle"][n], slot: run.columns["line.slot"][n],
    }));
    const found = run.vehicles.map(() => []);
    let start = 0;
    column("why.vehicle").forEach((v, n) => {
      found[v].push({ from_s: run.columns["why.time"][n], lines: lines.slice(start, (start += run.columns["why.n"][n])) });
    });
    return found;
  }

  // Milestones, what drives a vehicle whenever that changes, faults, turns of the organisation, and rows of the mission's own tables, in order of time.
  function eventsOf(run) {
    const found = [];
    const add = (time_s, kind, vehicle, text) => found.push({ time_s, kind, vehicle, text });
    const nameOf = (v) => (run.vehicles[v] ? run.vehicles[v].name : "");
    for (const { time_s, name, vehicle, group } of run.milestones) {
      const whose = nameOf(vehicle) || group;
      add(time_s, "milestone", vehicle, R.words(name) + (whose ? ": " + whose : ""));
    }
    run.vehicles.forEach((vehicle, v) => {
      const bars = run.bars(v).filter((bar) => bar.driving);
      let before = "";
      for (const time_s of [...new Set(bars.flatMap((bar) => [bar.from_s, bar.to_s]))].sort((a, b) => a - b)) {
        const now = bars.filter((bar) => bar.from_s <= time_s && time_s < bar.to_s).map((bar) => run.roleName(bar.group, bar.role)).sort().join(" + ");
        if (now !== before && time_s < run.header.end_s && !run.outAt(v, time_s)) {
          add(time_s, "role", v, now ? `${vehicle.name} has active role ${now}` : `${vehicle.name} has no active role: it waits`);
        }
        before = now;
      }
    });
    for (const { time_s, vehicle, kind, detail } of run.faults) {
      add(time_s, "fault", vehicle, `${nameOf(vehicle)}: ${kind}${detail ? ", " + detail : ""}`);
    }
    for (const { time_s, vehicle, text } of run.contacts) add(time_s, "peer", vehicle, `${nameOf(vehicle)}: ${text}`);
    for (const { time_s, vehicle, text } of run.turns) add(time_s, "organisation", vehicle, text);
    for (const layer of run.layers) {
      for (const row of layer.isEvents ? layer.rows : []) {
        const who = row.vehicle >= 0 ? nameOf(row.vehicle) + ": " : "";
        add(row.time_s, layer.name, row.vehicle, who + (row.text || layer.name));
      }
    }
    return found.sort((a, b) => a.time_s - b.time_s);
  }

  // Settings in which two runs differ: [[key, value of one, value of two]]; "–" where a run has none.
  R.settingsApart = function (one, two) {
    const all = [one, two].map(({ header }) => ({ ...header.settings, seed: String(header.seed), version: header.version }));
    const keys = [...new Set([...FIRST_SETTINGS, ...all.flatMap((settings) => Object.keys(settings))])];
    const value = (settings, key) => (key in settings ? settings[key] : "–");
    return keys.map((key) => [key, ...all.map((settings) => value(settings, key))]).filter(([, a, b]) => a !== b);
  };

  // The first moment at which two runs differ: {time_s, text}; null if they never do.
  R.divergence = function (one, two) {
    const found = [];
    for (let p = 0; p < Math.max(one.packets.length, two.packets.length); p++) {
      const a = one.packets[p], b = two.packets[p], said = a && b ? difference(one, a, two, b) : "only one of them sends more";
      if (!said) continue;
      found.push({ time_s: Math.min(...[a, b].filter(Boolean).map((packet) => packet.start_s)), text: said });
      break;
    }
    const acts = (run) => run.events.filter((event) => event.kind !== "fault");
    const mine = acts(one), other = acts(two);
    for (let e = 0; e < Math.max(mine.length, other.length); e++) {
      const a = mine[e], b = other[e];
      if (a && b && a.time_s === b.time_s && a.text === b.text) continue;
      const first = !b || (a && a.time_s <= b.time_s) ? a : b;
      found.push({ time_s: first.time_s, text: first.text + " in one of them" });
      break;
    }
    const ends_s = [one, two].map((run) => run.header.end_s);
    if (ends_s[0] !== ends_s[1]) found.push({ time_s: Math.min(...ends_s), text: "one of them ends" });
    return found.length ? found.reduce((first, next) => (next.time_s < first.time_s ? next : first)) : null;
  };

  function difference(one, a, two, b) {
    if (a.slot !== b.slot || a.sender !== b.sender) return "another packet is sent";
    if (a.size_bits !== b.size_bits || saidIn(one, a) !== saidIn(two, b)) {
      return `${one.vehicles[a.sender].name} sends another content in slot ${a.slot}`;
    }
    const heard = ({ to }) => to.filter((one) => one.arrival_s !== null).map((one) => one.v).sort((x, y) => x - y);
    return heard(a).join() === heard(b).join() ? "" : `slot ${a.slot} is received by others`;
  }

  // What a packet says, as a text to compare.
  function saidIn(run, { items, status, signals }) {
    return JSON.stringify([[...items, ...status].map((n) => [run.items[n].uid, run.items[n].facts]), signals]);
  }
})();
