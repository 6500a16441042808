"""Muscle lengths as functions of the coordinates of one formulation, and how good they are.

Letters: P sampled poses, M muscles, F recorded frames, K = 10 rotations behind the speeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.dynamics.compiled import CompiledDynamics
from scapulohumeral.dynamics.formulation import get_formulation
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.muscle_paths.authors_fit import fit_paths
from scapulohumeral.model.muscle_paths.fit import (
    FitSamples,
    FitSettings,
    MuscleFit,
    fit_geometry,
)
from scapulohumeral.model.muscle_paths.geometry import crossed_joints, is_straight
from scapulohumeral.model.participant import participant_of
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.model.rotations import (
    JOINT_SEQUENCES,
    Array,
    euler_rate_jacobian,
    positive_pose,
    trial_to_pose,
)

# Beyond these normalised fibre lengths the force-length curve gives hardly any active force.
FIBRE_LENGTH_RANGE = (0.4, 1.8)
PATHS = {True: "straight", False: "polynomial"}
MM = 1e3


@dataclass(frozen=True, eq=False)
class SampledGeometry:
    """Samples in the coordinates of one formulation: `fit` to fit to, `held_out` to judge by.

    `held_out_q` are the generalised coordinates (P, Nq) of the latter.
    """

    fit: FitSamples
    held_out: FitSamples
    held_out_q: Array


def fit_muscle_geometry(
    samples: Path, model: Path, formulation: str, settings: FitSettings
) -> MuscleFit:
    """Muscle geometry of a participant in the coordinates of a formulation.

    Parameters
    ----------
    samples : Path                   what rule sample_muscle_geometry wrote for this formulation
    model : Path                     model record, "model/1"
    formulation : str                "quaternion" or "euler"
    settings : FitSettings           the study's own; the authors' paths have theirs
    """
    record, fitted = read_record(model), read_samples(samples, formulation).fit
    if record.choices.paths == "published":
        return fit_paths(record, fitted)
    return fit_geometry(record, fitted, settings)


def read_samples(path: Path, formulation: str) -> SampledGeometry:
    """Sampled geometry in the coordinates of a formulation."""
    with np.load(path, allow_pickle=False) as data:
        held_out = data["held_out"]
        angles = data["angles"]
        rotation_gradient = data["rotation_gradient_m"]
        sampled = {name: data[name] for name in ("length_m", "gh_translation", "smooth")}
    q = coordinates(angles, formulation)
    variables = list(get_formulation(formulation).polynomial_variables)
    if formulation == "euler":
        gradient = euler_gradient(rotation_gradient, angles)
        rate_map = np.tile(np.eye(10), (len(q), 1, 1))
    else:
        gradient = rotation_gradient
        rate_map = quaternion_rate_map(q)[:, variables]
    fit_part, held_out_part = (
        FitSamples(
            variables=q[rows][:, variables],
            length=sampled["length_m"][rows],
            length_gradient=gradient[rows],
            rate_map=rate_map[rows],
            translation=sampled["gh_translation"][rows],
            smooth=sampled["smooth"][rows],
        )
        for rows in (~held_out, held_out)
    )
    return SampledGeometry(fit_part, held_out_part, q[held_out])


def coordinates(angles: Array, formulation: str) -> Array:
    """Generalised coordinates (P, Nq) of joint angles (P, 10) [rad]; quaternions have q0 >= 0."""
    if formulation == "euler":
        return angles
    return positive_pose(trial_to_pose(angles))


def quaternion_rate_map(q: Array) -> Array:
    """T(q) of the quaternion formulation, dq/dt = T(q) u, shape (P, 13, 10) for q (P, 13)."""
    constant, linear = get_formulation("quaternion").kinematic_tensor()
    return constant + np.einsum("ijk,pk->pij", linear, q)


def euler_gradient(gradient: Array, angles: Array) -> Array:
    """Length gradients by joint angle instead of by rotation about the child's axes.

    A rotation vector of a joint changes by J d(angles), so dL/d(angles) = J^T dL/d(rotation).

    Parameters
    ----------
    gradient : array, shape (P, M, 10)   [m/rad], SC xyz, AC xyz, GH xyz, EL
    angles : array, shape (P, 10)        [rad]

    Returns
    -------
    array, shape (P, M, 10)              [m/rad], in the order of ``rotations.ANGLE_NAMES``
    """
    result = gradient.copy()
    for start, sequence in zip((0, 3, 6), JOINT_SEQUENCES.values(), strict=True):
        columns = slice(start, start + 3)
        jacobian = euler_rate_jacobian(angles[:, columns], sequence)
        result[:, :, columns] = np.einsum("pmi,pij->pmj", gradient[:, :, columns], jacobian)
    return result


def assess_muscle_geometry(
    fit: MuscleFit,
    samples: Path,
    model: Path,
    participant: Path,
    dynamics: CompiledDynamics,
) -> pd.DataFrame:
    """How well lengths, moment arms and directions of pull are met on held-out poses.

    Numbers come from the functions that the solver evaluates. Moment arms are per joint rotation
    behind a speed of the formulation; for Euler angles per angle. Fibres are those along all
    recordings of the participant, whose participant.yaml is given.

    Returns
    -------
    table, one row per muscle
        path, joints, terms; condition [1]; left_out_fit (poses away from the
        branch that is fitted), left_out_held_out (poses where wrapping jumps, and lengths have no
        derivative); length_rmse_mm, length_max_mm; arm_rmse_median_mm, arm_rmse_worst_mm over the
        spanned rotations; direction_rmse [1]; fibre_min, fibre_max, normalised over the recorded
        motions [1]; fibre_outside (beyond FIBRE_LENGTH_RANGE)
    """
    record = read_record(model)
    geometry, sampled = fit.geometry, read_samples(samples, dynamics.name)
    held_out, forces = sampled.held_out, MuscleForces(dynamics, geometry)
    length, _ = forces.lengths(sampled.held_out_q, np.zeros((len(sampled.held_out_q), 10)))
    gradient = forces.gradients(sampled.held_out_q)
    # Only samples say what is left out: a pose is no jump because the functions miss it.
    keep = held_out.smooth
    misfit = errors_where(keep, np.abs(length - held_out.length))
    arms = errors_where(keep[..., None], gradient[..., :10] - held_out.length_gradient)
    spanned = np.abs(held_out.length_gradient).max(axis=0) > 0.0
    arm_rmse = np.where(spanned, np.sqrt(np.nanmean(arms**2, axis=0)), np.nan)
    pull = errors_where(keep[..., None], gradient[..., 10:] - held_out.translation)
    fibre = fibre_lengths(forces, record, participant_of(participant).recordings)
    lowest, highest = fibre.min(axis=0), fibre.max(axis=0)
    return pd.DataFrame(
        {
            "muscle": geometry.names,
            "path": [PATHS[is_straight(muscle)] for muscle in record.muscles],
            "joints": [" ".join(crossed_joints(muscle)) for muscle in record.muscles],
            "terms": np.count_nonzero(geometry.length, axis=1),
            "condition": fit.condition,
            "left_out_fit": fit.left_out,
            "left_out_held_out": np.count_nonzero(~keep, axis=0),
            "length_rmse_mm": MM * np.sqrt(np.nanmean(misfit**2, axis=0)),
            "length_max_mm": MM * np.nanmax(misfit, axis=0),
            "arm_rmse_median_mm": MM * np.nanmedian(arm_rmse, axis=1),
            "arm_rmse_worst_mm": MM * np.nanmax(arm_rmse, axis=1),
            "direction_rmse": np.sqrt(np.nanmean(np.sum(pull**2, axis=2), axis=0)),
            "fibre_min": lowest,
            "fibre_max": highest,
            "fibre_outside": ~(
                (lowest >= FIBRE_LENGTH_RANGE[0]) & (highest <= FIBRE_LENGTH_RANGE[1])
            ),
        }
    )


def errors_where(keep: Array, error: Array) -> Array:
    """Errors of what is kept, NaN elsewhere; no limit holds where the functions tell no number."""
    return np.where(keep, np.where(np.isfinite(error), error, np.inf), np.nan)


def fibre_lengths(forces: MuscleForces, record: ModelRecord, recorded: Sequence[Motion]) -> Array:
    """Normalised fibre lengths (F, M) [1] over all recorded frames, tendons rigid."""
    angles = np.concatenate([motion.angles_rad for motion in recorded])
    q = coordinates(angles, forces.dynamics.name)
    length, _ = forces.lengths(q, np.zeros((len(q), 10)))
    muscles = muscle_parameters(record)
    return (length - muscles.tendon_slack_length) / muscles.optimal_fibre_length
