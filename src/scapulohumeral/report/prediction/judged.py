"""What predictions are judged by, and their distances: tables and limits as read from files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd


@dataclass(frozen=True, eq=False)
class Judged:
    """Limits and distances of predictions.

    Attributes
    ----------
    targets : config/targets.yaml
    recording, published : tables of results/prediction/against_*.csv
    tasks : the same of daily tasks, empty if none was predicted
    rhythm : table results/prediction/shr.csv
    requested : participants whose predictions the study asks for
    """

    targets: Mapping[str, Any]
    recording: pd.DataFrame
    published: pd.DataFrame
    requested: tuple[str, ...]
    tasks: pd.DataFrame = field(default_factory=pd.DataFrame)
    rhythm: pd.DataFrame = field(default_factory=pd.DataFrame)

    @property
    def has_limits(self) -> bool:
        """Whether limits were fixed for any of the participants: none were for others."""
        limits = self.targets["against_recording"]["upward_rotation_rmse_deg"]
        return any(name in limits for name in self.requested)


def read_judged(
    targets: Mapping[str, Any],
    recording: Path,
    published: Path,
    requested: tuple[str, ...],
    tasks: Sequence[Path] = (),
    rhythm: Sequence[Path] = (),
) -> Judged:
    """Distances from their files, with their limits."""
    return Judged(
        targets=targets,
        recording=pd.read_csv(recording),
        published=pd.read_csv(published),
        requested=requested,
        tasks=pd.concat([pd.DataFrame(), *map(pd.read_csv, tasks)]),
        rhythm=pd.concat([pd.DataFrame(), *map(pd.read_csv, rhythm)]),
    )
