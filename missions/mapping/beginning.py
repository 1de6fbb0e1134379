"""Wizard for a new scenario: six answers give adjacent squares and a fleet south of them.

The TOML template repeats the text between ``#: each KIND`` and ``#: end`` for each area, role, vehicle or fault.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

from exchange.arithmetic import length
from missions.errors import ConfigurationError

TEMPLATE = Path(__file__).with_name("new-scenario.toml.txt")
EACH = re.compile(r"^#: each (\w+)\n(.*?)^#: end\n", re.MULTILINE | re.DOTALL)
SWATH_M, SURVEY_MPS, TRANSIT_MPS, POWER_W = 25.0, 1.5, 2.5, 100.0
"""Sensor width and speeds of the template's vehicles; upper limit (W) of their survey power."""
MARGIN_M = 100.0
"""Distance from the start to the first area, and free margin around all areas."""


@dataclass(frozen=True)
class Inquiry:
    """A question of the wizard; ``value`` parses an answer and returns None if not allowed."""

    name: str
    text: str
    default: str
    allowed: str
    value: Callable[[str], Any]


def _number(low: float, high: float, kind: type = int) -> Callable[[str], Any]:

    def value(text: str) -> Any:
        try:
            number = kind(text)
        except ValueError:
            return None
        return number if low <= number <= high else None

    return value


def questions_of(modems: Mapping[str, float]) -> tuple[Inquiry, ...]:
    """Return the six questions in order; ``modems`` maps modem names to nominal ranges (m)."""
    return (
        Inquiry("vehicles", "How many AUVs?", "3", "2 to 16", _number(2, 16)),
        Inquiry("areas", "How many areas are they to map?", "4", "1 to 36", _number(1, 36)),
        Inquiry("side", "How long is the side of an area, in m?", "150", "50 to 1000", _number(50.0, 1000.0, float)),
        Inquiry(
            "modem", "Which modem do they have?", "nanomodem-v3", f"one of {', '.join(modems)}",
            lambda text: text if text in modems else None,
        ),
        Inquiry("per", "Which share of packets is lost?", "0.3", "0 to 0.95", _number(0.0, 0.95, float)),
        Inquiry("lost", "How many vehicles are lost on the way?", "0", "0 to 15, fewer than AUVs", _number(0, 15)),
    )  # fmt: skip


def scenario_text(name: str, answers: Mapping[str, Any], modems: Mapping[str, float]) -> str:
    """Return the scenario as TOML text.

    The time limit is 1.5 times the time that the vehicles left after all faults need for all areas, plus five minutes,
    rounded up to ten minutes. Raises ``ConfigurationError`` if no vehicle remains or a corner is out of modem range.
    """
    n_vehicles, n_areas, n_lost, side_m = (answers[key] for key in ("vehicles", "areas", "lost", "side"))
    n_columns = math.ceil(math.sqrt(n_areas))
    east_m, north_m = (MARGIN_M + side_m * n for n in (n_columns, math.ceil(n_areas / n_columns)))
    reach_m, carries_m = length(east_m, north_m), modems[answers["modem"]]
    if n_lost >= n_vehicles:
        raise _refused("lost", n_lost, f"0 to {n_vehicles - 1}, or none of --vehicles is left")
    if reach_m > carries_m:
        far = f"the farthest corner is {reach_m:.0f} m away, and {answers['modem']} carries {carries_m:g} m"
        raise _refused("side", f"{side_m:g}", f"shorter, or fewer --areas, or another --modem: {far}")
    each_s = side_m * side_m / SWATH_M / SURVEY_MPS + 2.0 * reach_m / TRANSIT_MPS
    work_s = math.ceil(n_areas / (n_vehicles - n_lost)) * each_s
    duration_s = 600.0 * math.ceil((1.5 * work_s + 300.0) / 600.0)
    corners = [
        {
            "area": f"area {number + 1}", "role": f"Mapper{number + 1}",
            "west": MARGIN_M + side_m * (number % n_columns), "east": MARGIN_M + side_m * (number % n_columns + 1),
            "south": MARGIN_M + side_m * (number // n_columns), "north": MARGIN_M + side_m * (number // n_columns + 1),
        }
        for number in range(n_areas)
    ]  # fmt: skip
    fleet = [{"vehicle": f"AUV{n:02d}", "slot": n, "start_x": 10.0 * n} for n in range(n_vehicles)]
    faults = [{"earliest_s": round(0.05 * work_s), "latest_s": round(0.25 * work_s)}] * n_lost
    entries: dict[str, list[dict[str, Any]]] = {"area": corners, "vehicle": fleet, "fault": faults}
    text = EACH.sub(
        lambda match: "".join(Template(match[2]).safe_substitute(entry) for entry in entries[match[1]]),
        TEMPLATE.read_text(encoding="utf-8"),
    )
    once = {
        "name": name, "n_vehicles": n_vehicles, "n_areas": n_areas, "side": f"{side_m:g}", "duration_s": duration_s,
        "east_m": east_m + MARGIN_M, "north_m": north_m + MARGIN_M, "modem": answers["modem"], "per": answers["per"],
        "range_m": 100.0 * math.ceil(reach_m / 100.0), "energy_j": 1e6 * math.ceil(POWER_W * duration_s / 1e6),
    }  # fmt: skip
    return Template(text).substitute(once).rstrip() + "\n"


def _refused(option: str, value: object, allowed: str) -> ConfigurationError:
    return ConfigurationError.of("new scenario", f"--{option}", str(value), f"allowed: {allowed}")
