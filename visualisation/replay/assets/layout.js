"use strict";
/* The parts of the page around the views: facts of the run, controls, legend, help. */
(function () {
  const MOST_APART = 6;

  /** Scenario, strategy, policy, loss, seed, version and verdict in one line; of two runs also wherein they differ. */
  R.factsLine = function (run, runs = [run]) {
    const { header } = run;
    const line = R.make("header", "facts");
    line.append(R.make("h1", "", header.scenario));
    const facts = [["strategy", header.strategy], ["policy", header.policy], ["channel", channelText(header)], ["seed", header.seed]];
    /* Side by side there is room for what differs only: the version is among it if it does. */
    if (runs.length === 1) facts.push(["version", header.version]);
    for (const [name, value] of facts) {
      const fact = R.make("span", "fact");
      fact.append(R.make("b", "", name), " " + value);
      line.append(fact);
    }
    if (runs.length > 1) line.append(apartLine(run, runs));
    const [look, mark] = header.is_underway ? ["", "… "] : header.completed ? ["good", "✓ "] : ["bad", "✕ "];
    line.append(R.make("span", "verdict " + look, mark + header.verdict));
    return line;
  };

  /* Settings of this run that the other one has not, each as one would give it to --set. */
  function apartLine(run, runs) {
    const apart = R.settingsApart(runs[0], runs[1]).map(([key, ...values]) => `${key} ${values[runs.indexOf(run)]}`);
    const shown = apart.slice(0, MOST_APART), more = apart.length - shown.length;
    const text = shown.length ? shown.join(" · ") + (more ? ` · and ${more} more` : "") : "nothing: same settings, same seed";
    const line = R.make("span", "apart");
    line.append(R.make("b", "", "Differs in"), " " + text);
    line.title = apart.join("\n");
    return line;
  }

  /* Not every channel has one rate of loss. */
  const channelText = ({ channel, per }) => (per === null || per === undefined ? channel : `${channel}, loss ${per}`);

  R.factsText = function ({ header }) {
    return [`scenario ${header.scenario}`, `strategy ${header.strategy}`, `policy ${header.policy}`, `channel ${channelText(header)}`,
            `seed ${header.seed}`, `version ${header.version}`, `run ${header.run_id}`, header.verdict].join(", ");
  };

  /** The line of controls; `app` acts. */
  R.Controls = class {
    constructor(app, parent) {
      this.app = app;
      this.root = R.make("div", "controls");
      const add = (text, title, action, name = "") => {
        const button = R.button(text, action, name);
        button.title = title;
        button.setAttribute("aria-label", title);
        this.root.append(button);
        return button;
      };
      add("|◂", "To the start (Home)", () => app.clock.seek(0));
      add("◂", "Step back (←)", () => app.clock.step(-1));
      this.play = add("▶ Play", "Play or pause (Space)", () => app.clock.toggle(), "play");
      add("▸", "Step ahead (→)", () => app.clock.step(1));
      this.pace = R.make("select");
      this.pace.setAttribute("aria-label", "Pace");
      for (const [value, name] of R.PACES) this.pace.append(new Option(name, value));
      this.pace.addEventListener("change", () => app.setPace(this.pace.value));
      this.scrub = R.make("input", "scrub");
      Object.assign(this.scrub, { type: "range", min: 0, max: app.clock.end_s, step: "any" });
      this.scrub.setAttribute("aria-label", "Time of the mission in seconds");
      this.scrub.addEventListener("input", () => app.clock.seek(Number(this.scrub.value)));
      this.now = R.make("output", "now");
      this.root.append(this.pace, this.scrub, this.now);
      add("−", "Show more time in the lanes (−)", () => app.zoomLanes(2));
      add("+", "Show less time in the lanes (+)", () => app.zoomLanes(0.5));
      add("whole run", "Show the whole run in the lanes (F)", () => app.zoomLanes(Infinity));
      if (app.views.length > 1) add("first divergence", "Jump to the first divergence of the runs (J)", () => app.toDivergence(), "jump");
      add("link", "Copy a link to this moment (L)", () => app.copyLink());
      add("SVG", "Save this view as SVG (S)", () => app.saveSvg());
      this.clip = add("● clip", "Record a clip as video (V)", () => app.toggleClip());
      add("◐", "Light or dark (D)", () => app.toggleTheme());
      add("?", "Help (?)", () => app.toggleHelp());
      parent.append(this.root);
    }

    update() {
      const { clock } = this.app;
      this.play.textContent = clock.following ? "❚❚ Hold" : clock.playing ? "❚❚ Pause" : "▶ Play";
      if (this.pace.value !== clock.pace) this.pace.value = clock.pace;
      this.scrub.value = clock.t;
      const slot = this.app.hasPackets ? ` · slot ${clock.slot}` : "";
      this.now.textContent = R.seconds(clock.t, 1) + slot;
    }
  };

  /** Symbols of the map in a line below it; `marks` of the mission's own tables in a second one, `ends` are what
      links come to beside being heard and lost. */
  R.drawLegend = function (pen, w, h, height, mind, marks, ends, isCrowded) {
    let y = h - height + (marks.length ? height / 4 : height / 2);
    pen.fillStyle = R.theme.panel;
    pen.fillRect(0, h - height, w, height);
    pen.font = R.FONT;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    let x = 8;
    const entry = (text, width, draw) => {
      const all = width + 6 + pen.measureText(text).width;
      if (x + all > w - 4) return;
      draw(x);
      pen.fillStyle = R.theme.ink;
      pen.fillText(text, x + width + 6, y);
      x += all + 12;
    };
    if (mind) {
      entry("last received", 12, (left) => { pen.lineWidth = 1.6; R.drawGlyph(pen, left + 6, y, 0, 0, 5, null, R.theme.ink); });
      entry(isCrowded ? "may be: point at one" : "may be", 14, (left) => {
        pen.beginPath();
        pen.arc(left + 7, y, 6, 0, 2 * Math.PI);
        pen.globalAlpha = 0.15; pen.fillStyle = R.theme.ink; pen.fill();
        pen.globalAlpha = 1; pen.strokeStyle = R.theme.ink; pen.lineWidth = 1; pen.stroke();
      });
      entry("unheard", 14, (left) => {
        pen.fillStyle = R.theme.done;
        pen.fillRect(left, y - 6, 14, 12);
        pen.strokeStyle = R.theme.belief;
        pen.lineWidth = 1.2;
        R.hatch(pen, left, y - 6, 14, 12, 5);
      });
    }
    entry("done", 14, (left) => { pen.fillStyle = R.theme.done; pen.fillRect(left, y - 6, 14, 12); });
    entry("heard", 20, (left) => R.drawLink(pen, [left, y], [left + 20, y], true));
    entry("lost", 28, (left) => R.drawLink(pen, [left, y], [left + 34, y], false));
    for (const why of ends) entry(why, 28, (left) => R.drawLink(pen, [left, y], [left + 34, y], false, true, why));
    [x, y] = [8, y + height / 2];
    for (const mark of marks) entry(mark.text, 12, (left) => mark.draw(pen, left, y));
  };

  R.KEYS = [
    ["Space", "play or pause"], ["← →", "one step: a slot, or a frame, as the pace says"], [", .", "one slot back or ahead"],
    ["Shift ← →", "60 s back or ahead"], ["Home End", "start, end"], ["[ ]", "event before or after (of the selected vehicle)"],
    ["1 … 9, 0", "select a vehicle; none"], ["↑ ↓", "vehicle above or below"], ["+ − F", "lanes: less time, more time, whole run"],
    ["K M X C", "Knowledge, Minds, Matrix, Cost"],
    ["O P W E T", "Organisation, Plans, Why, Events, Tables"], ["J", "first divergence of two runs"], ["D", "light or dark"],
    ["S", "save the view as SVG"], ["V", "start or end a clip as video"], ["L", "copy a link to this moment"], ["? Esc", "this help; close it"],
  ];
  const MEANINGS = [
    "A colour is a vehicle, as in the figures; a mark is a role, on the icon of the vehicle that it drives and all over its bar.",
    "Lanes: the labelled bar is the active role; thin rows below are roles it holds; a small triangle marks a decision: click it for the reasons.",
    "Strip below: a full tick upwards is a packet received, a hollow one upwards one that was refused; a hollow tick downwards one lost, a full one downwards one that collided; a dot one sent. Zoomed out: shares. Hatched: a reception gap, every packet lost for three frames or more.",
    "Arrows between lanes: influence signals, in the colour of their sender, from the sender's slot to the decision they changed; zoomed in, every signal received.",
    "Map: a full line is a packet received, a broken line with a cross one lost, with a ring around the cross one that collided, with a square one that was refused; where many fade at once, of the older ones the crosses stay. By slot, rings are the sound in the water. Diamonds and dots: rows of the mission's own tables (see Tables); squares: finds.",
    "With a vehicle selected, its beliefs are hollow: symbols at the last received positions of its peers, discs where they may be (of more than eight vehicles that of the one you point at), dotted lines to where they are, hatching for work unknown to it, ≠ for wrong roles.",
    "Organisation: roles and their holders, in the view of a selected vehicle; ≠ differs from the truth. Plans: ↻ is a branch repaired with another method. Why: ◆ is the mean of the best combination with a candidate; the highest is performed.",
    "Wheel: zoom. Drag: move. Double click: whole map, whole run. Lanes of alike vehicles fold; click one to open it.",
  ];

  R.makeHelp = function (parent, close) {
    const help = R.make("dialog", "help");
    help.append(R.make("h2", "", "How to read this page"));
    for (const text of MEANINGS) help.append(R.make("p", "", text));
    help.append(R.make("h2", "", "Keys"));
    const list = R.make("dl");
    for (const [key, text] of R.KEYS) list.append(R.make("dt", "", key), R.make("dd", "", text));
    help.append(list, R.button("Close", close));
    parent.append(help);
    return help;
  };
})();
