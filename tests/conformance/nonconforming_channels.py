"""Channel models that break one rule each, and a conforming external one: proof that checks can fail."""

import random
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, NamedTuple

from pydantic import Field

from exchange.channel.link import Bernoulli, LinkModel, Transmission
from exchange.channel.models import BernoulliChannel, ChannelModel, Deployment, SettingFault, VehicleName


class Muddy(NamedTuple):
    """Links of one vehicle lose all packets, the others some."""

    per: float
    muddy_node: int | None

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        return 1.0 if self.muddy_node in (packet.sender, receiver) else self.per


class Mud(ChannelModel):
    """A conforming external model: packets of one vehicle are never received."""

    title = "one vehicle is in the mud"

    clear_per: float = Field(0.1, ge=0.0, le=0.5, description="packet error rate of the others")
    in_mud: VehicleName = Field("", description="vehicle in the mud; nobody if absent")
    layers_m: tuple[float, ...] = Field((), description="depths of the layers of mud")

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        return Muddy(self.clear_per, deployment.nodes.get(self.in_mud))

    def mean_per(self, deployment: Deployment) -> float:
        share = 2 / len(deployment.nodes) if self.in_mud else 0.0
        return share + (1.0 - share) * self.clear_per

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Layers have to lie in order."""
        if list(self.layers_m) != sorted(self.layers_m):
            yield SettingFault("layers_m", str([*self.layers_m]), "must be in order")


NO_CLASS = Bernoulli(0.1)


def wrong(**parts: Any) -> Any:
    """A channel model with these parts in the place of sound ones."""
    return type(BernoulliChannel)("Wrong", (BernoulliChannel,), {"__module__": __name__, **parts})


def with_setting(name: str, kind: type, **field: Any) -> Any:
    """A channel model with one more setting."""
    return wrong(__annotations__={name: kind}, **field)


def losing(p_loss: Callable[..., Any]) -> Any:
    """A channel model whose links lose as a function of packet, receiver and range says."""
    return wrong(link_model=lambda self, deployment, seed: SimpleNamespace(p_loss=p_loss))


def raising(*_: Any) -> Any:
    """Raises."""
    raise KeyError("sea")


def streaming(self: Any, deployment: Deployment, seed: int) -> Any:
    """Links that draw from a stream when they are first asked, and remember the answer."""
    dice, known = random.Random(seed), dict[tuple[Any, ...], float]()
    return SimpleNamespace(p_loss=lambda *asked: known.setdefault(asked, dice.random()))


# Found by the checks of conformance.
Untitled = wrong(title="")
Unexplained = with_setting("haste", float, haste=0.0)
Unset = with_setting("haste", float, haste=Field(description="how soon"))
NamesVehicle = with_setting("blackout", float, blackout=Field(0.0, description="a key of every channel"))
NoMean = wrong(mean_per=ChannelModel.mean_per)
Percent = losing(lambda *_: 20.0)
Wordy = losing(lambda *_: "few")
Unrepeatable = losing(lambda *_: random.random())
Streamed = wrong(link_model=streaming)
ShortOfArguments = wrong(link_model=lambda self, deployment: NO_CLASS)
Optimist = with_setting(
    "per", float, per=Field(0.2, ge=0.0, lt=1.0, description="rate"), mean_per=lambda self, deployment: self.per / 2
)
# Found when a scenario is loaded, or in its run.
Late = losing(lambda packet, *_: 0.0 if packet.slot < 5 else 1.5)
Nothing = wrong(link_model=lambda *_: None)
Failing = wrong(link_model=raising)
WrongMean = wrong(mean_per=lambda *_: 20.0)
Standing = wrong(sound_speed_mps=lambda *_: 0.0)
Telling = wrong(sound_speed_mps=lambda *_: "1500 m/s")
Misfitting = wrong(misfits=lambda *_: iter(["too deep"]))
Grumbling = wrong(misfits=raising)
