"""Colours of vehicles stay apart, also for readers who do not see all of them.

Colour-blindness is simulated as by Machado, Oliveira and Fernandes (2009), severity 1, in linear RGB; distances are
those of CIE 1976 L*a*b*, in which 2.3 is just noticeable.
"""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from visualisation import style

SIMULATIONS = {
    "all colours": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = np.array([0.95047, 1.0, 1.08883])
LEAST = 15.0
"""More than six times what is just noticeable."""


def seen(colour: str, simulation: str) -> NDArray[np.float64]:
    """A colour in L*a*b* as such a reader sees it."""
    share = np.array([int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)])
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(np.array(SIMULATIONS[simulation]) @ linear, 0.0, 1.0) / WHITE
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def nearest(colours: tuple[str, ...], simulation: str) -> float:
    """Least distance between two of the colours."""
    points = [seen(colour, simulation) for colour in colours]
    return min(float(np.linalg.norm(a - b)) for a, b in itertools.combinations(points, 2))


@pytest.mark.parametrize("simulation", SIMULATIONS)
def test_eight_vehicles_stay_apart(simulation: str) -> None:
    fills = tuple(style.vehicle_look(number).colour for number in range(8))
    assert len(set(fills)) == 8
    assert nearest(fills, simulation) > LEAST
    assert nearest((*fills, style.YELLOW, style.BLACK), simulation) > 14.0  # places, and the fleet
