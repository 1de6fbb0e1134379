"""Invariants of knowledge and organisation: beliefs match recorded content, and roles have authority."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain, pairwise

from stress.invariants import EVENT, TICK, Invariant, Scene
from stress.schedules import AWAY, DAMAGE, FOR_GOOD

from remoras.fleet.vehicle import Vehicle
from remoras.group_hierarchy import Defect, specification_faults
from remoras.organisation import Organisation
from remoras.recorder import ORGANISATION

MANY = 3
"""Flaws that a message names."""


def _said(flaws: Iterable[str]) -> str | None:
    """The flaws in words; None without any."""
    found = list(flaws)
    more = f"; and {len(found) - MANY} more" if len(found) > MANY else ""
    return "; ".join(found[:MANY]) + more if found else None


class TrueBeliefs(Invariant):
    """No vehicle believes that a peer holds content which it lacks."""

    name = "beliefs"
    moment = EVENT
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Check new beliefs after each packet, and all beliefs at the end."""
        heard, reference = scene.heard, scene.reference
        if heard is None:
            flaws = reference.false_beliefs() if not scene.is_selective else []
            return _said(f"{one} believes that {other} holds {uid}" for one, other, uid in flaws)
        is_selective = not heard.reception.beliefs or scene.is_selective
        for node, uid in heard.reception.beliefs:
            peer, guid = reference.lives[node], (uid.origin, uid.epoch, uid.sequence)
            if reference.is_excused(heard.life, peer) or guid in peer.gave_up:
                continue
            if not peer.manager.holds(uid):
                return f"{heard.vehicle.name} believes that {peer.name} holds {uid}, which it lacks"
            fragment = heard.life.parts.get(guid, {}).get(uid.part)
            if fragment is None:
                return f"{heard.vehicle.name} believes that {peer.name} holds {uid}, which it was never given itself"
            if not is_selective and reference.is_false(heard.life, peer, fragment):
                return f"{heard.vehicle.name} believes that {peer.name} holds {fragment}, but it has other content"
        return None


class Recorded(Invariant):
    """No vehicle knows a value that no vehicle recorded, or a part of a block."""

    name = "recorded"
    moment = EVENT
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Check blocks accepted after each packet, and all blocks at the end."""
        heard, reference = scene.heard, scene.reference
        if heard is None:
            return _said(flaw for life in reference.all_alive() for flaw in reference.unfounded(life))
        found = (reference.flaw_of(heard.life, change.block) for change in heard.changes)
        return _said(flaw for flaw in found if flaw is not None)


class Remembered(Invariant):
    """No vehicle loses a block it held or received completely."""

    name = "remembered"
    moment = TICK
    not_under = DAMAGE

    def __init__(self) -> None:
        self._n_past = 0

    def broken(self, scene: Scene) -> str | None:
        """Look at all that was recorded and given when a vehicle has begun anew, and at the end."""
        reference, is_over = scene.reference, scene.finished is not None
        if (self._n_past == len(reference.past) and not is_over) or scene.is_selective:
            return None
        self._n_past = len(reference.past)
        if scene.setup.scenario.worldmodel.prune:
            return None
        return _said(flaw for life in reference.all_alive() for flaw in reference.lost(life))


class OneContent(Invariant):
    """Of two contents with one name the smaller digest wins, in any order of reception."""

    name = "one-content"

    def broken(self, scene: Scene) -> str | None:
        """Check content of valid packets if other content has the same name."""
        if scene.is_selective:
            return None
        return _said(chain.from_iterable(map(scene.reference.kept_out, scene.lives.values())))


class NewestCounts(Invariant):
    """The latest observation of a property is valid, in any order of reception."""

    name = "newest"

    def broken(self, scene: Scene) -> str | None:
        """Compare the valid values of world models with all values they hold."""
        return _said(chain.from_iterable(map(scene.reference.outdated, scene.reference.all_alive())))


class Past(Invariant):
    """No accepted fact lies in the future of its receiver, beyond the clock tolerance."""

    name = "past"
    moment = EVENT

    def broken(self, scene: Scene) -> str | None:
        """Check blocks accepted with a packet."""
        if (heard := scene.heard) is None:
            return None
        model = heard.life.model
        latest_s = heard.own_s + model.clock_tolerance_s + model.clock_grid.step
        for change in heard.changes:
            if change.block.time_s > latest_s:
                return f"{heard.vehicle.name} heard at {heard.own_s:g} s of {change.block}"
        return None


class SoundPackets(Invariant):
    """No damaged packet is accepted as valid."""

    name = "sound-packets"
    moment = EVENT
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Check for an accepted packet that no vehicle sent."""
        heard = scene.heard
        if heard is None or heard.aired is not None or heard.reception.fault is not None:
            return None
        return f"{heard.vehicle.name} takes a packet for {heard.reception.sender}'s that nobody sent"


class KnowledgeAgreement(Invariant):
    """After a quiet time, vehicles in contact have equal knowledge."""

    name = "agreement"
    not_under = DAMAGE

    def broken(self, scene: Scene) -> str | None:
        """Check the world models of vehicles in contact."""
        if scene.is_selective or not scene.rested or scene.is_silent or scene.is_parted:
            return None
        lives = [scene.lives[vehicle.name] for vehicle in scene.in_contact() if vehicle.radio.communicates]
        return _said(scene.reference.apart(lives, of_all=scene.setup.policy.repeat))


class Rest(Invariant):
    """After a quiet time all queues are empty and nothing is pending."""

    name = "rest"
    not_under = DAMAGE | {"deaf" + FOR_GOOD}  # who is heard and acknowledges nothing is told again and again

    def broken(self, scene: Scene) -> str | None:
        """Check the queues of vehicles in contact."""
        if scene.is_selective or scene.rested is None or scene.is_silent or len(scene.in_contact()) < 2:
            return None
        if scene.has_cut_links or not all(vehicle.radio.manager.parking for vehicle in scene.fleet.vehicles):
            return None
        if any(vehicle.is_alive and vehicle.condition.is_deaf for vehicle in scene.fleet.vehicles):  # still, at the end
            return None
        lives = [scene.lives[v.name] for v in scene.in_contact() if v.radio.communicates]
        return _said(scene.reference.restless(lives))


# Organisation -------------------------------------------------------------------------------------

PEER, GROUP, ROLE, EVENT, ISSUER, ACT = (
    ORGANISATION.column_names.index(name) for name in ("peer", "group", "role", "event", "issuer", "act")
)
QUIET_LEASES = 2.0
"""Leases of absence after healing, from when on the organisation has to be well formed."""


class OnlyAuthorised(Invariant):
    """No vehicle holds a role or objective assigned without authority."""

    name = "authority"
    moment = TICK
    not_under = DAMAGE

    def __init__(self) -> None:
        self._n_read = 0
        self._led: set[tuple[str, str, str, str]] = set()

    def broken(self, scene: Scene) -> str | None:
        """Check changes of the organisation views since the last tick."""
        rows = scene.fleet.recorder.organisation
        forged = set(scene.forged)
        for row in rows[self._n_read :] if forged else ():
            acts = [(row[ISSUER], f"{row[GROUP]}.{row[ROLE]}", kind) for kind in ("role", "objective")]
            if row[EVENT] == "assigned" and row[PEER] == row[ISSUER] and row[ACT] == "assign" and acts[0] in forged:
                return f"{row[1]} takes {row[PEER]} for {acts[0][1]}, by its own will alone"
            lead = row[1], row[ISSUER], row[GROUP], row[ROLE]
            if row[EVENT] == "given" and acts[1] in forged and lead[:3] not in {of[:3] for of in self._led}:
                return f"{row[1]} heeds an objective of {acts[1][1]} by {row[ISSUER]}, which is outside"
            if row[ACT] == "succeed" and row[EVENT] == "assigned":
                self._led.add(lead)  # once it leads by right it may claim again
            before = row[1], row[PEER], row[GROUP], row[ROLE]  # one that came to lead since has no more right to it
            is_succeeded = row[EVENT] == "left" and (*lead[1:3], "lead") in forged and before != lead
            if is_succeeded and self._led.isdisjoint({lead, before}) and _leads(scene, *before):
                return f"{row[1]} obeys {row[ISSUER]} as head of {row[GROUP]}, though {row[PEER]} is there"
        self._n_read = len(rows)
        return None


def _leads(scene: Scene, hearer: str, head: str, group: str, role: str) -> bool:
    """True if a vehicle counts the leader so far of a group as present; absent vehicles are excluded."""
    of = {vehicle.name: vehicle for vehicle in scene.fleet.vehicles}
    led = scene.setup.agreement.organisation.groups.get(group)
    away = {fault.vehicle for fault in scene.schedule.fault if fault.kind in AWAY}
    if led is None or led.head_role != role or not away.isdisjoint({hearer, head}):
        return False
    return of[head].data.social_layer and head not in of[hearer].social.absent


class Cardinality(Invariant):
    """Some leases after recovery no role is over-filled or held by an unqualified vehicle."""

    name = "cardinality"
    not_under = DAMAGE | {"deaf" + FOR_GOOD, "mute" + FOR_GOOD}

    def broken(self, scene: Scene) -> str | None:
        """Check the own roles of vehicles in contact, after enough time to agree."""
        lease_s = scene.setup.scenario.communication.lease_frames * scene.setup.schedule.frame_s
        ended_s = scene.fleet.ended_s
        quiet_s = QUIET_LEASES * lease_s
        if scene.is_silent or scene.was_parted or ended_s < scene.schedule.heal_s + quiet_s:
            return None
        if _is_doubted(scene, ended_s - quiet_s) or _was_silent(scene, ended_s - quiet_s, lease_s):
            return None
        own = [
            role
            for vehicle in scene.in_contact()
            for role in vehicle.social.organisation.roles_of(vehicle.name)
            if f"{role.group}.{role.role}" not in _kept_to_itself(vehicle)
        ]
        groups = tuple(scene.setup.agreement.organisation.groups.values())
        wrong = (Defect.TOO_MANY, Defect.PLAYED_BY, Defect.INCOMPATIBLE)
        for fault in specification_faults(Organisation.of(groups, own)):
            if fault.defect in wrong:
                return f"{fault.key}: {fault.given}; allowed: {fault.allowed}"
        return None


def _is_doubted(scene: Scene, since_s: float) -> bool:
    """True if a vehicle in contact was declared absent: losses can cause a silence of a lease."""
    there = {vehicle.name for vehicle in scene.in_contact()}
    rows = scene.fleet.recorder.membership
    return any(row[0] >= since_s and row[3] == "absent" and {row[1], row[2]} <= there for row in rows)


def _was_silent(scene: Scene, since_s: float, lease_s: float) -> bool:
    """True if a vehicle in contact sent nothing for a lease: some strategies send only at rendezvous."""
    ended_s, packets = scene.fleet.ended_s, scene.fleet.recorder.packets
    for vehicle in scene.in_contact() if len(scene.fleet.vehicles) > 1 else ():
        spoken_s = [row[1] for row in packets if row[2] == vehicle.name and row[1] >= since_s]
        if any(after_s - before_s > lease_s for before_s, after_s in pairwise([since_s, *spoken_s, ended_s])):
            return True
    return False


def _kept_to_itself(vehicle: Vehicle) -> set[str]:
    """Roles that a vehicle plays without reporting them, as some strategies allow."""
    beliefs = vehicle.beliefs
    plays, me = beliefs.model.tbox.attribute_named("playsRole").uid, beliefs.uid(vehicle.name)
    facts = [fact for block in beliefs.model.private_blocks() for fact in block.facts]
    return {beliefs.name(fact.value) for fact in facts if (fact.subject, fact.attribute) == (me, plays)}  # type: ignore[arg-type]
