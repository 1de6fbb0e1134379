"use strict";
/* The clock of the page. Time in the mission goes on by a rate (seconds of mission per second of the reader), which the
   chosen pace gives: slot by slot, frame by frame, or a multiple of real time. The end of a run that grows (a live one)
   may be followed: then the clock glides to it each time that it has moved. */
(function () {
  /* A slot lasts about 4 s for the reader, so that the eye can follow a wave front, which crosses the area in 0.7 s. */
  const SLOT_LASTS_S = 4, FRAME_LASTS_S = 2, LONGEST_TICK_S = 0.1, EPSILON_S = 1e-6;

  R.PACES = [["slot", "by slot"], ["frame", "by frame"],
             ...[10, 30, 60, 120, 300, 600].map((rate) => [String(rate), rate + "× real time"])];

  R.Clock = class {
    /* `run()` is the run by whose slots it steps. */
    constructor({ end_s, slot_s, frame_s }, run) {
      Object.assign(this, { end_s, run, slot_s: slot_s || 1, frame_s: frame_s || 10 });
      this.t = 0;
      this.playing = false;
      this.pace = "60";
      this.stop_s = null;
      this.grows = this.following = false;
      this.glide = 0;
      this.listeners = [];
      this.last_ms = null;
      this.tick = this.tick.bind(this);
    }

    /** Mission seconds per second of the reader. */
    get rate() {
      if (this.following) return this.glide;
      if (this.pace === "slot") return this.slot_s / SLOT_LASTS_S;
      if (this.pace === "frame") return this.frame_s / FRAME_LASTS_S;
      return Number(this.pace);
    }

    /** Number of the slot that the clock is in. */
    get slot() { return this.run().slotAt(this.t); }

    onChange(listener) { this.listeners.push(listener); }
    tell() { for (const listener of this.listeners) listener(this.t); }

    seek(time_s) {
      this.stop_s = null;
      this.following = this.grows && time_s >= this.end_s;
      this.t = Math.min(Math.max(time_s, 0), this.end_s);
      this.tell();
    }

    setPace(pace) { this.pace = pace; this.tell(); }

    toggle() { if (this.playing || this.following) this.pause(); else this.play(); }

    play() {
      if (this.t >= this.end_s && this.grows) { this.seek(this.end_s); return; }
      if (this.t >= this.end_s) this.t = 0;
      this.stop_s = null;
      this.start();
    }

    start() {
      if (!this.playing) { this.playing = true; this.last_ms = null; requestAnimationFrame(this.tick); }
      this.tell();
    }

    pause() { this.playing = this.following = false; this.stop_s = null; this.tell(); }

    /** Takes the end of a run that may grow on; who follows it is there within `lasts_s` seconds of the reader. */
    grow(end_s, grows, lasts_s) {
      this.end_s = end_s;
      this.grows = grows;
      this.t = Math.min(this.t, end_s);
      if (!this.following) return;
      this.glide = (end_s - this.t) / lasts_s;
      if (this.glide > 0) this.start();
      else [this.playing, this.following] = [false, grows];
    }

    /** Length of a step in slots: one by slot, else a frame. */
    get step_slots() { return this.pace === "slot" ? 1 : Math.max(1, Math.round(this.frame_s / this.slot_s)); }

    /** One step to the next start of so many slots; ahead by slot it is shown in slow motion, unless another follows at once. */
    step(direction, n = this.step_slots) {
      const run = this.run(), from_s = this.stop_s === null ? this.t : this.stop_s;
      const first = Math.floor(run.slotAt(from_s) / n) * n;
      const isAtStart = from_s - run.slotStart_s(first) < EPSILON_S;
      const next = direction > 0 ? first + n : isAtStart ? first - n : first;
      const to_s = Math.min(Math.max(run.slotStart_s(next), 0), this.end_s);
      const slow = direction > 0 && this.pace === "slot" && n === 1;
      this.playing = this.playing && slow;
      this.seek(slow ? from_s : to_s);
      if (slow && to_s > this.t) { this.stop_s = to_s; this.start(); }
    }

    tick(now_ms) {
      if (!this.playing) return;
      /* A page that was hidden for a minute must not leap by an hour of the mission. */
      const passed_s = this.last_ms === null ? 0 : Math.min((now_ms - this.last_ms) / 1000, LONGEST_TICK_S);
      this.last_ms = now_ms;
      const until_s = this.stop_s === null ? this.end_s : this.stop_s;
      this.t = Math.min(this.t + passed_s * this.rate, until_s);
      if (this.t >= until_s) {
        this.following = this.grows && this.t >= this.end_s;
        this.playing = false;
        this.stop_s = null;
      }
      this.tell();
      if (this.playing) requestAnimationFrame(this.tick);
    }
  };
})();
