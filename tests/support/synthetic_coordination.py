"""EMG, calibration, daily tasks and predictions of a small study, in the formats of the results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from places import REPOSITORY
from synthetic_study import MUSCLES, write_json, write_model

from scapulohumeral.emg.envelope import Envelopes, write_envelopes
from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.solution import Solution, write_solution
from scapulohumeral.problems.composite import Composite, compose
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.report.coordination import CoordinationFiles
from scapulohumeral.stages.distances.against import AgainstFiles, compare
from scapulohumeral.stages.prediction import Condition
from scapulohumeral.stages.prediction_summary import summarise_predictions
from scapulohumeral.stages.validation import summarise_validation

CHANNELS = ("lateral_deltoid", "clavicular_pectoralis")
CHANNEL_TABLE = """channel,group,scaled_muscle,elements,neighbours
lateral_deltoid,scapular_deltoid,delt_scap,delt_scap_6,
clavicular_pectoralis,clavicular_pectoralis,pect_maj_c,pect_maj_c_1 pect_maj_c_2,
"""
CUFF = ("supra", "infra")
CERTIFICATE = {
    "kkt_error": 1e-9,
    "inertia": [20, 10, 0],
    "expected_inertia": [20, 10, 0],
    "reduced_hessian_positive": True,
    "active_bounds": 3,
    "weakly_active_bounds": 0,
    "holds": True,
}
# By condition: what is predicted, how many degrees the scapula turns less than tracked, and the
# share of shear in the joint force.
CONDITIONS = {
    "healthy_generic": (Condition("healthy_generic", "generic", 2.0), -3.0, 0.1),
    "healthy": (Condition("healthy", "calibrated", 2.0), 0.0, 0.1),
    "cuff_w2": (Condition("cuff_w2", "calibrated", 2.0, CUFF, 0.0, "healthy"), -6.0, 0.7),
    "cuff_w10": (Condition("cuff_w10", "calibrated", 10.0, CUFF, 0.0, "healthy"), -8.0, 0.2),
    "cuff_50": (Condition("cuff_50", "calibrated", 2.0, CUFF, 0.5, "healthy"), -2.0, 0.2),
    "supraspinatus": (
        Condition("supraspinatus", "calibrated", 2.0, ("supra",), 0.0, "healthy"), -1.0, 0.2,
    ),
    "healthy_direct": (Condition("healthy_direct", "calibrated", 2.0, start="direct"), 0.1, 0.1),
}  # fmt: skip


def write_coordination(
    folder: Path, tracked: Sequence[Solution], tasks: bool = True, failed: tuple[str, ...] = ()
) -> CoordinationFiles:
    """Write all files beyond tracking of one participant.

    Parameters
    ----------
    tracked : quaternion solutions of the elevations
    tasks : whether there are daily tasks
    failed : conditions whose solve fails
    """
    participant = tracked[0].header["participant"]
    channels = folder / "channels.csv"
    channels.parent.mkdir(parents=True, exist_ok=True)
    channels.write_text(CHANNEL_TABLE, encoding="utf-8")
    emg = [_write_emg(folder / "emg" / participant, solution) for solution in tracked]
    files = CoordinationFiles(
        channels=[channels],
        envelopes=[envelope for envelope, _ in emg],
        emg_quality=[quality for _, quality in emg],
        calibrations=[
            write_json(folder / f"calibration/{participant}.json", calibration(participant))
        ],
    )
    if tasks:
        files = _with_tasks(files, folder, tracked[0])
    return _with_predictions(files, folder, tracked, failed)


def calibration(participant: str) -> dict:
    """A scored calibration; the second group is not identifiable."""

    def entry(value: float, plant: float, identifiable: bool) -> dict:
        half = 0.05 if identifiable else 0.4
        return {
            "value": value,
            "ci90": [value - half, value + half],
            "identifiable": identifiable,
            "at_bound": False,
            "paper_problem": 1.02,
            "plant": plant,
            "error": value / plant - 1.0,
            "paper_problem_error": 1.02 / plant - 1.0,
            "covered": abs(value - plant) <= half,
        }

    groups = {
        "scapular_deltoid": {"force": entry(1.15, 1.16, True), "fibre": entry(0.9, 0.96, True)},
        "clavicular_trapezius": {
            "force": entry(1.3, 1.02, False),
            "fibre": entry(0.8, 0.74, False),
        },
        "serratus_anterior": {"force": entry(1.16, 1.17, True), "fibre": entry(0.92, 0.92, True)},
    }
    score = {"identifiable": 2, "groups": 3, "median_error_all": 0.1}
    return {
        "schema": "calibration/1",
        "participant": participant,
        "emg_simulated": True,
        "status": "converged",
        "activation_time": 1.1,
        "deactivation_time": 0.9,
        "groups": groups,
        "scores": {
            "force": {**score, "median_error": 0.01, "median_error_paper_problem": 0.13},
            "fibre": {**score, "median_error": 0.04, "median_error_paper_problem": 0.08},
            "coverage90": 0.75,
        },
    }


def _write_emg(folder: Path, solution: Solution, trial: str = "") -> tuple[Path, Path]:
    """Envelopes like the first excitations, and their quality; nothing is above the MVC."""
    trial = trial or solution.header["trial"]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{trial}_envelope.csv"
    # A little longer than the motion.
    time = np.concatenate(
        [[solution.time_s[0] - 0.1], solution.time_s, [solution.time_s[-1] + 0.1]]
    )
    values = np.pad(solution.excitation[:, :2], ((1, 1), (0, 0)), mode="edge")
    write_envelopes(path, Envelopes(CHANNELS, time, values, simulated=True))
    checks = [
        {"recording": "trial", "channel": name, "check": check, "value": 0.4, "threshold": 1.0,
         "unit": "1", "passed": check != "mains_hum"}
        for name in CHANNELS for check in ("mains_hum", "above_mvc")
    ]  # fmt: skip
    document = {"schema": "emg_quality/1", "simulated": True, "passed": False, "checks": checks}
    return path, write_json(folder / f"{trial}_quality.json", document)


def _with_tasks(files: CoordinationFiles, folder: Path, like: Solution) -> CoordinationFiles:
    """One daily task: calibrated excitations equal EMG, generic ones are half too large."""
    participant = like.header["participant"]
    envelope, quality = _write_emg(folder / "emg" / participant, like, "shelf_reaching")
    solutions = []
    for parameters, factor in (("generic", 1.5), ("calibrated", 1.0)):
        header = {**like.header, "trial": "shelf_reaching", "parameters": parameters}
        path = folder / "validation" / participant / f"shelf_reaching_{parameters}.npz"
        path.parent.mkdir(parents=True, exist_ok=True)
        excitation = factor * like.excitation
        excitation[:, 1:3] = factor * like.excitation[:, 1:2]
        write_solution(replace(like, header=header, excitation=excitation), path)
        solutions.append(path)
    summary = folder / "validation/summary.csv"
    summarise_validation(solutions, files.channels[0], [envelope] * 2, summary)
    return replace(
        files,
        envelopes=[*files.envelopes, envelope],
        emg_quality=[*files.emg_quality, quality],
        validation=[summary],
        validation_solutions=solutions,
    )


def _with_predictions(
    files: CoordinationFiles, folder: Path, tracked: Sequence[Solution], failed: tuple[str, ...]
) -> CoordinationFiles:
    composite = compose(tracked, 0.04, 1.0)
    participant = tracked[0].header["participant"]
    parent = folder / "prediction" / participant
    parent.mkdir(parents=True, exist_ok=True)
    solutions, summaries = [], []
    for name in CONDITIONS:
        status = "failed" if name in failed else "optimal"
        solution = prediction(tracked[0], composite, name, status)
        write_solution(solution, parent / f"{name}.npz")
        proof = None if status == "failed" else CERTIFICATE
        solutions.append(parent / f"{name}.npz")
        document = {**solution.header, "certificate": proof}
        summaries.append(write_json(parent / f"{name}.summary.json", document))
    model = write_model(folder / f"prediction/{participant}.json", participant)
    tables = folder / "prediction/summary.csv", folder / "prediction/shr.csv"
    motions = []
    for solution in tracked:
        motions.append(folder / f"prediction/{participant}_{solution.header['trial']}.npz")
        write_solution(solution, motions[-1])
    summarise_predictions(solutions, summaries, {participant: model}, motions, *tables)
    distances = folder / "prediction/recording.csv", folder / "prediction/published.csv"
    config = REPOSITORY / "config"
    people = [config / "participants" / participant / "participant.yaml"]
    targets = config / "targets.yaml"
    judged = AgainstFiles(solutions, summaries, motions, people, targets)
    compare(judged, Region(10.0, (-30.0, 10.0)), *distances)
    return replace(
        files,
        against_recording=[distances[0]],
        against_published=[distances[1]],
        predictions=solutions,
        prediction_summaries=summaries,
        prediction_summary=[tables[0]],
        rhythm=[tables[1]],
    )


def prediction(like: Solution, composite: Composite, name: str, status: str) -> Solution:
    """The composite motion with a scapula that turns less, in step with the elevation."""
    condition, turn_deg, shear = CONDITIONS[name]
    x: Trajectory = composite.trajectory
    tracked = pose_to_trial(x.q)
    angles = tracked.copy()
    share = (angles[:, 7] - angles[:, 7].min()) / np.ptp(angles[:, 7])
    angles[:, 4] += np.deg2rad(turn_deg) * share
    pose = trial_to_pose(angles)
    header = {
        **like.header,
        "trial": "composite",
        "status": status,
        "condition": asdict(condition),
        "planes": {plane: list(nodes) for plane, nodes in composite.nodes.items()},
        "objective": 3.0 + 0.001 * turn_deg,
        "variant": "study",
        "body_mass_kg": 80.0,
        "terms": {"activation": 2.0},
        "choices": asdict(ProblemChoices()),
        "stop_moment_median_Nm": 0.0,
    }
    force = 300.0 + 200.0 * share
    reaction = np.column_stack([force, shear * force, 0.0 * force])
    signals = {"activation": x.a, "excitation": x.e, "muscle_force_N": 500.0 * x.a}
    return replace(
        like,
        header=header,
        time_s=composite.time_s,
        q=pose,
        u=x.u,
        **signals,
        fibre_length=np.ones_like(x.a),
        reaction_N=reaction,
        angles_rad=angles,
        reference_rad=tracked,
        pose=pose,
        reference_pose=x.q,
        muscles=np.array(list(MUSCLES)) if x.a.shape[1] == len(MUSCLES) else like.muscles,
    )
