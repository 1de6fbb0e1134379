"""Facts that a mission infers for a vehicle; groups believed gathered at rally points."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import VehicleData
from remoras.mission_parts import Finding, SocialPart
from remoras.motion import Motion
from remoras.organisation import Organisation
from remoras.picture import Picture
from remoras.plugins import answer
from remoras.recorder import OBJECTIVES
from remoras.sensor import NEVER_QUIET, Quiet, QuietFrom
from remoras.social.negotiation import Negotiation
from remoras.social.workload import BATTERY, Workload
from worldmodel import Change

GATHERED_AT = "gatheredAt"


class Gatherings:
    """Groups that one vehicle believes gathered, until a group that precedes them gathers again."""

    def __init__(self, beliefs: Beliefs, groups: Iterable[str], meets_after: Mapping[str, tuple[str, ...]]) -> None:
        self._beliefs = beliefs
        self._groups = tuple(groups)
        self._meets_after = meets_after
        self._alone_s: dict[str, float] = {}  # time of gatherings inferred while isolated
        self.attribute = beliefs.model.tbox.attribute_named(GATHERED_AT).uid
        self.keys = frozenset((GATHERED_AT, group) for group in self._groups)

    def begin(self, group: str, from_s: float) -> frozenset[Key]:
        """Invalidate gatherings of a restarted group and of groups that meet after it; return keys."""
        follow = (other for other, before in self._meets_after.items() if group in before)
        keys = frozenset((GATHERED_AT, met) for met in (group, *follow))
        for key in keys:
            self._beliefs.count_from(key, from_s)
        return keys

    def note_alone(self, keys: Iterable[Key], now_s: float) -> None:
        """Mark facts inferred while the vehicle is isolated."""
        self._alone_s |= {group: now_s for _, group in self.keys.intersection(keys)}

    @property
    def concluded_alone(self) -> set[Key]:
        """Facts inferred while the vehicle was isolated."""
        return {(GATHERED_AT, group) for group in self._alone_s}

    def is_undone(self, key: Key, cut_off: bool) -> bool:
        """Return whether the vehicle inferred a fact while isolated and has reconnected."""
        if cut_off or not self._alone_s or key not in self.keys or key[1] not in self._alone_s:
            return False
        return self._beliefs.observed_s(key) == self._alone_s[key[1]]

    def believed(self, cut_off: bool) -> frozenset[str]:
        """Return the groups believed gathered; ``cut_off`` is True while the vehicle is isolated."""
        keys = {group: (GATHERED_AT, group) for group in self._groups}
        met_s = {
            group: None if self.is_undone(key, cut_off) else self._beliefs.observed_s(key)
            for group, key in keys.items()
        }

        def follows_all(group: str, when_s: float) -> bool:
            before = (met_s[other] for other in self._meets_after.get(group, ()))
            return all(before_s is None or before_s <= when_s for before_s in before)

        return frozenset(group for group, when_s in met_s.items() if when_s is not None and follows_all(group, when_s))


class Conclusions:
    """Findings of a mission for one vehicle, as facts."""

    def __init__(self, me: str, mission: SocialPart, beliefs: Beliefs) -> None:
        self._me = me
        self._mission = mission
        self._mission_name = f"mission {type(mission).__name__}"
        self._beliefs = beliefs
        self._quiet = NEVER_QUIET
        self._asked_of: tuple[Organisation, tuple[str, ...]] | None = None
        model = beliefs.model
        self._is_told_always = {model.tbox.attribute_named(name).uid for name in ("position", BATTERY)}
        # Unless the ontology infers classes from them.
        self._is_told_always -= model.inference.heeded
        self.are_of_its_own = getattr(type(mission), "conclusions", None) is not SocialPart.conclusions

    def completion(self, objective: Objective) -> list[Fact]:
        """Return the facts to state when ``objective`` is complete; often none."""
        return self._facts_of(self._completing(objective))

    def _ends(self, objective: Objective) -> set[Key]:
        return {(finding.attribute, finding.subject) for finding in self._completing(objective)}

    def taken_back(
        self, objectives: Iterable[Objective], gatherings: Gatherings, workload: Workload, negotiation: Negotiation
    ) -> set[Key]:
        """Invalidate facts of objectives assigned again after a gathering; return the keys."""
        # A leader assigns such an objective only if it was not reached.
        over: set[Key] = set()
        met_s = {objective: self._beliefs.observed_s((GATHERED_AT, objective.group)) for objective in objectives}
        for objective, before_s in met_s.items():
            said_s = self._beliefs.observed_s((OBJECTIVES + objective.name, f"{objective.group}.{objective.role}"))
            if before_s is not None and said_s is not None and before_s < said_s and (ends := self._ends(objective)):
                over |= ends | gatherings.begin(objective.group, said_s)
                for key in ends:
                    self._beliefs.count_from(key, said_s)
                workload.give_anew(ends)
                negotiation.begin(objective.group)
        if over:
            self._quiet = NEVER_QUIET
        return over

    def note(self, changes: Iterable[Change]) -> None:
        """Ask the mission again if recorded or merged facts are more than periodic vehicle reports."""
        for change in changes if self._quiet is not NEVER_QUIET else ():
            for fact in change.block.facts:
                if fact.attribute not in self._is_told_always:
                    self._quiet = NEVER_QUIET
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
        """Return the facts that a leader infers about its group; ``organisation`` lacks the absent."""
        group = organisation.groups[name]
        return self._facts_of(
            self._asked("findings", lambda: self._mission.findings(group, organisation, self._beliefs, picture, motion))
        )

    def of_its_own(self, data: VehicleData, organisation: Organisation, picture: Picture, motion: Motion) -> list[Fact]:
        """Return the facts that a vehicle infers about itself; arguments as in ``of_head``."""
        if self.holds(organisation, picture, motion):
            return []
        context = data, organisation, self._beliefs, picture, motion
        findings = self._asked("conclusions", lambda: self._mission.conclusions(*context))
        self._quiet = NEVER_QUIET
        if isinstance(findings, Quiet):
            self._quiet = QuietFrom(findings.until_m, findings.until_s, motion.x_m, motion.y_m)
        self._asked_of = organisation, picture.body.answering
        return self._facts_of(findings)

    def holds(self, organisation: Organisation, picture: Picture, motion: Motion) -> bool:
        """Return whether the mission's last answer is still valid: no conclusions here and now."""
        asked_of = self._asked_of
        if asked_of is None or not self._quiet.holds(motion.x_m, motion.y_m, picture.body.now_s):
            return False
        return asked_of[0] is organisation and asked_of[1] == picture.body.answering

    def _asked(self, hook: str, asked: Callable[[], Sequence[Finding]]) -> Sequence[Finding]:
        def findings() -> Sequence[Finding]:
            result = asked()
            return result if isinstance(result, Quiet) else tuple(result)

        return answer(self._mission_name, hook, "a list of Finding", _are_findings, findings)

    def _facts_of(self, findings: Iterable[Finding]) -> list[Fact]:
        return [self._beliefs.fact(finding.subject, finding.attribute, finding.value) for finding in findings]


def _are_findings(result: Iterable[object]) -> bool:
    return all(isinstance(finding, Finding) for finding in result)
