"""Channel models that somebody brings: a sound one, and such as go wrong in a scenario."""

from collections.abc import Iterator, Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

from pydantic import Field

from exchange.channel.link import Bernoulli, LinkModel, Transmission
from exchange.channel.models import BernoulliChannel, ChannelModel, Deployment, SettingFault, VehicleName


class Muddy(NamedTuple):
    """Links of one vehicle lose more than the others."""

    per: float
    muddy_node: int | None

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """All of the packets from or to the vehicle in the mud, else some."""
        return 1.0 if self.muddy_node in (packet.sender, receiver) else self.per


class Mud(ChannelModel):
    """One vehicle lies in the mud, and is not heard."""

    title = "one vehicle is in the mud"

    clear_per: float = Field(0.1, ge=0.0, le=0.5, description="packet error rate of the others")
    in_mud: VehicleName = Field("", description="vehicle in the mud; nobody if absent")
    layers_m: tuple[float, ...] = Field((), description="depths of the layers of mud")

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of a run."""
        return Muddy(self.clear_per, deployment.nodes.get(self.in_mud))

    def mean_per(self, deployment: Deployment) -> float:
        """Mean over all links."""
        share = 2 / len(deployment.nodes) if self.in_mud else 0.0
        return share + (1.0 - share) * self.clear_per

    @classmethod
    def faults(cls, given: Mapping[str, Any]) -> Iterator[SettingFault]:
        """Layers have to lie in order."""
        layers = given.get("layers_m", [])
        if isinstance(layers, list) and layers != sorted(layers):
            yield SettingFault("layers_m", str(layers), "must be in order")


MODEL = Mud
NO_CLASS = Bernoulli(0.1)


def wrong(**methods: Any) -> Any:
    """A channel model with these methods in the place of sound ones."""
    return type(BernoulliChannel)("Wrong", (BernoulliChannel,), {"__module__": __name__, **methods})


def raising(*_: Any) -> Any:
    """Raises."""
    raise KeyError("sea")


Late = wrong(link_model=lambda *_: SimpleNamespace(p_loss=lambda packet, *_: 0.0 if packet.slot < 5 else 1.5))
Wordy = wrong(link_model=lambda *_: SimpleNamespace(p_loss=lambda *_: "few"))
Nothing = wrong(link_model=lambda *_: None)
Failing = wrong(link_model=raising)
WrongMean = wrong(mean_per=lambda *_: 20.0)
Standing = wrong(sound_speed_mps=lambda *_: 0.0)
Telling = wrong(sound_speed_mps=lambda *_: "1500 m/s")
Misfitting = wrong(misfits=lambda *_: iter(["too deep"]))
Grumbling = wrong(faults=classmethod(raising))
