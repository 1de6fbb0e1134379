"""Conclusions: what a mission lets a vehicle make known, asked in one place and held against the seam."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact
from remoras.database import VehicleData
from remoras.mission import Finding, SocialPart
from remoras.motion import Motion
from remoras.organisation import Organisation
from remoras.picture import Picture
from remoras.plugins import answer, broken_promise


class Conclusions:
    """Findings of a mission for one vehicle, as facts.

    Args:
        me: own name.
        mission: that is asked; mission_name: what messages call it.
        beliefs: of the vehicle.
    """

    def __init__(self, me: str, mission: SocialPart, mission_name: str, beliefs: Beliefs) -> None:
        self._me = me
        self._mission = mission
        self._mission_name = mission_name
        self._beliefs = beliefs

    def completion(self, objective: Objective) -> list[Fact]:
        """What to make known when all has been done for ``objective``; often nothing."""
        finding = answer(
            self._mission_name,
            "completion",
            "a Finding or None",
            lambda found: found is None or isinstance(found, Finding),
            lambda: self._mission.completion(objective, self._me),
        )
        return [] if finding is None else self._facts_of([finding])

    def of_head(self, name: str, organisation: Organisation, picture: Picture, motion: Motion) -> list[Fact]:
        """What a head concludes about its group.

        Args:
            name: of the group.
            organisation: without the absent.
            picture: what the vehicle knows of the peers; motion: its own.
        """
        expected = "a list of Finding"
        group = organisation.groups[name]
        try:
            found: Sequence[Finding] = tuple(
                self._mission.findings(group, organisation, self._beliefs, picture, motion)
            )
        except Exception as error:
            raise broken_promise(self._mission_name, "findings", expected, error) from error
        if found and not all(isinstance(one, Finding) for one in found):
            raise broken_promise(self._mission_name, "findings", expected, found)
        return self._facts_of(found)

    def of_its_own(self, data: VehicleData, organisation: Organisation, picture: Picture, motion: Motion) -> list[Fact]:
        """What a vehicle concludes for itself; arguments as of ``of_head``."""
        found: Sequence[Finding] = answer(
            self._mission_name,
            "conclusions",
            "a list of Finding",
            lambda given: all(isinstance(one, Finding) for one in given),
            lambda: tuple(self._mission.conclusions(data, organisation, self._beliefs, picture, motion)),
        )
        return self._facts_of(found)

    def _facts_of(self, findings: Iterable[Finding]) -> list[Fact]:
        return [self._beliefs.fact(one.subject, one.attribute, one.value) for one in findings]
