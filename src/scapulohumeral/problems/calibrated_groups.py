"""Virtual muscle groups whose strength and fibre length are calibrated (paper, supplement)."""

from __future__ import annotations

from scapulohumeral.emg.channels import Channels
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.scalers import Scalers


def muscle_groups(record: ModelRecord, channels: Channels) -> Scalers:
    """Scalers of the groups that EMG channels inform, for the muscles of a model record."""
    return Scalers(channels.groups, channels.members(record.muscle_groups))
