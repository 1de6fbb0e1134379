"use strict";
/* The page of a live run: a bar that steers it, and the replay of what has happened so far, of which the server sends
   what is new. */
(function () {
  const SPEEDS = [["1", "real time"], ...["10", "30", "60", "120", "300", "600"].map((n) => [n, n + "× real time"]), ["full", "full speed"]];
  const OVER = new Set(["finished", "crashed"]);
  const GONE = "The program does not answer; it may have ended. The page keeps what it had.";

  R.Live = class {
    constructor(root) {
      this.root = root;
      this.state = null;
      this.growing = new R.Growing(root, (text) => this.say(text, true));
      this.build();
      const source = new EventSource("events");
      source.addEventListener("rows", (event) => this.growing.take(event.data));
      source.addEventListener("state", (event) => this.show(JSON.parse(event.data)));
      source.addEventListener("error", () => this.say(GONE, true));
      source.addEventListener("open", () => { if (this.message.textContent === GONE) this.say(""); });
    }

    get data() { return this.growing.data; }

    build() {
      this.bar = R.make("section", "live");
      this.phase = R.make("output", "phase");
      this.play = R.button("▶ Start run", () => this.playOrPause());
      this.play.classList.add("play");
      this.step = R.button("Step run", () => this.ask({ do: "step" }));
      this.step.title = "One tick of motion";
      this.speed = R.make("select");
      this.speed.setAttribute("aria-label", "Speed of the run");
      for (const [value, name] of SPEEDS) this.speed.append(new Option(name, value));
      this.speed.addEventListener("change", () => this.ask({ do: "speed", speed: this.speed.value === "full" ? "full" : Number(this.speed.value) }));
      this.message = R.make("p", "message");
      this.message.setAttribute("role", "status");
      this.bar.append(this.play, this.step, this.speed, this.phase, this.message);
      this.buildForm();
      /* The keys of the replay are not for who types here. */
      for (const part of [this.bar, this.form]) part.addEventListener("keydown", (event) => event.stopPropagation());
      this.root.append(this.bar, this.form);
    }

    buildForm() {
      this.form = R.make("form", "live settings");
      this.fields = { strategy: R.make("select"), policy: R.make("select"), per: R.make("input"), faults: R.make("textarea") };
      this.fields.per.inputMode = "decimal";
      this.fields.faults.rows = 1;
      this.fields.faults.placeholder = "no faults";
      this.fields.faults.title = "What befalls vehicles, one fault a line";
      for (const [name, text] of [["strategy", "strategy"], ["policy", "policy"], ["per", "loss"], ["faults", "faults"]]) {
        const label = R.make("label", name, text);
        label.append(this.fields[name]);
        this.form.append(label);
        this.fields[name].addEventListener("input", () => this.mark());
      }
      this.kind = R.make("select");
      this.kind.setAttribute("aria-label", "Kind of a fault");
      this.vehicle = R.make("select");
      this.vehicle.setAttribute("aria-label", "Vehicle of a fault");
      this.add = R.button("+ fault", () => this.addFault());
      this.add.title = "Add a fault of this kind that begins now";
      this.again = R.button("↻ Restart", () => this.restart(0));
      this.again.title = "The run from its start, of the same seed, with these settings";
      this.here = R.button("↻ Apply here", () => this.restart(this.state.time_s));
      this.here.title = "The run of the same seed with these settings, made anew up to this time and going on from here";
      for (const button of [this.add, this.again, this.here]) button.type = "button";
      this.form.addEventListener("submit", (event) => { event.preventDefault(); this.restart(0); });
      this.form.append(this.kind, this.vehicle, this.add, this.again, this.here);
      this.bar.inert = this.form.inert = true; // until there is a run
    }

    say(text, isBad = false) {
      this.message.textContent = this.message.title = text;
      this.message.classList.toggle("bad", isBad);
    }

    async ask(what) {
      this.say("");
      try {
        const answer = await fetch("control", {
          method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(what),
        });
        const told = await answer.json();
        if (!answer.ok) { this.say(told.error, true); return; }
        this.show(told);
      } catch (error) {
        this.say(GONE, true);
      }
    }

    playOrPause() { this.ask({ do: this.state && this.state.phase === "running" ? "pause" : "play" }); }

    /** A line for a fault that begins now. */
    addFault() {
      const { faults } = this.fields, at_s = Math.floor(this.state.time_s);
      const sign = `kind = "${this.kind.value}", vehicle = ${JSON.stringify(this.vehicle.value)}, at_s = ${at_s}`;
      faults.value = [faults.value.trimEnd(), sign].filter(Boolean).join("\n");
      this.mark();
    }

    /** What the form changes; an empty loss is that of the command line again, and one that is no number goes as typed. */
    get asked() {
      const { strategy, policy, per, faults } = this.fields, loss = per.value.trim(), was = this.state.form;
      const form = {};
      if (strategy.value !== was.strategy) form.strategy = strategy.value;
      if (policy.value !== was.policy) form.policy = policy.value;
      if (loss === "" && was.per !== null) form.per = null;
      if (loss !== "" && loss !== String(was.per)) form.per = Number.isNaN(Number(loss)) ? loss : Number(loss);
      if (faults.value.trimEnd() !== was.faults) form.faults = faults.value;
      return form;
    }

    /** Settings that differ from those of the run are marked until they count. */
    mark() {
      const asked = this.asked;
      for (const [name, field] of Object.entries(this.fields)) field.classList.toggle("changed", name in asked);
      this.fields.faults.rows = Math.min(4, this.fields.faults.value.split("\n").length);
      this.here.disabled = !Object.keys(asked).length || this.state.time_s === 0;
    }

    restart(skip_to_s) {
      this.ask({ do: "restart", form: this.asked, play: this.state.phase === "running", skip_to_s });
    }

    show(state) {
      const before = this.state, { phase, time_s, duration_s } = state;
      if (before && state.number < before.number) return; // an answer may come after a later event
      this.state = state;
      this.bar.inert = this.form.inert = false;
      this.bar.dataset.phase = phase;
      this.phase.textContent = `${phase}, ${R.seconds(time_s)}` + (OVER.has(phase) ? "" : ` of at most ${R.seconds(duration_s)}`);
      this.play.textContent = phase === "running" ? "❚❚ Pause run" : phase === "ready" ? "▶ Start run" : "▶ Resume run";
      this.play.disabled = this.step.disabled = OVER.has(phase);
      if (document.activeElement !== this.speed) this.speed.value = state.speed === null ? "full" : String(state.speed);
      if (!before || JSON.stringify(before.form) !== JSON.stringify(state.form)) this.fill(state);
      if (before && before.time_s !== time_s) this.mark();
      if (state.message && (!before || before.message !== state.message)) this.say(state.message, phase === "crashed");
    }

    fill({ form, allowed, vehicles }) {
      this.fields.strategy.replaceChildren(...allowed.strategy.map((name) => new Option(name)));
      this.fields.policy.replaceChildren(...allowed.policy.map((name) => new Option(name)));
      this.kind.replaceChildren(...allowed.kind.map((name) => new Option(name)));
      this.vehicle.replaceChildren(...vehicles.map((name) => new Option(name)));
      for (const [name, field] of Object.entries(this.fields)) field.value = form[name] === null ? "" : form[name];
      this.mark();
    }
  };

  R.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  R.live = new R.Live(document.getElementById("app"));
})();
