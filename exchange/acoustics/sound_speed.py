"""Speed of sound in sea water, after K. V. Mackenzie, Nine-term equation for sound speed in the oceans (1981)."""


def sound_speed_mps(temperature_c: float, salinity_psu: float, depth_m: float) -> float:
    """Speed of sound; fitted for 2 to 30 degrees, a salinity of 25 to 40 and depths down to 8000 m.

    Args:
        temperature_c: of the water, degrees Celsius.
        salinity_psu: grams of salt in a kilogram of water, nearly.
        depth_m: below the surface.

    >>> round(sound_speed_mps(10.0, 35.0, 100.0), 4)
    1491.4351
    """
    t, d = temperature_c, depth_m
    return (
        1448.96
        + 4.591 * t
        - 5.304e-2 * t * t
        + 2.374e-4 * t * t * t
        + 1.340 * (salinity_psu - 35.0)
        + 1.630e-2 * d
        + 1.675e-7 * d * d
        - 1.025e-2 * t * (salinity_psu - 35.0)
        - 7.139e-13 * t * d * d * d
    )
