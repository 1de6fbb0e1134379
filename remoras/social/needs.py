"""Needs that follow from groups and roles: who needs a fact, as one vehicle believes.

What a vehicle tells concerns a group, and the members of that group need it; others neither pass it on nor keep it.
Whom a fact concerns follows from what it is about:

==========================  =========================================================================================
a fact about                is needed by
==========================  =========================================================================================
a job                       the members of the groups that have a role with this job; where its head holds what a group
                            knows, its heads and who plays such a role
a job that is done          the members of those groups, and the heads of the groups that supervise them
an objective of a role      the members of its group; so it is with bids for roles, and claims
who plays a role, or left   the vehicle itself; who is or was a member of the group; the heads that supervise it; the
                            members of groups with a role that its holder has to play
a group                     its members, and the heads of the groups that supervise it
who leads a group           the same; who was a member, and may not know; the members of the groups that it supervises,
                            and of the one to which its head has to belong
a vehicle                   the members of all its groups; everybody if it is in none, and who is not to be believed
anything else               everybody
==========================  =========================================================================================

What concerns a group that is formed at sea concerns the members of the group whose head forms it, too, since any of
them may come into it: before it is formed, while it is there, and when it is dissolved.

A vehicle answers by the organisation in its own view, and it hears of changes in groups of its own alone. So it may err
on others: then it says something to vehicles that have left, or leaves out such as have joined, until it hears of it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from remoras.organisation import Group, Organisation
from remoras.social.leadership import HEAD_TERM, HEADED_BY, ROLE_ATTRIBUTES
from worldmodel import NOBODY, PLAIN, PropertyValue, TBox, Terms, Wanted

Path = tuple[str, str]
"""Group and role, or group and group."""


@dataclass(frozen=True)
class Subjects:
    """What instances are, and whom facts about them concern: the same for all vehicles of a fleet, by uid.

    Attributes:
        names: of the vehicles; their nodes are their uids.
        groups: names of groups; roles: group and role.
        jobs: group and role for every role with the job; the role is empty where a mission names the group alone.
        done: (subject, attribute) of the facts that say that a job is done.
        supervised: a group and one that it supervises, directly or through others, by names.
        held: groups of which the head holds what is known of their jobs.
        at_sea: groups that are formed at sea, by name.
        for_all: attributes that concern everybody, whoever the fact is about.
    """

    names: Sequence[str]
    groups: Mapping[int, str]
    roles: Mapping[int, Path]
    jobs: Mapping[int, Collection[Path]]
    done: Collection[tuple[int, int]] = frozenset()
    supervised: Collection[Path] = ()
    held: Collection[str] = frozenset()
    at_sea: Mapping[str, Group] = field(default_factory=dict)
    for_all: Collection[int] = frozenset()


@dataclass(frozen=True)
class _Words:
    """Nodes, as bit words, by group: what follows from one view of the organisation.

    Attributes:
        members: of each group; heads: of it; above: heads of the groups that supervise it.
        told_who_leads: who needs to know who leads it.
        players: by group and role; tied: members of groups with a role that the holder of this one has to play.
        company: members of all groups of a vehicle, by its node.
    """

    members: Mapping[str, int]
    heads: Mapping[str, int]
    above: Mapping[str, int]
    told_who_leads: Mapping[str, int]
    players: Mapping[Path, int]
    tied: Mapping[Path, int]
    company: Sequence[int]


class GroupNeeds:
    """Who needs what, in the view of one vehicle: ``worldmodel.Needs`` of its exchange manager.

    Args:
        tbox: of the fleet.
        priorities: of the attributes that are exchanged, by uid.
        subjects: what instances are.
        organisation: as agreed before the mission.
    """

    def __init__(
        self, tbox: TBox, priorities: Mapping[int, int], subjects: Subjects, organisation: Organisation
    ) -> None:
        self._priorities = priorities
        self._subjects = subjects
        self._everybody = (1 << len(subjects.names)) - 1
        self._says_who_leads = {tbox.attribute_named(name).uid for name in (HEADED_BY, HEAD_TERM)}
        self._says_who_plays = {tbox.attribute_named(name).uid for name in ROLE_ATTRIBUTES}
        role = tbox.class_named("Role").uid
        self._names_role = {a.uid for a in tbox.attributes if a.range_class == role}
        self._ever: dict[str, int] = {}  # those whom each group concerns or has concerned
        self._organisation = organisation
        self._now = self._words(organisation)

    def renew(self, organisation: Organisation) -> bool:
        """Answer by another view of the organisation from now on; True if that makes a difference."""
        if organisation is self._organisation:
            return False
        ever, before = dict(self._ever), self._now
        self._organisation, self._now = organisation, self._words(organisation)
        return before != self._now or ever != self._ever

    def _words(self, view: Organisation) -> _Words:
        nodes = {name: 1 << node for node, name in enumerate(self._subjects.names)}

        def word(vehicles: Collection[str]) -> int:
            return sum(nodes[name] for name in vehicles)

        groups = {**self._subjects.at_sea, **view.groups}
        members = {name: word(view.members(name)) for name in groups}
        heads = {name: word(view.heads(name)) for name in groups}
        for name, group in self._subjects.at_sea.items():
            members[name] |= members.get(group.formed_by or "", 0)
            heads[name] |= heads.get(group.formed_by or "", 0)
        for name, now in members.items():
            self._ever[name] = self._ever.get(name, 0) | now
        above, told = dict.fromkeys(groups, 0), {name: self._ever[name] for name in groups}
        for superior, name in self._subjects.supervised:
            if superior in groups and name in groups:
                above[name] |= heads[superior]
                told[superior] |= members[name]
        tied: dict[Path, int] = {}
        for name, group in groups.items():
            told[name] |= above[name]
            for role in group.roles:
                if role.played_by is not None:
                    tied[role.played_by] = tied.get(role.played_by, 0) | members[name]
                    told[name] |= members.get(role.played_by[0], 0) if role.head else 0
        players = {(a.group, a.role): word(view.members(a.group, a.role)) for a in view.assignments}
        company = []
        for name in self._subjects.names:
            shared = 0
            for played in view.roles_of(name):
                shared |= members[played.group]
            company.append(shared or self._everybody)
        return _Words(members, heads, above, told, players, tied, company)

    def priority_of(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Which nodes need a fact, and how urgent it is; its attribute says the latter."""
        priority = self._priorities.get(fact.attribute)
        return NOBODY if priority is None else (self._nodes(fact), priority)

    def terms_of(self, fact: PropertyValue, class_uid: int) -> Terms:
        """How they want it served: as plain needs are."""
        return PLAIN

    def _nodes(self, fact: PropertyValue) -> int:
        subject, of, now = fact.subject, self._subjects, self._now
        if fact.attribute in of.for_all:
            return self._everybody
        if 0 <= subject < len(of.names):
            role = of.roles.get(fact.target) if fact.attribute in self._names_role else None
            return now.company[subject] if role is None else self._of_role(role, fact)
        if subject in of.roles:
            return now.members.get(of.roles[subject][0], self._everybody)
        if subject in of.groups:
            group = of.groups[subject]
            if fact.attribute in self._says_who_leads:
                return now.told_who_leads.get(group, self._everybody)
            return now.members.get(group, self._everybody) | now.above.get(group, 0)
        if subject in of.jobs:
            return self._of_job(of.jobs[subject], (subject, fact.attribute) in of.done)
        return self._everybody

    def _of_role(self, role: Path, fact: PropertyValue) -> int:
        """Who needs to know that a vehicle plays a role, has left it, or works on its job."""
        group, name = role
        if fact.attribute not in self._says_who_plays:
            return self._now.members.get(group, self._everybody)
        nodes = self._ever.get(group, self._everybody) | 1 << fact.subject
        nodes |= self._now.above.get(group, 0) | self._now.tied.get(role, 0)
        of_group = self._organisation.groups.get(group) or self._subjects.at_sea.get(group)
        return nodes | (self._now.told_who_leads[group] if of_group and of_group.head_role == name else 0)

    def _of_job(self, roles: Collection[Path], is_done: bool) -> int:
        now, nodes = self._now, 0
        for group, role in roles:
            if group not in now.members:
                return self._everybody
            if group in self._subjects.held and not is_done:
                nodes |= now.heads[group] | now.players.get((group, role), 0)
            else:
                nodes |= now.members[group] | (now.above[group] if is_done else 0)
        return nodes
