"use strict";
/* The page: one run, or two side by side with one clock. It holds the clock and the selection, and tells the views. */
(function () {
  const SLOT_WINDOW_SLOTS = 40, FRAME_WINDOW_FRAMES = 40, TIP_PX = 14, LINK_EVERY_MS = 400;

  R.App = class {
    constructor(root, runs) {
      this.root = root;
      this.runs = runs;
      const longest = runs.reduce((a, b) => (a.header.end_s >= b.header.end_s ? a : b));
      this.clock = new R.Clock(longest.header);
      this.selected = null;
      this.views = [];
      this.stage = R.make("div", "stage");
      this.views = runs.map((run) => new R.View(this, run, this.stage, runs.length > 1));
      this.controls = new R.Controls(this, root);
      root.append(this.stage);
      this.tipBox = R.make("div", "tip");
      this.toast = R.make("div", "toast");
      this.toast.setAttribute("role", "status");
      root.append(this.tipBox, this.toast);
      this.help = R.makeHelp(root, () => this.help.close());
      this.clock.onChange(() => this.paint());
      document.addEventListener("keydown", (event) => this.onKey(event));
      addEventListener("resize", () => this.resize());
      addEventListener("hashchange", () => this.openLink());
      this.openLink();
      this.resize();
    }

    onKey(event) {
      const inField = event.target.matches("select, input:not([type=range])");
      const onButton = event.target.matches("button") && (event.key === " " || event.key === "Enter");
      if (inField || onButton) return;
      if (R.onKey(this, event)) event.preventDefault();
    }

    paint() {
      for (const view of this.views) view.paint(false);
      this.controls.update();
      if (this.recording) this.recording.draw();
      this.writeLink();
    }

    /** Takes a run that has grown, or another one; a clock that follows is at its end within `lasts_s` seconds. */
    feed(run, lasts_s) {
      const { clock } = this, { end_s, slot_s, frame_s, is_underway } = run.header;
      this.runs = [run];
      Object.assign(clock, { slot_s: slot_s || clock.slot_s, frame_s: frame_s || clock.frame_s });
      this.controls.scrub.max = end_s;
      clock.grow(end_s, is_underway, lasts_s);
      this.views[0].take(run);
      this.resize();
    }

    resize() { for (const view of this.views) view.resize(); this.controls.update(); }

    /* -- Where and whom -- */

    select(name) {
      this.selected = name;
      for (const view of this.views) view.paint(true);
      this.writeLink();
    }

    selectNumber(number) {
      const vehicle = this.runs[0].vehicles[number];
      if (vehicle) this.select(vehicle.name);
    }

    selectNext(direction) {
      const count = this.runs[0].vehicles.length, at = this.views[0].selected;
      this.selectNumber(at < 0 ? (direction > 0 ? 0 : count - 1) : (at + direction + count) % count);
    }

    /** Jumps to a moment, and to a vehicle if one is named. */
    go(time_s, name) {
      this.clock.playing = false;
      if (name) this.selected = name;
      this.clock.seek(time_s);
      for (const view of this.views) view.paint(true);
    }

    toEvent(direction) {
      const { t } = this.clock;
      const times = this.views.flatMap((view) => view.run.events
        .filter((event) => view.selected < 0 || event.vehicle < 0 || event.vehicle === view.selected)
        .map((event) => event.time_s)).sort((a, b) => a - b);
      const next = direction > 0 ? times.find((time) => time > t + 1e-6) : times.reverse().find((time) => time < t - 1e-6);
      if (next !== undefined) this.go(next, null);
    }

    toDivergence() {
      if (this.runs.length < 2) { this.say("There is one run only; give a second folder to compare."); return; }
      const found = R.divergence(this.runs[0], this.runs[1]);
      if (!found) { this.say("The runs do not differ."); return; }
      this.go(found.time_s, null);
      this.say(`First divergence at ${R.seconds(found.time_s, 1)}: ${found.text}`);
    }

    /* -- How it is shown -- */

    setPace(pace) {
      this.clock.setPace(pace);
      const { slot_s, frame_s } = this.clock;
      const span = pace === "slot" ? SLOT_WINDOW_SLOTS * slot_s : pace === "frame" ? FRAME_WINDOW_FRAMES * frame_s : null;
      if (span) for (const view of this.views) if (view.window[1] - view.window[0] > span) view.setSpan(span);
    }

    zoomLanes(factor) {
      for (const view of this.views) view.setSpan(factor * (view.window[1] - view.window[0]));
    }

    toggleTheme() {
      R.setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
      for (const view of this.views) view.paint(true);
    }

    toggleHelp() { if (this.help.open) this.help.close(); else this.help.showModal(); }
    escape() { if (this.help.open) this.help.close(); else this.select(null); }

    tip(text, x, y) {
      this.tipBox.textContent = text;
      this.tipBox.classList.toggle("shown", Boolean(text));
      if (!text) return;
      const w = this.tipBox.offsetWidth, h = this.tipBox.offsetHeight;
      this.tipBox.style.left = Math.max(4, Math.min(x + TIP_PX, innerWidth - w - 8)) + "px";
      this.tipBox.style.top = (y + TIP_PX + h > innerHeight ? y - h - TIP_PX : y + TIP_PX) + "px";
    }

    say(text) {
      this.toast.textContent = text;
      this.toast.classList.add("shown");
      clearTimeout(this.toastTimer);
      this.toastTimer = setTimeout(() => this.toast.classList.remove("shown"), 6000);
    }

    /* -- Links, files -- */

    get link() {
      const parts = ["t=" + Math.round(this.clock.t * 10) / 10];
      if (this.selected) parts.push("v=" + encodeURIComponent(this.selected));
      return "#" + parts.join("&");
    }

    openLink() {
      const given = new URLSearchParams(location.hash.slice(1));
      const name = given.get("v");
      if (name !== null) this.selected = this.runs.some((run) => run.vehicles.some((vehicle) => vehicle.name === name)) ? name : null;
      const time_s = Number(given.get("t"));
      if (given.has("t") && Number.isFinite(time_s) && location.hash !== this.link) this.clock.seek(time_s);
      for (const view of this.views) if (view.laid) view.paint(true);
    }

    /* The address follows the clock, but browsers allow few changes a second. */
    writeLink() {
      clearTimeout(this.linkTimer);
      if (this.clock.playing || this.clock.following || !this.hasAddress) return;
      this.linkTimer = setTimeout(() => { if (location.hash !== this.link) history.replaceState(null, "", this.link); }, LINK_EVERY_MS);
    }

    /** False inside a frame of a notebook, whose address is the notebook's. */
    get hasAddress() { return location.protocol !== "about:"; }

    copyLink() {
      if (!this.hasAddress) { this.say("The page has no address here; save it as a file with: remoras replay"); return; }
      const link = location.href.split("#")[0] + this.link;
      history.replaceState(null, "", this.link);
      const copied = navigator.clipboard ? navigator.clipboard.writeText(link) : Promise.reject(new Error("no clipboard"));
      copied.then(() => this.say("Link copied: " + link), () => this.say("Copy this link: " + link));
    }

    fileName(ending) {
      const { scenario, strategy, seed } = this.runs[0].header;
      return `${scenario}-${strategy}-${seed}-${Math.round(this.clock.t)}s.${ending}`.replace(/[^\w.-]+/g, "_");
    }

    svg() { return R.pageSvg(this.stage, `${this.runs.map(R.factsText).join(" | ")} at ${R.seconds(this.clock.t, 1)}`); }

    saveSvg() { R.download(this.fileName("svg"), new Blob([this.svg()], { type: "image/svg+xml" })); }

    async toggleClip() {
      if (!R.Clip.possible) { this.say("This browser cannot record video; a current Chromium or Firefox can."); return; }
      if (this.recording) {
        const clip = this.recording;
        this.recording = null;
        this.clock.pause();
        this.controls.clip.textContent = "● clip";
        const blob = await clip.stop();
        if (!blob.size) { this.say("The browser encoded no frame; record a longer clip."); return; }
        R.download(this.fileName(blob.type.includes("mp4") ? "mp4" : "webm"), blob);
        return;
      }
      this.recording = new R.Clip(this);
      this.controls.clip.textContent = "■ end clip";
      if (!this.clock.playing) this.clock.play();
    }
  };

  /** Reads the runs from the page and shows them; says why if it cannot. */
  R.start = async function () {
    const root = document.getElementById("app");
    R.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    try {
      const texts = [...document.querySelectorAll("script.run")].map((script) => script.textContent);
      R.app = new R.App(root, await Promise.all(texts.map(R.decode)));
    } catch (error) {
      root.replaceChildren(R.make("p", "failure", `This replay cannot be shown: ${error.message}`));
      throw error;
    }
  };
  if (document.querySelector("script.run")) R.start();
})();
