"""Tables of predictions: solves with their certificates, starts, stability, healthy rhythm."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd

from scapulohumeral.model.rotations import relative_angle, segment_orientations
from scapulohumeral.quantities.population import RHYTHM
from scapulohumeral.report.coordination import Coordination, Prediction
from scapulohumeral.report.prediction.loading import stability_rows
from scapulohumeral.report.tables import Table, named_rows


def prediction_solves(coordination: Coordination) -> Table:
    """Every prediction: status, certificate, effort of the solver, branch."""
    table = coordination.prediction_table.drop_duplicates(["participant", "condition"])
    branches = {(r.participant, r.condition): r.branch for r in named_rows(table)}
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for prediction in coordination.predictions:
        proof = prediction.summary["certificate"]
        condition, header = prediction.condition, prediction.solution.header
        if prediction.failed or not proof["holds"]:
            flagged.add(len(rows))
        branch = branches.get((prediction.participant, condition.name))
        rows.append(
            (
                prediction.participant,
                condition.name,
                condition.parameters,
                f"{condition.w_gh:g}",
                " ".join(condition.muscles),
                f"{100 * condition.capacity:.0f}",
                condition.start,
                "NOT CONVERGED" if prediction.failed else "optimal",
                str(header["iterations"]),
                f"{header['seconds']:.0f}",
                "" if np.isnan(header["objective"]) else f"{header['objective']:.5g}",
                *_certificate_cells(proof),
                branch if isinstance(branch, str) else "",
                header["message"] if prediction.failed else "",
            )
        )
    columns = (
        "participant", "condition", "muscles", "w_GH", "limited", "capacity [%]", "start",
        "status", "iterations", "time [s]", "objective", "KKT error", "inertia (+, −, 0)",
        "reduced Hessian", "branch", "why it stopped",
    )  # fmt: skip
    return Table(columns, rows, frozenset(flagged))


def _certificate_cells(proof: dict | None) -> tuple[str, str, str]:
    if proof is None:
        return ("none", "", "")
    found, expected = (", ".join(map(str, proof[k])) for k in ("inertia", "expected_inertia"))
    inertia = found if found == expected else f"{found} (expected {expected})"
    definite = "positive definite" if proof["reduced_hessian_positive"] else "NOT positive definite"
    return (f"{proof['kkt_error']:.1e}", inertia, definite)


def starts(coordination: Coordination) -> Table:
    """Solutions of one problem from different starts, pair by pair."""
    solved = [p for p in coordination.predictions if not p.failed]
    rows = [
        _pair_row(first, second)
        for first, second in combinations(solved, 2)
        if (first.participant, first.problem) == (second.participant, second.problem)
    ]
    columns = (
        "participant", "prediction", "from another start", "objective", "difference [%]",
        "scapula, largest angle between both [deg]", "activations, largest difference",
    )  # fmt: skip
    return Table(columns, rows)


def _pair_row(first: Prediction, second: Prediction) -> tuple[str, ...]:
    objective = [p.solution.header["objective"] for p in (first, second)]
    scapulae = [segment_orientations(p.solution.pose)["scapula"] for p in (first, second)]
    angle = np.rad2deg(relative_angle(*scapulae))
    activation = np.abs(first.solution.activation - second.solution.activation)
    return (
        first.participant,
        first.condition.name,
        second.condition.name,
        f"{objective[0]:.5g} and {objective[1]:.5g}",
        f"{100 * (objective[1] / objective[0] - 1):+.3f}",
        f"{angle.max():.2f}",
        f"{activation.max():.3f}",
    )


def spread_table(spreads: pd.DataFrame) -> Table:
    """Upward rotation at fixed elevations, with its standard deviation by that of the scalers."""
    rows = [
        (
            str(row.participant),
            str(row.condition),
            str(row.plane),
            f"{row.arm_deg:g}",
            f"{row.upward_rotation_deg:.1f}",
            f"{row.sd_deg:.1f}",
            f"{row.mostly_by} ({row.by_it_deg:.1f})".replace("_", " "),
        )
        for row in named_rows(spreads)
    ]
    columns = (
        "participant", "shoulder", "plane", "arm [deg]", "upward rotation [deg]",
        "standard deviation [deg]", "mostly by (alone [deg])",
    )  # fmt: skip
    return Table(columns, rows)


def stability(coordination: Coordination) -> Table:
    """Peaks of every solved problem, by plane."""
    rows = [row for cases in coordination.cases.values() for row in stability_rows(cases.headline)]
    flagged = frozenset(i for i, row in enumerate(rows) if float(row[6]) > 1.0)
    columns = (
        "participant", "shoulder", "plane", "peak upward rotation [deg]", "rhythm start-90",
        "peak joint force [% body weight]", "largest distance from centre (rim: 1)",
        "time outside [%]",
    )  # fmt: skip
    return Table(columns, rows, flagged)


def population_rhythm() -> Table:
    """Rhythm of healthy shoulders across published studies."""
    phases = next(iter(RHYTHM.values()))
    rows = [
        (plane, *(f"{mean:.2f} ± {sd:.2f} (n = {n})" for mean, sd, n in values.values()))
        for plane, values in RHYTHM.items()
    ]
    return Table(("plane", *phases), rows)


def failed_predictions(coordination: Coordination) -> list[Prediction]:
    """Predictions without a solution."""
    return [p for p in coordination.predictions if p.failed]
