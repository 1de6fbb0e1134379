"""Conclusions of a vehicle from facts and responding modules: service status, requests, choice, verdicts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from missions.meeting.sequential_tests import sequential_verdict
from missions.trident.jobs import is_open
from missions.trident.scenario import TridentSettings
from missions.trident.services import AVAILABLE, CANDIDATE, CHOOSE, FAILED, Matching, SeabedBlock, Service, parties
from remoras.beliefs import Beliefs
from remoras.htn import FactsLike
from remoras.mission import Finding, Quiet
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.work import Point

NEAR_S = 1.0  # margin around a due time within which conclusions are evaluated at each decision


@dataclass(frozen=True)
class WithMembers:
    """Beliefs with the fact interface of plans: role members and class instances."""

    beliefs: Beliefs
    organisation: Organisation

    def get(self, key: tuple[str, str], default: object = None, /) -> object:
        """Return the value of a fact, or ``default`` if unknown."""
        if key[0] == "members":
            return self.organisation.members(*key[1].split("."))
        return self.beliefs.instances(key[1]) if key[0] == "instances" else self.beliefs.get(key, default)


@dataclass(frozen=True)
class Concluding:
    """Rules that turn a vehicle's facts into statements: status, requests, choice, verdicts."""

    matching: Matching
    groups: Mapping[str, Group]
    blocks: Mapping[str, SeabedBlock]
    recovery: str
    settings: TridentSettings

    def of(self, me: str, organisation: Organisation, beliefs: Beliefs, picture: Picture) -> Sequence[Finding]:
        """Return the first pending conclusion of a vehicle; one at a time keeps packets short."""
        facts, now_s = WithMembers(beliefs, organisation), picture.body.now_s
        for service in self.matching.services.values():
            if service.vehicle == me and (findings := _status(service, beliefs, picture)):
                return findings
        for findings in (
            self._asked(me, organisation, facts),
            self._served(me, beliefs),
            self._chosen(me, organisation, beliefs, facts, now_s),
            self._judged(me, organisation, beliefs),
            self._absent(me, organisation, beliefs, now_s),
            self._adrift(me, beliefs),
        ):
            if findings:
                return findings
        return Quiet(until_s=self._until_s(beliefs, now_s))

    def _until_s(self, beliefs: Beliefs, now_s: float) -> float:
        """Time until which nothing changes without new facts."""
        due_s, chosen_s = self._due_s(beliefs), beliefs.observed_s(("chosen", self.recovery))
        times_s = [] if chosen_s is None else [chosen_s + self.settings.reach_limit_s]
        if due_s is not None:
            times_s += [due_s + service.settings.delay_s for service in self.matching.services.values()]
        return min([time_s - NEAR_S for time_s in times_s if now_s <= time_s + NEAR_S], default=math.inf)

    def _asked(self, me: str, organisation: Organisation, facts: FactsLike) -> list[Finding]:
        """Request the service of another vehicle for an own block if that service ranks first."""
        for group, block in self._jobs_of(me, organisation):
            if block not in self.blocks or facts.get(("surveyedBy", block)) is not None:
                continue
            ways = self.matching.for_block(me, block, facts, parties(group, facts))
            if ways and self.matching.services[ways[0]].vehicle != me and facts.get(("requestedOf", block)) != ways[0]:
                return [Finding(block, "requestedOf", ways[0])]
        return []

    def _jobs_of(self, me: str, organisation: Organisation) -> Iterator[tuple[Group, str]]:
        """Yield group and job of each role of a vehicle that has a job."""
        for group in self.groups.values():
            for role in group.roles:
                if role.job is not None and organisation.plays(me, group.name, role.name):
                    yield group, role.job

    def requests(self, me: str, facts: FactsLike) -> list[tuple[str, Service]]:
        """Return the blocks that a vehicle is requested to survey, with the service."""
        requested = []
        for block in self.blocks:
            asked = self.matching.services.get(facts.get(("requestedOf", block)) or "")
            if asked is not None and asked.vehicle == me and facts.get(("surveyedBy", block)) is None:
                requested.append((block, asked))
        return requested

    def _served(self, me: str, beliefs: Beliefs) -> list[Finding]:
        for block, _ in self.requests(me, beliefs):
            if len(beliefs.values(("chartedTile", block))) >= len(self.blocks[block].tiles):
                return [Finding(block, "surveyedBy", me)]
        return []

    # The choice ----------------------------------------------------------------------------------

    def _chosen(
        self, me: str, organisation: Organisation, beliefs: Beliefs, facts: FactsLike, now_s: float
    ) -> list[Finding]:
        since_s = self._due_s(beliefs)
        if since_s is None:
            return []
        present = frozenset(name for group in self.groups.values() for name in parties(group, facts))
        ways = self.matching.ways(CHOOSE, me, facts, present)
        if not ways:
            return self._nobody_chooses(me, organisation, beliefs)
        chooser = self.matching.services[ways[0]]
        if chooser.vehicle != me or now_s - since_s < chooser.settings.delay_s:
            return []
        # A plan may use an own service without a status, but a choice waits for the self-test.
        if beliefs.get(("serviceStatus", chooser.name)) != AVAILABLE:
            return []
        n_again = int(beliefs.get(("surveysAgain", self.recovery), 0))
        asked, is_under_way = self._survey_again(me, beliefs, facts, present, n_again)
        if is_under_way:
            return asked
        candidates = beliefs.instances(CANDIDATE)
        likely = [(_likeness(beliefs, name), name) for name in candidates if is_open(beliefs, name)]
        rejected = () if likely else candidates
        again = [name for name in rejected if beliefs.count(("verdict", name), "open") < self.settings.looks_again]
        # Absent candidates first: they were never observed closely, whereas the others look like decoys.
        anew = [name for name in again if beliefs.get(("verdict", name)) == "absent"]
        if not (likely or anew) and n_again < self.settings.surveys_again:
            asked, is_possible = self._survey_again(me, beliefs, facts, present, n_again + 1)
            if is_possible:
                return [Finding(self.recovery, "surveysAgain", n_again + 1), *asked]
        anew = anew or again
        likely += [(_likeness(beliefs, name), name) for name in anew]
        is_exhausted = bool(beliefs.get(("isExhausted", self.recovery)))
        if not likely:
            return [] if is_exhausted else [Finding(self.recovery, "isExhausted", True)]
        # Ties go by name, which is the same on all vehicles.
        name = min(likely, key=lambda weighed: (-weighed[0], weighed[1]))[1]
        place = beliefs.fused(("location", name))
        at_m: Point | None = None if place is None else place.value
        if at_m is None:
            return []
        # Reopening dates the verdict, so that only later observations count.
        opened = [Finding(name, "verdict", "open")] if anew else []
        opened += [Finding(self.recovery, "isExhausted", False)] if is_exhausted else []
        return [*opened, Finding(self.recovery, "chosen", name), Finding(self.recovery, "chosenAt", at_m)]

    def _nobody_chooses(self, me: str, organisation: Organisation, beliefs: Beliefs) -> list[Finding]:
        """Leader: report exhaustion if no present vehicle has a choosing service that may work."""
        leads = any(
            me in organisation.heads(group.name) and any(role.job == self.recovery for role in group.roles)
            for group in self.groups.values()
        )
        if not leads or beliefs.get(("isExhausted", self.recovery)):
            return []
        for name in beliefs.instances(self.matching.activities[CHOOSE].requires):
            present = organisation.members(*(group.name for group in self.groups.values()))
            if self.matching.services[name].vehicle in present and beliefs.get(("serviceStatus", name)) != FAILED:
                return []
        return [Finding(self.recovery, "isExhausted", True)]

    def _survey_again(
        self, me: str, beliefs: Beliefs, facts: FactsLike, present: frozenset[str], n_again: int
    ) -> tuple[list[Finding], bool]:
        asked, is_possible = list[Finding](), False
        if n_again == 0 or self.matching.response != "matching":
            return asked, is_possible  # fixed plans contain no requests
        for block in self.blocks:
            if int(beliefs.get(("surveyedAgain", block), 0)) >= n_again:
                continue
            ways = self.matching.for_block(me, block, facts, present)
            is_possible = is_possible or bool(ways)
            if ways and beliefs.get(("requestedOf", block)) not in ways:
                asked.append(Finding(block, "requestedOf", ways[0]))
        return asked, is_possible

    def _due_s(self, beliefs: Beliefs) -> float | None:
        """Time since which a choice is pending, by a survey, rejection or identification; else None."""
        if beliefs.get(("recoveredBy", self.recovery)) is not None:
            return None
        chosen = beliefs.get(("chosen", self.recovery))
        again_s = [beliefs.observed_s(("surveyedAgain", block)) for block in self.blocks]
        at_last_s = max((time_s for time_s in again_s if time_s is not None), default=-math.inf)
        if chosen is not None:
            verdicts = {name: beliefs.get(("verdict", name)) for name in beliefs.instances(CANDIDATE)}
            if not is_open(beliefs, chosen):
                return max(at_last_s, beliefs.observed_s(("verdict", chosen)) or 0.0)
            # A target identified by chance replaces a chosen candidate of unknown class.
            known = [name for name, verdict in verdicts.items() if verdict == "target" and name != chosen]
            is_unknown = verdicts[chosen] in (None, "open")
            return beliefs.observed_s(("verdict", known[0])) if known and is_unknown else None
        surveyed_s = [beliefs.observed_s(("surveyedBy", block)) for block in self.blocks]
        known_s = [time_s for time_s in surveyed_s if time_s is not None]
        return max(at_last_s, *known_s) if len(known_s) == len(surveyed_s) else None

    def _recovers(self, me: str, organisation: Organisation) -> bool:
        return any(job == self.recovery for _, job in self._jobs_of(me, organisation))

    def _judged(self, me: str, organisation: Organisation, beliefs: Beliefs) -> list[Finding]:
        """Recovering vehicle: decide the class of a candidate from close observations of all vehicles."""
        if beliefs.get(("chosen", self.recovery)) is None or not self._recovers(me, organisation):
            return []  # no close observation before a choice
        for candidate in beliefs.instances(CANDIDATE):
            known, findings = ("verdict", candidate), list[Finding]()
            verdict = beliefs.get(known)
            if verdict in (None, "open"):
                # After a reopening, earlier observations would only repeat the old verdict.
                is_target = self._shown(beliefs, candidate, beliefs.observed_s(known))
                if is_target is None:
                    continue
                verdict = "target" if is_target else "decoy"
                findings = [Finding(candidate, "verdict", verdict)]
            if verdict == "target" and beliefs.get(("reacquiredBy", candidate)) != me:
                findings += self._reacquired(me, beliefs, candidate)
            if findings:
                return findings
        return []

    def _shown(self, beliefs: Beliefs, candidate: str, since_s: float | None, by: str | None = None) -> bool | None:
        looks = beliefs.fused(("looksLike", candidate), since_s=since_s, by=by)
        if looks is None:
            return None
        p_target = looks.probabilities.get("target", 0.0)
        return sequential_verdict(p_target, self.settings.p_mistaken, self.settings.p_missed)

    def _reacquired(self, me: str, beliefs: Beliefs, candidate: str) -> list[Finding]:
        chosen_s = beliefs.observed_s(("chosen", self.recovery))
        if self._shown(beliefs, candidate, chosen_s, me) is None:
            return []
        # Position errors differ between vehicles and drift, so the place rests on own recent observations.
        place = beliefs.fused(("location", candidate), since_s=chosen_s, by=me)
        located = [] if place is None else [Finding(candidate, "location", place.value)]
        return [Finding(candidate, "reacquiredBy", me), *located]

    def _absent(self, me: str, organisation: Organisation, beliefs: Beliefs, now_s: float) -> list[Finding]:
        chosen = beliefs.get(("chosen", self.recovery))
        if chosen is None or beliefs.get(("verdict", chosen)) not in (None, "open"):
            return []
        chosen_s = beliefs.observed_s(("chosen", self.recovery))
        if chosen_s is None or now_s - chosen_s <= self.settings.reach_limit_s:
            return []
        return [Finding(chosen, "verdict", "absent")] if self._recovers(me, organisation) else []

    def _adrift(self, me: str, beliefs: Beliefs) -> list[Finding]:
        chosen = beliefs.get(("chosen", self.recovery))
        if chosen is None or is_open(beliefs, chosen) or not beliefs.get(("fixedOn", me)):
            return []
        # On the way to the next candidate the position error grows again.
        return [Finding(me, "fixedOn", False)]


def _status(service: Service, beliefs: Beliefs, picture: Picture) -> list[Finding]:
    works = not service.settings.tells_state or service.settings.name in picture.body.answering
    status, known = AVAILABLE if works else FAILED, beliefs.get(("serviceStatus", service.name))
    if known == status:
        return []
    findings = [Finding(service.name, "serviceStatus", status)]
    if known is not None:
        return findings
    return [
        Finding(service.name, "providedBy", service.vehicle),
        Finding(service.name, "serviceCost", service.settings.cost_s),
        Finding(service.name, "precondition", service.settings.precondition),
        *findings,
    ]


def _likeness(beliefs: Beliefs, candidate: str) -> float:
    if beliefs.get(("verdict", candidate)) == "target":
        return 2.0
    likeness = beliefs.fused(("likeness", candidate))
    return 0.0 if likeness is None else float(likeness.value)
