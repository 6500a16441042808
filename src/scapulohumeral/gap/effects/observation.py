"""What is recorded of one movement, which effects on the measurement change.

Letters: N nodes, C EMG channels.
"""

from __future__ import annotations

from dataclasses import dataclass

from scapulohumeral.model.rotations import Array


@dataclass(frozen=True, eq=False)
class Observation:
    """What is recorded of one movement, at equal steps of phase.

    Attributes
    ----------
    duration_s : of the movement
    pose : (N, 13) joint quaternions and elbow angle
    emg : (N, C), channels as `channels`; contact_N : (N, 3) force of the humerus on the glenoid,
        scapula axes. Both None where not recorded
    """

    duration_s: float
    pose: Array
    channels: tuple[str, ...]
    emg: Array | None
    contact_N: Array | None
