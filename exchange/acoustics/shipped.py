"""Shipped channel models, by their names in scenarios."""

from exchange.acoustics.acoustic import AcousticChannel
from exchange.acoustics.models import (
    BernoulliChannel,
    ChannelModel,
    GilbertElliottChannel,
    MatrixChannel,
    PerfectChannel,
)
from exchange.acoustics.network import NetworkChannel
from exchange.acoustics.trace import TraceChannel

CHANNELS: dict[str, type[ChannelModel]] = {
    "perfect": PerfectChannel,
    "bernoulli": BernoulliChannel,
    "matrix": MatrixChannel,
    "gilbert-elliott": GilbertElliottChannel,
    "acoustic": AcousticChannel,
    "trace": TraceChannel,
    "network": NetworkChannel,
}
"""Shipped models by name."""
