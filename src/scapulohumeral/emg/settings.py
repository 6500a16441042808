"""How raw EMG is processed, as the configuration says it.

Apart from what processes it, so that a plan of the study does not wait for filters to be loaded.
"""

from __future__ import annotations

from dataclasses import dataclass

from scapulohumeral.errors import ConfigError


@dataclass(frozen=True)
class EnvelopeSettings:
    """Keys of `emg.envelope`.

    Attributes
    ----------
    band_low_hz, band_high_hz : half-power edges of the band-pass
    cutoff_hz : half-power edge of the low-pass that makes the envelope
    rate_hz : sampling rate of the envelope
    mvc_window_s : the MVC is the largest mean of the envelope over a window of this length; with 0
        it is the largest value
    """

    band_low_hz: float
    band_high_hz: float
    cutoff_hz: float
    rate_hz: float
    mvc_window_s: float

    def __post_init__(self) -> None:
        if not 0.0 < self.cutoff_hz < self.band_low_hz < self.band_high_hz:
            raise ConfigError(
                f"emg.envelope: cutoff_hz {self.cutoff_hz}, band_low_hz {self.band_low_hz}, "
                f"band_high_hz {self.band_high_hz}; expected them to increase in this order."
            )
        if self.rate_hz < 4.0 * self.cutoff_hz:
            raise ConfigError(
                f"emg.envelope.rate_hz: {self.rate_hz}; expected at least four times cutoff_hz "
                f"({self.cutoff_hz}), or the envelope loses its shape between samples."
            )
