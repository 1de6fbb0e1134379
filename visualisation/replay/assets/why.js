"use strict";
/* Why a vehicle chose what it did: its causes in words, and the candidates with their motivations as bars. */
(function () {
  /** The decision of `v` that holds at a time: the last one at or before it, or the first. */
  R.decisionAt = function (facts, v, time_s) {
    const all = facts.decisions[v];
    let at = 0;
    while (at + 1 < all.length && all[at + 1].time_s <= time_s) at += 1;
    return all.length ? { number: at, decision: all[at], all } : null;
  };

  /** Fills `body` with the panel; `go(time_s, vehicle)` jumps. */
  R.showWhy = function (body, facts, v, time_s, go) {
    const { run } = facts;
    const found = v >= 0 ? R.decisionAt(facts, v, time_s) : null;
    if (!found) {
      const text = v < 0 ? "Select a vehicle: click its lane or its symbol, or press its number." :
        `This run recorded no decisions of ${run.vehicles[v].name}.`;
      body.replaceChildren(R.make("p", "hint", text));
      return;
    }
    const { decision, all } = found;
    const changes = all.filter((one) => one.changed);
    const before = [...changes].reverse().find((one) => one.time_s < decision.time_s);
    const after = changes.find((one) => one.time_s > decision.time_s);
    const head = R.make("div", "row");
    head.append(
      R.make("h2", "", `${run.vehicles[v].name} at ${R.seconds(decision.time_s)}: ${R.choiceText(decision)}`),
      R.button("◂ change before", before ? () => go(before.time_s, v) : null),
      R.button("change after ▸", after ? () => go(after.time_s, v) : null));
    const nodes = [head, causesOf(run, v, Math.max(time_s, decision.time_s), go)];
    nodes.push(R.make("h3", "", "Candidates of the decision"), bars(facts, decision, go), keyOfBars());
    body.replaceChildren(...nodes);
  };

  R.choiceText = function (decision) {
    const chosen = decision.candidates.filter((c) => c.chosen);
    const named = chosen.filter((c) => c.role).map((c) => c.label);
    return named.length ? named.join(", ") : chosen.length ? chosen.map((c) => c.label).join(", ") : "nothing chosen";
  };

  const signed = (x) => (x < 0 ? "−" : "") + Math.abs(x).toFixed(2);

  function bars(facts, decision, go) {
    const rows = [...decision.candidates].sort((a, b) => b.chosen - a.chosen || b.motivation - a.motivation);
    const most = Math.max(0.01, ...rows.flatMap((c) => [Math.abs(c.own) + Math.abs(c.external), Math.abs(c.stimulus), Math.abs(c.motivation), c.bestMean || 0]));
    const least = Math.min(0, ...rows.flatMap((c) => [c.own, c.external, c.own + c.external, c.bestMean || 0]));
    const table = R.make("div", "bars");
    for (const candidate of rows) {
      const row = R.make("div", "bar" + (candidate.chosen ? " chosen" : ""));
      const name = R.make("span", "name", (candidate.chosen ? "● " : "○ ") + candidate.label);
      name.title = [candidate.group, candidate.role, candidate.objective, candidate.argument].filter(Boolean).join(", ");
      row.append(name, track(candidate, least, most), R.make("span", "number", signed(candidate.motivation)));
      if (candidate.source >= 0 && candidate.external) {
        row.append(R.button(`${facts.run.vehicles[candidate.source].name}, slot ${candidate.slot}`,
                            () => go(R.slotStart(facts, candidate.slot, decision.time_s), candidate.source), "link"));
      }
      table.append(row);
    }
    return table;
  }

  /* Own part from zero, external part from its end; both may be negative. The stimulus is a mark. */
  function track(candidate, least, most) {
    const box = R.make("span", "track");
    const at = (x) => 100 * (x - least) / Math.max(most - least, 0.01);
    const part = (name, from, to) => {
      const bar = R.make("i", name);
      bar.style.left = Math.min(at(from), at(to)) + "%";
      bar.style.width = Math.abs(at(to) - at(from)) + "%";
      box.append(bar);
    };
    part("zero", 0, 0);
    part("own", 0, candidate.own);
    part("external", candidate.own, candidate.own + candidate.external);
    part("stimulus", candidate.stimulus, candidate.stimulus);
    if (candidate.bestMean !== null) {
      const mark = R.make("i", "mean", "◆");
      mark.style.left = at(candidate.bestMean) + "%";
      box.append(mark);
    }
    return box;
  }

  function keyOfBars() {
    const key = R.make("p", "note key");
    for (const [name, text] of [["own", "its own motivation"], ["external", "due to a peer's signal"], ["stimulus", "stimulus now"]]) {
      key.append(R.make("i", name), R.make("span", "", text));
    }
    key.append(R.make("span", "", "◆ mean of the best combination with it  ● chosen  ○ not chosen"));
    return key;
  }

  function causesOf(run, v, time_s, go) {
    const list = R.make("ol", "chain");
    run.why(v, time_s).forEach((link) => {
      const item = R.make("li");
      item.append(R.button(link.text, () => go(link.time_s, link.vehicle), "link"));
      list.append(item);
    });
    return list;
  }
})();
