"""Interface of channel models, the simple models, and checks of link files.

A model is a class with its settings, the keys of ``[channel]``. It creates the ``LinkModel`` of a run.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from exchange.channel.link import Bernoulli, GilbertElliott, LinkModel, Matrix
from exchange.channel.modems import Modem, Probability


class LinkFileError(ValueError):
    """Invalid file of links; the text has place and reason."""


class LinkFileGoneError(LinkFileError):
    """Missing file, or one that differs from the file used before."""


def hash_of(file: str, kinds: str, sha256: str = "") -> str:
    """Return the sha256 of a file; raises LinkFileGoneError if unreadable or not ``sha256``, if given."""
    try:
        digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        where = "from the folder of the scenario; with an option or in a study from the current one"
        raise LinkFileGoneError(f"cannot be read: {why}; allowed: {kinds}, {where}") from None

    if sha256 and digest != sha256:
        raise LinkFileGoneError(f"is not the file that was used: its sha256 is {digest}, not {sha256}")
    return digest


def number_in(text: str) -> float:
    """Return the number in a field of a file; NaN if there is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


class OfVehicle(NamedTuple):
    """Annotation of a setting that must name a vehicle of the scenario."""


VehicleName = Annotated[str, OfVehicle()]


class SettingFault(NamedTuple):
    """Inconsistent settings of a model: ``key`` behind ``channel.``, or in the model's own ``file``.

    List entries have numbers from 1, as in ``link.2.receiver``. The nearest of ``names`` is proposed.
    """

    key: str
    given: str
    allowed: str
    names: tuple[str, ...] = ()
    file: str = ""
    line: int | None = None


@dataclass(frozen=True, slots=True)
class Deployment:
    """Transmitting fleet: ``nodes`` maps vehicles to numbers from 0 on, ``range_m`` is the declared range."""

    nodes: Mapping[str, int]
    depths_m: tuple[float, ...]
    modem: Modem
    range_m: float
    duration_s: float


class ChannelModel(BaseModel):
    """Channel model with its settings.

    Compulsory: ``title``, ``link_model`` and ``mean_per``. Settings are fields with bounds, description and default. A
    key shared with a shipped model, such as ``per``, keeps its type and bounds.

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
    >>> from exchange.channel.link import Transmission
    >>> from exchange.channel.modems import modems
    >>> pond = Deployment({"AUV00": 0, "AUV01": 1}, (0.0, 20.0), modems()["nanomodem-v3"], 1000.0, 3600.0)
    >>> links = Fading(reach_m=2000.0).link_model(pond, seed=1)
    >>> links.p_loss(Transmission(slot=0, sender=0, start_s=0.0, size_bits=512), 1, 500.0)
    0.25
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    title: ClassVar[str] = ""
    """One line for listings."""
    counts_depth: ClassVar[bool] = False
    """True if ranges and arrival times are three-dimensional, else horizontal."""
    UNSAID: ClassVar[frozenset[str]] = frozenset()
    """Settings omitted from output while None."""
    carries_beyond_range: ClassVar[bool] = False
    """True if only losses limit the range; else no packet arrives beyond the declared range."""

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return the links of one run; random ones draw from ``exchange.channel.loss``."""
        raise NotImplementedError(f"{type(self).__name__} makes no links: define link_model(deployment, seed)")

    def mean_per(self, deployment: Deployment) -> float:
        """Return the mean packet error rate over time and links in range, possibly estimated."""
        raise NotImplementedError(f"{type(self).__name__} lacks mean_per(deployment), its mean loss")

    def sound_speed_mps(self, deployment: Deployment) -> float | None:
        """Return the sound speed (m/s) from the settings; None for that of the world. Optional."""
        return None

    def assumed(self, deployment: Deployment | None = None, seed: int = 0) -> str:
        """Return an assumption for figure captions; ``deployment`` is None for several runs."""
        return ""

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Yield faults between individually valid settings, or with the fleet, at the check of a scenario. Optional."""
        yield from ()


class PerfectChannel(ChannelModel):
    """Every packet arrives."""

    title = "every packet arrives"

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return links without loss."""
        return Bernoulli(0.0)

    def mean_per(self, deployment: Deployment) -> float:
        """Return 0."""
        return 0.0


class BernoulliChannel(ChannelModel):
    """Independent losses with one rate on all links."""

    title = "every receiver loses every packet with probability per, independently"

    per: float = Field(
        0.0, ge=0.0, lt=1.0, description="packet error rate of bernoulli, and of the links that matrix does not list"
    )

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return links with one packet error rate."""
        return Bernoulli(self.per)

    def mean_per(self, deployment: Deployment) -> float:
        """Return ``per``."""
        return self.per


class LinkTable(BaseModel):
    """Directed link of the matrix channel."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    sender: VehicleName = Field(description="sender")
    receiver: VehicleName = Field(description="receiver; the reverse direction is a separate link")
    per: Probability = Field(description="packet error rate of this link")


class MatrixChannel(BernoulliChannel):
    """Independent losses with a rate for each listed link."""

    title = "as bernoulli, but each (sender, receiver) listed under link has a per of its own"

    link: tuple[LinkTable, ...] = ()

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return links with individual rates."""
        nodes = deployment.nodes
        return Matrix(self.per, {(nodes[link.sender], nodes[link.receiver]): link.per for link in self.link})

    def mean_per(self, deployment: Deployment) -> float:
        """Return the mean over all links."""
        # Only listed links differ from ``per``.
        n_links = len(deployment.nodes) * (len(deployment.nodes) - 1)
        return self.per + math.fsum(link.per - self.per for link in self.link) / n_links

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Yield faults for links of a vehicle to itself and duplicates."""
        pairs: set[tuple[str, str]] = set()
        for number, link in enumerate(self.link, 1):
            sender, receiver = link.sender, link.receiver
            if sender == receiver:
                yield SettingFault(f"link.{number}.receiver", f'"{receiver}"', "must not be the sender")
            elif (sender, receiver) in pairs:
                allowed = f"the link from {sender} to {receiver} is listed twice"
                yield SettingFault(f"link.{number}.receiver", f'"{receiver}"', allowed)
            pairs.add((sender, receiver))


class GilbertElliottChannel(ChannelModel):
    """Burst losses."""

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
        """Return links with states drawn by the seed."""
        return self._chain(seed)

    def mean_per(self, deployment: Deployment) -> float:
        """Return the stationary mean over both states."""
        return self._chain(seed=0).mean_per

    def _chain(self, seed: int) -> GilbertElliott:
        return GilbertElliott(self.p_good_to_bad, self.p_bad_to_good, self.per_good, self.per_bad, seed)

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Yield a fault if the sum of both transition probabilities is not in (0, 1]."""
        rates = {"p_good_to_bad": self.p_good_to_bad, "p_bad_to_good": self.p_bad_to_good}
        total, greater = math.fsum(rates.values()), max(rates, key=lambda key: rates[key])
        if not 0.0 < total <= 1.0:
            allowed = f"{' + '.join(rates)} must be above 0 and at most 1, not {total:g}"
            yield SettingFault(greater, f"{rates[greater]:g}", allowed)
