"""The link budget: what of a sender's sound reaches a receiver, against the noise there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from exchange.arithmetic import log10

SOURCE_LEVEL_OF_1_W_DB = 170.8
"""Source level of an omnidirectional source that gives 1 W of sound, dB re 1 uPa at 1 m (Urick 1983)."""


def source_level_db(acoustic_power_w: float) -> float:
    """Source level of an omnidirectional source, dB re 1 uPa at 1 m.

    >>> round(source_level_db(10.0), 1)
    180.8
    """
    return SOURCE_LEVEL_OF_1_W_DB + 10.0 * log10(acoustic_power_w)


def transmission_loss_db(range_m: float, spreading: float, absorption_db_per_km: float) -> float:
    """Loss by spreading and absorption, against 1 m from the source; nearer than that it is taken as at 1 m.

    Args:
        range_m: from the source.
        spreading: exponent k of the intensity: 1 cylindrical, 1.5 practical, 2 spherical.
        absorption_db_per_km: of the water at the centre of the band.

    >>> round(transmission_loss_db(1000.0, 1.5, 6.1048), 2)
    51.1
    """
    away_m = max(range_m, 1.0)
    return spreading * 10.0 * log10(away_m) + absorption_db_per_km * away_m / 1000.0


@lru_cache(maxsize=64)
def _per_bit_db(band_hz: float, rate_bps: float) -> float:
    """What the ratio of a bit is above that in the band; worked out once, since every packet asks for it."""
    return 10.0 * log10(band_hz / rate_bps)


@dataclass(frozen=True, slots=True)
class Budget:
    """What decides the signal-to-noise ratio of a link, but for its range.

    Args:
        source_level_db: dB re 1 uPa at 1 m.
        noise_db: level of the noise in the band, dB re 1 uPa.
        directivity_db: gain of the receiver against that noise.
        spreading: exponent of the spreading loss.
        absorption_db_per_km: at the centre of the band.
        band_hz: width of the band.
        rate_bps: net bits of a second.
        margin_db: by which a receiver falls short of what its modulation, or its curve, would do.
    """

    source_level_db: float
    noise_db: float
    directivity_db: float
    spreading: float
    absorption_db_per_km: float
    band_hz: float
    rate_bps: float
    margin_db: float = 0.0

    def shifted(self, excess_db: float) -> Budget:
        """The same budget with a ratio of signal to noise that is higher by so much."""
        return replace(self, directivity_db=self.directivity_db + excess_db)

    def loss_db(self, range_m: float) -> float:
        """Transmission loss."""
        return transmission_loss_db(range_m, self.spreading, self.absorption_db_per_km)

    def snr_db(self, range_m: float) -> float:
        """Signal-to-noise ratio in the band."""
        return self.source_level_db - self.loss_db(range_m) - self.noise_db + self.directivity_db

    def effective_snr_db(self, range_m: float) -> float:
        """Signal-to-noise ratio in the band, less the margin."""
        return self.snr_db(range_m) - self.margin_db

    def ebn0_db(self, range_m: float) -> float:
        """Energy of a bit over the density of the noise: the ratio in the band, less the margin, times B / R."""
        return self.effective_snr_db(range_m) + _per_bit_db(self.band_hz, self.rate_bps)
