"use strict";
/* What the reader does with the mouse on map, lanes and panels, and with the keyboard. */
(function () {
  const DRAG_PX = 4, NEAR_VEHICLE_PX = 16, NEAR_FLAG_PX = 8, WHEEL = 1.0015;

  function at(event, element) {
    const box = element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /* Calls `move(dx, dy, x, y)` while a drag lasts and `click(x, y)` if there was none. */
  function onDrag(element, move, click) {
    element.addEventListener("pointerdown", (down) => {
      if (down.button) return;
      let [lastX, lastY] = at(down, element), moved = false;
      const [startX, startY] = [lastX, lastY];
      element.setPointerCapture(down.pointerId);
      const onMove = (event) => {
        const [x, y] = at(event, element);
        if (!moved && Math.hypot(x - startX, y - startY) < DRAG_PX) return;
        moved = true;
        move(x - lastX, y - lastY, x, y, startX, startY);
        [lastX, lastY] = [x, y];
      };
      const onUp = (event) => {
        element.removeEventListener("pointermove", onMove);
        if (!moved && event.type === "pointerup") click(startX, startY);
      };
      element.addEventListener("pointermove", onMove);
      element.addEventListener("pointerup", onUp, { once: true });
      element.addEventListener("pointercancel", onUp, { once: true });
    });
  }

  function onHover(view, element, textAt) {
    element.addEventListener("pointermove", (event) => {
      const text = event.buttons ? "" : textAt(...at(event, element));
      view.app.tip(text, event.clientX, event.clientY);
      element.style.cursor = text ? "pointer" : "default";
    });
    element.addEventListener("pointerleave", () => {
      view.facts.pointed = -1;
      view.app.tip("", 0, 0);
    });
  }

  R.listenMap = function (view) {
    const { canvas } = view.map;
    const nearest = (x, y) => {
      let best = -1, least = NEAR_VEHICLE_PX;
      for (let v = 0; v < view.facts.n; v += 1) {
        const state = view.run.at(v, view.app.clock.t);
        const off = Math.hypot(view.frame.x(state.x) - x, view.frame.y(state.y) - y);
        if (off < least) [best, least] = [v, off];
      }
      return best;
    };
    onHover(view, canvas, (x, y) => {
      const v = nearest(x, y);
      const time_s = view.app.clock.t;
      if (v !== view.facts.pointed) {
        view.facts.pointed = v;
        view.paintMap();
      }
      return v < 0 ? R.markTip(view.facts, view.frame, time_s, x, y) : R.vehicleTip(view.facts, v, time_s);
    });
    onDrag(canvas, (dx, dy) => {
      if (!view.zoom) view.zoom = { factor: 1, x: view.frame.centre[0], y: view.frame.centre[1] };
      view.zoom.x -= dx / view.frame.scale;
      view.zoom.y += dy / view.frame.scale;
      view.paintMap();
    }, (x, y) => {
      const v = nearest(x, y);
      view.app.select(v < 0 ? null : view.run.vehicles[v].name);
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [x, y] = at(event, canvas), [x_m, y_m] = view.frame.metres(x, y);
      const before = view.zoom ? view.zoom.factor : 1;
      const factor = Math.min(Math.max(before * Math.pow(WHEEL, -event.deltaY), 0.5), 40);
      const [cx, cy] = view.frame.centre, keep = before / factor;
      view.zoom = { factor, x: x_m + (cx - x_m) * keep, y: y_m + (cy - y_m) * keep };
      view.paintMap();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => { view.zoom = null; view.paintMap(); });
  };

  R.vehicleTip = function (facts, v, time_s) {
    const state = facts.run.at(v, time_s), vehicle = facts.run.vehicles[v], spell = facts.drivingAt(v, time_s);
    return `${vehicle.name} (${vehicle.type}) · ${spell ? spell.text : "waits"} · ${state.speed.toFixed(1)} m/s · ` +
      `x ${Math.round(state.x)} m, y ${Math.round(state.y)} m, depth ${Math.round(vehicle.depth_m)} m · ${(state.energy / 1000).toFixed(1)} kJ used`;
  };

  R.listenLanes = function (view) {
    const { canvas } = view.laneNow;
    onHover(view, canvas, (x, y) => laneTip(view, x, y));
    onDrag(canvas, (dx, dy, x, y, startX, startY) => {
      const { scale } = view.laneAt(x, y);
      if (startY < R.AXIS_PX) { view.app.clock.seek(scale.time(x)); return; }
      if (startX < scale.left) return;
      const span = view.window[1] - view.window[0];
      view.setSpan(span, view.window[0] - dx / scale.px_per_s, 0);
    }, (x, y) => clickLane(view, x, y));
    canvas.addEventListener("wheel", (event) => {
      const [x, y] = at(event, canvas), spot = view.laneAt(x, y);
      if (spot.inHead) return;
      event.preventDefault();
      const span = view.window[1] - view.window[0];
      if (event.shiftKey) { view.setSpan(span, view.window[0] + event.deltaY * span / 2000, 0); return; }
      const wider = span * Math.pow(WHEEL, event.deltaY);
      view.setSpan(wider, spot.time_s, (spot.time_s - view.window[0]) / span);
    }, { passive: false });
    canvas.addEventListener("dblclick", () => view.setSpan(Infinity));
    onDrag(view.splitter, (dx, dy) => {
      const room = view.top.offsetHeight + view.lanesBox.offsetHeight;
      view.lanes_px = Math.min(Math.max(view.lanesBox.offsetHeight - dy, 90), room - 130);
      view.resize();
    }, () => {});
  };

  function clickLane(view, x, y) {
    const spot = view.laneAt(x, y);
    if (!spot.lane) { if (!spot.inHead) view.app.clock.seek(spot.time_s); return; }
    if (spot.lane.head) {
      if (view.open.has(spot.lane.key)) view.open.delete(spot.lane.key); else view.open.add(spot.lane.key);
      view.paintLanes();
      return;
    }
    const name = view.run.vehicles[spot.v].name;
    if (spot.inHead) { view.app.select(view.app.selected === name ? null : name); return; }
    const change = view.changeNear(spot.v, spot.time_s, spot.scale);
    view.app.go(change === null ? spot.time_s : change, name);
    if (change !== null) view.showTab("why");
  }

  function laneTip(view, x, y) {
    const { lane, time_s, inHead, v } = view.laneAt(x, y);
    if (!lane) return axisTip(view, x, y);
    if (lane.head) return `${R.plural(lane.members.length, lane.role)}: ${lane.members.map((m) => view.run.vehicles[m].name).join(", ")}`;
    if (inHead) return R.vehicleTip(view.facts, v, view.app.clock.t);
    const spell = view.facts.drivingAt(v, time_s);
    const held = view.facts.held[v].filter((row) => row.spells.some((s) => s.from_s <= time_s && time_s < s.to_s)).map((row) => row.role);
    const silence = view.facts.silences[v].find((s) => s.from_s <= time_s && time_s < s.to_s);
    return [`${view.run.vehicles[v].name} at ${R.seconds(time_s)}`,
            spell ? `${spell.text} active, ${R.seconds(spell.from_s)} to ${R.seconds(spell.to_s)}` : "waits",
            held.length ? "holds " + held.join(", ") : "",
            silence ? `reception gap ${R.seconds(silence.from_s)} to ${R.seconds(silence.to_s)}: ${silence.lost} packets lost` : "",
            refusedNear(view, v, time_s)].filter(Boolean).join(" · ");
  }

  /* Why the vehicle refused what arrived in this slot. */
  function refusedNear({ run }, v, time_s) {
    const slot_s = run.header.slot_s || 1;
    const found = run.refusals.filter((one) => one.vehicle === v && Math.abs(one.time_s - time_s) <= slot_s);
    return found.length ? "refused: " + [...new Set(found.map((one) => one.reason))].join(", ") : "";
  }

  function axisTip(view, x, y) {
    const { scale } = view.laneAt(x, y);
    const near = view.run.milestones.filter((one) => one.vehicle < 0 && Math.abs(scale.x(one.time_s) - x) < NEAR_FLAG_PX);
    return near.map((one) => `${R.words(one.name)}${one.group ? ": " + one.group : ""}, ${R.seconds(one.time_s)}`).join(" · ");
  }

  R.listenPanel = function (view, tab) {
    const { sheet } = view, { canvas } = sheet;
    canvas.addEventListener("click", (event) => {
      const [x, y] = at(event, canvas);
      if (tab === "minds") {
        const hit = R.layMinds(view.facts, sheet.w, sheet.h, view.selected).find((m) => x >= m.x && x < m.x + m.w && y >= m.y && y < m.y + m.h);
        if (hit) view.app.select(view.run.vehicles[hit.v].name);
      } else if (tab === "matrix") {
        const hit = R.hitMatrix(view.facts, sheet.w, sheet.h, x, y);
        if (hit) view.app.select(view.run.vehicles[hit.v].name);
      } else view.app.clock.seek(R.costScale(view.facts, sheet.w).time(x));
    });
    if (tab !== "matrix") return;
    onHover(view, canvas, (x, y) => {
      const hit = R.hitMatrix(view.facts, sheet.w, sheet.h, x, y);
      if (!hit || hit.v === hit.peer) return "";
      const { age_s, lacking } = view.run.matrix(view.app.clock.t), age = age_s[hit.v][hit.peer];
      const names = [hit.v, hit.peer].map((v) => view.run.vehicles[v].name);
      const parts = [`${names[0]} of ${names[1]}: ${Number.isFinite(age) ? "information of " + R.seconds(age) + " ago" : "never received"}, lacks ${lacking[hit.v][hit.peer]} items`];
      if (view.run.isParked(hit.v, hit.peer, view.app.clock.t)) parts.push("declared absent");
      const links = view.run.linkAt(hit.v, hit.peer, view.app.clock.t);
      const told = (way, link) => (link ? `${way} it loses ${Math.round(100 * link.p_loss)} % (n = ${link.n})` : "");
      return [...parts, told("link from", links.incoming), told("link to", links.outgoing)].filter(Boolean).join(" · ");
    });
  };

  /** Acts on a key; true if it meant something. */
  R.onKey = function (app, event) {
    const { clock } = app, key = event.key;
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    const tabs = { k: "news", m: "minds", x: "matrix", c: "cost", o: "organisation", p: "plans", w: "why", e: "events", t: "tables" };
    const actions = {
      " ": () => clock.toggle(), "ArrowLeft": () => (event.shiftKey ? clock.seek(clock.t - 60) : clock.step(-1)),
      "ArrowRight": () => (event.shiftKey ? clock.seek(clock.t + 60) : clock.step(1)),
      ",": () => clock.step(-1, 1), ".": () => clock.step(1, 1),
      "Home": () => clock.seek(0), "End": () => clock.seek(clock.end_s), "[": () => app.toEvent(-1), "]": () => app.toEvent(1),
      "ArrowUp": () => app.selectNext(-1), "ArrowDown": () => app.selectNext(1), "0": () => app.select(null),
      "+": () => app.zoomLanes(0.5), "=": () => app.zoomLanes(0.5), "-": () => app.zoomLanes(2), "f": () => app.zoomLanes(Infinity),
      "j": () => app.toDivergence(), "d": () => app.toggleTheme(), "s": () => app.saveSvg(), "v": () => app.toggleClip(),
      "l": () => app.copyLink(), "?": () => app.toggleHelp(), "Escape": () => app.escape(),
    };
    const small = key.length === 1 ? key.toLowerCase() : key;
    if (actions[small]) { actions[small](); return true; }
    if (tabs[small]) { app.views.forEach((view) => view.showTab(tabs[small])); return true; }
    if (/^[1-9]$/.test(key)) { app.selectNumber(Number(key) - 1); return true; }
    return false;
  };
})();
