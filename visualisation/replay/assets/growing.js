"use strict";
/* The replay of a run that is underway: shown anew as it has grown. */
(function () {
  /* The clock takes so long, at least, to what is new, which comes about as often. */
  const GLIDE_S = 0.45;
  /* Building the run anew takes longer as it grows; so much of the time goes into it at most. */
  const GREATEST_SHARE = 0.25;

  R.Growing = class {
    /** @param say is told what cannot be shown. */
    constructor(root, say) {
      Object.assign(this, { root, say, next: null, isReading: false, glide_s: GLIDE_S });
    }

    /** Shows the run as far as it is; of what comes while that is being built, and for a while after it, the newest. */
    async take(text) {
      this.next = text;
      if (this.isReading) return;
      this.isReading = true;
      while (this.next !== null) {
        const began_ms = performance.now();
        try {
          await this.read();
        } catch (error) {
          this.say(`The update cannot be shown: ${error.message}`);
          console.error(error);
        }
        const every_ms = (performance.now() - began_ms) / GREATEST_SHARE;
        this.glide_s = Math.max(GLIDE_S, every_ms / 1000);
        await new Promise((resolve) => setTimeout(resolve, every_ms * (1 - GREATEST_SHARE)));
      }
      this.isReading = false;
    }

    async read() {
      const text = this.next;
      this.next = null;
      const run = await R.decode(text);
      if (R.app) { R.app.feed(run, this.glide_s); return; }
      R.app = new R.App(this.root, [run]);
      this.live = R.button("● live", () => R.app.clock.seek(R.app.clock.end_s));
      this.live.className = "follow";
      this.live.title = "Follow the running mission (End)";
      R.app.controls.scrub.after(this.live);
      R.app.clock.onChange(() => {
        this.live.setAttribute("aria-pressed", String(R.app.clock.following));
        this.live.disabled = !R.app.clock.grows;
      });
      R.app.clock.grow(run.header.end_s, run.header.is_underway, GLIDE_S);
      if (!location.hash.includes("t=")) R.app.clock.seek(R.app.clock.end_s);
    }
  };
})();
