"""Invariants of the exchange: what vehicles know and believe is what was recorded and given."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

from missions.fault import Danger
from stress.invariants.seam import Moment, Scene
from stress.kinds import FOR_GOOD
from stress.witness import Breach, Flaw

DAMAGE = frozenset({"bits", "cut", "forged"})
"""Kinds by which packets say what was not said, where no checksum or key protects them."""
MANY = 3
"""Flaws that a message names."""


def _said(flaws: Iterable[Flaw]) -> str | None:
    """The flaws in words; None without any."""
    found = [flaw.text for flaw in flaws]
    more = f"; and {len(found) - MANY} more" if len(found) > MANY else ""
    return "; ".join(found[:MANY]) + more if found else None


class TrueBeliefs:
    """Nobody believes that a peer holds content which it lacks."""

    name = "beliefs"
    moment = Moment.EVENT
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Look at what is believed anew with a packet; at the end at all that is."""
        heard, witness = scene.heard, scene.witness
        if heard is None:
            flaws = witness.false_beliefs() if not scene.is_selective else []
            return _said(Flaw(Breach.BELIEF, f"{one} believes that {other} holds {uid}") for one, other, uid in flaws)
        is_selective = not heard.reception.beliefs or scene.is_selective
        for node, uid in heard.reception.beliefs:
            peer, guid = witness.lives[node], (uid.origin, uid.epoch, uid.sequence)
            if witness.is_excused(heard.life, peer) or guid in peer.gave_up:
                continue
            if not peer.manager.holds(uid):
                return f"{heard.vehicle.name} believes that {peer.name} holds {uid}, which it lacks"
            fragment = heard.life.parts.get(guid, {}).get(uid.part)
            if fragment is None:
                return f"{heard.vehicle.name} believes that {peer.name} holds {uid}, which it was never given itself"
            if not is_selective and witness.is_false(heard.life, peer, fragment):
                return f"{heard.vehicle.name} believes that {peer.name} holds {fragment}, but it has other content"
        return None


class _Founded:
    """Flaws of one kind in what world models have."""

    breaches: frozenset[Breach]
    moment = Moment.EVENT
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Look at what has come in with a packet; at the end at all that is in."""
        return _said(flaw for flaw in flaws if flaw.breach in self.breaches) if (flaws := scene.flaws) else None


class Recorded(_Founded):
    """No vehicle knows a value that nobody recorded."""

    name = "recorded"
    breaches = frozenset({Breach.UNRECORDED, Breach.OTHER_CONTENT})


class WholeBlocks(_Founded):
    """No vehicle knows a part of a block."""

    name = "whole-blocks"
    breaches = frozenset({Breach.PARTIAL})


class Remembered:
    """No vehicle loses what it held, or was given whole."""

    name = "remembered"
    moment = Moment.TICK
    not_under = DAMAGE

    def __init__(self) -> None:
        self._n_past = 0

    def broken(self, scene: Scene) -> str | None:
        """Look at all that was recorded and given when a vehicle has begun anew, and at the end."""
        witness, is_over = scene.witness, scene.finished is not None
        if (self._n_past == len(witness.past) and not is_over) or scene.is_selective:
            return None
        self._n_past = len(witness.past)
        if scene.setup.scenario.worldmodel.prune:
            return None
        return _said(flaw for life in witness.all_alive() for flaw in witness.lost(life))


class OneContent:
    """Of two contents under one name the one of smaller digest stays, whichever came first."""

    name = "one-content"
    moment = Moment.END
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Look at what was given by sound packets, if other content came under its name."""
        if scene.is_selective:
            return None
        return _said(chain.from_iterable(map(scene.witness.kept_out, scene.lives.values())))


class NewestCounts:
    """Of what a vehicle holds of one thing, that counts which was observed last, whatever came in last."""

    name = "newest"
    moment = Moment.END
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Ask world models for what counts, and look at all that they hold."""
        return _said(chain.from_iterable(map(scene.witness.outdated, scene.witness.all_alive())))


class Past:
    """No fact counts that lies in the future of who heard it, beyond the tolerance of clocks."""

    name = "past"
    moment = Moment.EVENT
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Look at what has come in with a packet."""
        if (heard := scene.heard) is None:
            return None
        model = heard.life.model
        latest_s = heard.own_s + model.clock_tolerance_s + model.clock_grid.step
        for change in heard.changes:
            if change.block.time_s > latest_s:
                return f"{heard.vehicle.name} heard at {heard.own_s:g} s of {change.block}"
        return None


class SoundPackets:
    """No damaged packet is taken for a sound one."""

    name = "sound-packets"
    moment = Moment.EVENT
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Look at a packet that was taken and that nobody sent."""
        heard = scene.heard
        if heard is None or heard.aired is not None or heard.reception.fault is not None:
            return None
        return f"{heard.vehicle.name} takes a packet for {heard.reception.sender}'s that nobody sent"


class KnowledgeAgreement:
    """After a quiet time, those who hear each other know the same."""

    name = "agreement"
    moment = Moment.END
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Look at the world models of those in contact."""
        if scene.is_selective or not scene.rested or scene.is_silent or scene.is_parted:
            return None
        lives = [scene.lives[vehicle.name] for vehicle in scene.in_contact() if vehicle.radio.communicates]
        return _said(scene.witness.apart(lives, of_all=scene.setup.policy.repeat))


class Rest:
    """After a quiet time nobody has anything left to say, and nothing waits."""

    name = "rest"
    moment = Moment.END
    not_under = DAMAGE | {Danger.HEARING + FOR_GOOD}  # who is heard and acknowledges nothing is told again and again

    def broken(self, scene: Scene) -> str | None:
        """Look at the queues of those in contact."""
        if scene.is_selective or scene.rested is None or scene.is_silent or len(scene.in_contact()) < 2:
            return None
        if scene.has_cut_links or any(vehicle.radio.manager.waits_for_absent for vehicle in scene.fleet.vehicles):
            return None
        if any(vehicle.is_alive and vehicle.condition.is_deaf for vehicle in scene.fleet.vehicles):  # still, at the end
            return None
        lives = [scene.lives[v.name] for v in scene.in_contact() if v.radio.communicates]
        return _said(scene.witness.restless(lives))
