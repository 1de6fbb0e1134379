"""Local metres as latitude and longitude on the ellipsoid of WGS 84.

The plane of the simulation touches the ellipsoid at the datum, x east and y north. A point of it goes by way of
earth-centred coordinates to the foot of its normal on the ellipsoid. Distances from the datum are kept to 3 cm within
10 km and to 3 m within 50 km.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SEMI_MAJOR_M = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_2 = FLATTENING * (2.0 - FLATTENING)
"""Square of the first eccentricity."""
ROUNDS = 4
"""Each makes the latitude more exact by a factor of 150 or more."""


class Datum(NamedTuple):
    """Where x = 0, y = 0 is."""

    latitude_deg: float
    longitude_deg: float

    def degrees(self, x_m: Any, y_m: Any) -> tuple[Floats, Floats]:
        """Latitudes and longitudes of points, to 1e-8 degrees (1 mm).

        Args:
            x_m: metres east of the datum, a number or an array.
            y_m: metres north of it, likewise.

        >>> latitudes, longitudes = Datum(0.0, 0.0).degrees([0.0, 1000.0], [1000.0, 0.0])
        >>> [round(float(latitudes[0]), 6), round(float(longitudes[1]), 6)]
        [0.009044, 0.008983]
        """
        east, north = np.asarray(x_m, dtype=float), np.asarray(y_m, dtype=float)
        latitude, longitude = np.radians(self.latitude_deg), np.radians(self.longitude_deg)
        sine, cosine = np.sin(latitude), np.cos(latitude)
        normal_m = SEMI_MAJOR_M / np.sqrt(1.0 - ECCENTRICITY_2 * sine**2)
        outward_m = normal_m * cosine - sine * north  # from the axis, in the meridian of the datum
        up_m = normal_m * (1.0 - ECCENTRICITY_2) * sine + cosine * north  # above the equator
        radius_m = np.hypot(outward_m, east)
        found = np.arctan2(up_m, radius_m * (1.0 - ECCENTRICITY_2))
        for _ in range(ROUNDS):
            sines = np.sin(found)
            normals_m = SEMI_MAJOR_M / np.sqrt(1.0 - ECCENTRICITY_2 * sines**2)
            found = np.arctan2(up_m + ECCENTRICITY_2 * normals_m * sines, radius_m)
        longitudes = np.degrees(longitude + np.arctan2(east, outward_m))
        return np.round(np.degrees(found), 8), np.round((longitudes + 180.0) % 360.0 - 180.0, 8)
