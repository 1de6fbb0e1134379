"use strict";
/* The page of a live run: a bar that steers it, and the replay of what has happened so far, which the server is asked
   for again and again. */
(function () {
  const SPEEDS = [["1", "real time"], ...["10", "30", "60", "120", "300", "600"].map((n) => [n, n + "× real time"]), ["full", "full speed"]];
  const OVER = new Set(["finished", "crashed"]);
  const GONE = "The program does not answer; it may have ended. The page keeps what it had.";
  const EVERY_MS = 400;

  R.Live = class {
    constructor(root) {
      Object.assign(this, { state: null, number: 0 });
      this.growing = new R.Growing(root, (text) => this.say(text, true));
      this.bar = R.make("section", "live");
      this.phase = R.make("output", "phase");
      this.play = R.button("▶ Start run", () => this.ask({ do: this.state.phase === "running" ? "pause" : "start" }));
      this.play.classList.add("play");
      this.step = R.button("Step run", () => this.ask({ do: "step" }));
      this.step.title = "One tick of motion";
      this.speed = R.make("select");
      this.speed.setAttribute("aria-label", "Speed of the run");
      for (const [value, name] of SPEEDS) this.speed.append(new Option(name, value));
      this.speed.addEventListener("change", () => this.ask({ do: "speed", speed: Number(this.speed.value) || "full" }));
      this.message = R.make("p", "message");
      this.message.setAttribute("role", "status");
      this.bar.append(this.play, this.step, this.speed, this.phase, this.message);
      this.bar.inert = true; // until there is a run
      this.bar.addEventListener("keydown", (event) => event.stopPropagation()); // not for the replay
      root.append(this.bar);
      this.follow();
    }

    say(text, isBad = false) {
      this.message.textContent = this.message.title = text;
      this.message.classList.toggle("bad", isBad);
    }

    async ask(what) {
      const headers = { "Content-Type": "application/json" };
      try {
        const answer = await fetch("control", { method: "POST", headers, body: JSON.stringify(what) });
        if (!answer.ok) this.say(await answer.text(), true);
      } catch (error) {
        this.say(GONE, true);
      }
    }

    async follow() {
      try {
        const state = await (await fetch(`news?${this.number}`)).json();
        if (state.data) this.growing.take(state.data);
        this.number = state.number;
        this.show(state);
      } catch (error) {
        this.say(GONE, true);
      }
      setTimeout(() => this.follow(), EVERY_MS);
    }

    show(state) {
      const { phase, time_s, duration_s, message } = this.state = state;
      this.bar.inert = false;
      this.bar.dataset.phase = phase;
      this.phase.textContent = `${phase}, ${R.seconds(time_s)}` + (OVER.has(phase) ? "" : ` of at most ${R.seconds(duration_s)}`);
      this.play.textContent = phase === "running" ? "❚❚ Pause run" : phase === "ready" ? "▶ Start run" : "▶ Resume run";
      this.play.disabled = this.step.disabled = OVER.has(phase);
      if (document.activeElement !== this.speed) this.speed.value = state.speed === null ? "full" : String(state.speed);
      if (message || this.message.textContent === GONE) this.say(message, phase === "crashed");
    }
  };

  R.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  R.live = new R.Live(document.getElementById("app"));
})();
