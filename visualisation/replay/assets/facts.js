"use strict";
/* What the view derives once from a run: receptions by vehicle, spells of silence, speeds, flags, groups of lanes. */
(function () {
  /* A spell of silence lasts at least so many frames, and every packet sent in it was lost. */
  const SILENT_FRAMES = 3;
  /* Lanes fold only in fleets larger than this, and only so many or more alike. */
  const FOLDS_ABOVE = 8, FOLDS_FROM = 3;

  R.Facts = class {
    constructor(run, looks = R.roleLooks([run])) {
      this.run = run;
      this.looks = looks;
      this.pointed = -1; // vehicle under the mouse
      this.n = run.vehicles.length;
      this.sound_mps = run.header.sound_mps;
      this.end_s = run.header.end_s;
      this.receptions = run.vehicles.map(() => ({ heard: [], lost: [], collided: [], refused: [], sent: [] }));
      run.packets.forEach((packet, number) => {
        this.receptions[packet.sender].sent.push(number);
        for (const to of packet.to) {
          const of = this.receptions[to.v];
          of[to.arrival_s === null ? "lost" : "heard"].push(number);
          if (to.why === "collided" || to.why === "refused") of[to.why].push(number);
        }
      });
      this.ends = ["collided", "refused"].filter((why) => this.receptions.some((one) => one[why].length));
      this.silences = run.vehicles.map((_, v) => this.silencesOf(v));
      this.top_mps = run.vehicles.map((_, v) => topSpeed(run.track(v)));
      this.extent = extentOf(run);
      this.held = run.vehicles.map((_, v) => rolesHeld(run.bars(v).filter((bar) => !bar.driving)));
      this.driving = run.vehicles.map((_, v) => spellsOf(run, run.bars(v).filter((bar) => bar.driving), this.looks));
      this.drivingFrom_s = this.driving.map((spells) => spells.map((spell) => spell.from_s));
      this.decisions = run.vehicles.map((_, v) => markChanges(run.decisions(v)));
      this.flags = run.vehicles.map((_, v) => flagsOf(run, v));
    }

    /** Spells in which packets were sent to `v`, in the mission, and none got through: {from_s, to_s, lost}. */
    silencesOf(v) {
      const { heard, lost } = this.receptions[v];
      /* Slots differ by fractions of a millisecond: so half of one is allowed for. */
      const least_s = SILENT_FRAMES * (this.run.header.frame_s || 10) - (this.run.header.slot_s || 0) / 2;
      const bounds = [0, ...heard.map((p) => this.run.packets[p].start_s), this.end_s];
      const lost_s = lost.map((p) => this.run.packets[p].start_s);
      const lostBefore = (time_s) => R.lastAt(lost_s, time_s) + 1;
      return bounds.slice(1).flatMap((to_s, n) => R.within({ from_s: bounds[n], to_s }, this.run.vehicles[v].out))
        .filter(({ from_s, to_s }) => to_s - from_s >= least_s)
        .map((spell) => ({ ...spell, lost: lostBefore(spell.to_s) - lostBefore(spell.from_s) }))
        .filter(({ lost }) => lost);
    }

    /** How long `v` was deaf in all (s). */
    deaf_s(v) { return this.silences[v].reduce((sum, spell) => sum + spell.to_s - spell.from_s, 0); }

    longestSilence(v) {
      return this.silences[v].reduce((a, b) => (a && a.to_s - a.from_s >= b.to_s - b.from_s ? a : b), null);
    }

    heardShare(v) {
      const { heard, lost } = this.receptions[v];
      return heard.length + lost.length ? heard.length / (heard.length + lost.length) : null;
    }

    /** The spell {from_s, to_s, roles, role} of what drives `v` at a time, or null while it waits. */
    drivingAt(v, time_s) {
      const spell = this.driving[v][R.lastAt(this.drivingFrom_s[v], time_s)];
      return spell && (time_s < spell.to_s || spell.to_s >= this.end_s) ? spell : null;
    }

    /** Groups of vehicles that one lane shows: alike are those of one type that began in the same role and work, or wait, most of the time. */
    lanes(open, selected) {
      const groups = new Map();
      this.run.vehicles.forEach((vehicle, v) => {
        const role = this.held[v].length ? this.held[v][0].role : "no role", waits = this.mostlyWaits(v);
        const key = [vehicle.type, role, waits].join("\n");
        if (!groups.has(key)) groups.set(key, { key, role, waits, members: [] });
        groups.get(key).members.push(v);
      });
      const lanes = [];
      for (const group of groups.values()) {
        const foldable = this.n > FOLDS_ABOVE && group.members.length >= FOLDS_FROM;
        if (foldable) lanes.push({ ...group, folded: !open.has(group.key), head: true });
        if (!foldable || open.has(group.key)) for (const v of group.members) lanes.push({ v, members: [v], key: group.key });
        else if (group.members.includes(selected)) lanes.push({ v: selected, members: [selected], key: group.key });
      }
      return lanes;
    }

    mostlyWaits(v) {
      return this.driving[v].reduce((sum, spell) => sum + spell.to_s - spell.from_s, 0) < this.end_s / 2;
    }

    /** When sound from a packet's sender reaches `v`; for a lost packet, when it would have. */
    arrival_s(packet, to) {
      if (to.arrival_s !== null) return to.arrival_s;
      const a = this.run.at(packet.sender, packet.start_s), b = this.run.at(to.v, packet.start_s);
      return packet.end_s + Math.hypot(a.x - b.x, a.y - b.y) / this.sound_mps;
    }
  };

  /* What happened to a vehicle, for its lane: milestones, faults, and rows of the mission's own tables: [{time_s, text}]. */
  function flagsOf(run, v) {
    const ofVehicle = (rows, text) => rows.filter((one) => one.vehicle === v).map((one) => ({ time_s: one.time_s, text: text(one) }));
    const flags = [...ofVehicle(run.milestones, (one) => R.words(one.name)), ...ofVehicle(run.faults, faultText), ...ofVehicle(run.contacts, (one) => one.text)];
    const noted = new Set(run.milestones.filter((one) => one.vehicle === v).map((one) => one.time_s));
    for (const layer of run.layers.filter((one) => one.isEvents)) {
      const rows = layer.rows.filter((row) => !noted.has(row.time_s));
      flags.push(...ofVehicle(rows, (row) => R.words(layer.name) + (row.text ? ": " + row.text : "")));
    }
    return flags.sort((a, b) => a.time_s - b.time_s);
  }

  /* A fault that is over is no alarm; what joins was away until then. */
  function faultText({ kind, detail }) {
    const isOver = detail === "over";
    if (kind === "joins") return isOver ? "joins" : "⚠ away";
    return isOver ? R.words(kind) + " no more" : "⚠ " + R.words(kind);
  }

  function topSpeed({ t, x, y }) {
    let top = 0;
    for (let n = 1; n < t.length; n += 1) {
      const passed_s = t[n] - t[n - 1];
      if (passed_s > 0) top = Math.max(top, Math.hypot(x[n] - x[n - 1], y[n] - y[n - 1]) / passed_s);
    }
    return top;
  }

  /* Several roles may drive a vehicle at once: spells in which they are the same, the first of them giving the colour. */
  function spellsOf(run, bars, looks) {
    const bounds = [...new Set(bars.flatMap((bar) => [bar.from_s, bar.to_s]))].sort((a, b) => a - b);
    const order = [...looks.keys()];
    const spells = [];
    for (let n = 0; n + 1 < bounds.length; n += 1) {
      const [from_s, to_s] = [bounds[n], bounds[n + 1]];
      const now = bars.filter((bar) => bar.from_s <= from_s && to_s <= bar.to_s);
      const roles = order.filter((role) => now.some((bar) => bar.role === role));
      if (!roles.length) continue;
      const namesOf = (role) => now.filter((bar) => bar.role === role).map((bar) => run.roleName(bar.group, role));
      const text = [...new Set(roles.flatMap(namesOf))].join(" + ");
      const last = spells[spells.length - 1];
      if (last && last.to_s === from_s && last.text === text) last.to_s = to_s;
      else spells.push({ from_s, to_s, roles, role: roles[0], text });
    }
    return spells;
  }

  /* A decision is a change if other candidates are chosen than in the one before. */
  function markChanges(decisions) {
    let before = null;
    return decisions.map((decision) => {
      const chosen = decision.candidates.filter((c) => c.chosen).map((c) => c.label).join();
      const changed = chosen !== before;
      before = chosen;
      return { ...decision, changed };
    });
  }

  /* What the map shows at first: all places and all tracks, with a margin; the world may be much wider. */
  function extentOf(run) {
    const x_m = [], y_m = [];
    const take = (x, y) => { if (Number.isFinite(x) && Number.isFinite(y)) { x_m.push(x); y_m.push(y); } };
    for (const place of run.world.places) for (const [x, y] of place.points_m) take(x, y);
    run.vehicles.forEach((_, v) => {
      const { t, x, y } = run.track(v);
      for (let n = 0; n < t.length; n += 1) take(x[n], y[n]);
    });
    const span = (values, given) => {
      if (!values.length) return given || [0, 100];
      const [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
      const margin = Math.max(0.05 * (high - low), 20);
      return [low - margin, high + margin];
    };
    return { x_m: span(x_m, run.world.x_m), y_m: span(y_m, run.world.y_m) };
  }

  /* Held roles in the order in which they were first held; each has a thin row of its own in the lane. */
  function rolesHeld(bars) {
    const rows = new Map();
    for (const bar of bars) {
      const key = bar.group + "\n" + bar.role;
      if (!rows.has(key)) rows.set(key, { group: bar.group, role: bar.role, spells: [] });
      rows.get(key).spells.push(bar);
    }
    return [...rows.values()];
  }
})();
