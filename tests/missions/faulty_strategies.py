"""Strategies that fail, each in its way; otherwise they form the organisation of ``remoras``."""

import os
import time
from dataclasses import dataclass

from remoras.strategies.remoras import Remoras


@dataclass(frozen=True)
class Raising(Remoras):
    name: str = "raising"

    def form(self, fleet_data, groups):
        raise ValueError("no fleet today")


@dataclass(frozen=True)
class Killing(Remoras):
    name: str = "killing"

    def form(self, fleet_data, groups):
        os._exit(9)


@dataclass(frozen=True)
class Endless(Remoras):
    """It never returns, and lets no interruption through."""

    name: str = "endless"

    def form(self, fleet_data, groups):
        while True:
            try:
                time.sleep(60.0)
            except BaseException:
                continue


RAISING, KILLING, ENDLESS = Raising(), Killing(), Endless()
