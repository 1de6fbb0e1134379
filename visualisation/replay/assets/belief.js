"use strict";
/* One vehicle's world beside the truth: where it last heard its peers, where they may be by now, work that is done but
   that it has not heard of, and roles that it has wrong. */
(function () {
  const GHOST_PX = 7, FEW = 8, FAR_M = 1e5;

  R.isCrowded = (facts) => facts.n > FEW;

  /** Where `v` is wrong about its peers' roles: {peer, extra: it believes, missing: it has not heard of}. */
  R.disagreements = function (facts, v, time_s) {
    const { extra, lacking } = facts.run.disagreements(v, time_s);
    const rolesOf = (entries, peer) => entries.filter((entry) => entry.v === peer)
      .map((entry) => facts.run.roleName(entry.group, entry.role));
    return facts.run.vehicles.map((_, peer) => ({ peer, extra: rolesOf(extra, peer), missing: rolesOf(lacking, peer) }))
      .filter((entry) => entry.peer !== v && entry.extra.length + entry.missing.length);
  };

  /** Tiles done in truth that a vehicle has not heard of. */
  R.unheardTiles = function (facts, mind, time_s) {
    const { tiles } = facts.run, unheard = [];
    for (let n = 0; n < tiles.n; n += 1) if (tiles.done_s[n] <= time_s && !(mind.tilesKnown_s[n] <= time_s)) unheard.push(n);
    return unheard;
  };

  R.drawUnheard = function (pen, frame, facts, mind, time_s, step = 6) {
    pen.strokeStyle = R.theme.belief;
    pen.lineWidth = 1.2;
    pen.beginPath();
    for (const n of R.unheardTiles(facts, mind, time_s)) R.addHatch(pen, ...R.tileBox(frame, facts.run.tiles, n), step);
    pen.stroke();
  };

  /** Ghosts of the peers, discs of where they may be, and lines to where they are; returns what there is to name. */
  R.drawGhosts = function (pen, frame, facts, v, mind, time_s, taken, size = GHOST_PX) {
    const { run } = facts;
    const ghosts = [];
    const peers = mind.peers.filter((peer) => peer.v !== v);
    pen.save();
    pen.beginPath();
    pen.rect(0, 0, frame.w, frame.h);
    pen.clip();
    drawDiscs(pen, frame, facts, peers, time_s);
    for (const peer of peers) {
      const x = frame.x(peer.x), y = frame.y(peer.y);
      const age_s = Math.max(0, time_s - peer.since_s);
      const so = run.at(peer.v, time_s);
      pen.strokeStyle = R.vehicleLook(peer.v).line;
      pen.lineWidth = 1.2;
      pen.setLineDash([2, 3]);
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(frame.x(so.x), frame.y(so.y));
      pen.stroke();
      pen.setLineDash([]);
      pen.lineWidth = 1.6;
      const heading = Math.atan2(so.y - peer.y, so.x - peer.x);
      R.drawGlyph(pen, x, y, heading, R.shapeOf(facts, peer.v), size, null, R.vehicleLook(peer.v).line);
      ghosts.push({ peer: peer.v, x, y, age_s, far: Math.hypot(so.x - peer.x, so.y - peer.y) * frame.scale });
      taken.push([x - size, y - size, 2 * size, 2 * size]);
    }
    pen.restore();
    return ghosts;
  };

  /* Of many peers the discs would cover all: that of the peer the mouse points at is drawn alone. */
  function drawDiscs(pen, frame, facts, peers, time_s) {
    for (const peer of R.isCrowded(facts) ? peers.filter((one) => one.v === facts.pointed) : peers) {
      const radius = Math.max(1, Math.min((time_s - peer.since_s) * facts.top_mps[peer.v], FAR_M) * frame.scale);
      if (radius > Math.hypot(frame.w, frame.h)) continue; // anywhere on the map
      pen.fillStyle = pen.strokeStyle = R.vehicleLook(peer.v).line;
      pen.lineWidth = 1;
      pen.beginPath();
      pen.arc(frame.x(peer.x), frame.y(peer.y), radius, 0, 2 * Math.PI);
      pen.globalAlpha = 0.1;
      pen.fill();
      pen.globalAlpha = 0.8;
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  /** Names of ghosts that are off the mark, with the age of the news, and ≠ where roles are wrong. */
  R.nameGhosts = function (pen, frame, facts, ghosts, wrong, taken) {
    const mistaken = new Map(wrong.map((entry) => [entry.peer, entry]));
    for (const { peer, x, y, age_s, far } of ghosts) {
      const entry = mistaken.get(peer);
      if (far < 10 && !entry) continue;
      const text = `${facts.run.vehicles[peer].name} ${R.seconds(age_s)} ago` + (entry ? " ≠" : "");
      R.placeText(pen, frame, text, x, y, taken, { colour: R.theme.belief });
    }
  };
})();
