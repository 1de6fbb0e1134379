from dataclasses import dataclass

from pydantic import Field

from exchange.channel.models import ChannelModel


@dataclass(frozen=True)
class FadingLink:
    reach_m: float

    def p_loss(self, packet, receiver, range_m):
        return min(1.0, (range_m / self.reach_m) ** 2)


class Fading(ChannelModel):
    title = "losses grow with the square of the range"
    reach_m: float = Field(2000.0, gt=0.0, description="range beyond which all packets are lost (m)")

    def link_model(self, deployment, seed):
        return FadingLink(self.reach_m)

    def mean_per(self, deployment):
        return min(1.0, (deployment.range_m / self.reach_m) ** 2 / 3.0)  # even distances up to range_m
