"""Answers hold as long as they say: asked only where ``remoras stress --answers`` adds it.

Whoever says how long an answer holds is not asked meanwhile. Here it is asked all the same, as it would be without
that, and has to answer alike: behaviours of their references, decisions of the best combination of activities, and
negotiators of moves that stand until there is news. A mission that concludes nothing before then concludes nothing
still.
"""

from __future__ import annotations

from remoras.behaviours import distance_m
from remoras.vehicle import Vehicle
from stress.invariants.seam import Moment, Scene


class AnswersHold:
    """Whoever has said that an answer holds gives the same when it is asked again."""

    name = "answers"
    moment = Moment.TICK
    not_under: frozenset[str] = frozenset()

    def broken(self, scene: Scene) -> str | None:
        """The first answer that is another one before it was to be."""
        for vehicle in scene.fleet.vehicles:
            if vehicle.is_alive:
                found = _reference(vehicle) or _decision(vehicle) or _move(vehicle, scene.now_s) or _conclusion(vehicle)
                if found is not None:
                    return f"{found}, at {scene.now_s:g} s"
        return None


def _reference(vehicle: Vehicle) -> str | None:
    """The behaviour that guides gives another reference than the one that it said would hold."""
    layer = vehicle.functional
    held, behaviour = layer.held, layer.guiding
    if held is None or behaviour is None:
        return None
    to_go_m = distance_m(layer.believed, held.target_m)
    if to_go_m <= held.holds_m or (asked := behaviour.reference(layer.believed, layer.picture)) == held:
        return None
    return (
        f"{type(behaviour).__name__}.reference of {vehicle.name} said to hold to {held.holds_m:g} m from its target, "
        f"and {to_go_m:g} m from it answers {asked} in place of {held}"
    )


def _decision(vehicle: Vehicle) -> str | None:
    """The best combination of activities is another one; before the first decision nothing moves a vehicle."""
    executive = vehicle.executive
    if not any(executive.motivations) or (chosen := executive.decided_anew()) == executive.decision.chosen:
        return None
    return f"the decision of {vehicle.name} stands at sets {executive.decision.chosen}, and {chosen} are the best"


def _move(vehicle: Vehicle, now_s: float) -> str | None:
    """A negotiator that is not asked before there is news answers otherwise."""
    for group, move, now in vehicle.social.moves_anew(now_s, vehicle.functional.believed):
        if now != move:
            return f"negotiate of {vehicle.name} for {group} said to stand until news, and answers {now} for {move}"
    return None


def _conclusion(vehicle: Vehicle) -> str | None:
    """A mission that has said that it concludes nothing before there is news concludes something."""
    of = vehicle.social.present, vehicle.functional.picture, vehicle.functional.believed
    found = vehicle.social.conclusions.anew(vehicle.data, *of)
    return f"conclusions of {vehicle.name} said to be none until news, and are {list(found)}" if found else None
