"""Virtual muscle groups whose strength and fibre length are calibrated (paper, supplement)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scapulohumeral.emg.channels import Channels
from scapulohumeral.ocp.scalers import Scalers


def muscle_groups(
    record: Mapping[str, Any],
    channels: Channels,
    force_bounds: tuple[float, float] = (0.5, 1.5),
    fibre_bounds: tuple[float, float] = (0.7, 1.3),
) -> Scalers:
    """Scalers of the groups that EMG channels inform, for the muscles of a model record."""
    members = channels.members([muscle["group"] for muscle in record["muscles"]])
    return Scalers(channels.groups, members, force_bounds, fibre_bounds)
