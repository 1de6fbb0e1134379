"use strict";
// The organisation at any time: groups, roles, holders, what they are for, and what was asked of it; of one viewer, or
// (viewer -1) as every vehicle sees itself. Nothing here knows the document.
globalThis.R = globalThis.R || {};

(function () {
  const CREATE = "create", DISSOLVE = "dissolve", MISSION = "mission", OBJECTIVE = "objective", REFUSED = "refused";
  const TURNS = new Set([CREATE, DISSOLVE, "succeed"]);

  R.organise = function (run) {
    const rows = run._rows("organisation");
    run.groups = groupsOf(run.about.groups || [], rows);
    run._shared = sharedNames(run);
    run._changes = [-1, ...run.vehicles.keys()].map((viewer) => rows.filter((row) => isOf(row, viewer)));
    run._changed_s = run._changes.map((own) => own.map((row) => row.time_s));
    // Groups formed and dissolved, heads that succeeded: [{time_s, vehicle, text}].
    run.turns = run._changes[0].filter((row) => TURNS.has(row.act) && row.event !== REFUSED)
      .map((row) => ({ time_s: row.time_s, vehicle: row.issuer, text: changeText(run, row) }));
  };

  Object.assign(R.Run.prototype, {
    // {groups: [{name, above, depth, mission, roles: [{name, isHead, minimum, maximum, holders: [{v, isAway}], vacant,
    // aims}]}], reserves: [v]}: the groups that are there at t, each behind the one that supervises it. A holder is away
    // while the viewer takes it for absent, or while it is out of the mission; vacant is how many are lacking.
    organisation(viewer, t) {
      const { missions, aims, isThere } = said(this, viewer, t);
      const held = this.rolesAt(viewer, t), absent = new Set(viewer < 0 ? [] : this.absent(viewer, t));
      const isAway = (v) => (viewer < 0 ? Boolean(this.outAt(v, t)) : absent.has(v));
      const roleOf = (group, role) => {
        const own = held.filter((one) => one.group === group.name && one.role === role.name).map((one) => one.v);
        const holders = own.sort((a, b) => a - b).map((v) => ({ v, isAway: isAway(v) }));
        const present = holders.filter((one) => !one.isAway).length;
        return { ...role, holders, vacant: Math.max(0, role.minimum - present), aims: aims.get(key(group.name, role.name)) || [] };
      };
      const there = this.groups.filter((group) => isThere.get(group.name));
      const groups = ordered(there).map((group) => (
        { ...group, mission: missions.get(group.name) || "", roles: group.roles.map((role) => roleOf(group, role)) }
      ));
      const busy = new Set(held.map((one) => one.v));
      return { groups, reserves: [...this.vehicles.keys()].filter((v) => !busy.has(v)) };
    },

    // A role in a text: its name, or "Group.Role" where several groups have a role of that name.
    roleName(group, role) {
      return this._shared.has(role) ? `${group}.${role}` : role;
    },

    // How many rows of the table there are by t in a view.
    changeCount(viewer, t) {
      return R.lastAt(this._changed_s[viewer + 1], t) + 1;
    },

    // The last rows of the table by t in a view, newest first: [{time_s, text, isRefused}].
    changes(viewer, t, most) {
      const until = this.changeCount(viewer, t);
      const rows = this._changes[viewer + 1].slice(Math.max(0, until - most), until).reverse();
      return rows.map((row) => ({ time_s: row.time_s, text: changeText(this, row), isRefused: row.event === REFUSED }));
    },

    // Who leads a group at t, of those in the mission.
    headsOf(group, t) {
      const roles = group.roles.filter((role) => role.isHead).map((role) => role.name);
      const heads = this.rolesAt(-1, t).filter((one) => one.group === group.name && roles.includes(one.role));
      return heads.map((one) => one.v).filter((v) => !this.outAt(v, t));
    },
  });

  const key = (group, role) => group + "\n" + role;

  // A viewer's own rows; without one what vehicles say of their own roles, what issuers say of what they changed, and
  // every refusal. What was agreed before has no issuer: the first vehicle tells it.
  function isOf(row, viewer) {
    if (viewer >= 0) return row.vehicle === viewer;
    if (row.event === REFUSED) return true;
    if (row.event === "assigned" || row.event === "left") return row.vehicle === row.peer;
    return row.vehicle === (row.issuer >= 0 ? row.issuer : 0);
  }

  function groupsOf(declared, rows) {
    const roleOf = ([name, minimum, maximum, isHead]) => ({ name, minimum, maximum, isHead });
    const groups = new Map(declared.map((one) => (
      [one.name, { name: one.name, above: one.above, isFounded: one.is_founded, roles: one.roles.map(roleOf) }]
    )));
    for (const { group, role } of rows) {
      if (!groups.has(group)) groups.set(group, { name: group, above: "", isFounded: true, roles: [] });
      const { roles } = groups.get(group);
      if (role && !roles.some((one) => one.name === role)) roles.push({ name: role, minimum: 0, maximum: null, isHead: false });
    }
    return [...groups.values()];
  }

  // Names of roles that several groups have, declared or held.
  function sharedNames(run) {
    const first = new Map(), shared = new Set();
    const add = (group, role) => {
      if (!first.has(role)) first.set(role, group);
      else if (first.get(role) !== group) shared.add(role);
    };
    for (const { name, roles } of run.groups) for (const role of roles) add(name, role.name);
    run.vehicles.forEach((_, v) => run.bars(v).forEach((bar) => add(bar.group, bar.role)));
    return shared;
  }

  // What rows by t say beside holders: missions by group, objectives by group and role, and which groups are there.
  function said(run, viewer, t) {
    const missions = new Map(), given = new Map(), isThere = new Map();
    const rows = run._changes[viewer + 1], formed = new Set();
    for (const { act, event, group } of rows) if (act === CREATE && event !== REFUSED) formed.add(group);
    for (const group of run.groups) isThere.set(group.name, group.isFounded && !firstIs(rows, group.name, CREATE, formed));
    for (const row of rows.slice(0, run.changeCount(viewer, t))) {
      if (row.event === REFUSED) continue;
      if (row.act === CREATE || row.act === DISSOLVE) isThere.set(row.group, row.act === CREATE);
      if (row.act === MISSION) missions.set(row.group, row.argument);
      if (row.act === OBJECTIVE) {
        const of = key(row.group, row.role);
        if (!given.has(of)) given.set(of, new Map());
        given.get(of).set(row.objective, row.argument);
      }
    }
    const texts = (of) => [...of].map(([objective, argument]) => (argument ? `${objective}(${argument})` : objective));
    return { missions, aims: new Map([...given].map(([of, objectives]) => [of, texts(objectives)])), isThere };
  }

  // True if the first act on the being of a group is of that kind.
  function firstIs(rows, group, act, formed) {
    if (!formed.has(group)) return false;
    const first = rows.find((row) => row.group === group && row.event !== REFUSED && (row.act === CREATE || row.act === DISSOLVE));
    return first.act === act;
  }

  // Groups each behind the one above it, with their depths.
  function ordered(groups) {
    const names = new Set(groups.map((group) => group.name)), found = [];
    const add = (group, depth) => {
      if (found.some((one) => one.name === group.name)) return;
      found.push({ ...group, depth });
      for (const below of groups) if (below.above === group.name) add(below, depth + 1);
    };
    for (const group of groups) if (!names.has(group.above)) add(group, 0);
    return found;
  }

  // A row in words.
  function changeText(run, { issuer, act, event, peer, group, role, objective, argument, outcome }) {
    const name = (v) => (run.vehicles[v] ? run.vehicles[v].name : ""), by = name(issuer);
    const of = role ? `${role} of ${group}` : group;
    const words = {
      objective: `${objective}${argument ? `(${argument})` : ""} for ${of}`,
      mission: `mission ${argument} for ${of}`,
      create: `${group} is formed under ${name(peer)}`,
      dissolve: `${group} is dissolved`,
      succeed: `${name(peer)} succeeds as ${of}`,
    };
    const what = words[act] || `${name(peer)} ${event === "left" || act === "release" ? "no longer" : "as"} ${of}`;
    const whose = by ? `, by ${by}` : ", agreed before";
    return event === REFUSED ? `refused: ${what}${whose}: ${outcome}` : what + whose;
  }
})();
