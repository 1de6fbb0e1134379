"""Needs of a scenario: which vehicles need which of the listed attributes, all of them or by their groups."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

from missions.scenarios.needs import ALL, states_needs
from missions.scenarios.scenario import BY_GROUPS, HELD, Scenario
from remoras.bans import BANNED_FROM
from remoras.database import AUVDatabase
from remoras.mission import Mission
from remoras.needs import NEED_ATTRIBUTES, StatedNeed, need_name
from remoras.organisation import Group
from remoras.plugins import answer
from remoras.slots import SENDS_IN
from remoras.social.agreement import Agreement
from remoras.social.formations import FORMATION_ATTRIBUTES
from remoras.social.needs import Path, Subjects
from remoras.social.negotiation import negotiated_attributes
from remoras.social.reports import SENSORS_WORK
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
    ordered = [name for name in (BANNED_FROM, SENDS_IN) if name in known]
    stated = (*negotiated_attributes(strategy, mission.jobs, tbox), *SOCIAL_ATTRIBUTES, *formation, *ordered)
    stated += NEED_ATTRIBUTES if states_needs(scenario) else ()
    strategic = dict.fromkeys(stated, max(listed.values(), default=1))
    return {tbox.attribute_named(name).uid: priority for name, priority in {**strategic, **listed}.items()}


def needs_of_all(tbox: TBox, urgency: Mapping[int, int], n_nodes: int) -> NeedsIndex:
    """Every vehicle needs every attribute that is exchanged, of every instance of its domain.

    Args:
        urgency: priority of each of them, by uid.
    """
    needs = tuple(InformationNeed(uid, one, class_uid=tbox.attributes[uid].domain) for uid, one in urgency.items())
    return NeedsIndex(tbox, dict.fromkeys(range(n_nodes), needs))


def stated_needs(scenario: Scenario, tbox: TBox, instances: Sequence[Instance]) -> tuple[StatedNeed, ...]:
    """The needs of ``[[need]]``, vehicle by vehicle; the n-th table is the n-th need of each."""
    uids = {one.name: one.uid for one in instances}
    classes = {one.name: one.uid for one in tbox.classes}
    found = []
    for number, table in enumerate(scenario.need, 1):
        attribute = tbox.attribute_named(table.attribute)
        class_uid = classes.get(table.of) if table.of else attribute.domain
        instance = uids[table.of] if class_uid is None else None
        need = InformationNeed(attribute.uid, table.priority, class_uid, instance, table.terms())
        until_s = math.inf if table.until_s is None else table.until_s
        for vehicle in scenario.vehicle:
            if table.vehicle in (ALL, vehicle.name):
                found.append(StatedNeed(vehicle.name, number, need, table.from_s, until_s))
    return tuple(found)


def on_demand_of(scenario: Scenario, tbox: TBox) -> frozenset[int]:
    """Attributes, by uid, that are exchanged once somebody needs them."""
    names = (*scenario.communication.on_demand, *(table.attribute for table in scenario.need))
    return frozenset(tbox.attribute_named(name).uid for name in names)


def needs_at_start(
    scenario: Scenario, stated: Iterable[StatedNeed], instances: Iterable[Instance], nodes: Mapping[str, int]
) -> dict[int, tuple[int, InformationNeed]] | None:
    """Needs that hold from the start of the mission, each with the node of its vehicle, by the uid of their name.

    None if no vehicle may state a need.

    Args:
        scenario: the whole input.
        stated: needs of single vehicles.
        instances: what the whole fleet has names for.
        nodes: of the vehicles, by name.
    """
    if not states_needs(scenario):
        return None
    uids = {one.name: one.uid for one in instances}
    return {
        uids[need_name(one.vehicle, one.number)]: (nodes[one.vehicle], one.need) for one in stated if one.from_s == 0.0
    }


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
    uid = {one.name: one.uid for one in instances}
    paths = {group.path(role.name): (group.name, role.name) for group in groups for role in group.roles}
    own = {name: _of_job(name, mission, groups) for _, name in mission.instances}
    return Subjects(
        database.names,
        {uid[group.name]: group.name for group in groups},
        {uid[path]: role for path, role in paths.items()},
        {uid[name]: found for name, found in own.items() if found},
        frozenset((uid[job.done[1]], tbox.attribute_named(job.done[0]).uid) for job in mission.jobs.values()),
        [(superior, name) for superior, inferiors in agreement.meets_after.items() for name in inferiors],
        frozenset(group.name for group in scenario.group if group.information == HELD),
        agreement.at_sea,
    )


def _of_job(name: str, mission: Mission, groups: Sequence[Group]) -> Collection[Path]:
    """Roles whose job an instance is about, or the groups that the mission names for it."""
    names = [group.name for group in groups]

    def is_expected(found: object) -> bool:
        return found is None or (isinstance(found, Collection) and set(found) <= set(names))

    expected = f"groups of the scenario ({', '.join(names)}), or None"
    found = answer(
        f"mission {type(mission).__name__}", "groups_of", expected, is_expected, lambda: mission.groups_of(name)
    )
    if found is not None:
        return [(group, "") for group in found]
    jobs = {job.name for job in mission.jobs.values() if name in (job.name, job.done[1])}
    return [(group.name, role.name) for group in groups for role in group.roles if role.job in jobs]
