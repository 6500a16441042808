"""Verdicts on predictions against recordings, published motions and implants.

Limits are those of config/targets.yaml, which was fixed before the runs that it judges. A limit
whose prediction failed or was not asked for is missed, not left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.published_arm import PUBLISHED_PLANES
from scapulohumeral.quantities.paper import ORTHOLOAD_BW
from scapulohumeral.report.prediction.judged import Judged
from scapulohumeral.report.prediction.rhythm_targets import (
    NOTHING,
    PRINTED,
    cells_that_agree,
    rhythm_verdicts,
)
from scapulohumeral.report.tables import Table, cell_in_words
from scapulohumeral.report.targets import Verdict
from scapulohumeral.report.words import in_words, variant_in_words
from scapulohumeral.stages.distances import daily_tasks
from scapulohumeral.stages.distances.against import FALL_LEVEL_DEG, FORCE_LEVELS_DEG

# What "in every plane" and "in every task" of the limits are. A limit that less was asked for than
# this is missed.
PLANES = tuple(PUBLISHED_PLANES)
TASKS = ("drinking", "driving", "shelf_reaching", "lifting")
# Variant of the configuration that differs from the study in the arm it follows only.
SAME_MODEL_ON_PUBLISHED_ARM = "study_arm"
# Variants on the published arm, by the names of the limits.
ON_PUBLISHED_ARM = {"study": SAME_MODEL_ON_PUBLISHED_ARM, "published": "published"}


def prediction_verdicts(judged: Judged) -> list[Verdict]:
    """All limits of config/targets.yaml that these tables answer."""
    return [
        *recording_verdicts(judged.targets["against_recording"], judged.recording),
        *rhythm_verdicts(judged.targets["own_rhythm"], judged.rhythm),
        *task_verdicts(judged.targets["against_tasks"], judged.tasks),
        *published_verdicts(judged.targets["against_published"], judged.published),
        *force_verdicts(judged.targets["joint_force"], judged.recording),
        uncertified_solves(judged.targets["solves"], judged.recording),
    ]


def recording_verdicts(limits: Mapping[str, Any], table: pd.DataFrame) -> Iterator[Verdict]:
    """Distances of the healthy predictions of the study's model from recordings and people."""
    for participant in limits["upward_rotation_rmse_deg"]:
        yield from verdicts_of(participant, limits, table).values()


def verdicts_of(
    participant: str, limits: Mapping[str, Any], table: pd.DataFrame
) -> dict[str, Verdict]:
    """The same of one participant, by what each is about in few words."""
    rows = _of(table, variant=limits["variant"], condition=limits["condition"], arm="own")
    own = _every(PLANES, _of(rows, participant=participant))
    name = f"{participant}, healthy prediction: "
    rmse, bias = limits["upward_rotation_rmse_deg"], limits["rest_bias_deg"]
    against = {
        "upward rotation": ("against the recording, RMSE", "ur_rmse_deg", rmse),
        "upward rotation at rest": ("against the recording", "ur_bias_rest_deg", bias),
    }
    found = {
        about: _at_most(
            f"{name}{about} {words}, worst plane", own, column, each[participant], " deg"
        )
        for about, (words, column, each) in against.items()
    }
    band = f"{name}share of the rise in the healthy band"
    share = limits["in_band_share"][participant]
    found["healthy band"] = _at_least(band, own, "in_band_share", share)
    paths = f"{name}share outside the fitted muscle paths"
    found["muscle paths"] = _outside(paths, own, limits)
    stops, limit = f"{name}median moment of the joint stops", limits["stop_moment_median_Nm"]
    found["joint stops"] = _at_most(stops, own, "stop_moment_median_Nm", limit, " N m")
    return found


def task_verdicts(limits: Mapping[str, Any], table: pd.DataFrame) -> Iterator[Verdict]:
    """Healthy predictions on the arm of daily tasks, which have chosen nothing in the model."""
    rows = _of(table, variant=limits["variant"], condition=limits["condition"])
    rows = rows.rename(columns={"task": "plane"})
    for participant, limit in limits["rmse_deg"].items():
        own = _every(TASKS, _of(rows, participant=participant))
        for column, words in daily_tasks.ANGLES.items():
            name = f"{participant}, daily tasks: {words} against the recording, RMSE, worst task"
            yield _at_most(name, own, column, limit, " deg")
        name = f"{participant}, daily tasks: share outside the fitted muscle paths"
        yield _outside(name, own, limits)
        name = f"{participant}, daily tasks: median moment of the joint stops"
        yield _at_most(name, own, "stop_moment_median_Nm", limits["stop_moment_median_Nm"], " N m")
    yield _certificates("daily tasks: predictions with a certificate", rows)


def published_verdicts(limits: Mapping[str, Any], table: pd.DataFrame) -> Iterator[Verdict]:
    """Whether the authors' problem gives the authors' results on the published arm."""
    rows = _of(table, variant=limits["variant"], participant=limits["participant"])
    for key in ("upward_rotation_rmse_deg", "clavicle_elevation_rmse_deg"):
        for condition in limits["conditions"]:
            part = _of(rows, quantity=key, condition=condition)
            words = key.removesuffix("_rmse_deg").replace("_", " ")
            name = f"authors' problem, {condition}: {words} against the published curve, RMSE"
            yield _at_most(name, part, "reproduced", limits[key], " deg")
    name = "authors' problem: cells of the rhythm table that agree, by the paper's estimator"
    cells = _of(rows, quantity="rhythm_range")
    if not cells.empty:
        cells = cells[cells.condition.isin(PRINTED)]
    yield cells_that_agree(name, limits, cells)
    for plane, fall in limits["peak_fall_deg"].items():
        part = _of(rows, quantity="upward_rotation_fall_deg", phase="peak", condition="cuff_w10")
        name = f"authors' problem, cuff lost: fall of peak upward rotation, {plane} plane"
        yield _near(name, _of(part, plane=plane), fall, limits["peak_fall_tolerance_deg"])
    yield _generic_clavicle(limits, rows)
    level = fall_level(limits)
    for condition, falls in limits["graded_fall_deg"].items():
        part = _of(rows, quantity="upward_rotation_fall_deg", phase=level, condition=condition)
        for plane, fall in falls.items():
            name = f"authors' problem, {condition}: fall of upward rotation {level}, {plane} plane"
            yield _near(name, _of(part, plane=plane), fall, limits["graded_fall_tolerance_deg"])


def fall_level(limits: Mapping[str, Any]) -> str:
    """Elevation of the arm that falls of upward rotation are told at, in words of the tables.

    Parameters
    ----------
    limits : section ``against_published`` of config/targets.yaml

    Raises
    ------
    ConfigError                      the tables tell them at another elevation
    """
    asked = limits["graded_elevation_deg"]
    if asked != FALL_LEVEL_DEG:
        raise ConfigError(
            f"config/targets.yaml: against_published.graded_elevation_deg is {asked:g}, but falls "
            f"of upward rotation are tabulated at {FALL_LEVEL_DEG:g} deg. Change FALL_LEVEL_DEG in "
            f"scapulohumeral.stages.distances.against too, or write {FALL_LEVEL_DEG:g}"
        )
    return f"at {asked:g} deg"


def force_verdicts(limits: Mapping[str, Any], table: pd.DataFrame) -> Iterator[Verdict]:
    """Joint force: at rest, and against implants where the rising arm gets to their elevation.

    The study's variant follows recorded arms, of which some end lower. The same model on the
    published arm, which rises higher, is judged beside it and named so.
    """
    rows = _of(table, condition=limits["condition"])
    own = _of(rows, variant=limits["variant"])
    name = "glenohumeral force at rest, healthy prediction, worst plane and participant"
    yield _at_most(name, own, "gh_force_rest_bw", limits["rest_percent_bw"], " %BW")
    high = _of(rows, variant=SAME_MODEL_ON_PUBLISHED_ARM)
    for arm, those in (("recorded arms", own), ("published arm", high)):
        for plane in ORTHOLOAD_BW:
            yield _implants(limits, _of(those, plane=plane), plane, arm)


def _implants(limits: Mapping[str, Any], rows: pd.DataFrame, plane: str, arm: str) -> Verdict:
    """Force of all participants at the elevation that implants are compared at, in one plane."""
    level = FORCE_LEVELS_DEG[-1]
    mean, sd, _ = ORTHOLOAD_BW[plane]
    tolerance = limits["implants_sd"] * sd
    name = f"glenohumeral force at {level:g} deg (assumed) against implants, {arm}, {plane} plane"
    target = f"{mean:g} ± {tolerance:g} %BW"
    if rows.empty or rows.status.ne("optimal").any():
        return Verdict(name, NOTHING, target, holds=False)
    forces = rows[f"gh_force_{level:g}_bw"]
    low = [
        f"{r.participant} ends at {r.arm_peak_deg:.0f} deg"
        for r in rows[forces.isna()].itertuples()
    ]
    known = rows[forces.notna()]
    said = [
        f"{person} {force:.1f} %BW"
        for person, force in zip(known.participant, forces[known.index], strict=True)
    ]
    away = (forces[known.index] - mean).abs()
    worse = tuple(word for word, off in zip(said, away > tolerance, strict=True) if off)
    value = ", ".join([*said, *(f"{word}: arm too low" for word in low)])
    return Verdict(name, value, target, bool(said) and not worse, worse)


def cuff_effects(judged: Judged) -> Table:
    """What losing the cuff does at one weight of joint stability: stated with its sign, not judged.

    Marked: a prediction is missing.
    """
    limits = judged.targets["cuff_effect"]
    level = fall_level(judged.targets["against_published"])
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for variant in map(ON_PUBLISHED_ARM.__getitem__, limits["variants"]):
        for healthy, cuff in limits["pairs"]:
            kind = "fall_deg" if healthy == "healthy" else "fall_equal_weight_deg"
            names = {"variant": variant, "condition": cuff, "phase": level}
            part = _of(judged.published, **names, quantity=f"upward_rotation_{kind}")
            pairs = zip(part.get("plane", ()), part.get("reproduced", ()), strict=True)
            falls = {plane: f"{value:+.1f}" for plane, value in pairs}
            if part.empty:
                flagged.add(len(rows))
            cells = (falls.get(plane, NOTHING) for plane in PLANES)
            shoulders = f"{cuff} against {healthy}"
            rows.append((variant_in_words(variant), shoulders, *cells))
    columns = ("variant", "shoulders", *(f"{plane} plane [deg]" for plane in PLANES))
    return Table(columns, rows, frozenset(flagged))


def uncertified_solves(limits: Mapping[str, Any], table: pd.DataFrame) -> Verdict:
    """Converged predictions of all variants that are not shown to be a strict local minimum."""
    name = "predictions of all variants: converged without a certificate"
    target = f"≤ {limits['uncertified']:g}"
    solved = _of(table, status="optimal")
    if solved.empty:
        return Verdict(name, NOTHING, target, holds=False)
    solves = solved.drop_duplicates(["variant", "participant", "condition"])
    missed = solves[~solves.certified.astype(bool)]
    worse = tuple(
        f"{variant_in_words(str(row.variant))} {row.participant} {row.condition}"
        for row in missed.itertuples()
    )
    value = f"{len(worse)} of {len(solves)}"
    return Verdict(name, value, target, len(worse) <= limits["uncertified"], worse)


def participants_table(judged: Judged) -> Table:
    """Per participant: attempted, solved, and usable, which means that all its limits hold.

    The note says what is missing, or which limits are missed.
    """
    limits = judged.targets["against_recording"]
    table = _of(
        judged.recording, variant=limits["variant"], condition=limits["condition"], arm="own"
    )
    rows = []
    for participant in limits["upward_rotation_rmse_deg"]:
        own = _of(table, participant=participant)
        verdicts = verdicts_of(participant, limits, judged.recording)
        missed = [about for about, verdict in verdicts.items() if not verdict.holds]
        attempted = participant in judged.requested and not own.empty
        optimal = own.status.eq("optimal").all()
        solved = attempted and bool(optimal and own.certified.eq(True).all())
        usable = solved and not missed
        words = ["yes" if one else "no" for one in (attempted, solved, usable)]
        note = f"limits missed: {', '.join(missed)}" if missed else ""
        if not solved:
            without = "no certificate" if optimal else "no solution"
            note = without if attempted else ""
        rows.append((participant, *words, note))
    columns = ("participant", "attempted", "solved", "usable", "note")
    flagged = frozenset(k for k, row in enumerate(rows) if row[3] == "no")
    return Table(columns, rows, flagged)


def _of(table: pd.DataFrame, **values: str) -> pd.DataFrame:
    """Rows with values in columns; none of a table without rows."""
    for column, value in values.items():
        if table.empty:
            return table
        table = table[table[column] == value]
    return table


def _every(places: tuple[str, ...], rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of all planes or tasks that a limit holds for; none if one was not asked for."""
    return rows if not rows.empty and set(places) <= set(rows.plane) else rows.iloc[:0]


def _at_most(name: str, rows: pd.DataFrame, column: str, limit: float, unit: str) -> Verdict:
    """Largest size of a column; a solved motion without such a value is named and left out."""
    target = f"≤ {limit:g}{unit}"
    solved = not rows.empty and column in rows and bool((rows.status == "optimal").all())
    known = rows[rows[column].notna()] if solved else rows
    if not solved or known.empty:
        return Verdict(name, NOTHING, target, holds=False)
    sizes = known[column].abs()
    worse = tuple(
        f"{_place(row)} {getattr(row, column):+.3g}{unit}"
        for row in known[sizes > limit].itertuples()
    )
    without = ", ".join(_place(row) for row in rows[rows[column].isna()].itertuples())
    note = f" (no such value: {without})" if without else ""
    return Verdict(name, f"{sizes.max():.3g}{unit}{note}", target, not worse, worse)


def _certificates(name: str, rows: pd.DataFrame) -> Verdict:
    """Whether every prediction is a strict local minimum."""
    if rows.empty:
        return Verdict(name, NOTHING, "all", holds=False)
    held = rows.certified.eq(True)
    worse = tuple(_place(row) for row in rows[~held].itertuples())
    return Verdict(name, f"{int(held.sum())} of {len(rows)}", "all", not worse, worse)


def _place(row: Any) -> str:
    return f"{row.participant} {row.plane}"


def _outside(name: str, rows: pd.DataFrame, limits: Mapping[str, Any]) -> Verdict:
    """No node outside the fitted poses, and all lengths close to OpenSim's where that was audited.

    Without a limit on their error, lengths are not asked for.
    """
    share, error = limits["outside_fit_share"], limits.get("length_error_mm")
    target = f"≤ {share:g}"
    if error is not None:
        target += f", and lengths within {error:g} mm of OpenSim's"
    if rows.empty or rows.outside_fit_share.isna().any():
        return Verdict(name, NOTHING, target, holds=False)
    errors = rows.get("length_error_max_mm", pd.Series(np.nan, index=rows.index))
    # What was not audited is no number, which is larger than nothing.
    off = pd.Series(False, index=rows.index) if error is None else errors > error
    missed = rows[(rows.outside_fit_share > share) | off]
    worse = tuple(
        f"{row.plane} {row.outside_fit_share:.2f}"
        + (f", {errors[row.Index]:.1f} mm" if off[row.Index] else "")
        for row in missed.itertuples()
    )
    largest = "not audited" if errors.isna().all() else f"lengths within {errors.max():.1f} mm"
    return Verdict(name, f"{rows.outside_fit_share.max():.2f}, {largest}", target, not worse, worse)


def _at_least(name: str, rows: pd.DataFrame, column: str, limit: float) -> Verdict:
    target = f"≥ {100 * limit:g} % in each plane"
    if rows.empty or column not in rows or rows[column].isna().any():
        return Verdict(name, NOTHING, target, holds=False)
    worse = tuple(
        f"{plane} {100 * value:.0f} %"
        for plane, value in zip(rows.plane, rows[column], strict=True)
        if value < limit
    )
    return Verdict(name, f"{100 * rows[column].min():.0f} %", target, not worse, worse)


def _near(name: str, rows: pd.DataFrame, expected: float, tolerance: float) -> Verdict:
    target = f"{expected:g} ± {tolerance:g} deg"
    if rows.empty or rows.reproduced.isna().any():
        return Verdict(name, NOTHING, target, holds=False)
    value = float(rows.reproduced.iloc[0])
    return Verdict(name, f"{value:.1f} deg", target, abs(value - expected) <= tolerance)


def _generic_clavicle(limits: Mapping[str, Any], rows: pd.DataFrame) -> Verdict:
    limit = limits["generic_clavicle_elevation_below_deg"]
    name = "authors' problem, generic muscles: elevation of the clavicle at rest, highest plane"
    target = f"below {limit:g} deg"
    part = _of(rows, quantity="clavicle_elevation_deg", phase="rest", condition="healthy_generic")
    if part.empty or part.reproduced.isna().any():
        return Verdict(name, NOTHING, target, holds=False)
    highest = float(part.reproduced.max())
    return Verdict(name, f"{highest:.1f} deg", target, highest < limit)


def distance_table(judged: Judged) -> Table:
    """Every prediction against its recording, failed ones included; marked: not converged."""
    columns = {
        "ur_rmse_deg": "upward rotation, RMSE",
        "ur_bias_rest_deg": "at rest",
        "tilt_rmse_deg": "tilt, RMSE",
        "internal_rotation_rmse_deg": "internal rotation, RMSE",
        "clavicle_elevation_rmse_deg": "clavicle elevation, RMSE",
        "in_band_share": "share in the healthy band [1]",
        "recorded_in_band_share": "of the recording [1]",
        "outside_fit_share": "share outside the fit [1]",
        "stop_moment_median_Nm": "stops, median [N m]",
    }
    names = ("participant", "variant", "condition", "plane", "status")
    rows = [
        (
            *(cell_in_words(name, row[name]) for name in names),
            *(_number(row.get(column)) for column in columns),
        )
        for row in judged.recording.to_dict("records")
    ]
    flagged = frozenset(k for k, row in enumerate(rows) if row[4] != "optimal")
    return Table((*names, *columns.values()), rows, flagged)


def task_table(judged: Judged) -> Table:
    """Every prediction on the arm of a daily task; marked: not converged, or no certificate."""
    columns = {
        f"{daily_tasks.APART}turn_deg": "recorded scapula turned against the elevations'",
        f"{daily_tasks.APART}turn_sd_deg": "scatter of that turn",
        f"{daily_tasks.APART}matched_share": "nodes that this was told from [1]",
        "ur_bias_deg": "upward rotation, mean difference",
        "ur_recorded_sd_deg": "recorded upward rotation, standard deviation",
        "arm_rmse_deg": "elevation of the arm, RMSE",
        "outside_fit_share": "share outside the fit [1]",
        "stop_moment_median_Nm": "stops, median [N m]",
    }
    rows = [
        (
            *(str(row[name]) for name in ("participant", "task", "hand_load_kg", "status")),
            *(
                f"{_number(row[angle])} ({_number(row[daily_tasks.TRACKED + angle])};"
                f" {_number(row[daily_tasks.APART + angle])})"
                for angle in daily_tasks.ANGLES
            ),
            *(_number(row[column]) for column in columns),
        )
        for row in judged.tasks.to_dict("records")
    ]
    flagged = frozenset(k for k, row in enumerate(judged.tasks.itertuples()) if not _proven(row))
    angles = (f"{words}, RMSE (tracked; recordings)" for words in daily_tasks.ANGLES.values())
    names = ("participant", "task", "load [kg]", "status", *angles, *columns.values())
    return Table(names, rows, flagged)


def _proven(row: Any) -> bool:
    return row.status == "optimal" and bool(row.certified)


def published_table(judged: Judged, conditions: tuple[str, ...]) -> Table:
    """Quantities of some conditions on the published arm, cell by cell."""
    table = judged.published[judged.published.condition.isin(conditions)]
    names = ("variant", "condition", "plane", "phase", "quantity")
    rows = [
        (
            *(cell_in_words(name, row[name]) for name in names[:-1]),
            in_words(str(row["quantity"])),
            *(_number(row[kind]) for kind in ("published", "reproduced")),
            _number(row["reproduced"] - row["published"]),
        )
        for row in table.to_dict("records")
    ]
    return Table((*names, "published", "reproduced", "difference"), rows)


def _number(value: float | None) -> str:
    return "" if value is None or np.isnan(value) else f"{value:.2f}"
