"""The tables behind the figures of a diagnosis, by the rows of `gap.curve_files`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from scapulohumeral.gap.curve_files import (
    MODEL,
    REFERENCE,
    AmplitudeRow,
    EntersRow,
    FactorsRow,
    IsolabilityRow,
    OverlayRow,
    ShowsRow,
    SignatureRow,
    table_of,
)
from scapulohumeral.gap.detection.presence import DifferenceMap, z_values
from scapulohumeral.gap.detection.regions import EnteringCurve, repeated_points
from scapulohumeral.gap.isolation.channel_gains import gain_factors
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import TaskAmplitude
from scapulohumeral.gap.recording.observables import channel_unit
from scapulohumeral.gap.residual.residual import Residual


def shows_table(
    residual: Residual, found: DifferenceMap, halves: Sequence[np.ndarray]
) -> pd.DataFrame:
    """Where the gap shows: difference over standard error of each channel and phase.

    `halves` are the differences (D,) of two halves of the test trials, none with one trial.
    """
    phase = _phase(len(found.sigma))
    repeated = repeated_points(found, residual, halves)
    return table_of(
        ShowsRow,
        (
            ShowsRow(
                channel=channel,
                phase_percent=phase[n],
                effect_sigma=found.sigma[n, k],
                threshold_sigma=found.threshold,
                repeated=repeated[n, k],
            )
            for k, channel in enumerate(residual.channels)
            for n in range(len(phase))
        ),
    )


def enters_table(entries: Sequence[EnteringCurve]) -> pd.DataFrame:
    """Where the gap enters: curves by kind and name with their threshold and unit."""
    return table_of(
        EntersRow,
        (
            EntersRow(
                kind=entry.kind,
                name=entry.name,
                phase_percent=x,
                effect=effect,
                threshold=threshold,
                unit=entry.unit,
            )
            for entry in entries
            for x, effect, threshold in zip(
                _phase(len(entry.curve)), entry.curve, entry.threshold, strict=True
            )
        ),
    )


def overlay_table(residual: Residual, change: np.ndarray, referenced: bool) -> pd.DataFrame:
    """Difference to explain, change (D,) by the best effect, 95 % band without any effect.

    `referenced` says whether it is the difference to reference trials, or to the model.
    """
    given = residual.curves(residual.delta)
    explained = residual.curves(change)
    band = 1.96 * residual.spread
    phase = _phase(given.shape[1])
    return table_of(
        OverlayRow,
        (
            OverlayRow(
                task=task,
                channel=channel,
                phase_percent=phase[n],
                difference=given[t, n, k],
                with_effect=explained[t, n, k],
                floor_low=-band[t, n, k],
                floor_high=band[t, n, k],
                unit=channel_unit(channel),
                compared_with=REFERENCE if referenced else MODEL,
            )
            for t, task in enumerate(residual.tasks)
            for k, channel in enumerate(residual.channels)
            for n in range(len(phase))
        ),
    )


def signature_table(residual: Residual, change: np.ndarray) -> pd.DataFrame:
    """The gap, the change (D,) by the best effect and what it leaves, as z values."""
    left = residual.delta - change
    gap, effect, rest = (z_values(residual, one)[0] for one in (residual.delta, change, left))
    phase = _phase(len(gap))
    return table_of(
        SignatureRow,
        (
            SignatureRow(
                channel=channel,
                phase_percent=phase[n],
                residual_sigma=gap[n, k],
                signature_sigma=effect[n, k],
                rest_sigma=rest[n, k],
            )
            for k, channel in enumerate(residual.channels)
            for n in range(len(phase))
        ),
    )


def isolability_table(fits: Sequence[Fit], apart: np.ndarray) -> pd.DataFrame:
    """Probability that these trials tell each two of the likely effects apart."""
    return table_of(
        IsolabilityRow,
        (
            IsolabilityRow(label_a=fits[i].label, label_b=fits[k].label, p_apart=apart[i, k])
            for i in range(len(fits))
            for k in range(i)
        ),
    )


def amplitude_table(
    best: Fit, by_task: Sequence[TaskAmplitude], temperature: float
) -> pd.DataFrame:
    """Primary amplitude by each task alone that tells of it, with its 95 % interval, tempered."""
    param = best.hypothesis.effects[0].params[0]
    rows = []
    for task, x, sd in by_task:
        half = 1.96 * np.sqrt(temperature) * sd
        ends = np.clip([x - half, x, x + half], *param.bounds)
        low, value, high = (param.physical(float(end)) for end in ends)
        low, high = sorted((low, high))
        rows.append(
            AmplitudeRow(
                task=task,
                parameter=param.name,
                value=value,
                low=low,
                high=high,
                unit=param.unit,
            )
        )
    return table_of(AmplitudeRow, rows)


def factors_table(
    residuals: Mapping[float, Residual], fits: Sequence[Fit], relative_error: float
) -> pd.DataFrame:
    """How much of each effect this person shows in each channel, for every hypothesis.

    `residuals` are those of every supposed size of another movement.
    """
    return table_of(
        FactorsRow,
        (
            FactorsRow(label=fitted.label, effect=effect.label, channel=channel, factor=own[k])
            for fitted in fits
            for effect, own in zip(
                fitted.hypothesis.effects,
                gain_factors(fitted, residuals[fitted.moved_deg], relative_error),
                strict=True,
            )
            for k, channel in enumerate(residuals[0.0].channels)
        ),
    )


def _phase(nodes: int) -> np.ndarray:
    """Phase (N,) of the nodes [%]."""
    return np.linspace(0.0, 100.0, nodes)
