"""What predictions are judged by, and their distances: tables and limits as read from files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from scapulohumeral.provenance import last_commit


@dataclass(frozen=True, eq=False)
class Judged:
    """Limits and distances of predictions.

    Attributes
    ----------
    targets : config/targets.yaml; fixed_in : the commit that last changed it
    recording, published : tables of results/prediction/against_*.csv
    tasks : the same of daily tasks, empty if none was predicted
    rhythm : table results/prediction/shr.csv
    requested : participants whose predictions the study asks for
    """

    targets: Mapping[str, Any]
    fixed_in: str
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
    targets: Path,
    recording: Path,
    published: Path,
    requested: tuple[str, ...],
    tasks: Sequence[Path] = (),
    rhythm: Sequence[Path] = (),
) -> Judged:
    """Limits and distances from their files."""
    return Judged(
        targets=yaml.safe_load(targets.read_text(encoding="utf-8")),
        fixed_in=last_commit(targets),
        recording=pd.read_csv(recording),
        published=pd.read_csv(published),
        requested=requested,
        tasks=pd.concat([pd.DataFrame(), *map(pd.read_csv, tasks)]),
        rhythm=pd.concat([pd.DataFrame(), *map(pd.read_csv, rhythm)]),
    )
