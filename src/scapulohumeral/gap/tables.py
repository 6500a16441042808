"""The tables behind the figures of a diagnosis, by the columns of `gap.curves`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.gap.attribute import Fit
from scapulohumeral.gap.curves import TABLES
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.locate import Shows
from scapulohumeral.gap.observe import channel_unit
from scapulohumeral.gap.person import person_factors


def shows_table(comparison: Comparison, found: Shows) -> pd.DataFrame:
    """Where the gap shows: difference over standard error of each channel and phase."""
    phase = np.linspace(0.0, 100.0, len(found.sigma))
    rows = [
        (channel, x, sigma, found.threshold, bool(abs(sigma) > found.threshold))
        for k, channel in enumerate(comparison.channels)
        for x, sigma in zip(phase, found.sigma[:, k], strict=True)
    ]
    return _table("shows", rows)


def enters_table(entries: Sequence[tuple[str, str, np.ndarray, float, str]]) -> pd.DataFrame:
    """Where the gap enters: curves by kind and name with their threshold and unit."""
    rows = [
        (kind, name, x, effect, threshold, unit)
        for kind, name, curve, threshold, unit in entries
        for x, effect in zip(np.linspace(0.0, 100.0, len(curve)), curve, strict=True)
    ]
    return _table("enters", rows)


def overlay_table(comparison: Comparison, best: Fit) -> pd.DataFrame:
    """Difference to explain, without and with the best effect, and the 95 % band of the floor."""
    given = comparison.curves(comparison.delta)
    explained = comparison.curves(best.predicted)
    band = 1.96 * comparison.spread
    phase = np.linspace(0.0, 100.0, given.shape[1])
    rows = [
        (
            task,
            channel,
            phase[n],
            given[t, n, k],
            0.0,
            explained[t, n, k],
            -band[t, n, k],
            band[t, n, k],
            channel_unit(channel),
        )
        for t, task in enumerate(comparison.tasks)
        for k, channel in enumerate(comparison.channels)
        for n in range(len(phase))
    ]
    return _table("overlay", rows)


def signature_table(comparison: Comparison, best: Fit) -> pd.DataFrame:
    """The gap, the best effect and what it leaves, over the noise, as z values over all tasks."""
    parts = [
        (comparison.curves(vector) / comparison.spread).sum(axis=0) / np.sqrt(len(comparison.tasks))
        for vector in (comparison.delta, best.predicted, comparison.delta - best.predicted)
    ]
    phase = np.linspace(0.0, 100.0, len(parts[0]))
    rows = [
        (channel, phase[n], *(part[n, k] for part in parts))
        for k, channel in enumerate(comparison.channels)
        for n in range(len(phase))
    ]
    return _table("signature", rows)


def isolability_table(fits: Sequence[Fit], apart: np.ndarray) -> pd.DataFrame:
    """Probability that these trials tell each two of the likely effects apart."""
    rows = [(fits[i].label, fits[k].label, apart[i, k]) for i in range(len(fits)) for k in range(i)]
    return _table("isolability", rows)


def amplitude_table(best: Fit, by_task: Sequence[tuple[str, float, float]]) -> pd.DataFrame:
    """Primary amplitude fitted to each task alone, with its 95 % interval."""
    param = best.hypothesis.effects[0].params[0]
    rows = []
    for task, x, sd in by_task:
        ends = sorted(param.physical(x + sign * 1.96 * sd) for sign in (-1.0, 1.0))
        rows.append((task, param.name, param.physical(x), *ends, param.unit))
    return _table("amplitude", rows)


def factors_table(
    comparison: Comparison, fits: Sequence[Fit], relative_error: float
) -> pd.DataFrame:
    """How much of each effect this person shows in each channel, for every hypothesis."""
    rows = [
        (fitted.label, effect.label, channel, own[k])
        for fitted in fits
        for effect, own in zip(
            fitted.hypothesis.effects,
            person_factors(fitted, comparison, relative_error),
            strict=True,
        )
        for k, channel in enumerate(comparison.channels)
    ]
    return _table("factors", rows)


def plain_tables(tables: Mapping[str, Sequence[tuple[Any, ...]]]) -> dict[str, pd.DataFrame]:
    """Tables whose rows are ready, those without rows left out."""
    return {name: _table(name, rows) for name, rows in tables.items() if rows}


def _table(name: str, rows: Sequence[tuple[Any, ...]]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=list(TABLES[name]))
