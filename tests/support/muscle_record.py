"""A model record with the muscles that the study's EMG channels see."""

from dataclasses import replace

import numpy as np
from emg_study import CHANNELS
from skeleton import muscle, skeleton_record

from scapulohumeral.model.record import ModelRecord

# Every element of every channel, and a muscle that no channel sees.
ELEMENTS = {
    element: muscle
    for muscle, group in zip(CHANNELS.scaled_muscles, CHANNELS.groups, strict=True)
    for channel, names in zip(CHANNELS.channel_groups, CHANNELS.elements, strict=True)
    if channel == group
    for element in names
} | {"supra_1": "supra"}


def muscle_record() -> ModelRecord:
    """Muscles of different sizes, by the names of the study's channels."""
    sizes = np.linspace(1.0, 2.0, len(ELEMENTS))
    muscles = tuple(
        muscle(name, group=group, size=float(size))
        for (name, group), size in zip(ELEMENTS.items(), sizes, strict=True)
    )
    return replace(skeleton_record(), muscles=muscles)
