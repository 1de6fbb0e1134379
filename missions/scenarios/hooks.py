"""Checks of the answers of a mission's hooks, made once before a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from missions.errors import ConfigurationFault
from missions.figure import Figure, Layer, Mark, Place
from remoras.activities import Objective
from remoras.errors import PluginError
from remoras.htn import Domain
from remoras.mission import ELEMENTARY_TASKS, Mission
from remoras.plugins import answer
from remoras.recorder import Recorder
from remoras.work import Job

PARTS_OF_JOB = ("name", "place_m", "needs", "done", "is_able", "after")
PARTS_OF_TRUTH = ("milestones", "goal_fraction", "is_over", "observe", "close")


def hook_faults(reference: str, made: Mission) -> Iterator[ConfigurationFault]:
    """Hooks of a mission that raise, or answer with something else than the seam says.

    Args:
        reference: name of the mission in the scenario.
        made: the mission of a scenario.
    """
    count = "a whole number, 0 or more"
    hooks: tuple[tuple[str, str, Callable[[Any], bool], Callable[[], Any]], ...] = (
        ("jobs", f"objects by name, each with {', '.join(PARTS_OF_JOB)}", _are_jobs, lambda: made.jobs),
        ("world", "what its sensors perceive", lambda found: True, lambda: made.world(0)),
        (
            "nature",
            "None, or what is called with the fleet and the time",
            _is_nature,
            lambda: made.nature(made.world(0)),
        ),
        ("social_domain", _allowed_domain(), _is_domain, lambda: made.social_domain),
        ("founding_objectives", "a list of Objective", _all_are(Objective), made.founding_objectives),
        (
            "figures",
            "a tuple of Figure, Layer and Mark of missions.figure",
            _all_are(Figure, Layer, Mark),
            lambda: made.figures,
        ),
        ("places", "a list of missions.figure.Place", _all_are(Place), lambda: made.places),
        ("instances", "a list of (class, name), both texts", _are_instances, lambda: made.instances),
        ("instances_found_per_vehicle", count, _is_count, lambda: made.instances_found_per_vehicle),
        ("most_observations", count, _is_count, lambda: made.most_observations),
        (
            "truth",
            f"an object with {', '.join(PARTS_OF_TRUTH)}",
            _is_truth,
            lambda: made.truth(Recorder(made.tables), made.world(0)),
        ),
    )
    raised: set[str] = set()
    for hook, expected, is_expected, asked in hooks:
        try:
            answer("its", hook, expected, is_expected, asked)
        except PluginError as error:
            text = str(error).removeprefix("its: ")
            cause = repr(error.__cause__)
            if error.__cause__ is not None and cause in raised:
                continue  # a hook that asks another one, which has been told
            raised.add(cause)
            yield ConfigurationFault("scenario.mission", f'"{reference}"', text)


def _all_are(*kinds: type) -> Callable[[Any], bool]:
    return lambda found: all(isinstance(one, kinds) for one in found)


def _is_nature(found: Any) -> bool:
    return found is None or callable(found)


def _is_truth(found: Any) -> bool:
    return all(hasattr(found, part) for part in PARTS_OF_TRUTH)


def _are_jobs(found: Any) -> bool:
    jobs: Mapping[str, Job] = found
    return all(hasattr(job, part) for job in jobs.values() for part in PARTS_OF_JOB)


def _are_instances(found: Any) -> bool:
    return all(isinstance(kind, str) and isinstance(name, str) for kind, name in found)


def _is_count(found: Any) -> bool:
    return isinstance(found, int) and found >= 0


def _allowed_domain() -> str:
    return f"a remoras.htn.Domain whose elementary tasks have a handler among {', '.join(ELEMENTARY_TASKS)}"


def _is_domain(found: Any) -> bool:
    return isinstance(found, Domain) and all(
        operator.handled_by in ELEMENTARY_TASKS for operator in found.operators.values()
    )
