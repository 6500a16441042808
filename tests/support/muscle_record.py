"""The parts of a model record that muscle parameters and groups are read from."""

import numpy as np
from arm import HILL_RECORD
from emg_study import CHANNELS

# Every element of every channel, and a muscle that no channel sees.
ELEMENTS = {
    element: muscle
    for muscle, group in zip(CHANNELS.scaled_muscles, CHANNELS.groups, strict=True)
    for channel, names in zip(CHANNELS.channel_groups, CHANNELS.elements, strict=True)
    if channel == group
    for element in names
} | {"supra_1": "supra"}


def muscle_record() -> dict:
    """Muscles of different sizes, by the names of the study's channels."""
    sizes = np.linspace(1.0, 2.0, len(ELEMENTS))
    muscles = [
        {
            "name": name,
            "group": group,
            "max_isometric_force_N": 100.0 * size,
            "optimal_fibre_length_m": 0.1 * size,
            "tendon_slack_length_m": 0.05 * size,
            "activation_time_s": 0.01 * size,
            "deactivation_time_s": 0.04 * size,
        }
        for (name, group), size in zip(ELEMENTS.items(), sizes, strict=True)
    ]
    return {"muscles": muscles, "constants": {"hill": HILL_RECORD}}
