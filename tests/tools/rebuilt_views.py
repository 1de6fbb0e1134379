"""What vehicles know of the organisation, is it what follows from all their facts at once? Counted in random schedules.

    python -m tests.tools.rebuilt_views areas-100m 3504006 60

runs 60 schedules of ``tests.tools.campaigns`` on a ground, from a seed on. At the end of each, a vehicle of the same
name that knows nothing takes over the world model of each that is alive and was never cut off, and counts it in one
round. It prints how many differ, and in what.
"""

from __future__ import annotations

import argparse
from collections import Counter
from typing import Any

from missions.runs.assembly import assemble
from missions.runs.setup import Setup
from remoras.fleet import Fleet
from remoras.social.standing import Standing
from remoras.vehicle import Vehicle
from stress import trial
from stress.campaign import campaign
from stress.drawing import plan_of
from tests.tools.campaigns import ground_of
from worldmodel.remembering import remember


def known(vehicle: Vehicle) -> dict[str, Any]:
    """What a vehicle knows of the organisation."""
    social, standing = vehicle.social, vehicle.social.standing
    return {
        "roles": standing.organisation.assignments,
        "claims": standing.view.leadership.leading,
        "objectives": set(social.objectives.values()),
        "missions": social.missions,
        "takes no jobs": standing.takes_no_jobs,
    }


def rebuilt(vehicle: Vehicle, fresh: Vehicle, now_s: float) -> dict[str, Any]:
    """The same, if it had heard all at once, and missed whom it misses now.

    Args:
        vehicle: whose world model is taken over.
        fresh: one of the same name that knows nothing.
        now_s: the time now.
    """
    social = fresh.social
    social.standing._membership.absent = vehicle.social.standing.absent
    social.consider(remember(fresh.beliefs.model, vehicle.beliefs.model, now_s).changes)
    social.consult()
    return known(fresh)


class Count:
    """Counts while schedules run."""

    def __init__(self) -> None:
        self.n_vehicles = 0
        self.differ: Counter[str] = Counter()
        self._cut_off: set[int] = set()

    def look_out(self) -> None:
        """Look at each fleet when its mission is over."""
        look_around, rest = Standing.look_around, trial._Trial._rest

        def noted(standing: Standing, *seen: Any) -> Any:
            came = look_around(standing, *seen)
            if standing.is_cut_off:
                self._cut_off.add(id(standing))
            return came

        def counted(of: Any) -> None:
            self._count(of.fleet, of.setup)
            rest(of)

        Standing.look_around = noted  # type: ignore[method-assign]
        trial._Trial._rest = counted  # type: ignore[method-assign]

    def _count(self, fleet: Fleet, setup: Setup) -> None:
        again = assemble(setup, seed=1)
        for vehicle, fresh in zip(fleet.vehicles, again.vehicles, strict=True):
            if not vehicle.is_alive or id(vehicle.social.standing) in self._cut_off:
                continue
            now, then = known(vehicle), rebuilt(vehicle, fresh, fleet.now_s)
            self.n_vehicles += 1
            parts = [part for part in now if now[part] != then[part]]
            self.differ.update([*parts, *(["any"] if parts else [])])
        again.close()
        self._cut_off.clear()


def main() -> None:
    """Run the schedules, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ground")
    parser.add_argument("first", type=int)
    parser.add_argument("schedules", type=int)
    asked = parser.parse_args()
    ground, count = ground_of(asked.ground), Count()
    count.look_out()
    campaign(plan_of(ground.scenario, "", ground.settings), range(asked.first, asked.first + asked.schedules))
    parts = ", ".join(f"{part} {n}" for part, n in count.differ.items() if part != "any")
    print(f"{asked.ground}: of {count.n_vehicles} vehicles {count.differ['any']} differ ({parts or 'in nothing'})")


if __name__ == "__main__":
    main()
