"""The table ``[channel]``: which loss model, with which settings, and when the channel is cut off."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from exchange.acoustics.channel import Blackout
from exchange.acoustics.link import LINKS, Bernoulli, GilbertElliott, LinkModel, Matrix, Perfect
from missions.errors import ConfigurationFault
from missions.scenarios.tables import NotNegative, Probability, Raw, Table, entries, names_of, one_of, table_of

PERFECT = "perfect"
USED_BY: dict[str, tuple[str, ...]] = {
    PERFECT: (),
    "bernoulli": ("per",),
    "matrix": ("per", "link"),
    "gilbert-elliott": ("p_good_to_bad", "p_bad_to_good", "per_good", "per_bad"),
}
"""Keys that each loss model uses; the others of the table go with every model."""
OF_MODELS = {key for keys in USED_BY.values() for key in keys}


class LinkTable(Table):
    """One directed link of the matrix channel."""

    sender: str = Field(description="vehicle that sends")
    receiver: str = Field(description="vehicle that listens; the other direction is a link of its own")
    per: Probability = Field(description="packet error rate of this link")


class BlackoutTable(Table):
    """A time without communication."""

    from_s: NotNegative = Field(description="packets that start at this time or later are lost")
    until_s: NotNegative = Field(description="packets that start at this time or later are heard again")
    vehicle: str | None = Field(None, description="vehicle neither heard nor hearing; the whole channel if absent")


class ChannelTable(Table):
    name: str = Field(
        description="loss model, see `remoras list channels`. A key that the model does not use is refused, with two "
        "exceptions: perfect leaves the settings of all models aside, and a model named by --channel, --set or a study "
        "those that the scenario has for its own"
    )
    per: float = Field(
        0.0, ge=0.0, lt=1.0, description="packet error rate of bernoulli, and of the links that matrix does not list"
    )
    link: tuple[LinkTable, ...] = ()
    p_good_to_bad: Probability = Field(
        0.1, description="gilbert-elliott: probability per TDMA slot that a good link turns bad"
    )
    p_bad_to_good: Probability = Field(
        0.3, description="gilbert-elliott: probability per TDMA slot that a bad link turns good"
    )
    per_good: Probability = Field(0.05, description="gilbert-elliott: packet error rate of a link in its good state")
    per_bad: Probability = Field(0.8, description="gilbert-elliott: packet error rate of a link in its bad state")
    blackout: tuple[BlackoutTable, ...] = ()

    @model_serializer(mode="wrap")
    def _what_is_used(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without the settings of other models: what is written can be read again, and what is alike looks alike."""
        unused = OF_MODELS.difference(USED_BY.get(self.name, ()))
        return {key: value for key, value in handler(self).items() if key not in unused}

    def link_model(self, nodes: Mapping[str, int], seed: int) -> LinkModel:
        """The loss model that is named, for vehicles of these node numbers."""
        match self.name:
            case "bernoulli":
                return Bernoulli(self.per)
            case "matrix":
                return Matrix(self.per, {(nodes[link.sender], nodes[link.receiver]): link.per for link in self.link})
            case "gilbert-elliott":
                return GilbertElliott(self.p_good_to_bad, self.p_bad_to_good, self.per_good, self.per_bad, seed)
            case _:
                return Perfect()

    def blackouts(self, nodes: Mapping[str, int]) -> tuple[Blackout, ...]:
        """Times without communication, for vehicles of these node numbers."""
        return tuple(
            Blackout(table.from_s, table.until_s, None if table.vehicle is None else nodes[table.vehicle])
            for table in self.blackout
        )

    def mean_per(self, n_vehicles: int) -> float:
        """Packet error rate in the mean over time and all directed pairs of vehicles, within range and no blackout."""
        if self.name == "matrix":
            n_links = n_vehicles * (n_vehicles - 1)
            return self.per + sum(link.per - self.per for link in self.link) / n_links
        model = self.link_model({}, seed=0)
        return model.mean_per if isinstance(model, GilbertElliott) else model.p_loss(0, 0, 1, 0.0)


def leave_aside(own: Raw, raw: Raw, overridden: Collection[str]) -> list[ConfigurationFault]:
    """Take out of the channel of ``raw`` what its model does not use; what was meant to be used is a fault.

    Args:
        own: channel as the scenario's file has it.
        raw: scenario with overrides applied; its channel is changed.
        overridden: dotted keys of the overrides.
    """
    channel, name, own_name = raw.get("channel"), table_of(raw, "channel").get("name"), own.get("name")
    if not isinstance(channel, dict) or not isinstance(name, str) or name not in USED_BY:
        return []
    replaced = USED_BY.get(own_name, ()) if isinstance(own_name, str) and "channel" not in overridden else ()
    faults = []
    for key in [key for key in channel if key in OF_MODELS and key not in USED_BY[name]]:
        value = channel.pop(key)
        if name != PERFECT and (key not in replaced or f"channel.{key}" in overridden):
            users = " and ".join(user for user, keys in USED_BY.items() if key in keys)
            allowed = f"not used by the {name} channel, only by {users}; {name} uses {', '.join(USED_BY[name])}"
            faults.append(ConfigurationFault(f"channel.{key}", "" if isinstance(value, list) else str(value), allowed))
    return faults


def channel_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """What has to hold within the channel, and between it and the vehicles."""
    channel, vehicles = table_of(raw, "channel"), names_of(raw, "vehicle")
    yield from one_of("channel.name", channel.get("name"), list(LINKS))
    pairs: set[tuple[str, str]] = set()
    for number, link in enumerate(entries(channel, "link"), 1):
        sender, receiver = link.get("sender"), link.get("receiver")
        for key, name in (("sender", sender), ("receiver", receiver)):
            yield from one_of(f"channel.link.{number}.{key}", name, vehicles)
        if isinstance(sender, str) and isinstance(receiver, str):
            if sender == receiver:
                yield ConfigurationFault(f"channel.link.{number}.receiver", f'"{receiver}"', "must not be the sender")
            elif (sender, receiver) in pairs:
                allowed = f"the link from {sender} to {receiver} is listed twice"
                yield ConfigurationFault(f"channel.link.{number}.receiver", f'"{receiver}"', allowed)
            pairs.add((sender, receiver))
    if channel.get("name") == "gilbert-elliott":
        keys = ("p_good_to_bad", "p_bad_to_good")
        rates = {key: channel.get(key, ChannelTable.model_fields[key].default) for key in keys}
        if all(isinstance(rate, int | float) and 0.0 <= rate <= 1.0 for rate in rates.values()):
            greater = max(rates, key=lambda key: rates[key])
            if not 0.0 < sum(rates.values()) <= 1.0:
                allowed = f"{' + '.join(rates)} must be above 0 and at most 1, not {sum(rates.values()):g}"
                yield ConfigurationFault(f"channel.{greater}", str(rates[greater]), allowed)
    for number, blackout in enumerate(entries(channel, "blackout"), 1):
        yield from one_of(f"channel.blackout.{number}.vehicle", blackout.get("vehicle"), vehicles)
        from_s, until_s = blackout.get("from_s"), blackout.get("until_s")
        if isinstance(from_s, int | float) and isinstance(until_s, int | float) and from_s >= until_s:
            allowed = f"must be above from_s = {from_s}"
            yield ConfigurationFault(f"channel.blackout.{number}.until_s", str(until_s), allowed)
