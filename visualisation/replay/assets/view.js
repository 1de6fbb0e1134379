"use strict";
/* The view of one run: header, map, panel, lanes. The app holds the clock and the selection, which two views share. */
(function () {
  const PANEL_EVERY_MS = 200, LEGEND_PX = 22, NEAR_PX = 7, LEAST_SPAN_S = 4, STACKED_PX = 1000;
  R.TABS = [["news", "Knowledge"], ["minds", "Minds"], ["matrix", "Matrix"], ["cost", "Cost"], ["organisation", "Organisation"],
            ["plans", "Plans"], ["why", "Why"], ["events", "Events"], ["tables", "Tables"]];

  R.View = class {
    constructor(app, run, parent, hasCompany) {
      Object.assign(this, { app, run, hasCompany, facts: new R.Facts(run, R.roleLooks(app.runs)) });
      this.narrow = this.isNarrow;
      this.tab = this.narrow ? "map" : "news";
      this.window = [0, Math.max(run.header.end_s, LEAST_SPAN_S)];
      this.open = new Set();
      this.zoom = null;
      this.ground = new R.Ground();
      this.panelAt_ms = this.tableAt = 0;
      this.build(parent);
      R.listenMap(this);
      R.listenLanes(this);
    }

    /** Where there is no room for map and panel side by side the map is one of the panels. */
    get isNarrow() { return this.hasCompany || innerWidth < STACKED_PX; }

    get selected() { return this.run.vehicles.findIndex((vehicle) => vehicle.name === this.app.selected); }

    /** Shows a run that has grown. */
    take(run) {
      const end_s = Math.max(run.header.end_s, LEAST_SPAN_S);
      const isWhole = this.window[0] === 0 && this.window[1] >= this.run.header.end_s;
      Object.assign(this, { run, facts: new R.Facts(run), laneKey: "", laidFor: "" });
      this.ground.key = ""; // drawn anew
      if (isWhole || this.window[1] > end_s) this.window = [0, end_s];
      this.body.dataset.shows = "";
      this.root.firstChild.replaceWith(R.factsLine(run));
    }

    build(parent) {
      this.root = R.make("section", "view" + (this.narrow ? " narrow" : ""));
      this.root.append(R.factsLine(this.run, this.app.runs));
      for (const what of this.run.missing || []) this.root.append(R.make("p", "missing", `Not recorded: ${what}.`));
      this.top = R.make("div", "top");
      this.mapBox = R.make("div", "map");
      this.panel = R.make("div", "panel");
      this.tabs = R.make("nav", "tabs");
      this.tabs.setAttribute("role", "tablist");
      this.body = R.make("div", "body");
      this.panel.append(this.tabs, this.body);
      this.top.append(this.mapBox, this.panel);
      this.splitter = R.make("div", "splitter");
      this.lanesBox = R.make("div", "lanes");
      this.lanesInner = R.make("div", "inner");
      this.lanesBox.append(this.lanesInner);
      this.root.append(this.top, this.splitter, this.lanesBox);
      parent.append(this.root);
      this.map = new R.Sheet(this.mapBox, "Map of the mission", (pen, w, h) => this.drawMap(pen, w, h));
      this.laneBase = new R.Sheet(this.lanesInner, "Lanes of the vehicles over time", (pen, w, h) => this.drawLanes(pen, w, h));
      this.laneNow = new R.Sheet(this.lanesInner, "", (pen, w, h) => this.drawNow(pen, w, h));
      this.laneNow.canvas.classList.add("over");
      this.laneNow.canvas.setAttribute("aria-hidden", "true");
      this.spacer = R.make("div", "spacer");
      this.lanesBox.append(this.spacer);
      this.lanesBox.addEventListener("scroll", () => this.paintLanes());
      this.makeTabs();
    }

    makeTabs() {
      const own = R.TABS.filter(([key]) => key !== "tables" || this.run.layers.length);
      const tabs = this.narrow ? [["map", "Map"], ...own] : own;
      this.tabs.replaceChildren(...tabs.map(([key, name]) => {
        const button = R.button(name, () => this.showTab(key));
        button.dataset.tab = key;
        button.setAttribute("role", "tab");
        return button;
      }));
      this.showTab(this.tab);
    }

    showTab(tab) {
      if (tab === "tables" && !this.run.layers.length) return;
      this.tab = tab;
      this.body.dataset.shows = "";
      this.body.className = "body " + tab;
      for (const button of this.tabs.children) button.setAttribute("aria-selected", String(button.dataset.tab === tab));
      const sheets = { minds: R.drawMinds, matrix: R.drawMatrix, cost: R.drawCost };
      this.body.replaceChildren();
      this.sheet = null;
      this.tables = tab === "tables" ? new R.TablesPanel(this.body, this) : null;
      if (this.narrow) {
        if (tab === "map") this.body.append(this.mapBox); else this.mapBox.remove();
      }
      if (sheets[tab]) {
        const name = R.TABS.find(([key]) => key === tab)[1];
        this.sheet = new R.Sheet(this.body, name, (pen, w, h) => sheets[tab](pen, this.facts, this.app.clock.t, w, h, this.selected));
        R.listenPanel(this, tab);
      }
      if (this.laid) this.paint(true);
    }

    /** Stacks map and panel, or puts them side by side, as there is room. */
    stack() {
      if (this.narrow === this.isNarrow) return;
      this.narrow = this.isNarrow;
      this.root.classList.toggle("narrow", this.narrow);
      if (!this.narrow) this.top.prepend(this.mapBox);
      if (this.narrow || this.tab === "map") this.tab = this.narrow ? "map" : "news";
      this.laid = false;
      this.makeTabs();
    }

    /** Places everything anew after a change of size. */
    resize() {
      this.stack();
      const room = this.root.clientHeight - this.top.offsetTop + this.root.offsetTop;
      const wanted = R.layLanes(this.facts, this.open, this.selected, room * 0.46).height + 4;
      const lanes_px = this.lanes_px || Math.min(wanted, Math.round(room * 0.5));
      this.top.style.height = Math.max(120, room - lanes_px - this.splitter.offsetHeight) + "px";
      const world = this.facts.extent, h = this.top.clientHeight;
      const aspect = (world.x_m[1] - world.x_m[0]) / Math.max(world.y_m[1] - world.y_m[0], 1);
      const w = Math.min(Math.max(h * aspect, 470), this.root.clientWidth * 0.58);
      this.mapBox.style.width = this.narrow ? "100%" : Math.round(w) + "px";
      this.laid = true;
      this.paint(true);
    }

    paint(panelNow) {
      this.paintMap();
      this.follow();
      this.paintLanes();
      const now_ms = performance.now();
      /* While a button of the panel is pressed it stays, else it would be gone before it is let go. */
      const isPressed = this.body.querySelector("button:active");
      if (panelNow || (!isPressed && (!this.app.clock.playing || now_ms - this.panelAt_ms > PANEL_EVERY_MS))) {
        this.panelAt_ms = now_ms;
        this.paintPanel();
      }
    }

    paintMap() { if (!this.narrow || this.tab === "map") this.map.paint(); }

    paintPanel() {
      if (this.sheet || this.tables) { (this.sheet || this.tables).paint(); return; }
      const time_s = this.app.clock.t, go = (t, v) => this.app.go(t, v < 0 ? null : this.run.vehicles[v].name);
      if (this.tab === "news") R.showNews(this.body, this.facts, this.selected, time_s, go);
      if (this.tab === "events") R.showEvents(this.body, this.facts, this.selected, time_s, go);
      if (this.tab === "why") {
        const found = this.selected >= 0 ? R.decisionAt(this.facts, this.selected, time_s) : null;
        const said = found ? this.run.why(this.selected, time_s).map((line) => line.text) : [];
        this.fill(JSON.stringify([found ? found.number : -1, said]), () => R.showWhy(this.body, this.facts, this.selected, time_s, go));
      }
      if (this.tab === "organisation") {
        const key = R.organisationKey(this.facts, this.selected, time_s);
        this.fill(key, () => R.showOrganisation(this.body, this.facts, this.selected, time_s, go));
      }
      if (this.tab === "plans") {
        const shown = R.plansShown(this.facts, this.selected, time_s);
        const late = shown.flatMap((plan) => plan.tasks.map((task) => task.expected_s !== null && time_s - task.expected_s >= 1));
        this.fill(JSON.stringify([shown, late]), () => R.showPlans(this.body, this.facts, this.selected, shown, go, time_s));
      }
    }

    /** Shows a panel anew only if what it shows has changed; so its buttons stay while the clock runs. */
    fill(key, show) {
      const shows = [this.tab, this.selected, key].join();
      if (this.body.dataset.shows === shows) return;
      const top = this.body.dataset.shows.startsWith([this.tab, this.selected].join()) ? this.body.scrollTop : 0;
      show();
      this.body.scrollTop = top;
      this.body.dataset.shows = shows;
    }

    /** The lanes are drawn again only if what they show has changed; the clock needs the upper canvas alone. */
    paintLanes() {
      const laid = [this.lanesBox.clientHeight, this.selected, ...this.open].join();
      if (laid !== this.laidFor) {
        this.laidFor = laid;
        this.layout = R.layLanes(this.facts, this.open, this.selected, this.lanesBox.clientHeight);
      }
      this.lanesInner.style.height = this.lanesBox.clientHeight + "px";
      this.spacer.style.height = Math.max(0, this.layout.height - this.lanesBox.clientHeight) + "px";
      const key = [this.window, this.lanesBox.clientWidth, this.lanesBox.clientHeight, this.lanesBox.scrollTop, this.selected,
                   [...this.open], R.theme.paper].join();
      if (this.laneBase.fit() || key !== this.laneKey) { this.laneKey = key; this.laneBase.paint(); }
      this.laneNow.paint();
    }

    scale(w) { return R.laneScale(this.window[0], this.window[1], w); }

    drawLanes(pen, w, h) {
      R.drawLanes(pen, this.facts, this.layout, this.scale(w), { w, h, scroll: this.lanesBox.scrollTop, selected: this.selected });
    }

    drawNow(pen, w, h) {
      const scale = this.scale(w), x = scale.x(this.app.clock.t);
      R.noteFolded(pen, this.facts, this.layout, this.app.clock.t, { room: scale.left, h, scroll: this.lanesBox.scrollTop });
      if (x < scale.left - 1 || x > scale.right + 1) return;
      pen.strokeStyle = pen.fillStyle = R.theme.ink;
      pen.lineWidth = 1.5;
      pen.beginPath();
      pen.moveTo(x, R.AXIS_PX - 2);
      pen.lineTo(x, h);
      pen.stroke();
      R.drawMoment(pen, scale, this.app.clock.t, w);
    }

    /** Turns the page of the lanes when the clock leaves it. */
    follow() {
      const [from_s, to_s] = this.window, span = to_s - from_s, t = this.app.clock.t;
      if (t >= from_s && t <= to_s) return;
      const start = Math.min(Math.max(0, t - 0.1 * span), Math.max(0, this.run.header.end_s - span));
      this.window = [start, start + span];
    }

    /** Shows `span_s` seconds around a time, or the whole run. */
    setSpan(span_s, around_s = this.app.clock.t, share = 0.5) {
      const end_s = Math.max(this.run.header.end_s, LEAST_SPAN_S);
      const span = Math.min(Math.max(span_s, LEAST_SPAN_S), end_s);
      const start = Math.min(Math.max(0, around_s - share * span), end_s - span);
      this.window = [start, start + span];
      this.paint(false);
    }

    drawMap(pen, w, h) {
      const { facts, app, selected } = this, time_s = app.clock.t;
      const marks = R.markEntries(facts), legend_px = LEGEND_PX * (marks.length ? 2 : 1);
      const frame = new R.Frame(this.facts.extent, w, h - legend_px, this.zoom);
      const mind = selected >= 0 ? this.run.mind(selected, time_s) : null;
      const wrong = mind ? R.disagreements(facts, selected, time_s) : [];
      this.frame = frame;
      pen.save();
      pen.beginPath();
      pen.rect(0, 0, w, frame.h);
      pen.clip();
      this.drawGround(pen, frame, time_s);
      if (mind) R.drawUnheard(pen, frame, facts, mind, time_s);
      R.drawPackets(pen, frame, facts, app.clock, selected);
      const taken = [R.scaleBarBox(frame)];
      R.drawFinds(pen, frame, facts, mind, time_s);
      const ghosts = mind ? R.drawGhosts(pen, frame, facts, selected, mind, time_s, taken) : [];
      R.drawVehicles(pen, frame, facts, time_s, { selected, taken });
      R.nameGhosts(pen, frame, facts, ghosts, wrong, taken);
      R.namePlaces(pen, frame, facts, mind, time_s, taken);
      pen.restore();
      R.drawLegend(pen, w, h, legend_px, Boolean(mind), marks, this.facts.ends, R.isCrowded(facts));
    }

    drawGround(pen, frame, time_s) {
      if (pen instanceof R.SvgPen) {
        R.drawWorld(pen, frame, this.facts);
        R.drawDone(pen, frame, this.facts, -1, time_s);
        R.drawTracks(pen, frame, this.facts, -1, time_s);
        R.drawMarks(pen, frame, this.facts, -1, time_s);
        return;
      }
      this.ground.update(frame, this.facts, time_s, this.map.ratio, true);
      pen.drawImage(this.ground.canvas, 0, 0, frame.w, frame.h);
    }

    /** What is under a point of the lanes: {lane, time_s, v}. */
    laneAt(x, y) {
      const scale = this.scale(this.laneNow.w);
      const down = y + this.lanesBox.scrollTop;
      const lane = y < R.AXIS_PX ? null : this.layout.lanes.find((one) => down >= one.y && down < one.y + one.h) || null;
      return { lane, scale, time_s: scale.time(x), inHead: x < scale.left, v: lane && !lane.head ? lane.v : -1 };
    }

    /** The change of role or activity near a time in a lane, or null. */
    changeNear(v, time_s, scale) {
      const near_s = NEAR_PX / scale.px_per_s;
      let best = null;
      for (const { time_s: at_s, changed } of this.facts.decisions[v]) {
        const off = Math.abs(at_s - time_s);
        if (changed && off <= near_s && (best === null || off < Math.abs(best - time_s))) best = at_s;
      }
      return best;
    }
  };
})();
