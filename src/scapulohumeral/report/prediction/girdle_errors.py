"""Every angle of the girdle against the published curves: all planes, two shoulders, two models."""

from __future__ import annotations

import numpy as np
import pandas as pd

from scapulohumeral.report.tables import Table, cell_in_words

VARIANTS, CONDITIONS = ("study_arm", "published"), ("healthy", "cuff_w10")
NAMES = {
    "upward_rotation": "upward rotation",
    "internal_rotation": "internal rotation (protraction)",
    "posterior_tilt": "tilt",
    "clavicle_retraction": "clavicle retraction",
    "clavicle_elevation": "clavicle elevation",
    "clavicle_axial_rotation": "clavicle axial rotation",
}


def girdle_errors(published: pd.DataFrame) -> pd.DataFrame:
    """Root mean square errors over each elevation [deg], a column per angle of `NAMES`.

    Parameters
    ----------
    published : rows of results/prediction/against_published.csv. What it does not hold is no number
    """
    kept = published[
        published.variant.isin(VARIANTS)
        & published.condition.isin(CONDITIONS)
        & (published.phase == "elevation")
    ]
    table = kept.pivot_table(
        index=["variant", "condition", "plane"], columns="quantity", values="reproduced", sort=False
    )
    return table.reindex(columns=[f"{name}_rmse_deg" for name in NAMES])


def girdle_table(published: pd.DataFrame) -> Table:
    """The same as text; no rows without predictions on the published arm."""
    errors = girdle_errors(published)
    of_rows = ("variant", "condition", "plane")
    rows = [
        (*map(cell_in_words, of_rows, names), *("" if np.isnan(x) else f"{x:.1f}" for x in row))
        for names, row in zip(errors.index, errors.to_numpy(), strict=True)
    ]
    return Table((*of_rows, *NAMES.values()), rows)
