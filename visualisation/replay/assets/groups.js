"use strict";
/* The panel of the organisation: groups below those that supervise them, roles with their holders, vacancies and aims, in
   the view of the selected vehicle, or as every vehicle sees itself. */
(function () {
  const MOST_CHANGES = 8, HEAD = "★ ";

  /** What the panel shows: the same text as long as nothing has changed. */
  R.organisationKey = function (facts, v, time_s) {
    const { run } = facts;
    const away = run.vehicles.map((_, p) => (run.outAt(p, time_s) ? 1 : 0));
    const views = [v < 0 ? [] : run.absent(v, time_s), v < 0 ? [] : R.disagreements(facts, v, time_s)];
    return JSON.stringify([v, run.changeCount(v, time_s), away, views]);
  };

  /** Fills `body`; `go(time_s, vehicle)` jumps. */
  R.showOrganisation = function (body, facts, v, time_s, go) {
    const { run } = facts;
    if (!run.has("organisation")) { body.replaceChildren(R.make("p", "hint", "This run recorded no organisation.")); return; }
    const { groups, reserves } = run.organisation(v, time_s);
    const wrong = v < 0 ? { extra: [], lacking: [] } : run.disagreements(v, time_s);
    const whose = v < 0 ? "own roles of each vehicle" : `view of ${run.vehicles[v].name}`;
    const head = R.make("div", "row");
    head.append(R.make("h2", "", `Organisation, ${whose}`));
    const nodes = [head];
    if (v < 0) nodes.push(R.make("p", "note", "Select a vehicle for its view."));
    for (const group of groups) nodes.push(box(facts, group, wrong, time_s, go));
    if (reserves.length) {
      const line = R.make("p", "seats");
      line.append(R.make("span", "note", "without a role: "));
      for (const one of reserves) line.append(chip(facts, one, "", "", time_s, go));
      nodes.push(line);
    }
    nodes.push(R.make("p", "note", "★ leads the group. Dashed: vacant below the minimum, or absent. ≠: differs from the truth."));
    const changes = run.changes(v, time_s, MOST_CHANGES);
    if (changes.length) nodes.push(R.make("h3", "", "Last changes"), list(changes, v, go));
    body.replaceChildren(...nodes);
  };

  function box(facts, group, wrong, time_s, go) {
    const node = R.make("div", "group");
    node.style.marginLeft = 18 * group.depth + "px";
    const head = R.make("div", "title");
    head.append(R.make("b", "", group.name), R.make("span", "note", group.mission ? `mission ${group.mission}` : ""));
    node.append(head);
    for (const role of group.roles) node.append(...line(facts, group, role, wrong, time_s, go));
    return node;
  }

  /* A role in three cells: name, who plays it, what it is for. */
  function line(facts, group, role, wrong, time_s, go) {
    const look = facts.looks.get(role.name), name = R.make("span", "name");
    name.append(R.make("i", "mark", look ? look.sign : ""), `${role.isHead ? HEAD : ""}${role.name} `, R.make("span", "note", cardinality(role)));
    const seats = R.make("span", "seats");
    const isIn = (list, v) => list.some((one) => one.v === v && one.group === group.name && one.role === role.name);
    for (const { v, isAway } of role.holders) {
      const isWrong = isIn(wrong.extra, v);
      seats.append(chip(facts, v, isWrong ? "≠ " : "", [isAway ? "away" : "", isWrong ? "wrong" : ""].join(" "), time_s, go));
    }
    if (role.vacant) seats.append(R.make("span", "chip vacant", role.vacant === 1 ? "vacant" : `${role.vacant} vacant`));
    const unheard = wrong.lacking.filter((one) => one.group === group.name && one.role === role.name);
    if (unheard.length) seats.append(R.make("span", "wrong", `≠ also ${unheard.map((one) => facts.run.vehicles[one.v].name).join(", ")}`));
    return [name, seats, R.make("span", "aims", role.aims.join(", "))];
  }

  function cardinality({ minimum, maximum }) {
    if (maximum === null) return minimum ? `(≥ ${minimum})` : "";
    return minimum === maximum ? `(${minimum})` : `(${minimum}–${maximum})`;
  }

  function chip(facts, v, mark, name, time_s, go) {
    return R.button(mark + facts.run.vehicles[v].name, () => go(time_s, v), "chip " + name);
  }

  function list(changes, v, go) {
    const items = R.make("ul", "changes");
    for (const { time_s, text, isRefused } of changes) {
      const item = R.make("li", isRefused ? "refused" : "");
      item.append(R.button(R.seconds(time_s, 1), () => go(time_s, v), "link"), " " + text);
      items.append(item);
    }
    return items;
  }
})();
