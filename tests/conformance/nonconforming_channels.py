"""Channel models that break one rule each, and one from outside that keeps to all: they prove that checks can fail."""

import random
from dataclasses import dataclass, field
from typing import Any

from pydantic import Field

from exchange.channel.link import Bernoulli, LinkModel, Transmission
from exchange.channel.models import BernoulliChannel, ChannelModel, Deployment


@dataclass(frozen=True)
class FadingLink:
    """Links that lose the more, the longer they are."""

    reach_m: float

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Loss grows with range to 1."""
        return min(1.0, range_m / self.reach_m)


class Fading(ChannelModel):
    """A model from outside that keeps to all rules."""

    title = "losses grow with range"

    reach_m: float = Field(2000.0, ge=1000.0, description="range from which on all is lost (m)")

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links by their range."""
        return FadingLink(self.reach_m)

    def mean_per(self, deployment: Deployment) -> float:
        """Over distances of 0 to 1000 m."""
        return 500.0 / self.reach_m


class Untitled(BernoulliChannel):
    """Says not what it does."""

    title = ""


class Unexplained(BernoulliChannel):
    """Has a setting that nobody explains."""

    haste: float = 0.0


class Unset(BernoulliChannel):
    """Has a setting without a default."""

    haste: float = Field(description="how soon")


class NoMean(ChannelModel):
    """Does not say what it loses."""

    title = "no mean"

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of some rate."""
        return Bernoulli(0.1)


class NamesVehicle(BernoulliChannel):
    """Has a setting with a name that every channel has."""

    blackout: float = Field(0.0, description="taken")


@dataclass
class Answers:
    """Links that answer as a function says."""

    answer: Any

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> Any:
        """Whatever."""
        return self.answer(packet, receiver, range_m)


class Percent(BernoulliChannel):
    """Counts in percent."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Rates of 20."""
        return Answers(lambda *asked: 20.0)


class Wordy(BernoulliChannel):
    """Answers with a text."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Rates in words."""
        return Answers(lambda *asked: "few")


class Nothing(BernoulliChannel):
    """Makes no links."""

    def link_model(self, deployment: Deployment, seed: int) -> Any:
        """Nothing at all."""
        return None


class ShortOfArguments(BernoulliChannel):
    """Takes no seed."""

    def link_model(self, deployment: Deployment) -> LinkModel:  # type: ignore[override]
        """Links without a seed."""
        return Bernoulli(0.1)


class Unrepeatable(BernoulliChannel):
    """Draws from a stream of the process."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of any rate."""
        return Answers(lambda *asked: random.random())


@dataclass
class Streaming:
    """Draws from a stream of the run: the answer depends on how many came before."""

    dice: random.Random
    known: dict[tuple[Any, ...], float] = field(default_factory=dict)

    def p_loss(self, *asked: Any) -> float:
        """Drawn when it is first asked, then remembered."""
        return self.known.setdefault(asked, self.dice.random())


class Streamed(BernoulliChannel):
    """Draws in the order of asking."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of a stream."""
        return Streaming(random.Random(seed))


class Optimist(BernoulliChannel):
    """Claims half of what it loses."""

    per: float = Field(0.2, ge=0.0, lt=1.0, description="packet error rate")

    def mean_per(self, deployment: Deployment) -> float:
        """Too little."""
        return self.per / 2


NO_CLASS = Bernoulli(0.1)
