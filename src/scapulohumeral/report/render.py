"""The report as one HTML file: results in, text out."""

from __future__ import annotations

from typing import Any

import numpy as np

from scapulohumeral.report import chapters, tables
from scapulohumeral.report.coordination_targets import coordination_verdicts
from scapulohumeral.report.published.comparison import comparison, recovered
from scapulohumeral.report.speed import speed_content
from scapulohumeral.report.study import ReportFiles, Study, read_study
from scapulohumeral.report.targets import changed_afterwards, verdicts
from scapulohumeral.report.tracking import figures, solver_figures
from scapulohumeral.report.tracking.gimbal import gimbal_lock
from scapulohumeral.report.words import BESIDE_OTHERS
from scapulohumeral.templates import page_template

TEMPLATE = "template.html.j2"


def render_report(files: ReportFiles) -> str:
    """HTML text of the report; needs nothing but itself to be read.

    Raises
    ------
    DataError                        no solve, or files that do not belong together
    """
    study = read_study(files)
    return page_template("scapulohumeral.report", TEMPLATE).render(_content(study))


def _content(study: Study) -> dict[str, Any]:
    """Everything that the template shows, by name."""
    return {
        **_verdicts(study),
        "study": study,
        "participants": list(study.models),
        "planes": list(dict.fromkeys(trial.trial for trial in study.trials)),
        "judged": chapters.judged_content(study),
        "comparison": comparison(study, study.coordination),
        "recovered": recovered(study.coordination),
        "emg": study.coordination.emg_word,
        "calibration": chapters.calibration_chapter(study),
        "validation": chapters.validation_chapter(study),
        "prediction": chapters.prediction_chapter(study),
        "player": chapters.player(study),
        "gap": chapters.gap_chapter(study),
        "other_objective": chapters.other_objective(study),
        "tables": _tables(study),
        "glossary": chapters.glossary(),
        "speed": speed_content(study.speed),
        "beside_others": BESIDE_OTHERS,
        "trials": [
            {
                "participant": trial.participant,
                "plane": trial.trial,
                "failed": [run.formulation for run in trial.runs.values() if run.failed],
                "motion": figures.motion_figure(trial),
                "excitation": figures.excitation_figure(trial),
            }
            for trial in study.trials
        ],
        "performance": solver_figures.performance_figure(study),
        "convergence": solver_figures.convergence_figure(study),
        "reaction": figures.reaction_figure(study.trials),
        "gimbal": gimbal_lock(study),
        "clavicle": clavicle_point(study),
        "conoid_N_per_m": sorted(
            {record.conoid.stiffness_N_per_m for record in study.models.values()}
        ),
        "masses": sorted({record.masses for record in study.models.values()}),
        "muscle_count": len(study.runs[0].solution.muscles),
    }


def _verdicts(study: Study) -> dict[str, Any]:
    """All targets, what fails first, and what was done to them after results were seen."""
    judged = [
        *verdicts(study.summary, study.quality, study.targets),
        *coordination_verdicts(study.coordination),
    ]
    return {
        "verdicts": sorted(judged, key=lambda verdict: verdict.holds),
        "afterwards": {v.name: changed_afterwards(v.name, study.targets) for v in judged},
    }


def _tables(study: Study) -> dict[str, tables.Table]:
    makers = (
        tables.masses,
        tables.tracking_errors,
        tables.solver,
        tables.cost_terms,
        tables.geometry,
        tables.thoraxes,
        tables.reactions,
        tables.muscle_groups,
        tables.timing,
        tables.versions,
        tables.hashes,
        tables.settings,
    )
    return {maker.__name__: maker(study) for maker in makers}


def clavicle_point(study: Study) -> dict[str, Any]:
    """Where quaternion solves track the clavicle, where the paper does, and what that weighs.

    A rotation by a small angle moves a point at distance d by d times the angle; the vector part
    of a quaternion changes by half the angle. Squares of both are what the objective adds up.
    """
    points = {run.summary["settings"]["weights"]["clavicle_point_m"] for run in study.runs}
    distances = [
        float(np.linalg.norm(record.joints["ac1"].location_m)) for record in study.models.values()
    ]
    return {
        "points_m": sorted(points),
        "distances_m": sorted(distances),
        "share_at_ac": min(distances) ** 2,
        "share_quaternion": 0.25,
    }
