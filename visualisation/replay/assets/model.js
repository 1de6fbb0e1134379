"use strict";
// One run: vehicles, where they were, what they played, what was sent. Times in s, positions in m, vehicles by index.
// knowledge.js adds what was known, links.js what links lost, work.js what there was to do, decisions.js why they did what they did, organisation.js who
// played what, plans.js how far plans were. Nothing here knows the document.
globalThis.R = globalThis.R || {};

(function () {
  const HEARD = 2; // what became of a packet at a vehicle, see tables.py; 0: it is the sender, or was out of reach
  const FAILED = { 1: "lost", 3: "collided", 4: "refused" };
  const POINT = /^POINT \((\S+) (\S+)\)$/; // a value of a fact
  const PART = /(-p?\d+)\.\d+$/; // the last number of the name of one of the parts of a block
  const EPSILON_S = 1e-6;
  const MOST_EVENTS_PER_VEHICLE = 20; // the rows of a longer table of the mission's own are samples, no events
  const OUT = new Set(["lost", "joins", "energy"]), OVER = "over"; // faults by which a vehicle is out of the mission

  // Index of the last entry of a sorted array that is at most `value`; -1 if there is none.
  R.lastAt = function (sorted, value, start = 0, end = sorted.length) {
    let low = start, high = end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (sorted[middle] <= value) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  };

  R.Run = class {
    constructor({ about, columns }) {
      this.about = about;
      this.columns = columns;
      this.header = about.header;
      this.missing = about.missing;
      this.vehicles = about.vehicles.map((one) => ({ ...one, out: [] }));
      this._tracks = tracksOf(this);
      this.faults = this._rows("faults");
      markLost(this);
      this.milestones = about.milestones.map(([name, vehicle, group, time_s]) => ({ time_s, name, vehicle, group }));
      this._bars = barsOf(this);
      this.items = itemsOf(this);
      this.packets = packetsOf(this);
      this._starts_s = Float64Array.from(this.packets, (packet) => packet.start_s);
      this._slots = Float64Array.from(this.packets, (packet) => packet.slot);
      this.layers = layersOf(this);
      R.learn(this);
      R.connect(this);
      R.survey(this);
      R.organise(this);
      R.recount(this);
      R.explain(this);
    }

    text(number) {
      return number < 0 ? "" : this.about.texts[number];
    }

    has(table) {
      return this.about.events.includes(table);
    }

    // Rows of a table of events as objects; empty if the run has none.
    _rows(table) {
      if (!this.has(table)) return [];
      const names = this.about.columns.map(([name]) => name).filter((name) => name.startsWith(table + "."));
      const kinds = names.map((name) => name.slice(table.length + 1));
      const time_s = this.columns[names[0]];
      return Array.from(time_s, (_, row) => {
        const found = {};
        kinds.forEach((kind, at) => {
          const value = this.columns[names[at]][row];
          found[kind] = MAY_LACK.has(kind) ? (value > MISSING ? value : null) : NUMBERS.has(kind) ? value : this.text(value);
        });
        return found;
      });
    }

    // Where a vehicle was, how it headed (rad), how fast it was (m/s), what energy it had used (J).
    at(v, t) {
      const track = this._tracks[v];
      if (!track.t.length) return { x: NaN, y: NaN, heading: 0, speed: 0, energy: 0 };
      const low = Math.max(0, R.lastAt(track.t, t)), high = Math.min(low + 1, track.t.length - 1);
      const length_s = track.t[high] - track.t[low];
      const share = length_s > 0 ? Math.min(1, Math.max(0, (t - track.t[low]) / length_s)) : 0;
      const between = (values) => values[low] + share * (values[high] - values[low]);
      const turn = track.heading[high] - track.heading[low];
      return {
        x: between(track.x),
        y: between(track.y),
        heading: track.heading[low] + share * Math.atan2(Math.sin(turn), Math.cos(turn)),
        speed: between(track.speed),
        energy: between(track.energy),
      };
    }

    // {t, x, y, heading, speed, energy}: arrays of one length.
    track(v) {
      return this._tracks[v];
    }

    // The spell {kind, from_s, to_s} in which a vehicle is out of the mission at t; null while it is in it.
    outAt(v, t) {
      return this.vehicles[v].out.find((spell) => spell.from_s <= t && t < spell.to_s) || null;
    }

    // [{from_s, to_s, group, role, driving}]: a bar while a role is held, another one while it drives the vehicle.
    bars(v) {
      return this._bars[v];
    }

    // [from, to): the packets whose sending begins from t0 to before t1.
    packetsIn(t0, t1) {
      const before = (t) => R.lastAt(this._starts_s, t) + 1;
      let low = before(t0), high = before(t1);
      while (low > 0 && this._starts_s[low - 1] >= t0) low--;
      while (high > 0 && this._starts_s[high - 1] >= t1) high--;
      return [low, high];
    }

    // Number of the slot in which t lies: that of the last packet, counted on while nobody sends.
    slotAt(t) {
      const p = R.lastAt(this._starts_s, t + EPSILON_S), { slot, start_s } = this._near(p), next = this.packets[p + 1];
      const counted = slot + Math.floor((t - start_s + EPSILON_S) / (this.header.slot_s || 1));
      return next ? Math.min(counted, next.slot - 1) : counted;
    }

    // When a slot opened: when its packet was sent, or counted from the packet before.
    slotStart_s(number) {
      const { slot, start_s } = this._near(R.lastAt(this._slots, number));
      return start_s + (number - slot) * (this.header.slot_s || 1);
    }

    _near(p) {
      return this.packets[Math.max(p, 0)] || { slot: 0, start_s: 0 };
    }
  };

  const NUMBERS = new Set([
    "time_s", "vehicle", "peer", "issuer", "stimulus", "own", "external", "source", "slot", "chosen", "node", "parent",
    "sender", "n",
  ]);
  const MAY_LACK = new Set(["best_mean", "expected_time_s", "p_loss"]), MISSING = -999; // see tables.py

  function tracksOf(run) {
    const rows = run.about.track_rows || run.vehicles.map(() => 0);
    const column = (name) => run.columns["track." + name] || new Float64Array(0);
    let start = 0;
    return rows.map((count) => {
      const part = (name) => column(name).subarray(start, start + count);
      const track = {
        t: part("time"), x: part("x"), y: part("y"),
        heading: part("heading"), speed: part("speed"), energy: part("energy"),
      };
      start += count;
      return track;
    });
  }

  // out: [{kind, from_s, to_s}] while a vehicle is lost, has not joined yet or has no energy.
  function markLost(run) {
    const since = new Map();
    for (const { kind, vehicle, detail, time_s } of run.faults) {
      const of = run.vehicles[vehicle], key = vehicle + kind;
      if (!of || !OUT.has(kind)) continue;
      if (detail !== OVER) {
        since.set(key, { kind, from_s: time_s, to_s: Infinity });
        of.out.push(since.get(key));
      } else if (since.has(key)) since.get(key).to_s = time_s;
    }
  }

  function barsOf(run) {
    const bars = run.vehicles.map(() => []);
    const open = new Map();
    const close = (row, driving, key) => {
      const bar = open.get(key + driving);
      if (!bar) return;
      bar.to_s = row.time_s;
      open.delete(key + driving);
    };
    for (const row of run._rows("roles")) {
      if (!bars[row.vehicle]) continue;
      const key = row.vehicle + "\n" + row.group + "\n" + row.role + "\n";
      if (row.event === "assigned" || row.event === "active") {
        const driving = row.event === "active";
        if (open.has(key + driving)) continue;
        const bar = { from_s: row.time_s, to_s: run.header.end_s, group: row.group, role: row.role, driving };
        bars[row.vehicle].push(bar);
        open.set(key + driving, bar);
      } else {
        close(row, true, key);
        if (row.event === "left") close(row, false, key);
      }
    }
    return bars.map((of, v) => of.flatMap((bar) => (bar.driving ? R.within(bar, run.vehicles[v].out) : [bar])));
  }

  // The parts of a spell {from_s, to_s} that lie outside of others: nothing drives a vehicle that is out of the mission.
  R.within = function (spell, out) {
    return out.reduce((parts, gap) => parts.flatMap((part) => {
      const before = { ...part, to_s: Math.min(part.to_s, gap.from_s) }, after = { ...part, from_s: Math.max(part.from_s, gap.to_s) };
      return gap.to_s <= part.from_s || part.to_s <= gap.from_s ? [part] : [before, after].filter((one) => one.from_s < one.to_s);
    }), [spell]);
  };

  function factsOf(run) {
    const { "facts.subject": subject, "facts.attribute": attribute, "facts.value": value } = run.columns;
    return Array.from(subject, (_, n) => ({
      subject: run.text(subject[n]), attribute: run.text(attribute[n]), value: valueOf(run.text(value[n])),
    }));
  }

  // A point, a number, or else the text.
  function valueOf(text) {
    const point = POINT.exec(text), number = Number(text);
    if (point) return [Number(point[1]), Number(point[2])];
    return text !== "" && Number.isFinite(number) ? number : text;
  }

  function itemsOf(run) {
    const column = (name) => run.columns["items." + name];
    if (!column("origin")) return [];
    const facts = factsOf(run);
    let start = 0;
    return Array.from(column("origin"), (origin, n) => {
      const uid = run.text(column("uid")[n]), end = start + column("facts")[n];
      const item = {
        uid,
        block: uid.replace(PART, "$1"),
        origin,
        time_s: column("time")[n],
        recorded_s: column("time")[n] + column("late")[n],
        kind: run.text(column("kind")[n]),
        facts: facts.slice(start, end),
      };
      start = end;
      return item;
    });
  }

  // The next elements of flat columns, list by list.
  function lists(counts, flat) {
    let start = 0;
    return Array.from(counts, (count) => Array.from(flat.subarray(start, (start += count))));
  }

  function packetsOf(run) {
    const column = (name) => run.columns["packets." + name];
    if (!column("start")) return [];
    const n = column("start").length, width = run.vehicles.length;
    const none = new Float64Array(n), nothing = new Float64Array(0);
    const said = (name) => lists(column(name + ".n") || none, column(name) || nothing);
    const items = said("items"), status = said("status"), signals = signalsOf(run, n);
    const packets = Array.from(column("start"), (start_s, p) => ({
      slot: column("slot")[p],
      start_s,
      end_s: start_s + column("length")[p],
      sender: column("sender")[p],
      size_bits: column("size")[p],
      items: items[p].filter((item) => item >= 0),
      status: status[p].filter((item) => item >= 0),
      to: [],
      signals: signals[p],
    }));
    const ofSender = run.vehicles.map(() => []);
    packets.forEach((packet, p) => ofSender[packet.sender] && ofSender[packet.sender].push(p));
    const delay_s = column("delay"), outcome = column("outcome");
    let next = 0;
    for (const sent of ofSender) {
      for (let v = 0; v < width; v++) {
        for (const p of sent) {
          const became = outcome[p * width + v];
          if (became === HEARD) packets[p].to.push({ v, arrival_s: packets[p].end_s + delay_s[next++] });
          else if (FAILED[became]) packets[p].to.push({ v, arrival_s: null, why: FAILED[became] });
        }
      }
    }
    return packets;
  }

  // One signal of a role has an entry for every role of its group that it addresses: they become one.
  function signalsOf(run, n) {
    const counts = run.columns["packets.signals.n"];
    if (!counts) return Array.from({ length: n }, () => []);
    const { "signals.role": role, "signals.to": to, "signals.value": value } = run.columns;
    let row = 0;
    return Array.from(counts, (count) => {
      const found = new Map();
      for (const end = row + count; row < end; row++) {
        const [group, name] = split(run.text(role[row]));
        const key = role[row];
        if (!found.has(key)) found.set(key, { group, role: name, addressed: [], value: value[row] });
        const addressed = run.text(to[row]);
        if (addressed) found.get(key).addressed.push(split(addressed)[1]);
      }
      return [...found.values()];
    });
  }

  // "Group.Role" as [group, role]; names have no point.
  function split(path) {
    const at = path.indexOf(".");
    return [path.slice(0, at), path.slice(at + 1)];
  }

  // Tables of the mission's own: [{name, total, isEvents, columns: [{name, unit, kind}], rows: [{time_s, vehicle, x, y,
  // values, text}]}]. A row without a place is where its vehicle was; x and y are null where it has none either.
  // Numbers that are missing are null.
  function layersOf(run) {
    return run.about.world.layers.map(({ name, n, total, has_places, columns }) => {
      const column = (of) => run.columns["layer." + name + "." + of];
      const vehicle = column("vehicle"), time_s = column("time");
      const place = (row) => {
        if (has_places) return { x: column("x_m")[row], y: column("y_m")[row] };
        return vehicle[row] >= 0 && run.track(vehicle[row]).t.length ? run.at(vehicle[row], time_s[row]) : { x: null, y: null };
      };
      const rows = Array.from({ length: n }, (_, row) => {
        const values = columns.map((one) => one.values[row]);
        const { x, y } = place(row);
        return { time_s: time_s[row], vehicle: vehicle[row], x, y, values, text: rowText(columns, values) };
      });
      return { name, total, columns, rows, isEvents: n <= MOST_EVENTS_PER_VEHICLE * run.vehicles.length };
    });
  }

  function rowText(columns, values) {
    const text = ({ name, unit, kind }, value) => (kind !== "text" ? `${R.words(name)} ${R.plain(value, unit)}` : value);
    return columns.map((column, n) => (values[n] === null ? "" : text(column, values[n]))).filter(Boolean).join(", ");
  }

  // Names as words.
  R.words = (name) => name.replace(/_/g, " ");

  // A number to four digits with its unit, such as "4.2 degC", a whole one as it is; empty where it is missing.
  R.plain = function (value, unit) {
    if (value === null) return "";
    return (Number.isInteger(value) ? value : Number(value.toPrecision(4))) + (unit && unit !== "1" ? "\u00a0" + unit : "");
  };
})();
