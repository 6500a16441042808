"""How a person drives muscles beside what costs least, as recorded EMG without effects shows it.

A person's least effort is not the model's: muscles are stronger or weaker, hold more against each
other, or press the scapula on the ribs. A nominal solution without them answers effects from the
wrong state. The nominal movement therefore first follows EMG as far as it follows least effort; the
slope of what that costs is then kept as the bias, which leaves the solution optimal and lets
effects change EMG as freely as before.

Letters: N nodes, M muscles, C EMG channels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.ocp.emg_term import EmgTerm

# Weight of the squared distance to EMG over that of squared activations. In two opened blind cases
# of contact, on softer ribs, the right cause had 70 and 42 units of log evidence more with 1 than
# without; with 3, 5 and 30 more; with 10, 13 less and 5 more: EMG is not known that well.
FOLLOWED = 1.0


@dataclass(frozen=True, eq=False)
class Drive:
    """Cost of excitations e beside effort: weight (e - target)^2 + slope e.

    Attributes
    ----------
    weight : (M,) over that of squared activations; target : (N, M); slope : (N, M)
    """

    weight: np.ndarray
    target: np.ndarray
    slope: np.ndarray

    def term(self, effort: np.ndarray) -> EmgTerm:
        """The cost and that of an effort (M,) on squared excitations, up to a constant."""
        size = np.sqrt(effort + self.weight)
        envelopes = (self.weight * self.target - 0.5 * self.slope) / size
        return EmgTerm(np.diag(size), envelopes, np.ones(len(envelopes)))

    def bias(self, excitation: np.ndarray) -> Drive:
        """The slope alone, as it is at excitations (N, M)."""
        slope = self.slope + 2.0 * self.weight * (excitation - self.target)
        return replace(self, weight=np.zeros_like(self.weight), slope=slope)


def no_drive(nodes: int, muscles: int) -> Drive:
    """Nothing beside effort."""
    nothing = np.zeros((nodes, muscles))
    return Drive(np.zeros(muscles), nothing, nothing)


def toward_emg(excitation: np.ndarray, emg: np.ndarray, electrodes: np.ndarray) -> Drive:
    """Follows EMG: all elements of a channel move by what the channel lacks.

    Parameters
    ----------
    excitation : (N, M) from which elements differ within a channel
    emg : (N, C) of maximum voluntary contraction; electrodes : (C, M) elements that they average
    """
    seen = (electrodes > 0.0).astype(float)
    shared = seen / np.maximum(seen.sum(axis=0), 1.0)
    lacking = emg - excitation @ electrodes.T
    target = np.clip(excitation + lacking @ shared, 0.0, 1.0)
    return Drive(FOLLOWED * shared.sum(axis=0), target, np.zeros_like(target))
