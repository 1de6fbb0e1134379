"""Needs of a scenario: which vehicles need which of the listed attributes, all of them or by their groups."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from missions.scenarios.extending import features
from missions.scenarios.scenario import BY_GROUPS, HELD, Scenario
from remoras.database import AUVDatabase
from remoras.mission import Mission
from remoras.organisation import Group
from remoras.plugins import answer
from remoras.social.agreement import Agreement
from remoras.social.needs import Path, Subjects
from remoras.social.negotiation import negotiated_attributes
from remoras.social.reports import SENSORS_WORK
from remoras.social.requests import FORMATION_ATTRIBUTES
from remoras.strategy import Strategy
from worldmodel import InformationNeed, Instance, NeedsIndex, TBox

SOCIAL_ATTRIBUTES = ("available", "headedBy", "headTerm", SENSORS_WORK)
"""What vehicles say of themselves whatever the strategy."""


def priorities(scenario: Scenario, strategy: Strategy, mission: Mission, tbox: TBox) -> dict[int, int]:
    """Priority of every attribute that is exchanged, by uid.

    What the strategy says, who leads and who takes jobs is needed most if it is not listed. An attribute that the
    mission has no use for in this scenario is left out.
    """
    known = {attribute.name for attribute in tbox.attributes}
    listed = {name: priority for name, priority in scenario.communication.needs.items() if name in known}
    formation = [name for name in FORMATION_ATTRIBUTES if name in known]
    ordered = [name for feature in features().values() for name in feature.states if name in known]
    stated = (*negotiated_attributes(strategy, mission.jobs, tbox), *SOCIAL_ATTRIBUTES, *formation, *ordered)
    strategic = dict.fromkeys(stated, max(listed.values(), default=1))
    return {tbox.attribute_named(name).uid: priority for name, priority in {**strategic, **listed}.items()}


def needs_of_all(tbox: TBox, urgency: Mapping[int, int], n_nodes: int) -> NeedsIndex:
    """Every vehicle needs every attribute that is exchanged, of every instance of its domain.

    Args:
        urgency: priority of each of them, by uid.
    """
    needs = tuple(
        InformationNeed(uid, priority, class_uid=tbox.attributes[uid].domain) for uid, priority in urgency.items()
    )
    return NeedsIndex(tbox, dict.fromkeys(range(n_nodes), needs))


def subjects_of(
    scenario: Scenario,
    mission: Mission,
    tbox: TBox,
    instances: Sequence[Instance],
    database: AUVDatabase,
    agreement: Agreement,
) -> Subjects | None:
    """What the instances of a scenario are; None if every vehicle needs everything.

    Raises:
        PluginError: the mission's ``groups_of`` raises, or answers with something else than groups of the scenario.
    """  # fmt: skip
    if scenario.communication.needs_follow != BY_GROUPS:
        return None
    groups = agreement.groups
    uid = {instance.name: instance.uid for instance in instances}
    paths = {group.path(role.name): (group.name, role.name) for group in groups for role in group.roles}
    own = {name: _of_job(name, mission, groups) for _, name in mission.instances}
    for_all = {name for feature in features().values() for name in feature.for_all}
    return Subjects(
        database.names,
        {uid[group.name]: group.name for group in groups},
        {uid[path]: role for path, role in paths.items()},
        {uid[name]: found for name, found in own.items() if found},
        frozenset((uid[job.done[1]], tbox.attribute_named(job.done[0]).uid) for job in mission.jobs.values()),
        [(superior, name) for superior, inferiors in agreement.meets_after.items() for name in inferiors],
        frozenset(group.name for group in scenario.group if group.information == HELD),
        agreement.at_sea,
        frozenset(attribute.uid for attribute in tbox.attributes if attribute.name in for_all),
    )


def _of_job(name: str, mission: Mission, groups: Sequence[Group]) -> Collection[Path]:
    """Roles whose job an instance is about, or the groups that the mission names for it."""
    names = [group.name for group in groups]

    def is_expected(answered: object) -> bool:
        return answered is None or (isinstance(answered, Collection) and set(answered) <= set(names))

    expected = f"groups of the scenario ({', '.join(names)}), or None"
    answered = answer(
        f"mission {type(mission).__name__}", "groups_of", expected, is_expected, lambda: mission.groups_of(name)
    )
    if answered is not None:
        return [(group, "") for group in answered]
    jobs = {job.name for job in mission.jobs.values() if name in (job.name, job.done[1])}
    return [(group.name, role.name) for group in groups for role in group.roles if role.job in jobs]
