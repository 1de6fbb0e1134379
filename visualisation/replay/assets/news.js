"use strict";
/* What one vehicle knows, in words and numbers: of every peer how old its news is, how far off the place, which roles it
   has wrong, what it lacks; and its spells of silence. */
(function () {
  const MOST_SPELLS = 6, MOST_NAMES = 8, MOST_PLACES = 4;

  R.showNews = function (body, facts, v, time_s, go) {
    if (v < 0) { body.replaceChildren(...overview(facts, time_s, go)); return; }
    const { run } = facts;
    const mind = run.mind(v, time_s);
    const wrong = new Map(R.disagreements(facts, v, time_s).map((entry) => [entry.peer, entry]));
    const head = R.make("div", "row");
    head.append(R.make("h2", "", `Knowledge of ${run.vehicles[v].name} at ${R.seconds(time_s)}`));
    body.replaceChildren(head, R.make("p", "", summary(facts, v, mind, wrong, time_s)), silenceLine(facts, v, go),
                         table(facts, v, mind, wrong, time_s));
  };

  function summary(facts, v, mind, wrong, time_s) {
    const done = doneCells(facts, time_s), unheard = R.unheardTiles(facts, mind, time_s);
    const parts = [], out = facts.run.outAt(v, time_s);
    if (out) parts.push(`It is out of the mission: ${outText(out)}.`);
    parts.push(...knownJobs(facts, v, time_s));
    if (done) parts.push(unheard.length ? `Of ${R.plural(done, "square")} done ${unheard.length} are unknown to it: ${byPlace(facts, unheard)} (hatched on the map).` : `It knows ${all(done, "square")} done.`);
    if (facts.n > 1) parts.push(wrong.size ? `Its view of roles is wrong for ${wrong.size} of ${R.plural(facts.n - 1, "peer")}.` : "Its view of the roles of all peers is right.");
    const age_s = facts.run.matrix(time_s).age_s[v];
    const oldest = age_s.reduce((worst, age, peer) => (peer !== v && (worst < 0 || age > age_s[worst]) ? peer : worst), -1);
    if (oldest >= 0) {
      const name = facts.run.vehicles[oldest].name;
      parts.push(Number.isFinite(age_s[oldest]) ? `Its oldest information is on ${name}: ${R.seconds(age_s[oldest])}.` : `It has no information on ${name}.`);
    }
    return parts.join(" ");
  }

  const all = (count, noun) => (count === 1 ? `the one ${noun}` : `all ${R.plural(count, noun)}`);

  /* "5 in left, 3 in middle". */
  function byPlace({ run }, tiles) {
    const count = new Map();
    for (const tile of tiles) count.set(run.tiles.place[tile], (count.get(run.tiles.place[tile]) || 0) + 1);
    const places = [...count].sort((a, b) => b[1] - a[1]);
    const most = places.slice(0, MOST_PLACES).map(([place, n]) => `${n} in ${run.world.places[place].name}`);
    return most.join(", ") + (places.length > MOST_PLACES ? ", others elsewhere" : "");
  }

  const listed = (jobs) => jobs.slice(0, MOST_NAMES).map((job) => job.name).join(", ") + (jobs.length > MOST_NAMES ? " and more" : "");

  /* Which jobs are done without its knowing. */
  function knownJobs(facts, v, time_s) {
    const done = facts.run.jobs.filter((job) => job.done_s !== null && job.done_s <= time_s);
    const unheard = done.filter((job) => job.known_s[v] > time_s);
    if (!done.length) return [];
    return [unheard.length ? `Of ${R.plural(done.length, "job")} done ${unheard.length} are unknown to it: ${listed(unheard)}.` : `It knows ${all(done.length, "job")} done.`];
  }

  /* How it stands with the jobs in truth; of one that nobody has found the record has the name alone. */
  function jobsLine(facts, time_s) {
    const { jobs } = facts.run, isLast = time_s >= facts.end_s;
    if (!jobs.length) return [];
    const done = jobs.filter((job) => job.done_s !== null && job.done_s <= time_s);
    const hidden = jobs.filter((job) => job.cameUp_s > time_s), open = jobs.length - done.length - hidden.length;
    const parts = [`Of ${R.plural(jobs.length, "job")} ${done.length} ${done.length === 1 ? "is" : "are"} done`, open ? `${open} known and not done` : "",
                   hidden.length ? `${hidden.length} ${isLast ? "never found" : "not found yet"}: ${listed(hidden)}` : ""].filter(Boolean);
    const where = hidden.some((job) => job.cameUp_s === Infinity) ? " Positions of jobs that no vehicle finds are not recorded." : "";
    return [R.make("p", "", parts.join(", ") + "." + where)];
  }

  function doneCells(facts, time_s) {
    return facts.run.tiles.done_s.reduce((count, done_s) => count + (done_s <= time_s ? 1 : 0), 0);
  }

  function silenceLine(facts, v, go) {
    const line = R.make("p", "spells");
    const spells = [...facts.silences[v]].sort((a, b) => (b.to_s - b.from_s) - (a.to_s - a.from_s));
    line.append(R.make("span", "", spells.length ? `Reception gaps: ${spells.length}, ${R.seconds(facts.deaf_s(v))} in total, longest first: ` : "It had no reception gap of three frames or more."));
    for (const [n, spell] of spells.slice(0, MOST_SPELLS).entries()) {
      line.append(n ? "; " : "", R.button(`${R.seconds(spell.to_s - spell.from_s)} from ${R.seconds(spell.from_s)}`, () => go(spell.from_s, v), "link"));
    }
    return line;
  }

  function table(facts, v, mind, wrong, time_s) {
    const { run } = facts;
    const { age_s, lacking } = run.matrix(time_s);
    const ghosts = new Map(mind.peers.map((peer) => [peer.v, peer]));
    const rolesOf = (peer) => mind.roles.filter((one) => one.v === peer).map((one) => run.roleName(one.group, one.role)).join(", ") || "none";
    const rows = run.vehicles.map((_, peer) => peer).filter((peer) => peer !== v).map((peer) => {
      const so = run.at(peer, time_s), ghost = ghosts.get(peer);
      const off_m = ghost ? Math.hypot(so.x - ghost.x, so.y - ghost.y) : null;
      return [[run.vehicles[peer].name], [Number.isFinite(age_s[v][peer]) ? R.seconds(age_s[v][peer]) : "never received"],
              [ghost ? `${Math.round(off_m)} m (sent ${R.seconds(time_s - ghost.since_s)} ago)` : "unknown"],
              [String(lacking[v][peer])], [mind.absent.includes(peer) ? "declared absent" : rolesOf(peer)],
              run.outAt(peer, time_s) ? [outText(run.outAt(peer, time_s))] : mistake(wrong.get(peer))];
    });
    return R.table(["peer", "age of information", "position error", "missing items", "believed roles", "true roles"], rows);
  }

  /* Why a vehicle is out of the mission: "lost since 600 s". */
  function outText({ kind, from_s, to_s }) {
    return kind === "joins" ? `joins at ${R.seconds(to_s)}` : `${kind === "energy" ? "without energy" : R.words(kind)} since ${R.seconds(from_s)}`;
  }

  function mistake(entry) {
    if (!entry) return ["✓\u00a0agrees"];
    const parts = [];
    if (entry.extra.length) parts.push("no longer " + entry.extra.join(", "));
    if (entry.missing.length) parts.push("also " + entry.missing.join(", "));
    return ["≠ " + parts.join("; "), "wrong"];
  }

  /* Without a selected vehicle: how well each one is informed. */
  function overview(facts, time_s, go) {
    const { run } = facts;
    const rows = run.vehicles.map((vehicle, v) => {
      const mind = run.mind(v, time_s), spell = facts.longestSilence(v), share = facts.heardShare(v);
      const wrong = R.disagreements(facts, v, time_s).length, times = facts.silences[v].length;
      const bar = facts.drivingAt(v, time_s), out = run.outAt(v, time_s);
      return [[vehicle.name, "", () => go(time_s, v)], [out ? outText(out) : bar ? bar.text : "waits"], [share === null ? "nothing sent" : `${Math.round(100 * share)} %`],
              [spell ? `${R.seconds(spell.to_s - spell.from_s)} from ${R.seconds(spell.from_s)}` : "none", "", spell ? () => go(spell.from_s, v) : null],
              [times ? `${R.seconds(facts.deaf_s(v))}, ${times} ${times === 1 ? "time" : "times"}` : "never"],
              [wrong ? `≠ ${wrong}` : "✓ none", wrong ? "wrong" : ""], [String(R.unheardTiles(facts, mind, time_s).length)]];
    });
    return [R.make("h2", "", `The fleet at ${R.seconds(time_s)}`), R.make("p", "", "Select a vehicle to compare its knowledge with the truth. Receptions and reception gaps are of the whole run."), ...jobsLine(facts, time_s),
            R.table(["vehicle", "active role", "heard", "longest gap", "gaps in total", "wrong peer roles", "unknown squares"], rows)];
  }

  /** The list of what happened, of one vehicle and of groups, or of all. */
  R.showEvents = function (body, facts, v, time_s, go) {
    const { run } = facts;
    const shown = run.events.filter((event) => v < 0 || event.vehicle === v || event.vehicle < 0);
    const rows = shown.map((event) => [
      [R.seconds(event.time_s, 1), "", () => go(event.time_s, event.vehicle < 0 ? v : event.vehicle)],
      [event.vehicle < 0 ? "" : run.vehicles[event.vehicle].name], [event.kind], [event.text]]);
    const name = v < 0 ? "Events" : `Events of ${run.vehicles[v].name} and of groups`;
    const table = R.table(["time", "vehicle", "kind", "what"], rows);
    const at = shown.findIndex((event) => event.time_s > time_s + 1e-6);
    const now = table.rows[at < 0 ? shown.length : at];
    if (now) now.classList.add("now");
    const keep = body.dataset.shows === "events" + v ? body.scrollTop : null;
    body.replaceChildren(R.make("h2", "", name), table);
    body.dataset.shows = "events" + v;
    if (keep !== null) body.scrollTop = keep; else if (now) now.scrollIntoView({ block: "center" });
  };
})();
