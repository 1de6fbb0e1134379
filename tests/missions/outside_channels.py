"""Channel models that somebody brings: a sound one, and such as go wrong in a scenario."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from pydantic import Field

from exchange.acoustics.link import Bernoulli, LinkModel, Transmission
from exchange.acoustics.models import BernoulliChannel, ChannelModel, Deployment, SettingFault, VehicleName


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


class Late(BernoulliChannel):
    """Goes wrong in the middle of a run."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links that fail later."""
        return _Late()


class _Late:
    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        return 0.0 if packet.slot < 5 else 1.5


class Wordy(BernoulliChannel):
    """Answers with a text."""

    def link_model(self, deployment: Deployment, seed: int) -> Any:
        """Links that speak."""
        return _Wordy()


class _Wordy:
    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> Any:
        return "few"


class Nothing(BernoulliChannel):
    """Makes no links."""

    def link_model(self, deployment: Deployment, seed: int) -> Any:
        """Nothing."""


class Failing(BernoulliChannel):
    """Raises."""

    def link_model(self, deployment: Deployment, seed: int) -> Any:
        """Raises."""
        raise KeyError("sea")


class WrongMean(BernoulliChannel):
    """Says what cannot be."""

    def mean_per(self, deployment: Deployment) -> float:
        """Percent."""
        return 20.0


class Standing(BernoulliChannel):
    """Its sound does not move."""

    def sound_speed_mps(self, deployment: Deployment) -> float:
        """Nothing."""
        return 0.0


class Telling(BernoulliChannel):
    """Tells of a speed in words."""

    def sound_speed_mps(self, deployment: Deployment) -> Any:
        """A text."""
        return "1500 m/s"


class Misfitting(BernoulliChannel):
    """Tells what does not fit in a form of its own."""

    def misfits(self, deployment: Deployment) -> Iterator[Any]:
        """A text."""
        yield "too deep"


class Grumbling(BernoulliChannel):
    """Its own checks fail."""

    @classmethod
    def faults(cls, given: Mapping[str, Any]) -> Iterator[SettingFault]:
        """Raises."""
        raise KeyError("per")


NO_CLASS = Bernoulli(0.1)
