"use strict";
// How far plans were at any time: the trees of what groups and vehicles planned. Nothing here knows the document.
globalThis.R = globalThis.R || {};

(function () {
  R.recount = function (run) {
    run._plans = run.vehicles.map(() => new Map());
    for (const row of run._rows("plans")) {
      const own = run._plans[row.vehicle];
      if (!own) continue;
      const { vehicle, group, role, objective, argument } = row, key = [group, role, objective, argument].join("\n");
      if (!own.has(key)) own.set(key, { vehicle, group, role, objective, argument, isOfGroup: !role, from_s: row.time_s, nodes: new Map() });
      const { nodes } = own.get(key);
      if (!nodes.has(row.node)) nodes.set(row.node, { node: row.node, parent: row.parent, rows: [] });
      nodes.get(row.node).rows.push(row);
    }
  };

  Object.assign(R.Run.prototype, {
    // Plans that v carries out at t, those of groups first: [{vehicle, group, role, objective, argument, isOfGroup}].
    plansOf(v, t) {
      const begun = [...this._plans[v].values()].filter((plan) => plan.from_s <= t);
      return [...begun.filter((plan) => plan.isOfGroup), ...begun.filter((plan) => !plan.isOfGroup)];
    },

    // The tasks of a plan at t from the top down: [{depth, task, method, status, since_s, expected_s, isMended}]. A task
    // is mended if a failure or a change of facts gave it another method; expected_s is when a running one should end.
    tasksOf(plan, t) {
      const below = new Map(), found = [];
      for (const node of [...plan.nodes.values()].sort((a, b) => a.node - b.node)) {
        if (node.rows[0].time_s > t) continue;
        if (!below.has(node.parent)) below.set(node.parent, []);
        below.get(node.parent).push(node);
      }
      const add = (node, depth) => {
        const rows = node.rows.filter((row) => row.time_s <= t), last = rows[rows.length - 1];
        const methods = new Set(rows.map((row) => row.method).filter(Boolean));
        const from = rows.findIndex((row, n) => rows.slice(n).every((one) => one.status === last.status));
        const isRunning = last.status === "running" && last.expected_time_s !== null && last.expected_time_s > 0;
        found.push({
          depth, task: last.task, method: last.method, status: last.status, since_s: rows[from].time_s,
          expected_s: isRunning ? last.time_s + last.expected_time_s : null, isMended: methods.size > 1,
        });
        for (const one of below.get(node.node) || []) add(one, depth + 1);
      };
      for (const top of below.get(-1) || []) add(top, 0);
      return found;
    },
  });
})();
