"""Conclusions: what a mission lets a vehicle make known, asked in one place and held against the seam.

Gatherings: which groups a vehicle takes for gathered at their rally points.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import VehicleData
from remoras.mission import Finding, Nothing, SocialPart
from remoras.motion import Motion
from remoras.organisation import Organisation
from remoras.picture import Picture
from remoras.plugins import answer, broken_promise
from remoras.social.negotiation import Negotiation
from remoras.social.view import OBJECTIVE_PREFIX
from remoras.social.workload import BATTERY, Workload
from worldmodel import Change

GATHERED_AT = "gatheredAt"


class Gatherings:
    """What one vehicle believes of the meetings.

    A meeting before those that it must follow does not count. One that a vehicle concluded while it was cut off counts
    only as long as it is.

    Args:
        beliefs: of the vehicle.
        groups: names.
        meets_after: for each group, those that meet before it.
    """

    def __init__(self, beliefs: Beliefs, groups: Iterable[str], meets_after: Mapping[str, tuple[str, ...]]) -> None:
        self._beliefs = beliefs
        self._groups = tuple(groups)
        self._meets_after = meets_after
        self._alone_s: dict[str, float] = {}  # when a group was taken for gathered while cut off
        self.attribute = beliefs.model.tbox.attribute_named(GATHERED_AT).uid
        self.keys = frozenset((GATHERED_AT, group) for group in self._groups)
        """Facts that say of a group that it is gathered."""

    def begin(self, group: str, from_s: float) -> frozenset[Key]:
        """A group begins anew: its meetings before do not count, nor do those that follow them. Return their keys."""
        follow = (other for other, before in self._meets_after.items() if group in before)
        keys = frozenset((GATHERED_AT, met) for met in (group, *follow))
        for key in keys:
            self._beliefs.count_from(key, from_s)
        return keys

    def note_alone(self, keys: Iterable[Key], now_s: float) -> None:
        """These facts were concluded while the vehicle is cut off."""
        self._alone_s |= {group: now_s for _, group in self.keys.intersection(keys)}

    @property
    def concluded_alone(self) -> set[Key]:
        """Facts that were concluded while the vehicle was cut off."""
        return {(GATHERED_AT, group) for group in self._alone_s}

    def is_undone(self, key: Key, cut_off: bool) -> bool:
        """True if a fact was concluded by the vehicle while it was cut off, and it is so no longer."""
        if cut_off or not self._alone_s or key not in self.keys or key[1] not in self._alone_s:
            return False
        return self._beliefs.observed_s(key) == self._alone_s[key[1]]

    def believed(self, cut_off: bool) -> set[str]:
        """Groups believed to be together.

        Args:
            cut_off: True while the vehicle is.
        """
        keys = {group: (GATHERED_AT, group) for group in self._groups}
        met_s = {
            group: None if self.is_undone(key, cut_off) else self._beliefs.observed_s(key)
            for group, key in keys.items()
        }

        def follows_all(group: str, when_s: float) -> bool:
            before = (met_s[other] for other in self._meets_after.get(group, ()))
            return all(before_s is None or before_s <= when_s for before_s in before)

        return {group for group, when_s in met_s.items() if when_s is not None and follows_all(group, when_s)}


class Conclusions:
    """Findings of a mission for one vehicle, as facts.

    Args:
        me: own name.
        mission: that is asked; mission_name: what messages call it.
        beliefs: of the vehicle.

    Attributes:
        are_of_its_own: False if the mission lets vehicles conclude nothing for themselves.
    """

    def __init__(self, me: str, mission: SocialPart, mission_name: str, beliefs: Beliefs) -> None:
        self._me = me
        self._mission = mission
        self._mission_name = mission_name
        self._beliefs = beliefs
        self._until_s = -math.inf  # nothing is concluded before, without news
        self._asked_of: tuple[Organisation, tuple[str, ...]] | None = None
        model = beliefs.model
        self._is_told_always = {model.tbox.attribute_named(name).uid for name in ("position", BATTERY)}
        self._is_told_always -= model.inference.heeded
        self.are_of_its_own = getattr(type(mission), "conclusions", None) is not SocialPart.conclusions

    def completion(self, objective: Objective) -> list[Fact]:
        """What to make known when all has been done for ``objective``; often nothing."""
        return self._facts_of(self._completing(objective))

    def _ends(self, objective: Objective) -> set[Key]:
        """Facts of which it is known that all has been done for ``objective``; often none."""
        return {(finding.attribute, finding.subject) for finding in self._completing(objective)}

    def taken_back(
        self, objectives: Iterable[Objective], gatherings: Gatherings, workload: Workload, negotiation: Negotiation
    ) -> set[Key]:
        """Facts that count no longer as they were told, since objectives were given after their group had gathered.

        A head gives an objective then that was not reached, whoever said so: that it was, and that the group has
        gathered, is over, and so is how the group's jobs were divided.

        Args:
            objectives: objectives that count now.
            gatherings, workload, negotiation: of the vehicle; they take note of it.
        """
        over: set[Key] = set()
        met_s = {objective: self._beliefs.observed_s((GATHERED_AT, objective.group)) for objective in objectives}
        for objective, before_s in met_s.items():
            said_s = self._beliefs.observed_s(
                (OBJECTIVE_PREFIX + objective.name, f"{objective.group}.{objective.role}")
            )
            if before_s is not None and said_s is not None and before_s < said_s and (ends := self._ends(objective)):
                over |= ends | gatherings.begin(objective.group, said_s)
                for key in ends:
                    self._beliefs.count_from(key, said_s)
                workload.give_anew(ends)
                negotiation.begin(objective.group)
        if over:
            self._until_s = -math.inf
        return over

    def note(self, changes: Iterable[Change]) -> None:
        """Facts were recorded or merged: unless they are what each vehicle tells in its slots, they are news."""
        if self._until_s == -math.inf:
            return
        for change in changes:
            for fact in change.block.facts:
                if fact.attribute not in self._is_told_always:
                    self._until_s = -math.inf
                    return

    def _completing(self, objective: Objective) -> Sequence[Finding]:
        finding = answer(
            self._mission_name,
            "completion",
            "a Finding or None",
            lambda finding: finding is None or isinstance(finding, Finding),
            lambda: self._mission.completion(objective, self._me),
        )
        return () if finding is None else (finding,)

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
            findings: Sequence[Finding] = tuple(
                self._mission.findings(group, organisation, self._beliefs, picture, motion)
            )
        except Exception as error:
            raise broken_promise(self._mission_name, "findings", expected, error) from error
        if findings and not all(isinstance(finding, Finding) for finding in findings):
            raise broken_promise(self._mission_name, "findings", expected, findings)
        return self._facts_of(findings)

    def of_its_own(self, data: VehicleData, organisation: Organisation, picture: Picture, motion: Motion) -> list[Fact]:
        """What a vehicle concludes for itself; arguments as of ``of_head``."""
        if self.holds(organisation, picture):
            return []
        findings = self._own(data, organisation, picture, motion)
        self._until_s = findings.until_s if isinstance(findings, Nothing) else -math.inf
        self._asked_of = organisation, picture.body.answering
        return self._facts_of(findings)

    def holds(self, organisation: Organisation, picture: Picture) -> bool:
        """True while the mission has said that it concludes nothing; arguments as of ``of_head``."""
        of = self._asked_of
        if of is None or not picture.body.now_s < self._until_s:
            return False
        return of[0] is organisation and of[1] == picture.body.answering

    def _own(
        self, data: VehicleData, organisation: Organisation, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        def asked() -> Sequence[Finding]:
            found = self._mission.conclusions(data, organisation, self._beliefs, picture, motion)
            return found if isinstance(found, Nothing) else tuple(found)

        return answer(
            self._mission_name,
            "conclusions",
            "a list of Finding",
            lambda findings: all(isinstance(finding, Finding) for finding in findings),
            asked,
        )

    def _facts_of(self, findings: Iterable[Finding]) -> list[Fact]:
        return [self._beliefs.fact(finding.subject, finding.attribute, finding.value) for finding in findings]
