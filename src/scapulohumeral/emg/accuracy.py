"""How well an envelope tells an excitation: what whoever compares the two has to allow for.

Measured with the pipeline itself on simulated recordings of constant excitation, with the settings
of ``config/config.yaml``; `tests/unit/emg/test_accuracy.py` measures again.

===========================  ==============================================================
noise of a sample            10.7 % of the excitation: +-0.021 at 0.2, the same share from
                             0.01 to 1. It comes from the randomness of EMG, not from the
                             electrode, and is nearly independent of the channel
its correlation              samples closer than 0.12 s share it, so a second of envelope
                             holds about eight independent values
gain of a channel            reads 1.5 % low, +-1.9 % from channel to channel, because the MVC
                             is itself the largest of several noisy means; 5.6 +- 2.4 % low for
                             means over 1 s instead of 3 s, and 23 +- 4 % for the largest value
                             (0 s). The same for all trials of a participant, so that longer
                             trials do not help
at rest                      0.0025 of MVC: the electrode noise
===========================  ==============================================================
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import Array

# The table above, at the low-pass it was measured with.
MEASURED_CUTOFF_HZ = 4.0
NOISE_SHARE = 0.107
CORRELATION_TIME_S = 0.118
REST_LEVEL = 0.0025
# Mean and standard deviation of gain - 1 by window [s], for contractions held 5 s.
GAINS = {0.0: (-0.23, 0.04), 1.0: (-0.056, 0.024), 3.0: (-0.015, 0.019)}


def noise_sd(values: Array, settings: EnvelopeSettings) -> Array:
    """Standard deviation of envelope samples about the excitation, without the gain of the channel.

    A low-pass of half the width averages over twice the time, which halves the variance.

    Parameters
    ----------
    values : excitations or envelopes, any shape, fractions of MVC
    settings : EnvelopeSettings      its `cutoff_hz`

    Returns
    -------
    array like `values`              at least the level at rest, by which small ones are biased
    """
    share = NOISE_SHARE * np.sqrt(settings.cutoff_hz / MEASURED_CUTOFF_HZ)
    return np.maximum(share * values, REST_LEVEL)


def channel_gain(settings: EnvelopeSettings) -> tuple[float, float]:
    """Mean and standard deviation over channels of gain - 1 [1], by the window of the MVC.

    Raises
    ------
    ConfigError                      a window that the gain was not measured for
    """
    window = settings.mvc_window_s
    if window not in GAINS:
        raise ConfigError(
            f"emg.envelope.mvc_window_s: {window}; a calibration has to know by how much channels "
            f"then read low, which was measured for {', '.join(f'{w:g}' for w in GAINS)} s. "
            "Choose one of these."
        )
    return GAINS[window]


def correlation_time_s(settings: EnvelopeSettings) -> float:
    """Time over which envelope noise is the same: duration over it is the number of
    independent samples, for the variance of a mean over that duration.
    """
    return CORRELATION_TIME_S * MEASURED_CUTOFF_HZ / settings.cutoff_hz
