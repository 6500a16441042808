"""Every published number next to the reproduced one, with the difference and its reason."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.model.published_arm import (
    PUBLISHED_PLANES,
    PUBLISHED_RISES,
    published_pose,
)
from scapulohumeral.quantities import paper
from scapulohumeral.quantities.rhythm import SHARED, PhaseRhythm, phase_rhythm, rhythm_by_plane
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)
from scapulohumeral.report.coordination import Cases, Coordination, Prediction
from scapulohumeral.report.coordination_targets import (
    KIND_NAMES,
    channel_reductions,
    stable_weight,
    swept_weights,
)
from scapulohumeral.report.published.rhythm_cause import RhythmCell, rhythm_cause
from scapulohumeral.report.study import Study
from scapulohumeral.report.tables import Table, mean_errors, number_or_none
from scapulohumeral.report.targets import MEASURE_NAMES

# Upward rotations that differ by less tell the same story: share of the published one, but at least
# so many degrees.
SAME_SHARE = 0.2
SAME_DEG = 1.0
LARGEST_PUBLISHED_NORM_RMSE = 1e-14
COLUMNS = ("part", "quantity", "published", "reproduced", "difference", "why")


@dataclass(frozen=True)
class PublishedPlane:
    """One elevation of a published prediction.

    Attributes
    ----------
    rhythm : by phase, over the authors' window of the rise
    peak_elevation_deg, peak_upward_rotation_deg : largest values of the motion
    """

    rhythm: dict[str, PhaseRhythm]
    peak_elevation_deg: float
    peak_upward_rotation_deg: float


def comparison(study: Study, coordination: Coordination) -> Table:
    """All published numbers, as far as this study has their counterparts.

    Without those that simulated EMG puts in, see :func:`recovered`.
    """
    rows = [*_tracking_rows(study), *_norm_rows(study)]
    if coordination.emg_word == "EMG":
        rows += _emg_rows(coordination)
    cases = coordination.cases.get(paper.PREDICTED_PARTICIPANT)
    if cases is not None and cases.healthy is not None:
        rows += _rhythm_rows(coordination, cases)
        rows += _upward_rotation_rows(cases)
        rows += _force_rows(cases)
        rows += _clavicle_rows(cases)
        rows += _weight_rows(coordination, cases)
    return Table(COLUMNS, rows)


def recovered(coordination: Coordination) -> Table:
    """Published numbers that simulated EMG was made with, and what calibration finds of them.

    Fibres that the model has shortened itself are another number in the plant; its rows say so.
    No rows with measured EMG, which knows nothing of them.
    """
    rows = _emg_rows(coordination) if coordination.emg_word != "EMG" else []
    return Table(COLUMNS, rows)


def _emg_rows(coordination: Coordination) -> list[tuple[str, ...]]:
    return [*_scaler_rows(coordination), *_validation_rows(coordination)]


def published_plane(cases: Cases, name: str, plane: str) -> PublishedPlane | None:
    """One elevation of a published prediction, at the nodes of the authors' mesh.

    Rhythm is told of the window in which the authors measure it, as in the table of quantities on
    the published arm: before it begins the arm waits, and the scapula may move.
    """
    if name not in cases.published or plane not in PUBLISHED_RISES:
        return None
    angles = thorax_angles(published_pose(cases.published[name]))
    rise, whole = (slice(*limits[plane]) for limits in (PUBLISHED_RISES, PUBLISHED_PLANES))
    elevation, upward = angles[:, ELEVATION_COLUMN], angles[:, UPWARD_ROTATION_COLUMN]
    phases = {phase.phase: phase for phase in phase_rhythm(elevation[rise], upward[rise])}
    return PublishedPlane(phases, float(elevation[whole].max()), float(upward[whole].max()))


def _row(
    part: str, quantity: str, published: float, ours: float, why: str, digits: int = 2
) -> tuple[str, ...]:
    if np.isnan(ours):
        return (part, quantity, f"{published:.{digits}f}", "none", "", why)
    numbers = (f"{published:.{digits}f}", f"{ours:.{digits}f}", f"{ours - published:+.{digits}f}")
    return (part, quantity, *numbers, why)


def _tracking_rows(study: Study) -> Iterable[tuple[str, ...]]:
    for error in mean_errors(study):
        measure = MEASURE_NAMES[error.key]
        quantity = f"{measure}, {error.formulation}, mean of {error.solves} solves [deg]"
        yield _row("tracking", quantity, error.published_deg, error.ours_deg, error.why)


def _norm_rows(study: Study) -> list[tuple[str, ...]]:
    solved = study.solved("quaternion")
    if not solved:
        return []
    largest = max(run.summary["norm_rmse"] for run in solved)
    why = (
        "agrees"
        if largest <= LARGEST_PUBLISHED_NORM_RMSE
        else "the penalty on the norm is the paper's; the solver stops at its tolerance"
    )
    quantity = "deviation of quaternion norms from one, root mean square"
    return [("tracking", quantity, "1e-14 or lower", f"at most {largest:.0e}", "", why)]


def _scaler_rows(coordination: Coordination) -> Iterable[tuple[str, ...]]:
    document = coordination.calibrations.get(paper.PREDICTED_PARTICIPANT)
    if document is None:
        return
    for group, kinds in paper.SCALERS.items():
        for kind, published in kinds.items():
            entry = document["groups"][group][kind]
            low, high = entry["ci90"]
            why = _scaler_reason(entry, published)
            why += "" if entry["identifiable"] else "; the data do not identify this scaler"
            name = f"scaler of {KIND_NAMES[kind]}, {group.replace('_', ' ')}"
            row = _row("calibration", name, published, entry["value"], why)
            yield (*row[:3], f"{row[3]} ({low:.2f} to {high:.2f})", *row[4:])


def _scaler_reason(entry: Mapping[str, Any], published: float) -> str:
    """What a calibrated scaler was calibrated to."""
    if "plant" not in entry:
        return "other EMG, other muscle geometry"
    if entry["plant"] == published:
        return (
            "the EMG is simulated by a plant with the published scaler, so this is the error of "
            "the calibration"
        )
    return (
        f"the EMG is simulated by a plant with {entry['plant']:g} (config/plant/README.md says "
        f"why), from which the calibration differs by {100 * entry['error']:+.0f} %"
    )


def _validation_rows(coordination: Coordination) -> Iterable[tuple[str, ...]]:
    if coordination.validation.empty:
        return
    table = channel_reductions(coordination.validation)
    table = table[table.participant == paper.PREDICTED_PARTICIPANT].set_index("channel")
    for channel, (before, after) in paper.VALIDATION_RMSE.items():
        if channel not in table.index:
            continue
        row = table.loc[channel]
        if np.isnan(row.reduction):
            continue
        change = 100 * (row.reduction - (1 - after / before))
        yield (
            "validation",
            f"RMSE of excitation against {coordination.emg_word}, daily tasks, "
            + channel.replace("_", " "),
            f"{before:.3f} → {after:.3f} ({100 * (after / before - 1):+.0f} %)",
            f"{row.generic:.3f} → {row.calibrated:.3f} ({-100 * row.reduction:+.0f} %)",
            f"reduction {change:+.0f} percentage points",
            f"{coordination.emg_word} against measured EMG: what calibration cannot remove is "
            "smaller, because plant and model share their equations"
            if coordination.emg_word != "EMG"
            else "other recordings",
        )


def _rhythm_rows(coordination: Coordination, cases: Cases) -> Iterable[tuple[str, ...]]:
    for name, prediction in (("healthy", cases.healthy), ("rc_limited", cases.cuff)):
        if prediction is None:
            continue
        limits = {k: (nodes.start, nodes.stop) for k, nodes in prediction.planes.items()}
        for phase in rhythm_by_plane(prediction.solution.pose, limits):
            published = paper.RHYTHM[name].get(phase.plane, {}).get(phase.phase)
            if published is not None:
                word = "healthy" if name == "healthy" else "cuff-limited"
                quantity = f"rhythm, {word}, {phase.plane} plane, {phase.phase} deg"
                why = [_rhythm_reason(cases, name, published, phase)]
                if coordination.judged is not None:
                    own = RhythmCell(prediction.condition.name, phase.plane, phase.phase, published)
                    tables = coordination.judged.published, coordination.ladder
                    why.append(rhythm_cause(own, phase.shr_range, *tables))
                text = "; ".join(filter(None, why))
                yield _row("prediction", quantity, published, phase.shr, text)


def _rhythm_reason(cases: Cases, name: str, published: float, phase: PhaseRhythm) -> str:
    """How much upward rotation the difference is, and what the published motion itself gives."""
    expected = phase.delta_th_deg / (published + 1.0)
    turned = f"upward rotation {phase.delta_ts_deg:.1f} deg here, {expected:.1f} deg by the paper"
    tolerance = max(SAME_DEG, SAME_SHARE * expected)
    if abs(phase.delta_ts_deg - expected) <= tolerance:
        turned += f": agrees within {tolerance:.1f} deg"
    parts = [turned, phase.note]
    plane = published_plane(cases, name, phase.plane)
    if plane is not None:
        measured = plane.rhythm[phase.phase]
        ratio = number_or_none(measured.shr)
        parts.append(f"the published motion by signed ends, in the authors' window: {ratio}")
    return "; ".join(part for part in parts if part)


def _upward_rotation_rows(cases: Cases) -> Iterable[tuple[str, ...]]:
    healthy, cuff = cases.healthy, cases.cuff
    if healthy is not None and cuff is not None:
        for plane, published in paper.UPWARD_ROTATION_FALL_DEG.items():
            if plane in healthy.planes:
                fall = _peak_upward(healthy, plane) - _peak_upward(cuff, plane)
                quantity = f"fall of peak upward rotation with the cuff lost, {plane} plane [deg]"
                yield _row(
                    "prediction", quantity, published, fall, _fall_reason(cases, plane), digits=1
                )
    weak = cases.cuff_at_healthy_weight
    if healthy is not None and weak is not None:
        falls = [_peak_upward(healthy, p) - _peak_upward(weak, p) for p in healthy.planes]
        low, high = paper.UPWARD_ROTATION_FALL_AT_HEALTHY_WEIGHT_DEG
        yield (
            "prediction",
            "the same at the healthy w_GH, range over the planes [deg]",
            f"{low:.0f} to {high:.0f}",
            f"{min(falls):.1f} to {max(falls):.1f}",
            f"{min(falls) - low:+.1f}, {max(falls) - high:+.1f}",
            "as above",
        )


def _peak_upward(prediction: Prediction, plane: str) -> float:
    return float(prediction.angles[prediction.planes[plane], UPWARD_ROTATION_COLUMN].max())


def _fall_reason(cases: Cases, plane: str) -> str:
    """Peaks behind the fall, here and in the published motions."""
    healthy, cuff = cases.healthy, cases.cuff
    if healthy is None or cuff is None:
        return ""
    ours = f"peaks {_peak_upward(healthy, plane):.1f} and {_peak_upward(cuff, plane):.1f} deg here"
    found = [published_plane(cases, name, plane) for name in ("healthy", "rc_limited")]
    known = [p for p in found if p is not None]
    if len(known) < len(found):
        return ours
    elevation = healthy.angles[healthy.planes[plane], ELEVATION_COLUMN].max()
    peaks = " and ".join(f"{p.peak_upward_rotation_deg:.1f}" for p in known)
    return (
        f"{ours}, {peaks} deg in the published motions; the arm rises to {elevation:.0f} deg here, "
        f"{known[0].peak_elevation_deg:.0f} deg there"
    )


def _force_rows(cases: Cases) -> Iterable[tuple[str, ...]]:
    healthy = cases.healthy
    for plane, published in paper.PEAK_FORCE_BW.items():
        if healthy is None or plane not in healthy.planes:
            continue
        nodes = healthy.planes[plane]
        peak_N = float(np.linalg.norm(healthy.solution.reaction_N[nodes], axis=1).max())
        peak = float(healthy.load.percent_body_weight[nodes].max())
        mean, sd, count = paper.ORTHOLOAD_BW[plane]
        published_motion = published_plane(cases, "healthy", plane)
        elevation = healthy.angles[nodes, ELEVATION_COLUMN].max()
        why = f"the arm rises to {elevation:.0f} deg here"
        if published_motion is not None:
            why += f", {published_motion.peak_elevation_deg:.0f} deg in the published motion"
        weight_N = paper.BODY_WEIGHT_OF_FIGURES_N
        why += f"; printed as {published:g} % of {weight_N:g} N"
        quantity = f"peak glenohumeral force, healthy, {plane} plane [N]"
        yield _row("prediction", quantity, published / 100 * weight_N, peak_N, why, digits=0)
        quantity = (
            f"the same against instrumented implants (Orthoload, n = {count}) [% body weight]"
        )
        why = (
            f"{abs(peak - mean) / sd:.1f} standard deviations from the mean of the implants; body "
            f"weight here: {healthy.record.body_mass_kg:.0f} kg, {healthy.record.body_mass_source}"
        )
        row = _row("prediction", quantity, mean, peak, why, digits=1)
        yield (*row[:2], f"{mean:.1f} ± {sd:.1f}", *row[3:])


def _clavicle_rows(cases: Cases) -> Iterable[tuple[str, ...]]:
    columns = {"retraction": 0, "elevation": 1}
    for parameters, ranges in paper.CLAVICLE_RANGE_DEG.items():
        prediction = cases.healthy if parameters == "calibrated" else cases.generic
        if prediction is None or "scapular" not in prediction.planes:
            continue
        for name, (low, high) in ranges.items():
            angle = prediction.angles[prediction.planes["scapular"], columns[name]]
            printed = f"{low:.0f} to {'not printed' if high is None else f'{high:.0f}'}"
            difference = f"{angle.min() - low:+.1f}"
            difference += "" if high is None else f", {angle.max() - high:+.1f}"
            yield (
                "prediction",
                f"range of clavicular {name}, {parameters} muscles, scapular plane [deg]",
                printed,
                f"{angle.min():.1f} to {angle.max():.1f}",
                difference,
                "the paper gives rounded ranges; negative: retraction, depression",
            )


def _weight_rows(coordination: Coordination, cases: Cases) -> Iterable[tuple[str, ...]]:
    tried = sorted(swept_weights(coordination, cases.participant))
    if len(tried) < 2:
        return
    weight = stable_weight(coordination, cases.participant)
    published = paper.CUFF_STABILITY_WEIGHT
    yield (
        "prediction",
        "smallest w_GH that keeps the force inside the glenoid with the cuff lost",
        f"{published:g}",
        "none of those tried" if weight is None else f"{weight:g}",
        "" if weight is None else f"{weight - published:+g}",
        f"tried: {', '.join(f'{w:g}' for w in tried)}; the rim here is an ellipse of "
        "shear over compression",
    )


def published_rhythm_table(rhythm: pd.DataFrame, cases: Cases) -> Table:
    """Rhythm of all conditions of one participant and of its recording, next to the published.

    Every cell has the rhythm by signed ends of the phase and by the paper's estimator; the last
    column one over the elevations that all motions of the plane pass.

    Parameters
    ----------
    rhythm : rows of results/prediction/shr.csv
    """
    known = {
        p.condition.name: name
        for name, p in (("healthy", cases.healthy), ("rc_limited", cases.cuff))
        if p is not None and cases.participant == paper.PREDICTED_PARTICIPANT
    }
    rows = []
    own = rhythm[rhythm.participant == cases.participant]
    phases = tuple(name for name in own.phase.unique() if name != SHARED)
    cases_of = own[["plane", "condition"]].drop_duplicates()
    for plane, condition in cases_of.to_numpy().tolist():
        part = own[(own.plane == plane) & (own.condition == condition)]
        values = part.set_index("phase")
        published = paper.RHYTHM[known[condition]].get(plane, {}) if condition in known else {}
        cells = [
            f"{number_or_none(values.shr[phase])} / {number_or_none(values.shr_range[phase])}"
            + (f" ({published[phase]:.2f})" if phase in published else "")
            for phase in phases
        ]
        low, high, shared = (values[key][SHARED] for key in ("from_deg", "to_deg", "shr"))
        cells.append(f"{number_or_none(shared)} ({low:.0f} to {high:.0f})")
        notes = {phase: note for phase, note in values.note.items() if isinstance(note, str)}
        text = "; ".join(f"{phase}: {note}" for phase, note in notes.items())
        rows.append((plane, condition, *cells, text))
    return Table(("plane", "condition", *phases, "shared elevations (deg)", "notes"), rows)
