"""Where a key says that its cause shows, by phases of the movement as answers have them.

Letters: F phase points, K channels.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from scapulohumeral.gap.benchmark.noise_free.trial import noise_free_trial


def change_over_movement(key: Mapping[str, Any]) -> np.ndarray | None:
    """Largest change (F, K) in any visible task [standard errors], at equal steps of the movement.

    A key holds it over the whole recording, rest before and after the movement too. The movement is
    that of the test trial without noise. None for keys that hold no such trial.
    """
    if "noise_free" not in key:
        return None
    changes = []
    for task, whole in key["change_sigma"].items():
        trial = noise_free_trial(key["noise_free"][task]["test"], key["channels"], task, "test")
        recorded = np.linspace(trial.time_s[0], trial.time_s[-1], len(whole))
        moved = np.linspace(*trial.window_s, len(whole))
        changes.append([np.interp(moved, recorded, np.abs(curve)) for curve in np.transpose(whole)])
    return np.max(changes, axis=0).T
