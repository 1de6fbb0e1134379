from pydantic import Field

from remoras import Condition, DeclaredFault


class Fouled(DeclaredFault):
    """One ``[[fault]]``: weed in the propeller."""

    TEXT = "weed in the propeller: the vehicle is slower and consumes weed_w more"

    weed_w: float = Field(30.0, gt=0.0, description="additional power (W)")

    def leaves(self, data):
        return Condition(speed_factor=0.7, drain_w=self.weed_w)

    def detail(self, data, how_long):
        return f"{self.weed_w:g} W, {how_long}"
