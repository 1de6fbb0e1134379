"""Answers hold as long as they say: asked only where ``remoras stress --answers`` adds it.

Whoever says how long an answer holds is not asked meanwhile. Here it is asked all the same, as it would be without
that, and has to answer alike.
"""

from __future__ import annotations

from remoras.behaviours import distance_m
from stress.invariants.seam import Moment, Scene


class AnswersHold:
    """The behaviour that guides a vehicle gives the reference that it said would hold."""

    name = "answers"
    moment = Moment.TICK
    not_under: frozenset[str] = frozenset()

    def broken(self, scene: Scene) -> str | None:
        """The first reference that is another one before it was to be."""
        for vehicle in scene.fleet.vehicles:
            layer = vehicle.functional
            held, behaviour = layer.held, layer.guiding
            if held is None or behaviour is None or not vehicle.is_alive:
                continue
            to_go_m = distance_m(layer.believed, held.target_m)
            if to_go_m > held.holds_m and (asked := behaviour.reference(layer.believed, layer.picture)) != held:
                return (
                    f"{type(behaviour).__name__}.reference of {vehicle.name} said to hold to {held.holds_m:g} m from "
                    f"its target, and at {scene.now_s:g} s, {to_go_m:g} m from it, answers {asked} in place of {held}"
                )
        return None
