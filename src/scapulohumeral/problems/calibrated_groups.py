"""Virtual muscle groups whose strength and fibre length are calibrated (paper, supplement)."""

from __future__ import annotations

from scapulohumeral.emg.channels import Channels
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.scalers import Scalers


def muscle_groups(
    record: ModelRecord,
    channels: Channels,
    force_bounds: tuple[float, float] = (0.5, 1.5),
    fibre_bounds: tuple[float, float] = (0.7, 1.3),
) -> Scalers:
    """Scalers of the groups that EMG channels inform, for the muscles of a model record."""
    members = channels.members(record.muscle_groups)
    return Scalers(channels.groups, members, force_bounds, fibre_bounds)
