"""Gatherings: which groups a vehicle takes for gathered at their rally points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from remoras.beliefs import Beliefs, Key

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
