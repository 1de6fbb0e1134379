"""Newest: when the newest word about each matter was said: a role of a vehicle, an objective, a mission of a group."""

from __future__ import annotations

from remoras.social.leadership import AGREED_BEFORE, Age


class Newest(dict[tuple[str, ...], Age]):
    """When the newest word that counts was said, by group, role and vehicle, or what else it is about."""

    def at(self, *about: str) -> Age:
        """When it was said; ``AGREED_BEFORE`` if nothing was said at sea."""
        return self.get(about, AGREED_BEFORE)

    def take(self, about: tuple[str, ...], age: Age) -> bool:
        """True if nothing newer is known about it; it counts since ``age`` then."""
        if self.get(about, age) > age:
            return False
        self[about] = age
        return True

    def forget(self, group: str) -> None:
        """The group is formed or dissolved: what was said of it before is over."""
        for about in [about for about in self if about[0] == group]:
            del self[about]
