"""Sensor for one quantity of the water at its vehicle."""

import math

from pydantic import Field

from remoras import TIME, VEHICLE, Column, Observation, Quiet, SensorSettings, Table


def true_value(x_m, y_m, depth_m):
    """A patch of high values at (300, 300), and one less for every 20 m of depth: write your own law here."""
    return 12.0 + 4.0 * math.exp(-((x_m - 300.0) ** 2 + (y_m - 300.0) ** 2) / 200.0**2) - depth_m / 20.0


class ThermometerSettings(SensorSettings):
    every_s: float = Field(10.0, gt=0.0, description="time between two readings")

    def make(self, data):
        return Thermometer(self.every_s)


class Thermometer:
    table = Table("thermometer", (TIME, VEHICLE, Column("reading", "float")))  # a third argument of Column is its unit

    def __init__(self, every_s):
        self._every_s, self._next_s = every_s, 0.0

    def sense(self, pose, world, now_s):
        if now_s < self._next_s:
            return Quiet(until_s=self._next_s)
        self._next_s = now_s + self._every_s
        return [Observation(row=(true_value(pose.x_m, pose.y_m, pose.depth_m),))]
