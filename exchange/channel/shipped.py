"""Shipped channel models, by their names in scenarios."""

from exchange.channel.acoustic import AcousticChannel
from exchange.channel.models import (
    BernoulliChannel,
    ChannelModel,
    GilbertElliottChannel,
    MatrixChannel,
    PerfectChannel,
)
from exchange.channel.network import NetworkChannel
from exchange.channel.trace import TraceChannel

CHANNELS: dict[str, type[ChannelModel]] = {
    "perfect": PerfectChannel,
    "bernoulli": BernoulliChannel,
    "matrix": MatrixChannel,
    "gilbert-elliott": GilbertElliottChannel,
    "acoustic": AcousticChannel,
    "trace": TraceChannel,
    "network": NetworkChannel,
}
