"""Trials of opened keys, as they would have been recorded without noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.gap.recording.case import ContactSeries, EmgSeries, GapTrial
from scapulohumeral.gap.recording.movement_window import movement_window, smoothed
from scapulohumeral.gap.recording.observables import channel_kind
from scapulohumeral.model.motion import Motion


def noise_free_trial(
    curves: Mapping[str, Any], channels: Sequence[str], task: str, side: str
) -> GapTrial:
    """A trial of a key.

    Parameters
    ----------
    curves : "time_s" (S,), "angles_deg" (S, 10), "emg" (S, C) and "force_N" (S, 3) or None
    channels : of the key, EMG channels among them
    task, side : names
    """
    time_s, angles = np.array(curves["time_s"]), np.deg2rad(curves["angles_deg"])
    emg = None
    if curves.get("emg"):
        names = [name for name in channels if channel_kind(name) == "emg"]
        emg = EmgSeries(time_s, tuple(names), np.array(curves["emg"]))
    contact = None
    if curves.get("force_N"):
        contact = ContactSeries(time_s, np.array(curves["force_N"]))
    smooth = smoothed(Motion(time_s, angles))
    window = movement_window(smooth)
    return GapTrial(side, task, 1, time_s, angles, smooth, emg, contact, window, Path(side))
