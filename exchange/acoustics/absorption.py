"""How much sound the water takes up on its way, in decibels per kilometre."""

import math

from exchange.arithmetic import power_of_10


def thorp_db_per_km(frequency_khz: float) -> float:
    """Absorption after Thorp (1967), a fit to water of 4 degrees near 1000 m, for frequencies above 0.4 kHz.

    >>> round(thorp_db_per_km(25.0), 4)
    6.1048
    """
    f2 = frequency_khz * frequency_khz
    return 0.11 * f2 / (1.0 + f2) + 44.0 * f2 / (4100.0 + f2) + 2.75e-4 * f2 + 0.003


def francois_garrison_db_per_km(
    frequency_khz: float, temperature_c: float, salinity_psu: float, depth_m: float, ph: float
) -> float:
    """Absorption by boric acid, magnesium sulphate and water itself, after Francois and Garrison (1982).

    Args:
        frequency_khz: of the sound.
        temperature_c: of the water, degrees Celsius.
        salinity_psu: of the water; the formula was fitted for 30 to 35.
        depth_m: below the surface.
        ph: acidity of the water, 8.1 at the surface of the oceans.

    >>> round(francois_garrison_db_per_km(25.0, 4.0, 35.0, 1000.0, 8.0), 4)
    4.9757
    """
    f2, t, d = frequency_khz * frequency_khz, temperature_c, depth_m
    speed_mps = 1412.0 + 3.21 * t + 1.19 * salinity_psu + 0.0167 * d
    boric = 8.86 / speed_mps * power_of_10(0.78 * ph - 5.0)
    boric_khz = 2.8 * math.sqrt(salinity_psu / 35.0) * power_of_10(4.0 - 1245.0 / (273.0 + t))
    sulphate = 21.44 * salinity_psu / speed_mps * (1.0 + 0.025 * t)
    sulphate_khz = 8.17 * power_of_10(8.0 - 1990.0 / (273.0 + t)) / (1.0 + 0.0018 * (salinity_psu - 35.0))
    sulphate_pressure = 1.0 - 1.37e-4 * d + 6.2e-9 * d * d
    if t <= 20.0:
        water = 4.937e-4 - 2.59e-5 * t + 9.11e-7 * t * t - 1.50e-8 * t * t * t
    else:
        water = 3.964e-4 - 1.146e-5 * t + 1.45e-7 * t * t - 6.5e-10 * t * t * t
    water_pressure = 1.0 - 3.83e-5 * d + 4.9e-10 * d * d
    of_boric = boric * boric_khz * f2 / (boric_khz * boric_khz + f2) if salinity_psu > 0.0 else 0.0
    of_sulphate = sulphate * sulphate_pressure * sulphate_khz * f2 / (sulphate_khz * sulphate_khz + f2)
    return of_boric + of_sulphate + water * water_pressure * f2
