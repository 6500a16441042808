"""Verdicts on rhythms: beside the printed table, and beside people in vivo."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.quantities import paper
from scapulohumeral.quantities.population import RHYTHM as OF_PEOPLE
from scapulohumeral.quantities.prediction_rows import WHOLE_RISE
from scapulohumeral.report.tables import named_rows
from scapulohumeral.report.targets import Verdict

CELLS = 24
# Names of the printed shoulders by predicted condition.
PRINTED = {"healthy": "healthy", "cuff_w10": "rc_limited"}
NOTHING = "no prediction"


def rhythm_verdicts(limits: Mapping[str, Any], rhythm: pd.DataFrame) -> Iterator[Verdict]:
    """Rhythm of the study's own model: cells of the printed table, and people in vivo.

    Parameters
    ----------
    limits : section ``own_rhythm`` of config/targets.yaml
    rhythm : rows of results/prediction/shr.csv
    """
    name = "own model: cells of the printed rhythm table that agree, by the paper's estimator"
    yield cells_that_agree(name, limits, _beside_printed(rhythm, limits["participant"]))
    yield _in_vivo(limits, rhythm)


def cells_that_agree(name: str, limits: Mapping[str, Any], cells: pd.DataFrame) -> Verdict:
    """How many cells of the printed table agree; the others are named.

    Parameters
    ----------
    limits : with ``rhythm_difference`` [1] and ``rhythm_cells``
    cells : columns condition, plane, phase, published and reproduced; empty without predictions
    """
    share, least = limits["rhythm_difference"], limits["rhythm_cells"]
    target = f"≥ {least} of {CELLS} within {100 * share:g} %"
    if cells.empty:
        return Verdict(name, NOTHING, target, holds=False)
    off = np.abs(cells.reproduced / cells.published - 1.0)
    agreeing = int((off <= share).sum())
    worse = tuple(
        f"{r.condition} {r.plane} {r.phase}: {r.reproduced:.2f} for {r.published:.2f}"
        for r in cells[~(off <= share)].itertuples()
    )
    return Verdict(name, f"{agreeing} of {CELLS}", target, agreeing >= least, worse)


def _beside_printed(rhythm: pd.DataFrame, participant: str) -> pd.DataFrame:
    """Cells of the printed table beside the own rhythm by the same estimator."""
    rows = [
        {
            "condition": row.condition,
            "plane": row.plane,
            "phase": row.phase,
            "published": paper.RHYTHM[PRINTED[row.condition]].get(row.plane, {}).get(row.phase),
            "reproduced": row.shr_range,
        }
        for row in named_rows(rhythm)
        if row.participant == participant and row.condition in PRINTED
    ]
    return pd.DataFrame(rows).dropna(subset="published") if rows else pd.DataFrame()


def _in_vivo(limits: Mapping[str, Any], rhythm: pd.DataFrame) -> Verdict:
    """Rhythm of the whole rise beside people; a cell without a number is missed."""
    people, planes = limits["in_vivo_participants"], tuple(OF_PEOPLE)
    name = f"own model, healthy: rhythm of the rise ({WHOLE_RISE}) beside people in vivo"
    count, most = len(people) * len(planes), limits["in_vivo_sd"]
    target = f"all {count} within {most:g} SD of the mean of studies"
    if rhythm.empty:
        return Verdict(name, NOTHING, target, holds=False)
    part = rhythm[(rhythm.condition == "healthy") & (rhythm.phase == WHOLE_RISE)]
    found = part.set_index(["participant", "plane"]).shr
    inside, worse = 0, []
    for cell in ((person, plane) for person in people for plane in planes):
        mean, sd, _ = OF_PEOPLE[cell[1]][WHOLE_RISE]
        value = float(found.get(cell, np.nan))
        if abs(value - mean) <= most * sd:
            inside += 1
        else:
            said = "no rhythm" if np.isnan(value) else f"{value:.2f}"
            worse.append(f"{' '.join(cell)}: {said} for {mean:.2f} ± {most * sd:.2f}")
    return Verdict(name, f"{inside} of {count}", target, not worse, tuple(worse))
