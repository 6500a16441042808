"""Distance between muscle excitations and EMG envelopes (paper, eq. objective-emg).

Letters: N nodes, M muscles, C channels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.errors import DataError


@dataclass(frozen=True, eq=False)
class EmgTerm:
    """Envelopes and the muscle elements that they are compared with.

    Attributes
    ----------
    channels : (C, M) share of each element's excitation in a channel
    envelopes : (N, C) EMG over maximum voluntary contraction [1]
    activity : (N,) factor on the term per node, 0 in pauses and where EMG is undefined
    """

    channels: np.ndarray
    envelopes: np.ndarray
    activity: np.ndarray

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit each other, and envelopes with gaps."""
        expected = (len(self.activity), len(self.channels))
        if self.envelopes.shape != expected:
            raise DataError(
                f"EMG envelopes have shape {self.envelopes.shape}, expected {expected}: "
                "one row per mesh node and one column per channel"
            )
        gaps = np.argwhere(~np.isfinite(self.envelopes))
        if len(gaps):
            node, channel = gaps[0].tolist()
            raise DataError(
                f"EMG envelope of channel {channel} at node {node} is not a number: "
                "set it to 0 and the activity of this node to 0"
            )

    @property
    def coupling(self) -> np.ndarray:
        """Half the second derivative of the squared errors by excitations, (M, M)."""
        return self.channels.T @ self.channels

    def errors(self, excitation: np.ndarray) -> np.ndarray:
        """Excitation of each channel minus its envelope, (N, C), for excitations (N, M)."""
        return excitation @ self.channels.T - self.envelopes

    def on_nodes(self, nodes: int) -> EmgTerm:
        """The same term on a mesh of the same duration with another number of nodes."""
        here, there = np.linspace(0, 1, len(self.activity)), np.linspace(0, 1, nodes)
        envelopes = [np.interp(there, here, column) for column in self.envelopes.T]
        return replace(
            self,
            envelopes=np.stack(envelopes, axis=1),
            activity=np.interp(there, here, self.activity),
        )
