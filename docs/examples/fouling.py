from pydantic import Field

from remoras import Condition, DeclaredFault


class Fouled(DeclaredFault):
    """One ``[[fault]]`` of a vehicle that has weed in its propeller."""

    TEXT = "weed is in its propeller: it is slower, and loses weed_w beside what it uses"

    weed_w: float = Field(30.0, gt=0.0, description="power that the weed takes, W")

    def leaves(self, data):
        return Condition(speed_factor=0.7, drain_w=self.weed_w)

    def detail(self, data, how_long):
        return f"{self.weed_w:g} W, {how_long}"
