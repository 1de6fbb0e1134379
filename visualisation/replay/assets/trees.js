"use strict";
/* The panel of plans: trees of tasks with their status, of the heads of groups and of the selected vehicle. */
(function () {
  const GLYPHS = { waiting: "○", running: "▶", done: "✓", failed: "✕", dropped: "⊘" };
  const WORDS = { waiting: "planned" };

  /** Plans that are shown: those of the vehicle, then those of its groups that others lead; without one those of all groups. */
  R.plansShown = function (facts, v, time_s) {
    const { run } = facts;
    const roles = v < 0 ? [] : run.rolesAt(-1, time_s).filter((one) => one.v === v).map((one) => one.group);
    const groups = run.groups.filter((group) => v < 0 || roles.includes(group.name));
    const ofHeads = groups.flatMap((group) => run.headsOf(group, time_s).flatMap((head) => (
      head === v ? [] : run.plansOf(head, time_s).filter((plan) => plan.isOfGroup && plan.group === group.name)
    )));
    const own = v < 0 ? [] : run.plansOf(v, time_s);
    return [...own, ...ofHeads].map((plan) => ({ ...plan, tasks: run.tasksOf(plan, time_s) }));
  };

  /** Fills `body`; `go(time_s, vehicle)` jumps. */
  R.showPlans = function (body, facts, v, shown, go, time_s) {
    const { run } = facts;
    if (!run.has("plans")) { body.replaceChildren(R.make("p", "hint", "This run recorded no plans.")); return; }
    const title = v < 0 ? "Plans of group leaders" : `Plans of ${run.vehicles[v].name}, and of the leaders of its groups`;
    const head = R.make("div", "row"), nodes = [head];
    head.append(R.make("h2", "", title));
    if (!shown.length) nodes.push(R.make("p", "hint", "Nothing is planned."));
    for (const plan of shown) {
      const what = plan.isOfGroup ? `for ${plan.group}` : `as ${plan.role} of ${plan.group}: ${plan.objective}(${plan.argument})`;
      nodes.push(R.make("h3", "", `${run.vehicles[plan.vehicle].name} ${what}`), tree(plan, go, time_s));
    }
    const key = Object.entries(GLYPHS).map(([status, glyph]) => `${glyph} ${WORDS[status] || status}`);
    nodes.push(R.make("p", "note", [...key, "↻ repaired with another method"].join("   ")));
    body.replaceChildren(...nodes);
  };

  /* When a task should end; a time that is past says that the estimate was wrong. */
  function endNote(expected_s, time_s) {
    const late_s = Math.floor(time_s - expected_s);
    if (late_s < 1) return R.make("span", "note", `expected to end at ${R.seconds(expected_s)}`);
    return R.make("span", "note overdue", `overdue since ${R.seconds(expected_s)}`);
  }

  function tree(plan, go, time_s) {
    const list = R.make("ul", "tree");
    for (const { depth, task, method, status, since_s, expected_s, isMended } of plan.tasks) {
      const item = R.make("li", status);
      item.style.paddingLeft = 16 * depth + "px";
      const glyph = R.make("span", "glyph", GLYPHS[status] || "?");
      glyph.title = WORDS[status] || status;
      item.append(glyph, R.make("span", "task", depth ? task.replace(`(${plan.group}, `, "(").replace(`(${plan.group})`, "") : task));
      if (method) item.append(R.make("span", "note", `${isMended ? "↻ " : ""}${method}`));
      const when = `${status === "running" || status === "waiting" ? "since" : "at"} ${R.seconds(since_s)}`;
      item.append(R.button(when, () => go(since_s, plan.vehicle), "link"));
      if (expected_s !== null) item.append(endNote(expected_s, time_s));
      list.append(item);
    }
    return list;
  }
})();
