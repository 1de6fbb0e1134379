"use strict";
/* The page of a live run: a bar that steers it, and the replay of what has happened so far, which the server sends anew
   whenever the run has grown. */
(function () {
  const SPEEDS = [["1", "real time"], ...["10", "30", "60", "120", "300", "600"].map((n) => [n, n + "× real time"]), ["full", "full speed"]];
  const OVER = new Set(["finished", "crashed"]);

  R.Live = class {
    constructor(root) {
      this.root = root;
      this.state = null;
      this.isDecoding = false;
      this.next = null;
      this.build();
      const source = new EventSource("events");
      source.addEventListener("rows", (event) => this.take(event.data));
      source.addEventListener("state", (event) => this.show(JSON.parse(event.data)));
      source.addEventListener("error", () => this.say("The program does not answer; it may have been ended. The page keeps what it had.", true));
    }

    build() {
      this.bar = R.make("section", "live");
      this.phase = R.make("output", "phase");
      this.play = R.button("▶ Start", () => this.playOrPause());
      this.step = R.button("Step", () => this.ask({ do: "step" }));
      this.step.title = "One tick of motion";
      this.speed = R.make("select");
      this.speed.setAttribute("aria-label", "Speed of the run");
      for (const [value, name] of SPEEDS) this.speed.append(new Option(name, value));
      this.speed.addEventListener("change", () => this.ask({ do: "speed", speed: this.speed.value === "full" ? "full" : Number(this.speed.value) }));
      this.form = R.make("form");
      this.fields = { strategy: R.make("select"), policy: R.make("select"), per: R.make("input"), faults: R.make("textarea") };
      this.fields.per.inputMode = "decimal";
      this.fields.faults.placeholder = 'kind = "lost", vehicle = "AUV01", at_s = 300';
      this.fields.faults.title = "What befalls vehicles, one fault a line";
      for (const [name, text] of [["strategy", "strategy"], ["policy", "policy"], ["per", "loss"], ["faults", "faults"]]) {
        const label = R.make("label", "", text);
        label.append(this.fields[name]);
        this.form.append(label);
      }
      this.again = R.button("↻ Restart", () => this.restart());
      this.again.type = "button";
      this.again.title = "Another run of the same seed with these settings";
      this.form.addEventListener("submit", (event) => { event.preventDefault(); this.restart(); });
      this.form.append(this.again);
      this.message = R.make("p", "message");
      this.message.setAttribute("role", "status");
      this.bar.append(this.phase, this.play, this.step, this.speed, this.form, this.message);
      /* The keys of the replay are not for who types here. */
      this.bar.addEventListener("keydown", (event) => event.stopPropagation());
      this.root.append(this.bar);
    }

    say(text, bad = false) {
      this.message.textContent = text;
      this.message.classList.toggle("bad", bad);
    }

    async ask(what) {
      try {
        const answer = await fetch("control", {
          method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(what),
        });
        const told = await answer.json();
        if (answer.ok) this.show(told); else this.say(told.error, true);
      } catch (error) {
        this.say(`The program does not answer: ${error.message}`, true);
      }
    }

    playOrPause() { this.ask({ do: this.state && this.state.phase === "running" ? "pause" : "play" }); }

    /** What the form changes; an empty loss is that of the command line again, and one that is no number goes as typed. */
    get asked() {
      const { strategy, policy, per, faults } = this.fields, loss = per.value.trim(), was = this.state.form;
      const form = {};
      if (strategy.value !== was.strategy) form.strategy = strategy.value;
      if (policy.value !== was.policy) form.policy = policy.value;
      if (loss === "" && was.per !== null) form.per = null;
      if (loss !== "" && loss !== String(was.per)) form.per = Number.isNaN(Number(loss)) ? loss : Number(loss);
      if (faults.value !== was.faults) form.faults = faults.value;
      return form;
    }

    restart() { this.ask({ do: "restart", form: this.asked, play: this.state.phase === "running" }); }

    show(state) {
      const before = this.state;
      this.state = state;
      const { phase, time_s, duration_s } = state;
      this.phase.textContent = `${phase}, ${R.seconds(time_s)} of at most ${R.seconds(duration_s)}`;
      this.play.textContent = phase === "running" ? "❚❚ Pause" : phase === "paused" ? "▶ Go on" : "▶ Start";
      this.play.disabled = this.step.disabled = OVER.has(phase);
      const speed = state.speed === null ? "full" : String(state.speed);
      if (document.activeElement !== this.speed) this.speed.value = speed;
      if (!before || JSON.stringify(before.form) !== JSON.stringify(state.form)) this.fill(state);
      if (!before || before.message !== state.message || before.phase !== phase) this.say(state.message, phase === "crashed");
    }

    fill({ form, strategies, policies }) {
      this.fields.strategy.replaceChildren(...strategies.map((name) => new Option(name)));
      this.fields.policy.replaceChildren(...policies.map((name) => new Option(name)));
      for (const [name, field] of Object.entries(this.fields)) field.value = form[name] === null ? "" : form[name];
    }

    /** Shows the rows so far; while one lot is being read, only the newest of those that come waits. */
    async take(text) {
      this.next = text;
      if (this.isDecoding) return;
      this.isDecoding = true;
      while (this.next !== null) {
        const taken = this.next;
        this.next = null;
        try {
          const run = await R.decode(taken);
          if (R.app) R.app.feed(run); else R.app = new R.App(this.root, [run]);
        } catch (error) {
          this.say(`What the program sent cannot be shown: ${error.message}`, true);
          console.error(error);
        }
      }
      this.isDecoding = false;
    }
  };

  R.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  R.live = new R.Live(document.getElementById("app"));
})();
