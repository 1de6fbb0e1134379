"""A vehicle's part in allocating areas during the mission, whatever the strategy: what it hears, what it states."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from remoras.beliefs import Beliefs
from remoras.organisation import Organisation
from remoras.strategy import Evidence, Heard, Negotiator, Situation, Statement, Strategy
from remoras.work import Point
from worldmodel import Change, TBox

ROLE_ATTRIBUTES = ("playsRole", "leftRole")


def negotiated_attributes(strategy: Strategy, tbox: TBox) -> tuple[str, ...]:
    """Attributes of the ontology by which the vehicles of a strategy organise themselves."""
    known = {attribute.name for attribute in tbox.attributes}
    return tuple(dict.fromkeys([*ROLE_ATTRIBUTES, *(name for name in strategy.declaration.messages if name in known)]))


class Negotiation:
    """The negotiators of one vehicle, one for each of its groups that has areas.

    Args:
        me: own name.
        strategy: makes the negotiators.
        organisation: as agreed before the mission.
        beliefs: facts of this vehicle.
        rally_points_m: rally points by name.
    """

    def __init__(
        self,
        me: str,
        strategy: Strategy,
        organisation: Organisation,
        beliefs: Beliefs,
        rally_points_m: Mapping[str, Point],
    ) -> None:
        self._me = me
        self._beliefs = beliefs
        tbox = beliefs.model.tbox
        self._attributes = frozenset(tbox.attribute_named(name).uid for name in negotiated_attributes(strategy, tbox))
        self._negotiators: dict[str, Negotiator] = {}
        self._rally_m: dict[str, Point | None] = {}
        for group in organisation.groups.values():
            if any(role.area is not None for role in group.roles) and organisation.is_member(me, group.name):
                negotiator = strategy.negotiator(me, group)
                if negotiator is not None:
                    self._negotiators[group.name] = negotiator
                    self._rally_m[group.name] = rally_points_m.get(group.rally_point or "")
        self._heard: list[Heard] = []
        self._round = 0
        self.holding = frozenset(self._negotiators)
        """Groups that are not to be taken for gathered, since there is work to be given out."""

    @property
    def takes_part(self) -> bool:
        """Has this vehicle a negotiator for any of its groups?"""
        return bool(self._negotiators)

    def note(self, change: Change) -> None:
        """Keep what a peer states until the end of the round."""
        block = change.block
        if self._negotiators and block.facts[0].attribute in self._attributes:
            issuer = self._beliefs.name(block.origin)
            if issuer != self._me:
                facts = tuple(self._beliefs.by_name(fact) for fact in block.facts)
                self._heard.append(Heard(issuer, block.time_s, facts))

    def negotiate(
        self,
        now_s: float,
        organisation: Organisation,
        evidence: Evidence,
        heard_s: Mapping[str, float],
        unheard: Mapping[str, Collection[str]],
    ) -> list[Statement]:
        """End of a round: what this vehicle states to organise its groups."""
        self._round += 1
        now_s = self._beliefs.model.quantise_time(now_s)
        heard, self._heard = tuple(self._heard), []
        statements: list[Statement] = []
        holding = []
        for group, negotiator in self._negotiators.items():
            if not organisation.is_member(self._me, group):
                continue  # it has left, to look after itself
            rally_m = self._rally_m[group]
            move = negotiator.negotiate(
                Situation(now_s, self._round, organisation, evidence, rally_m, heard, heard_s, unheard)
            )
            statements += move.statements
            if move.holding:
                holding.append(group)
        self.holding = frozenset(holding)
        return statements
