"""Content of the chapters beyond tracking; a chapter without results is None."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.ocp.solution import Solution
from scapulohumeral.player.page import player_html
from scapulohumeral.player.scene import Scene
from scapulohumeral.quantities.paper import PREDICTED_PARTICIPANT
from scapulohumeral.quantities.population import CITATION, UPWARD_ROTATION
from scapulohumeral.quantities.segment_angles import thorax_angles
from scapulohumeral.report.calibration import figures as calibration_figures
from scapulohumeral.report.coordination import Cases, Prediction
from scapulohumeral.report.gap import tables as gap_tables
from scapulohumeral.report.gap.real_cases import real_content
from scapulohumeral.report.gap.words import FAMILIES, WORDS
from scapulohumeral.report.player import build_scene
from scapulohumeral.report.prediction import figures as prediction_figures
from scapulohumeral.report.prediction import ladder, literature, sensitivity
from scapulohumeral.report.prediction import loading as loading_figures
from scapulohumeral.report.prediction import moments as moment_figures
from scapulohumeral.report.prediction import tables as prediction_tables
from scapulohumeral.report.prediction import targets as prediction_targets
from scapulohumeral.report.prediction.audit import audit_rows
from scapulohumeral.report.prediction.girdle_errors import girdle_table
from scapulohumeral.report.published.comparison import published_rhythm_table
from scapulohumeral.report.study import Study
from scapulohumeral.report.tables import Table, cell_in_words, named_rows
from scapulohumeral.report.tracking.figures import GROUP_NAMES
from scapulohumeral.report.validation import figures as validation_figures
from scapulohumeral.report.words import GLOSSARY, STEPS, in_words

# Terms of the calibration alone, and the weight that each predicted condition has of its own.
NOT_COMPARED = ("emg", "parameters", "stability")


def calibration_chapter(study: Study) -> dict[str, Any] | None:
    """EMG quality and scalers."""
    coordination = study.coordination
    if not coordination.emg and not coordination.calibrations:
        return None
    return {
        "quality": calibration_figures.emg_quality(coordination),
        "figure": calibration_figures.scaler_figure(coordination),
        "scores": calibration_figures.score_table(coordination),
        "scalers": calibration_figures.scaler_table(coordination),
        "recovery": calibration_figures.recovery_table(coordination.recovery),
    }


def validation_chapter(study: Study) -> dict[str, Any] | None:
    """Daily tasks."""
    coordination = study.coordination
    if coordination.validation.empty:
        return None
    return {
        "reductions": validation_figures.reduction_table(coordination),
        "tasks": validation_figures.task_table(coordination),
        "errors": validation_figures.error_figure(coordination),
        "figures": validation_figures.task_figures(coordination),
        "skipped": [p for p in study.models if p not in set(coordination.validation.participant)],
        "again": validation_figures.solved_again(coordination.validation),
    }


def prediction_chapter(study: Study) -> dict[str, Any] | None:
    """Predicted motions, joint force, moments and muscle forces."""
    coordination = study.coordination
    if not coordination.predictions:
        return None
    shown = [_participant_content(study, cases) for cases in coordination.cases.values()]
    return {
        "failed": prediction_tables.failed_predictions(coordination),
        "participants": sorted(shown, key=lambda p: p["name"] != PREDICTED_PARTICIPANT),
        "solves": prediction_tables.prediction_solves(coordination),
        "starts": prediction_tables.starts(coordination),
        "stability": prediction_tables.stability(coordination),
        "push": moment_figures.largest_push(coordination.predictions),
        "spread": prediction_tables.spread_table(coordination.spreads),
        "ladder": ladder_content(study),
        "sensitivity": sensitivity_content(study),
        "postures": committed_content(study.coordination.postures),
        "held": committed_content(study.coordination.held),
        "tried": committed_content(study.coordination.tried),
        "measured": measured_content(study),
        "population": prediction_tables.population_rhythm(),
        "population_source": CITATION,
    }


def judged_content(study: Study) -> dict[str, Any] | None:
    """What predictions are judged by, who is usable, and all distances."""
    judged = study.coordination.judged
    if judged is None:
        return None
    return {
        "participants": prediction_targets.participants_table(judged)
        if judged.has_limits
        else None,
        "fall_level": prediction_targets.fall_level(judged.targets["against_published"]),
        "stated": prediction_targets.cuff_effects(judged) if judged.has_limits else None,
        "distances": prediction_targets.distance_table(judged),
        "tasks": prediction_targets.task_table(judged) if len(judged.tasks) else None,
        "audit": audit_content(study),
        "girdle": girdle_table(judged.published),
        "published": prediction_targets.published_table(judged, ("healthy", "cuff_w10")),
        "graded": prediction_targets.published_table(
            judged, ("healthy_generic", "healthy_w10", "cuff_w2", "cuff_75", "cuff_50", "cuff_25")
        ),
    }


def audit_content(study: Study) -> Table | None:
    """Muscle geometry of predictions against OpenSim, None if nothing was audited."""
    coordination = study.coordination
    if coordination.judged is None or coordination.audit.empty:
        return None
    limit = coordination.judged.targets["against_recording"]["length_error_mm"]
    return audit_rows(coordination.audit, limit)


def ladder_content(study: Study) -> dict[str, Any] | None:
    """Figure and table of the ladder, None if it was not climbed."""
    table = study.coordination.ladder
    if table.empty:
        return None
    return {
        "figure": ladder.ladder_figure(table),
        "moves": ladder.ladder_moves(table),
        "rows": ladder.ladder_rows(table),
    }


def sensitivity_content(study: Study) -> dict[str, Any] | None:
    """Tornado and table of the sensitivity, None if it was not computed."""
    table = study.coordination.sensitivity
    if table.empty:
        return None
    return {
        "figure": sensitivity.tornado(table),
        "rows": sensitivity.sensitivity_rows(table),
        "reaction_rate": table.case.str.startswith("reaction_rate").any(),
    }


def committed_content(table: pd.DataFrame) -> Table | None:
    """A table of solves as it stands, None if they were not computed; marked: not solved."""
    if table.empty:
        return None
    rows = [
        tuple(
            "" if pd.isna(x) else f"{x:.3g}" if isinstance(x, float) else cell_in_words(name, x)
            for name, x in zip(table.columns, row, strict=True)
        )
        for row in named_rows(table)
    ]
    failed = frozenset(k for k, status in enumerate(table.status) if status != "optimal")
    return Table(tuple(map(in_words, table.columns)), rows, failed)


def measured_content(study: Study) -> dict[str, Any]:
    """Moment arms and joint forces beside published measurements, where the study has both."""
    coordination = study.coordination
    files, judged = coordination.files, coordination.judged
    return {
        "arms": literature.moment_arms(study, files.moment_arms[0]) if files.moment_arms else None,
        "pectoralis": literature.pectoralis_words(study) if files.moment_arms else "",
        "forces": literature.joint_forces(
            judged.recording,
            {name: cases.whole for name, cases in coordination.cases.items()},
            files.joint_force[0],
        )
        if files.joint_force and judged
        else None,
    }


def other_objective(study: Study) -> list[str]:
    """Weights of predictions with calibrated muscles that calibration has otherwise, in words."""
    predictions = study.coordination.predictions
    if all(one.condition.parameters != "calibrated" for one in predictions):
        return []
    there, here = (study.config["weights"][name] for name in ("calibration", "prediction"))
    names = [name for name in {**there, **here} if name not in NOT_COMPARED]
    # A weight that is not named is none.
    return [
        f"{name.replace('_', ' ')} {here.get(name, 0):g} instead of {there.get(name, 0):g}"
        for name in names
        if there.get(name, 0) != here.get(name, 0)
    ]


def gap_chapter(study: Study) -> dict[str, Any] | None:
    """Diagnoses of the recordings, and what cases of known cause say about such diagnoses."""
    if not study.diagnoses and not study.blind_scores and study.real_cases.empty:
        return None
    # Of several draws the newest of the largest: small ones say little.
    newest_first = reversed(study.blind_scores)
    card = max(newest_first, key=lambda one: one["scored"]["cases"], default=None)
    return {
        "verdicts": gap_tables.verdict_table(study.diagnoses),
        "diagnoses": [
            {
                "participant": document["inputs"]["participant"],
                "candidates": gap_tables.candidate_table(document),
                "warnings": document["warnings"],
                "untestable": document["untestable"],
            }
            for document in study.diagnoses
        ],
        "codes": sorted({document["hashes"]["code"][:16] for document in study.diagnoses}),
        "scores": gap_tables.score_tables(card) if card else {},
        "card": card,
        "together": gap_tables.together_table(study.blind_scores),
        "draws": gap_tables.draw_table(study.blind_scores),
        "real": real_content(study.real_cases),
    }


def _participant_content(study: Study, cases: Cases) -> dict[str, Any]:
    coordination, note = study.coordination, tracked_note(study, cases)
    moments = moment_figures.headline_moments(coordination, cases, study.equation_folders)
    excitations = prediction_figures.prediction_excitations(
        coordination, cases, _trial_times(study, cases)
    )
    return {
        "name": cases.participant,
        "rhythm": published_rhythm_table(coordination.rhythm, cases),
        "motion": [
            prediction_figures.prediction_kinematics(cases, note),
            prediction_figures.upward_rotation_figure(cases, note),
        ],
        "calibration": [prediction_figures.calibration_effect(cases)],
        "excitations": [excitations],
        "loading": [loading_figures.loading_figure(cases)],
        "sweep": [loading_figures.sweep_figure(cases), prediction_figures.sweep_kinematics(cases)],
        "capacity": [loading_figures.capacity_figure(cases)],
        "moments": [moment_figures.moment_figure(cases.participant, moments)],
        "margins": moment_figures.margin_table(moments),
        "forces": [moment_figures.group_force_figure(cases)],
    }


def tracked_note(study: Study, cases: Cases) -> str:
    """Sentences on what is drawn beside predictions: the tracked motion, which is no recording."""
    solves = [
        trial.runs["quaternion"].solution
        for trial in study.trials
        if trial.participant == cases.participant
        and "quaternion" in trial.runs
        and not trial.runs["quaternion"].failed
    ]
    if not solves:
        return ""
    apart = max(
        np.abs(thorax_angles(s.pose) - thorax_angles(s.reference_pose))[:, UPWARD_ROTATION].max()
        for s in solves
    )
    return (
        " Grey: the motion that was tracked in chapter 3. It is not the recording, which errors "
        f"and rhythms are told against: their upward rotations differ by up to {apart:.1f} deg."
    )


def _trial_times(study: Study, cases: Cases) -> dict[str, Any]:
    """Mesh of each tracked elevation of a participant."""
    return {
        trial.trial: trial.any_run.solution.time_s
        for trial in study.trials
        if trial.participant == cases.participant
    }


def glossary() -> Table:
    """Names that tables use, in words."""
    families = {f"{name} (family of effects)": words for name, words in FAMILIES.items()}
    steps = {f"{name} (step of the ladder)": words for name, words in STEPS.items()}
    return Table(("name", "meaning"), list({**GLOSSARY, **steps, **WORDS, **families}.items()))


def player(study: Study) -> str:
    """Interactive view of the predictions, or of a tracked motion where there are none."""
    every = sorted(
        study.coordination.cases.values(), key=lambda c: c.participant != PREDICTED_PARTICIPANT
    )
    predicted = (_predicted_scenes(study, c, c.healthy) for c in every if c.healthy is not None)
    scenes = next(predicted, None) or _tracked_scenes(study)
    return player_html(scenes, GROUP_NAMES) if scenes else ""


def _predicted_scenes(study: Study, cases: Cases, healthy: Prediction) -> list[Scene]:
    name = cases.participant
    chosen = (("predicted, healthy", healthy), ("predicted, cuff-limited", cases.cuff))
    scenes = [_scene(study, name, p.solution, label) for label, p in chosen if p is not None]
    return [*scenes, _scene(study, name, healthy.solution, "tracked motion", recorded=True)]


def _tracked_scenes(study: Study) -> list[Scene]:
    solved = study.solved("quaternion")
    if not solved:
        return []
    run = next((r for r in solved if r.participant == PREDICTED_PARTICIPANT), solved[0])
    title = f"{run.participant}, {run.trial} plane"
    return [
        _scene(study, run.participant, run.solution, f"{title}, simulated"),
        _scene(study, run.participant, run.solution, f"{title}, recorded", recorded=True),
    ]


def _scene(
    study: Study, participant: str, solution: Solution, label: str, recorded: bool = False
) -> Scene:
    record, thorax = study.models[participant], study.thoraxes[participant]
    return build_scene(solution, record, thorax, label, recorded=recorded)
