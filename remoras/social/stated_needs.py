"""Who needs what, as one vehicle has heard: the needs that vehicles state, beside those that nobody has to state."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from remoras.needs import (
    ACKNOWLEDGED,
    ATTRIBUTE,
    BLACKOUT,
    NEED,
    NEED_ATTRIBUTES,
    NEEDED_BY,
    NEWEST_FIRST,
    OF_CLASS,
    OF_INSTANCE,
    PRIORITY,
    QUEUE_LIMIT,
    TIME_TO_LIVE,
)
from remoras.organisation import Organisation
from remoras.social.needs import GroupNeeds
from worldmodel import (
    NOBODY,
    PLAIN,
    Change,
    InformationNeed,
    NeedError,
    NeedsIndex,
    PropertyValue,
    Terms,
    Wanted,
    WorldModel,
)


class NeedsInForce:
    """Who needs what, as one vehicle has heard: ``worldmodel.Needs`` of its exchange manager.

    What everybody needs, or what follows from groups, and the needs that vehicles state hold side by side; several
    needs for one attribute are served together, see ``worldmodel.needs``.

    Args:
        model: own world model, from which stated needs are read; they survive a restart with it.
        common: needs that nobody states.
        agreed: needs agreed before the mission, by the uid of their instance: node and need.
        on_demand: attributes that nobody may need yet: facts about them are kept as items, for who comes to need them.
    """

    def __init__(
        self,
        model: WorldModel,
        common: NeedsIndex | GroupNeeds,
        agreed: Mapping[int, tuple[int, InformationNeed]],
        on_demand: Iterable[int],
    ) -> None:
        tbox = self._tbox = model.tbox
        self._model = model
        self._common = common
        self._agreed = dict(agreed)
        self._on_demand = frozenset(on_demand)
        self._uid = {name: tbox.attribute_named(name).uid for name in NEED_ATTRIBUTES}
        self._said_of_needs = frozenset(self._uid.values())
        of_class = tbox.class_named(NEED).uid
        self._instances = [uid for uid in model.instance_uids() if _class_of(model, uid) == of_class]
        self._is_due = True
        self._in_force: dict[int, tuple[int, InformationNeed]] = {}
        self._stated = NeedsIndex(tbox, {})
        self.renew(None)

    def note(self, changes: Iterable[Change]) -> None:
        """See whether anybody has stated a need, or taken one back."""
        if any(fact.attribute in self._said_of_needs for change in changes for fact in change.block.facts):
            self._is_due = True

    def renew(self, organisation: Organisation | None) -> bool:
        """Answer by what has been heard so far, and another view of the organisation; True if needs have changed."""
        has_changed = False
        if organisation is not None and isinstance(self._common, GroupNeeds):
            has_changed = self._common.renew(organisation)
        if not self._is_due:
            return has_changed
        self._is_due = False
        found = {uid: one for uid in self._instances if (one := self._read(uid)) is not None}
        if found == self._in_force:
            return has_changed
        self._in_force = found
        by_peer: dict[int, list[InformationNeed]] = {}
        for peer, need in found.values():
            by_peer.setdefault(peer, []).append(need)
        self._stated = NeedsIndex(self._tbox, by_peer)
        return True

    @property
    def stated(self) -> Sequence[tuple[int, InformationNeed]]:
        """Node and need of the stated needs in force."""
        return tuple(self._in_force.values())

    def priority_of(self, fact: PropertyValue, class_uid: int) -> Wanted:
        """Which nodes need a fact, and how urgent it is; for one that nobody needs yet, nobody and 1."""
        common, stated = self._common.priority_of(fact, class_uid), self._stated.priority_of(fact, class_uid)
        if common == NOBODY == stated:
            return (0, 1) if fact.attribute in self._on_demand else NOBODY
        return common[0] | stated[0], max(common[1], stated[1])

    def terms_of(self, fact: PropertyValue, class_uid: int) -> Terms:
        """How those who need a fact want it served, all together."""
        if not self._common.priority_of(fact, class_uid)[0]:
            return self._stated.terms_of(fact, class_uid)
        terms = self._common.terms_of(fact, class_uid)
        if not self._stated.priority_of(fact, class_uid)[0]:
            return terms
        return terms.merged(self._stated.terms_of(fact, class_uid))

    def _read(self, uid: int) -> tuple[int, InformationNeed] | None:
        """Node and need of an instance; None if it is not in force, or what is said of it makes no sense."""

        def value(name: str, default: float | None = None) -> float | None:
            said = self._model.value(uid, self._uid[name])
            return default if said is None else float(said)  # type: ignore[arg-type]

        priority, by, attribute = value(PRIORITY), value(NEEDED_BY), value(ATTRIBUTE)
        if priority is None:
            return self._agreed.get(uid)
        of_class, of_instance = value(OF_CLASS), value(OF_INSTANCE)
        if priority < 1 or by is None or attribute is None or attribute >= len(self._tbox.attributes):
            return None
        limit = value(QUEUE_LIMIT)
        try:
            terms = Terms(
                value(TIME_TO_LIVE) or math.inf,
                value(BLACKOUT) or 0.0,
                None if limit is None else int(limit),
                bool(value(NEWEST_FIRST, 0.0)),
                bool(value(ACKNOWLEDGED, 1.0)),
            )
            need = InformationNeed(
                int(attribute),
                int(priority),
                None if of_class is None or of_instance is not None else int(of_class),
                None if of_instance is None else int(of_instance),
                PLAIN if terms == PLAIN else terms,
            )
            NeedsIndex(self._tbox, {int(by): [need]})
        except NeedError:
            return None  # a peer said so: it is no need that could be served
        return int(by), need


def _class_of(model: WorldModel, uid: int) -> int | None:
    instance = model.instance(uid)
    return None if instance is None else instance.class_uid
