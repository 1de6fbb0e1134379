"use strict";
// Why a vehicle did what it did: its decisions, the chain of causes behind one, and what happened in order.
globalThis.R = globalThis.R || {};

(function () {
  const LONGEST = 12; // links of a chain
  const EPSILON_S = 1e-6;
  const SATISFACTION = "\u2212128\u2026127"; // its range
  const FIRST_SETTINGS = ["strategy.name", "communication.policy", "channel.name", "channel.per", "seed"];
  const PLAYS_ROLE = "playsRole"; // attribute of the core vocabulary; those of objectives begin with "objective"

  R.explain = function (run) {
    run._decisions = decisionsOf(run);
    run._decided_s = run._decisions.map((list) => list.map((one) => one.time_s));
    run.events = eventsOf(run);
  };

  Object.assign(R.Run.prototype, {
    // [{time_s, candidates: [{label, group, role, objective, activities, stimulus, own, external, motivation, source,
    // slot, chosen, bestMean, isVital}]}]: written when what stands to choice, or the choice, changed. The mean is that
    // of the best combination with the candidate. What is vital comes before all else: no combination is weighed for it.
    decisions(v) {
      return this._decisions[v];
    },

    // The last decision of v by t; null if there is none.
    decisionAt(v, t) {
      const at = R.lastAt(this._decided_s[v], t + EPSILON_S);
      return at < 0 ? null : this._decisions[v][at];
    },

    // [{text, time_s, vehicle, slot}]: the choice of v at t, and backwards what it is owed to; slot -1 without one. Of
    // several things that v does at t, what it does in `role` is meant, else what it has begun last.
    why(v, t, role = null) {
      const links = [];
      const seen = new Set();
      let next = { v, t, role };
      while (next && links.length < LONGEST && !seen.has(next.v + "@" + next.t)) {
        seen.add(next.v + "@" + next.t);
        next = explainOne(this, next, links);
      }
      return links;
    },
  });

  function decisionsOf(run) {
    const found = run.vehicles.map(() => []);
    for (const row of run._rows("decisions")) {
      const own = found[row.vehicle];
      if (!own) continue;
      const last = own[own.length - 1], of = row.role && run.roleName(row.group, row.role), label = row.activities + (of && ` (${of})`);
      const isAgain = (one) => one.label === label && one.group === row.group && one.objective === row.objective && one.argument === row.argument;
      if (!last || last.time_s !== row.time_s) own.push({ time_s: row.time_s, candidates: [] });
      else if (last.candidates.some(isAgain)) last.candidates = []; // it has decided anew at the same time
      own[own.length - 1].candidates.push({
        label,
        group: row.group, role: row.role, objective: row.objective, argument: row.argument, activities: row.activities,
        stimulus: row.stimulus, own: row.own, external: row.external, motivation: row.own + row.external,
        source: row.source, slot: row.slot, chosen: row.chosen === 1, bestMean: row.best_mean,
        isVital: row.chosen === 1 && row.role === "" && row.best_mean === null,
      });
    }
    return found;
  }

  function isPursued(candidate) {
    return candidate.chosen && candidate.role !== "";
  }

  // The decision at which v began, without a break, to do what it did at decision `at`.
  function beginning(decisions, at, candidate) {
    const does = (decision) => decision.candidates.some((one) => isPursued(one) && one.label === candidate.label);
    let first = at;
    while (first > 0 && does(decisions[first - 1])) first--;
    return first;
  }

  // One choice, and the signal behind it. Adds its links; returns the choice of the sender, which explains the signal.
  function explainOne(run, { v, t, role }, links) {
    const decisions = run._decisions[v];
    const at = R.lastAt(run._decided_s[v], t + EPSILON_S);
    if (at < 0) return null;
    const begun = decisions[at].candidates
      .filter((one) => isPursued(one) && (!role || one.role === role))
      .map((one) => ({ one, first: beginning(decisions, at, one) }));
    if (!begun.length) {
      explainVital(run, v, decisions[at], links);
      return null;
    }
    const external = ({ one, first }) => decisions[first].candidates.find((of) => of.label === one.label).external;
    const isLater = (b, a) => b.first > a.first || (b.first === a.first && external(b) > external(a));
    const last = begun.reduce((a, b) => (isLater(b, a) ? b : a));
    const decision = decisions[last.first];
    const chosen = decision.candidates.find((one) => isPursued(one) && one.label === last.one.label);
    links.push(link(choiceText(run.vehicles[v].name, chosen, decision, decisions[last.first - 1]), decision.time_s, v));
    if (chosen.external > 0 && chosen.source >= 0) return explainSignal(run, v, chosen, links);
    explainTask(run, v, chosen, decision.time_s, links);
    return null;
  }

  function explainVital(run, v, decision, links) {
    const vital = decision.candidates.filter((one) => one.isVital);
    if (!vital.length) return;
    const what = vital.map((one) => `${one.activities}, stimulus ${one.stimulus.toFixed(2)}`).join("; ");
    links.push(link(`${run.vehicles[v].name} performed a vital activity: ${what}`, decision.time_s, v));
  }

  function choiceText(name, chosen, decision, before) {
    const own = `${chosen.own.toFixed(2)} internal`;
    const motivation = chosen.external > 0
      ? `motivation ${chosen.motivation.toFixed(2)}, ${chosen.external.toFixed(2)} of it by a signal, ${own}`
      : `motivation ${own}`;
    return `${name} ${leavingText(decision, before)} ${chosen.label}: ${motivation}`;
  }

  // What was given up for a choice, and what would have moved the vehicle to go on with it.
  function leavingText(decision, before) {
    if (!before) return "chose";
    const goesOn = (one) => decision.candidates.some((now) => now.chosen && now.label === one.label);
    const given = before.candidates.filter((one) => !goesOn(one) && (isPursued(one) || one.isVital));
    const work = given.find(isPursued);
    if (!work) return given.length ? `after ${given[0].activities} chose` : "chose";
    const now = decision.candidates.find((one) => one.label === work.label);
    let how = "which had ended";
    if (now) how = now.stimulus > 0 ? `motivation ${now.motivation.toFixed(2)}` : "without further stimulus";
    return `left ${work.label}, ${how}, for`;
  }

  // The signal that moved v: when it was heard, and what its sender did in that role as it sent it.
  function explainSignal(run, v, chosen, links) {
    const source = run.vehicles[chosen.source].name, name = run.vehicles[v].name;
    const roleOf = (one) => run.roleName(one.group, one.role);
    const packet = chosen.slot < 0 ? null : run.packetOf(chosen.slot);
    if (!packet) {
      links.push(link(`${name} had received a signal of ${source}`, links[links.length - 1].time_s, v));
      return null;
    }
    const heard = packet.to.find((one) => one.v === v);
    const arrival_s = heard && heard.arrival_s !== null ? heard.arrival_s : packet.end_s;
    const meant = packet.signals.filter((one) => one.group === chosen.group && one.addressed.includes(chosen.role));
    const signal = meant.length ? meant.reduce((low, one) => (one.value < low.value ? one : low)) : null;
    const value = signal ? `, satisfaction ${signed(signal.value)} of ${SATISFACTION} as ${roleOf(signal)}` : "";
    links.push(link(`${name} received a signal of ${source} in slot ${packet.slot}${value}`, arrival_s, v, packet.slot));
    if (!signal) return null;
    const doing = run.decisionAt(chosen.source, packet.start_s);
    const aims = doing ? doing.candidates.filter((one) => one.role === signal.role && one.group === signal.group) : [];
    const still = aims.filter((one) => one.chosen).concat(aims.filter((one) => !one.chosen && one.stimulus > 0))[0];
    const advance = signal.value < 0 ? "made no progress" : "made progress";
    const as = still ? `as its ${still.activities} ${advance}` : `as ${roleOf(signal)}`;
    links.push(link(`${source} sent it in slot ${packet.slot} ${as}`, packet.start_s, chosen.source, packet.slot));
    return still && still.chosen ? { v: chosen.source, t: packet.start_s, role: signal.role } : null;
  }

  // How v came by what it does: by the facts that gave it the role, and the role its objective; the later one first.
  function explainTask(run, v, chosen, before_s, links) {
    const name = run.vehicles[v].name, path = chosen.group + "." + chosen.role;
    const role = run.roleName(chosen.group, chosen.role);
    const task = `${role} is for ${chosen.objective}(${chosen.argument})`;
    const found = [
      heardFact(run, v, "objective" + chosen.objective, path, chosen.argument, before_s, task),
      heardFact(run, v, PLAYS_ROLE, name, path, before_s, `${name} plays ${role}`),
    ];
    links.push(...found.filter(Boolean).sort((a, b) => b.time_s - a.time_s));
  }

  // The last time by `before_s` that v heard or said a fact, as a link; null if it never did.
  function heardFact(run, v, attribute, subject, value, before_s, words) {
    const isMeant = (fact) => fact.attribute === attribute && fact.subject === subject && fact.value === value;
    let found = -1;
    for (const n of run.itemsAbout(attribute, subject)) {
      const heard_s = run.heard_s(v, n);
      if (heard_s > before_s + EPSILON_S || !run.items[n].facts.some(isMeant)) continue;
      if (found < 0 || heard_s >= run.heard_s(v, found)) found = n;
    }
    if (found < 0) return null;
    const item = run.items[found], heard_s = run.heard_s(v, found), name = run.vehicles[v].name;
    if (item.origin === v) return link(`${name} decided that ${words}`, item.recorded_s, v);
    const brought = (one) => (one.items.includes(found) || one.status.includes(found)) && one.to.some((to) => to.v === v && to.arrival_s === heard_s);
    const packet = run.packets.find(brought), origin = run.vehicles[item.origin].name;
    const by = packet ? ` in slot ${packet.slot}` : "";
    return link(`${name} received${by} that ${words}, decided by ${origin}`, heard_s, v, packet ? packet.slot : -1);
  }

  function signed(value) {
    return (value < 0 ? "\u2212" : "") + Math.abs(value);
  }

  function link(text, time_s, vehicle, slot = -1) {
    return { text, time_s, vehicle, slot };
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
