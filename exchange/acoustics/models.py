"""Interface of channel models, and the files of links that some of them read.

A model is one class. It lists its settings, the keys of ``[channel]`` that it uses. It makes the ``LinkModel`` of a
run, and says how many packets it loses in the mean. ``exchange.acoustics.channel`` asks the ``LinkModel`` for each
packet and receiver, and draws by itself. A scenario names a shipped model, or another as ``package.module:Class``.
The simple models are here; ``acoustic``, ``trace`` and ``network`` have files of their own.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from exchange.acoustics.link import Bernoulli, GilbertElliott, LinkModel, Matrix, Perfect
from exchange.acoustics.modems import Modem


class LinkFileError(ValueError):
    """A file of links that cannot be used; its text says where and why."""


class LinkFileGoneError(LinkFileError):
    """A file that is not there any more, or not the one that was used."""


def hash_of(file: str, kinds: str) -> str:
    """The sha256 of a file, in hexadecimal digits.

    Args:
        file: its path.
        kinds: which files are allowed, for the message.

    Raises:
        LinkFileGoneError: it cannot be read.
    """
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        where = "from the folder of the scenario; with an option or in a study from the current one"
        raise LinkFileGoneError(f"cannot be read: {why}; allowed: {kinds}, {where}") from None


def same_hash(file: str, sha256: str, kinds: str) -> str:
    """The sha256 of a file that has to be the one that was used; any is if ``sha256`` is empty.

    Raises:
        LinkFileGoneError: it cannot be read, or has another hash.
    """
    digest = hash_of(file, kinds)
    if sha256 and digest != sha256:
        raise LinkFileGoneError(f"is not the file that was used: its sha256 is {digest}, not {sha256}")
    return digest


Probability = Annotated[float, Field(ge=0.0, le=1.0)]


class OfVehicle(NamedTuple):
    """Marks a text that names a vehicle of the scenario: whoever reads the scenario checks that there is one."""


VehicleName = Annotated[str, OfVehicle()]
"""Type of a setting that names a vehicle."""


class SettingFault(NamedTuple):
    """What is wrong between the settings of a model.

    Attributes:
        key: setting at fault, behind ``channel.``; an entry of a list by its number from 1, as in ``link.2.receiver``.
        given: its value.
        allowed: what is allowed instead.
        names: that are allowed; whoever shows the fault proposes the one most like what was given.
        file: that ``key`` stands in, where that is a file of the model's own and not the scenario.
        line: of that file, if the model knows it.
    """

    key: str
    given: str
    allowed: str
    names: tuple[str, ...] = ()
    file: str = ""
    line: int | None = None


@dataclass(frozen=True, slots=True)
class Deployment:
    """The fleet that transmits, as far as a channel model may know it.

    Attributes:
        nodes: node number of each vehicle, by name; from 0 on, without gaps.
        depths_m: working depth of each node.
        modem: of all vehicles.
        range_m: declared range, for which the guard of the slots is made.
        duration_s: time at which the run ends at the latest.
    """

    nodes: Mapping[str, int]
    depths_m: tuple[float, ...]
    modem: Modem
    range_m: float
    duration_s: float


class ChannelModel(BaseModel):
    """A channel model, and the settings that it takes.

    Compulsory: ``title``, ``link_model`` and ``mean_per``. Settings are fields with bounds, a description and a
    default, so that the model can be named alone. A key that a shipped model has too, such as ``per``, keeps its type
    and bounds. A model without settings leaves aside those that a scenario has for others.

    Here is a model whose links lose the more, the longer they are:

    >>> class Fading(ChannelModel):
    ...     title = "losses grow with range"
    ...     reach_m: float = Field(1000.0, gt=0.0, description="range from which on all is lost (m)")
    ...
    ...     def link_model(self, deployment, seed):
    ...         return FadingLink(self.reach_m)
    ...
    ...     def mean_per(self, deployment):
    ...         return 0.5
    >>> class FadingLink(NamedTuple):
    ...     reach_m: float
    ...
    ...     def p_loss(self, packet, receiver, range_m):
    ...         return min(1.0, range_m / self.reach_m)
    >>> from exchange.acoustics.link import Transmission
    >>> from exchange.acoustics.modems import modems
    >>> pond = Deployment({"AUV00": 0, "AUV01": 1}, (0.0, 20.0), modems()["nanomodem-v3"], 1000.0, 3600.0)
    >>> links = Fading(reach_m=2000.0).link_model(pond, seed=1)
    >>> links.p_loss(Transmission(slot=0, sender=0, start_s=0.0, size_bits=512), 1, 500.0)
    0.25
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    title: ClassVar[str] = ""
    """One line for listings."""
    counts_depth: ClassVar[bool] = False
    """True if ranges, and so the times of arrivals, are those in three dimensions; else those on the chart."""
    UNSAID: ClassVar[frozenset[str]] = frozenset()
    """Settings that are left out of what is written while they are None."""
    carries_beyond_range: ClassVar[bool] = False
    """True if the losses themselves say how far a packet carries; else nothing is heard beyond the declared range."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """The model of all links in one run; asked once, before the run starts.

        Args:
            deployment: the fleet that transmits.
            seed: of the run. A model that draws takes its numbers from ``exchange.acoustics.loss`` by seed, slot,
                sender and receiver, so that its answers do not depend on what was asked before.
        """
        raise NotImplementedError(f"{type(self).__name__} makes no links: define link_model(deployment, seed)")

    def mean_per(self, deployment: Deployment) -> float:
        """Packet error rate in the mean over time and all directed links of a fleet, within range; for the results.

        A model that cannot know it, for lack of the tracks, estimates it and says how.
        """
        raise NotImplementedError(f"{type(self).__name__} does not say what it loses: define mean_per(deployment)")

    def sound_speed_mps(self, deployment: Deployment) -> float | None:
        """Speed of sound that follows from the settings; None, as here, where that of the world holds. Optional."""
        return None

    def assumed(self, deployment: Deployment | None = None, seed: int = 0) -> str:
        """What is assumed that a reader of results has to know: captions of all figures add it. Optional.

        Args:
            deployment: the fleet of one run; None where several runs are meant.
            seed: of that run.
        """
        return ""

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """What is wrong between the settings and the fleet; asked when a scenario is checked. Optional."""
        yield from ()

    @classmethod
    def faults(cls, settings: Mapping[str, Any]) -> Iterator[SettingFault]:
        """What is wrong between settings that are right one by one; asked when a scenario is checked. Optional.

        Args:
            settings: values as the file has them, defaults left out. What is malformed is reported elsewhere: pass it
                by.
        """
        yield from ()


class PerfectChannel(ChannelModel):
    """Every packet arrives."""

    title = "every packet arrives"

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links that lose nothing."""
        return Perfect()

    def mean_per(self, deployment: Deployment) -> float:
        """Nothing is lost."""
        return 0.0


class BernoulliChannel(ChannelModel):
    """Independent losses, alike on all links."""

    title = "every receiver loses every packet with probability per, independently"

    per: float = Field(
        0.0, ge=0.0, lt=1.0, description="packet error rate of bernoulli, and of the links that matrix does not list"
    )

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of one packet error rate."""
        return Bernoulli(self.per)

    def mean_per(self, deployment: Deployment) -> float:
        """The rate itself."""
        return self.per


class LinkTable(BaseModel):
    """One directed link of the matrix channel."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    sender: VehicleName = Field(description="vehicle that sends")
    receiver: VehicleName = Field(description="vehicle that listens; the other direction is a link of its own")
    per: Probability = Field(description="packet error rate of this link")


class MatrixChannel(BernoulliChannel):
    """Independent losses, with a rate of its own for each link that is listed."""

    title = "as bernoulli, but each (sender, receiver) listed under link has a per of its own"

    link: tuple[LinkTable, ...] = ()

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links of a rate each."""
        nodes = deployment.nodes
        return Matrix(self.per, {(nodes[link.sender], nodes[link.receiver]): link.per for link in self.link})

    def mean_per(self, deployment: Deployment) -> float:
        """Mean over the links, listed or not."""
        n_links = len(deployment.nodes) * (len(deployment.nodes) - 1)
        return self.per + math.fsum(link.per - self.per for link in self.link) / n_links

    @classmethod
    def faults(cls, settings: Mapping[str, Any]) -> Iterator[SettingFault]:
        """A link from a vehicle to itself, or listed twice."""
        links = settings.get("link", ())
        pairs: set[tuple[str, str]] = set()
        for number, link in enumerate(links if isinstance(links, Sequence) else (), 1):
            sender, receiver = (link.get("sender"), link.get("receiver")) if isinstance(link, Mapping) else (None, None)
            if not isinstance(sender, str) or not isinstance(receiver, str):
                continue
            if sender == receiver:
                yield SettingFault(f"link.{number}.receiver", f'"{receiver}"', "must not be the sender")
            elif (sender, receiver) in pairs:
                allowed = f"the link from {sender} to {receiver} is listed twice"
                yield SettingFault(f"link.{number}.receiver", f'"{receiver}"', allowed)
            pairs.add((sender, receiver))


class GilbertElliottChannel(ChannelModel):
    """Losses in bursts."""

    title = "losses in bursts: links turn bad with p_good_to_bad and good with p_bad_to_good per slot"

    p_good_to_bad: Probability = Field(
        0.1, description="gilbert-elliott: probability per TDMA slot that a good link turns bad"
    )
    p_bad_to_good: Probability = Field(
        0.3, description="gilbert-elliott: probability per TDMA slot that a bad link turns good"
    )
    per_good: Probability = Field(0.05, description="gilbert-elliott: packet error rate of a link in its good state")
    per_bad: Probability = Field(0.8, description="gilbert-elliott: packet error rate of a link in its bad state")

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Links with a state each, drawn by the seed."""
        return self._chain(seed)

    def mean_per(self, deployment: Deployment) -> float:
        """Stationary mean over both states."""
        return self._chain(seed=0).mean_per

    def _chain(self, seed: int) -> GilbertElliott:
        return GilbertElliott(self.p_good_to_bad, self.p_bad_to_good, self.per_good, self.per_bad, seed)

    @classmethod
    def faults(cls, settings: Mapping[str, Any]) -> Iterator[SettingFault]:
        """A chain that never changes, or changes more than surely."""
        keys = ("p_good_to_bad", "p_bad_to_good")
        rates = {key: settings.get(key, cls.model_fields[key].default) for key in keys}
        if all(isinstance(rate, int | float) and 0.0 <= rate <= 1.0 for rate in rates.values()):
            greater = max(rates, key=lambda key: rates[key])
            if not 0.0 < math.fsum(rates.values()) <= 1.0:
                allowed = f"{' + '.join(rates)} must be above 0 and at most 1, not {math.fsum(rates.values()):g}"
                yield SettingFault(greater, str(rates[greater]), allowed)
