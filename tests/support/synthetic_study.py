"""A small study made up of recorded angles and invented signals, in the formats of the results."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from places import REPOSITORY
from skeleton import joint, muscle, skeleton_record

from scapulohumeral.model.participant import read_motion
from scapulohumeral.model.record import ModelRecord, write_record
from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from scapulohumeral.ocp.solution import Solution, write_solution
from scapulohumeral.quantities.tracking_metrics import tracking_metrics
from scapulohumeral.report.study import ReportFiles
from scapulohumeral.stages.summary import summarise

PARTICIPANTS = REPOSITORY / "config/participants"
MUSCLES = {
    "delt_scap_6": "delt_scap",
    "pect_maj_c_1": "pect_maj_c",
    "pect_maj_c_2": "pect_maj_c",
    "supra_1": "supra",
}
FORMULATIONS = ("quaternion", "euler")
SPIKE = 0.3


def solution(participant: str, trial: str, formulation: str, status: str = "optimal") -> Solution:
    """A motion three degrees off the recording; Euler activations have a spike of one node."""
    recorded = read_motion(PARTICIPANTS / participant / f"{trial}.csv")
    time_s = recorded.time_s[0] + 0.04 * np.arange(40)
    reference = np.column_stack(
        [np.interp(time_s, recorded.time_s, angle) for angle in recorded.angles_rad.T]
    )
    offset = np.deg2rad([3.0, 0, 0, 0, 3.0, 0, 0, 3.0, 0, 0])
    pose = trial_to_pose(reference + offset)
    angles = reference + offset if formulation == "euler" else pose_to_trial(pose)
    effort = 0.2 + 0.1 * np.sin(time_s)[:, None] * np.arange(1, len(MUSCLES) + 1) / len(MUSCLES)
    if formulation == "euler":
        effort[5, 0] += SPIKE
    none = np.zeros(0)
    return Solution(
        header=header(participant, trial, formulation, status),
        time_s=time_s,
        q=angles if formulation == "euler" else pose,
        u=np.gradient(angles, time_s, axis=0),
        activation=effort,
        excitation=1.1 * effort,
        muscle_force_N=500.0 * effort,
        fibre_length=np.ones_like(effort),
        reaction_N=np.column_stack([300.0 + 50.0 * np.sin(time_s), 0 * time_s, 0 * time_s]),
        angles_rad=angles,
        reference_rad=reference,
        pose=pose,
        reference_pose=trial_to_pose(reference),
        muscles=np.array(list(MUSCLES)),
        free=none,
        multipliers=none,
        lower=none,
        upper=none,
    )


def header(participant: str, trial: str, formulation: str, status: str) -> dict:
    """Header of a solution."""
    failed = status != "optimal"
    return {
        "participant": participant,
        "trial": trial,
        "formulation": formulation,
        "status": status,
        "message": "Maximum number of iterations exceeded." if failed else "Solved.",
        "objective": 2.5,
        "terms": {"scapula": 1.5, "activation": 1.0},
        "constraint_violation": 0.1 if failed else 1e-9,
        "iterations": 30,
        "seconds": 12.0,
        "phases": ["gauss-newton", "exact"],
        "settings": {"time_step_s": 0.04, "weights": {"clavicle_point_m": 0.5}},
        "hashes": {"inputs": "a" * 64, "code": "b" * 64},
        "versions": {"numpy": "1.2.3"},
        "machine": "x86_64",
    }


def history() -> list[dict]:
    """Records of a solve that converges."""
    return [
        {
            "phase": "exact",
            "iteration": i,
            "objective": 3.0,
            "primal_infeasibility": 10.0**-i,
            "dual_infeasibility": 10.0 ** (1 - i),
            "barrier": 1e-5,
            "seconds": 0.1 * i,
        }
        for i in range(6)
    ]


def model_record(participant: str) -> ModelRecord:
    """A model record of a heavy arm with the muscles of the solutions."""
    straight = ("scapula_r", [0.0, 0.0, 0.03]), ("humerus_r", [0.02, -0.15, 0.0])
    bones = skeleton_record().with_masses(
        {"humerus_r": 6.7, "ulna_r": 1.8, "radius_r": 1.8, "hand_r": 1.7}
    )
    return replace(
        bones,
        participant=participant,
        body_mass_kg=83.0,
        body_mass_source="mean of the participants",
        joints={**bones.joints, "ac1": joint([0.14, 0.0, 0.0])},
        pronation_rad=2.0 * np.pi / 3.0,
        muscles=tuple(muscle(name, *straight, group=g) for name, g in MUSCLES.items()),
    )


def write_model(path: Path, participant: str) -> Path:
    """Write that model record."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_record(model_record(participant), path)
    return path


def thorax_record(participant: str) -> dict:
    """Fitted thorax."""
    levels = {"level_mean": 0.1, "level_sd": 0.1, "level_min": -0.1, "level_max": 0.3}
    size = {"centre_m": [0.0, -0.2, 0.1], "radii_m": [0.1, 0.2, 0.1]}
    return {"participant": participant, **size, **levels, "prior": {"level_mean": -0.2}}


def quality() -> pd.DataFrame:
    """Quality of the muscle geometry; the last element is straight."""
    count = len(MUSCLES)
    return pd.DataFrame(
        {
            "muscle": list(MUSCLES),
            "path": ["polynomial"] * (count - 1) + ["straight"],
            "condition": 1e3,
            "left_out_held_out": 2,
            "length_rmse_mm": 0.2,
            "arm_rmse_median_mm": 0.8,
            "arm_rmse_worst_mm": [1.0, 2.0, 6.0, 0.0],
            "direction_rmse": 0.01,
            "fibre_min": 0.3,
            "fibre_max": 1.2,
            "fibre_outside": [True] + [False] * (count - 1),
        }
    )


def write_json(path: Path, document: object) -> Path:
    """Write a JSON file and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def write_run(folder: Path, solved: Solution) -> tuple[Path, Path]:
    """Write a solution and its summary."""
    names = [solved.header[key] for key in ("participant", "trial", "formulation")]
    stem = folder / "tracking" / names[0] / "_".join(names[1:])
    stem.parent.mkdir(parents=True, exist_ok=True)
    write_solution(solved, stem.with_suffix(".npz"))
    document = {**solved.header, **tracking_metrics(solved), "history": history()}
    return stem.with_suffix(".npz"), write_json(stem.with_suffix(".summary.json"), document)


def write_study(folder: Path, runs: list[Solution]) -> ReportFiles:
    """Write all files that the report reads."""
    people = sorted({run.header["participant"] for run in runs})
    solutions, summaries = zip(*(write_run(folder, run) for run in runs), strict=True)
    tables = []
    for person in people:
        for formulation in FORMULATIONS:
            path = folder / "muscle_geometry" / person / f"{formulation}_quality.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            quality().to_csv(path, index=False)
            tables.append(path)
    summary = folder / "tracking/summary.csv"
    summarise(summaries).to_csv(summary, index=False)
    source = folder / "source.py"
    source.write_text("x = 1  # ASSUME the arm is rigid,\n# as usual.\ny = 2\n", encoding="utf-8")
    models, job = folder / "models", {"s": 3.0, "max_rss": "NA"}
    return ReportFiles(
        summary=summary,
        solutions=solutions,
        summaries=summaries,
        models=[write_model(models / f"{p}.json", p) for p in people],
        thoraxes=[write_json(models / f"{p}_thorax.json", thorax_record(p)) for p in people],
        participants=[PARTICIPANTS / person / "participant.yaml" for person in people],
        geometry_quality=tables,
        equations=[
            write_json(
                folder / "equations" / name / "header.json",
                {"formulation": name, "expression_hash": "c" * 64},
            ).parent
            for name in FORMULATIONS
        ],
        benchmarks=[write_json(folder / "benchmarks/solve_tracking/par2_frontal.jsonl", job)],
        sources=[source],
        config=yaml.safe_load((REPOSITORY / "config/config.yaml").read_text(encoding="utf-8")),
    )
