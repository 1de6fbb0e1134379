"""Information needs that follow from groups and roles, as one vehicle believes.

A fact concerns a group, whose members need it (``docs/model/exchange.md``); one about a group formed at run time also
the members of the forming group, which may join it. A vehicle knows changes only in its own groups, so it may send to
vehicles that have left, or omit new members, until it receives the change.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from remoras.organisation import Group, Organisation
from remoras.organisation.leadership import HEAD_TERM, HEADED_BY, ROLE_ATTRIBUTES
from worldmodel import NOBODY, PropertyValue, TBox, Wanted

Path = tuple[str, str]
"""Group and role, or two groups."""


@dataclass(frozen=True)
class Subjects:
    """Meaning of instances, and the vehicles that facts about them concern, by uid; fleet-wide.

    ``names`` are those of the vehicles, whose uids are their nodes. ``jobs``: group and role for every role with the
    job; an empty role names the group alone. ``done``: (subject, attribute) of facts that report completion.
    ``supervised``: (supervising group, group), direct or indirect. ``held``: groups whose leader alone holds the
    knowledge of their jobs. ``for_all``: attributes that concern all vehicles.
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
    """Bit sets of nodes that follow from one view of the organisation, by group or role."""

    members: Mapping[str, int]
    heads: Mapping[str, int]
    above: Mapping[str, int]  # leaders of supervising groups
    told_who_leads: Mapping[str, int]
    players: Mapping[Path, int]
    tied: Mapping[Path, int]  # members of groups with a role that the holder of this one has to play
    company: Sequence[int]


class GroupNeeds:
    """Needs in the view of one vehicle: ``worldmodel.Needs`` of its exchange manager."""

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
        self._ever: dict[str, int] = {}  # current and former members
        self._organisation = organisation
        self._now = self._words(organisation)

    def renew(self, organisation: Organisation) -> bool:
        """Use another view of the organisation; return whether needs differ."""
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
        above, informed = dict.fromkeys(groups, 0), {name: self._ever[name] for name in groups}
        for superior, name in self._subjects.supervised:
            if superior in groups and name in groups:
                above[name] |= heads[superior]
                informed[superior] |= members[name]
        tied: dict[Path, int] = {}
        for name, group in groups.items():
            informed[name] |= above[name]
            for role in group.roles:
                if role.played_by is not None:
                    tied[role.played_by] = tied.get(role.played_by, 0) | members[name]
                    informed[name] |= members.get(role.played_by[0], 0) if role.head else 0
        players = {(a.group, a.role): word(view.members(a.group, a.role)) for a in view.assignments}
        company = []
        for name in self._subjects.names:
            shared = 0
            for played in view.roles_of(name):
                shared |= members[played.group]
            company.append(shared or self._everybody)
        return _Words(members, heads, above, informed, players, tied, company)

    def wanted(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Return the nodes that need a fact, and the priority of its attribute."""
        priority = self._priorities.get(fact.attribute)
        return NOBODY if priority is None else Wanted(self._nodes(fact), priority)

    def _nodes(self, fact: PropertyValue) -> int:
        subject, subjects, now = fact.subject, self._subjects, self._now
        if fact.attribute in subjects.for_all:
            return self._everybody
        if 0 <= subject < len(subjects.names):
            role = subjects.roles.get(fact.target) if fact.attribute in self._names_role else None
            return now.company[subject] if role is None else self._of_role(role, fact)
        if subject in subjects.roles:
            return now.members.get(subjects.roles[subject][0], self._everybody)
        if subject in subjects.groups:
            group = subjects.groups[subject]
            if fact.attribute in self._says_who_leads:
                return now.told_who_leads.get(group, self._everybody)
            return now.members.get(group, self._everybody) | now.above.get(group, 0)
        if subject in subjects.jobs:
            return self._of_job(subjects.jobs[subject], (subject, fact.attribute) in subjects.done)
        return self._everybody

    def _of_role(self, role: Path, fact: PropertyValue) -> int:
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
