"""Invariants of the organisation: who plays what, and by whose will."""

from __future__ import annotations

from itertools import pairwise

from missions.fault import Danger
from remoras.organisation import Organisation
from remoras.recorder import ORGANISATION
from remoras.vehicle import Vehicle
from remoras.wellformed import Defect, specification_faults
from stress.invariants.seam import Moment, Scene
from stress.kinds import FOR_GOOD, kind_of

PEER, GROUP, ROLE, EVENT, ISSUER, ACT = (
    ORGANISATION.column_names.index(name) for name in ("peer", "group", "role", "event", "issuer", "act")
)
QUIET_LEASES = 2.0
"""Leases of absence after healing, from when on the organisation has to be well formed."""


class OnlyAuthorised:
    """Nobody plays a role, or has an objective, by the will of who has no authority to give it."""

    name = "authority"
    moment = Moment.TICK
    not_under = frozenset({"forged", "bits", "cut"})

    def __init__(self) -> None:
        self._n_read = 0
        self._led: set[tuple[str, str, str, str]] = set()

    def broken(self, scene: Scene) -> str | None:
        """Look at what vehicles have come to hold true of the organisation since the last tick."""
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
    """True if a vehicle takes another, that has led a group until now, for present; of who was away nobody can say."""
    of = {vehicle.name: vehicle for vehicle in scene.fleet.vehicles}
    led = scene.setup.agreement.organisation.groups.get(group)
    away = {fault.vehicle for fault in scene.schedule.fault if kind_of(fault.kind).takes_away}
    if led is None or led.head_role != role or not away.isdisjoint({hearer, head}):
        return False
    return of[head].data.social_layer and head not in of[hearer].social.standing.absent


class Cardinality:
    """Some leases after recovery no role is over-filled or held by an unqualified vehicle."""

    name = "cardinality"
    moment = Moment.END
    not_under = frozenset({"forged", "bits", "cut", Danger.HEARING + FOR_GOOD, Danger.VOICE + FOR_GOOD})

    def broken(self, scene: Scene) -> str | None:
        """Look at what those in contact take themselves to play, if they have had the time to agree."""
        lease_s = scene.setup.scenario.communication.lease_frames * scene.setup.schedule.frame_s
        ended_s = scene.fleet.ended_s
        quiet_s = QUIET_LEASES * lease_s
        if scene.is_silent or scene.was_parted or ended_s < scene.schedule.stress.heal_s + quiet_s:
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
    """True if somebody in contact was taken for absent: losses are such that a silence of a lease comes about."""
    there = {vehicle.name for vehicle in scene.in_contact()}
    rows = scene.fleet.recorder.membership
    return any(row[0] >= since_s and row[3] == "absent" and {row[1], row[2]} <= there for row in rows)


def _was_silent(scene: Scene, since_s: float, lease_s: float) -> bool:
    """True if somebody in contact said nothing for a lease: some strategies speak only where they meet."""
    ended_s, packets = scene.fleet.ended_s, scene.fleet.recorder.packets
    for vehicle in scene.in_contact() if len(scene.fleet.vehicles) > 1 else ():
        spoken_s = [row[1] for row in packets if row[2] == vehicle.name and row[1] >= since_s]
        if any(after_s - before_s > lease_s for before_s, after_s in pairwise([since_s, *spoken_s, ended_s])):
            return True
    return False


def _kept_to_itself(vehicle: Vehicle) -> set[str]:
    """Roles that a vehicle plays without telling anybody, as some strategies have it."""
    beliefs = vehicle.beliefs
    plays, me = beliefs.model.tbox.attribute_named("playsRole").uid, beliefs.uid(vehicle.name)
    facts = [fact for block in beliefs.model.private_blocks() for fact in block.facts]
    return {beliefs.name(fact.value) for fact in facts if (fact.subject, fact.attribute) == (me, plays)}  # type: ignore[arg-type]
