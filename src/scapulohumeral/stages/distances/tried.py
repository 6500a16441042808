"""Variants of the study's model that were tried against the recordings of several participants.

What a recording is judged by may not be chosen by that recording. So every row says whether the
elevations of the other participants would have chosen its variant for this one. Daily tasks choose
nothing.
"""

from __future__ import annotations

import pandas as pd

UPWARD_ROTATION_ERROR = "ur_rmse_deg"
CHOSEN, TRIAL = "chosen_by_others", "trial"
SHOWN = (
    *("variant", "participant", TRIAL, "condition", "status", UPWARD_ROTATION_ERROR),
    *("ur_bias_rest_deg", "tilt_rmse_deg", "internal_rotation_rmse_deg"),
    *("clavicle_elevation_rmse_deg", "in_band_share", "recorded_in_band_share"),
    *("gh_force_rest_bw", "gh_force_peak_bw"),
)


def tried_table(distances: pd.DataFrame, tasks: pd.DataFrame) -> pd.DataFrame:
    """Distances of variants to recordings, and which variant the other participants choose.

    The others choose the variant with the least mean error of upward rotation over their planes;
    one with a failed solve is not chosen.

    Parameters
    ----------
    distances : as from :func:`~scapulohumeral.stages.distances.against.against_recording`, one
        condition, a row per participant, plane and variant
    tasks : the same of daily tasks, as from
        :func:`~scapulohumeral.stages.distances.daily_tasks.task_distances`
    """
    chosen = {name: _chosen_without(distances, name) for name in distances.participant.unique()}
    both = (distances.rename(columns={"plane": TRIAL}), tasks.rename(columns={"task": TRIAL}))
    table = pd.concat([each.reindex(columns=list(SHOWN)) for each in both], ignore_index=True)
    table[CHOSEN] = [chosen.get(row.participant) == row.variant for row in table.itertuples()]
    order = ["participant", TRIAL]
    return table.sort_values(order, kind="stable").reset_index(drop=True)


def _chosen_without(distances: pd.DataFrame, participant: str) -> str | None:
    """Variant that all participants but one choose; None if there are no others or all failed."""
    others = distances[distances.participant != participant]
    errors = others.groupby("variant", sort=False)[UPWARD_ROTATION_ERROR]
    means = errors.apply(lambda column: column.mean(skipna=False)).dropna()
    return None if means.empty else str(means.idxmin())
