"""Sections and keys of the study, ``config/config.yaml``.

Every key is required but those with a default here: the file is the one place of their values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from scapulohumeral.configuration.fields import (
    Angles,
    ConditionName,
    Factors,
    FolderName,
    Once,
    Real,
    Section,
    Seed,
    Share,
    TrialName,
    Whole,
    key,
)
from scapulohumeral.model.choices import (
    Fibres,
    GirdleStops,
    Glenohumeral,
    Masses,
    Paths,
    SerratusPath,
)

Conditions = Annotated[list[ConditionName], Once]


@dataclass(frozen=True)
class Model(Section):
    """The OpenSim model of every participant."""

    masses: Annotated[Masses, key("Source of the segment masses [no unit].")]
    serratus_path: Annotated[
        SerratusPath, key("Surface under serratus anterior and what follows it [no unit].")
    ]
    paths: Annotated[Paths, key("Paths of the other muscles [no unit].")]
    fibres: Annotated[Fibres, key("Rule or table of the optimal fibre lengths [no unit].")]
    girdle_stops: Annotated[
        GirdleStops, key("Where the stops of clavicle and scapula are [no unit].")
    ]
    glenohumeral: Annotated[
        Glenohumeral, key("What resists a turn of the humerus in the glenoid [no unit].")
    ]


@dataclass(frozen=True)
class Geometry(Section):
    """Sampling of the muscle lengths and their fit by smooth functions."""

    poses: Annotated[Whole, key("Number of random poses to fit to [1].", ge=100, le=20000)]
    held_out_poses: Annotated[
        Whole, key("Number of further poses to judge the fit on [1].", ge=50, le=20000)
    ]
    margin_deg: Annotated[
        Real, key("How far the sampled poses reach beyond the recorded motion [deg].", ge=0, le=60)
    ]
    scapula_turn_deg: Annotated[
        Angles, key("Lowest and highest turn of the scapula under the recorded arm [deg].")
    ]
    girdle_turn_deg: Annotated[
        Real, key("Largest turn of clavicle and scapula under the recorded arm [deg].", ge=0, le=60)
    ]
    clearance: Annotated[
        Share, key("Least level-set value of attachments in the ellipsoids of the thorax [1].")
    ]
    seed: Annotated[Seed, key("Seed of the random poses [1].")]
    length_target_m: Annotated[
        Real,
        key("Root mean square error of a length that is good enough [m].", ge=1.0e-6, le=1.0e-2),
    ]
    arm_target_m: Annotated[
        Real,
        key(
            "Root mean square error of a moment arm that is good enough [m].", ge=1.0e-6, le=1.0e-2
        ),
    ]
    rmse_change_stop: Annotated[
        Real,
        key(
            "Relative fall of the root mean square error, by ten terms together, below which no "
            "more terms are added [1].",
            gt=0,
            le=0.5,
        ),
    ]


@dataclass(frozen=True)
class Solve(Section):
    """Discretisation and solver."""

    time_step_s: Annotated[Real, key("Length of one mesh interval [s].", ge=0.005, le=0.2)]
    tolerance: Annotated[
        Real,
        key("Largest scaled optimality error at which IPOPT stops [1].", ge=1.0e-10, le=1.0e-2),
    ]
    max_iterations: Annotated[
        Whole,
        key(
            "Iterations of the last phase of a solve, after which it counts as failed [1].",
            ge=1,
            le=20000,
        ),
    ]
    hessian: Annotated[
        Literal["automatic", "exact", "gauss-newton", "limited-memory"],
        key("Kind of the second derivatives given to IPOPT [no unit]."),
    ]


@dataclass(frozen=True)
class CommonWeights(Section):
    """Weights of the terms that every objective has."""

    trajectory_quaternion: Annotated[
        Real,
        key("Squared orientation error, vector part of the quaternion [1/s].", ge=0, le=1.0e5),
    ]
    clavicle_point_m: Annotated[
        Real,
        key("Distance from the sternum of the tracked point on the clavicle axis [m].", gt=0, le=1),
    ]
    activation: Annotated[Real, key("Squared activations [1/s].", ge=0, le=1.0e4)]
    regularisation: Annotated[
        Real,
        key("Squared rates of generalised speeds [s^3/rad^2].", ge=0, le=100),
    ]
    reaction_rate: Annotated[
        Real, key("Squared rates of the glenohumeral reaction [s/N^2].", gt=0, le=1.0e-2)
    ]
    excitation_rate: Annotated[Real, key("Squared rates of the excitations [s].", ge=0, le=100)]
    quaternion_norm: Annotated[
        Real,
        key("Squared deviation of the squared quaternion norm from one [1/s].", ge=0, le=1.0e6),
    ]


@dataclass(frozen=True)
class TrackingWeights(CommonWeights):
    """Tracking of a recorded motion."""

    trajectory_euler: Annotated[
        Real, key("Squared error of the Euler angles [1/(rad^2 s)].", ge=0, le=1.0e5)
    ]


@dataclass(frozen=True)
class CalibrationWeights(CommonWeights):
    """Calibration of muscle parameters, and validation on daily tasks."""

    stability: Annotated[
        Real, key("Squared shear over compression at the glenoid [1/s].", ge=0, le=1.0e4)
    ]
    emg: Annotated[Real, key("Squared distance of excitations from EMG [1/s].", ge=0, le=1.0e4)]
    parameters: Annotated[Real, key("Squared distance of scalers from one [1].", ge=0, le=1.0e4)]


@dataclass(frozen=True)
class PredictionWeights(CommonWeights):
    """Prediction of scapula and clavicle."""

    strength_exponent: Annotated[
        Real, key("Power of an element's strength in its squared activation [1].", ge=0, le=1)
    ]


@dataclass(frozen=True)
class Weights(Section):
    """Weights of the terms of the objective, by problem."""

    tracking: Annotated[TrackingWeights, key("Tracking of a recorded motion.")]
    calibration: Annotated[
        CalibrationWeights, key("Calibration of muscle parameters, and validation on daily tasks.")
    ]
    prediction: Annotated[PredictionWeights, key("Prediction of scapula and clavicle.")]


@dataclass(frozen=True)
class Composite(Section):
    """The three elevations in one motion."""

    pause_s: Annotated[Real, key("Pause between two elevations [s].", ge=0.2, le=10)]


@dataclass(frozen=True)
class Identifiable(Section):
    """Largest half width of the 90 % interval of an identifiable scaler, by kind."""

    force: Annotated[Real, key("Of maximum isometric force [1].", gt=0, le=1)]
    fibre: Annotated[Real, key("Of optimal fibre length [1].", gt=0, le=1)]


@dataclass(frozen=True)
class Refinement(Section):
    """Gauss-Newton on the scalers after the paper's problem."""

    barrier_target: Annotated[
        Real, key("Barrier parameter that smooths activation bounds [1].", ge=0, le=1.0e-3)
    ]
    model_sd: Annotated[
        Real, key("What the model cannot say about an excitation [fraction of MVC].", gt=0, le=1)
    ]
    prior_sd_force: Annotated[
        Real, key("Standard deviation of force scalers about one [1].", gt=0, le=1)
    ]
    prior_sd_fibre: Annotated[
        Real, key("Standard deviation of fibre length scalers about one [1].", gt=0, le=1)
    ]
    prior_sd_time: Annotated[
        Real, key("Standard deviation of the factors on activation times [1].", gt=0, le=1)
    ]
    largest_step: Annotated[
        Real, key("Largest change of a scaler in one iteration [1].", gt=0, le=1)
    ]
    smallest_step: Annotated[
        Real, key("Change below which the scalers have converged [1].", gt=0, le=0.1)
    ]
    iterations: Annotated[Whole, key("Iterations at most [1].", ge=1, le=50)]


@dataclass(frozen=True)
class Calibration(Section):
    """Strength and fibre length of muscle groups from EMG."""

    force_bounds: Annotated[Factors, key("Bounds of the scalers of maximum isometric force [1].")]
    fibre_bounds: Annotated[Factors, key("Bounds of the scalers of optimal fibre length [1].")]
    identifiable: Annotated[
        Identifiable,
        key("Largest half width of the 90 % interval of an identifiable scaler, by kind."),
    ]
    refinement: Annotated[Refinement, key("Gauss-Newton on the scalers after the paper's problem.")]


@dataclass(frozen=True)
class Validation(Section):
    """Daily tasks that no calibration sees."""

    tasks: Annotated[
        list[TrialName], key("Names of trials; none leaves the validation out [no unit]."), Once
    ]


@dataclass(frozen=True)
class Condition(Section):
    """One shoulder that can be predicted."""

    parameters: Annotated[Literal["generic", "calibrated"], key("Muscle parameters [no unit].")]
    w_gh: Annotated[Real, key("Weight of joint stability [1/s].", ge=0, le=1.0e4)]
    muscles: Annotated[
        list[Annotated[str, key("Muscle group of the model.", min_length=1)]],
        key("Muscles with limited capacity [no unit]."),
        Once,
    ]
    capacity: Annotated[Share, key("Share of the healthy active force [1].")]
    start: Annotated[
        ConditionName,
        key("tracking, direct, or the condition that the solution is reached from [no unit]."),
    ]
    girdle_stiffness_Nm_per_rad: Annotated[
        Real | None,
        key(
            "Passive stiffness of SC and AC joint, default that of the model [N m/rad].",
            ge=0,
            le=1000,
        ),
    ] = None


@dataclass(frozen=True)
class Prediction(Section):
    """Prediction of scapula and clavicle from the motion of the humerus."""

    predict: Annotated[
        Conditions, key("Conditions to predict for every participant, of those below [no unit].")
    ]
    predict_also: Annotated[
        dict[FolderName, Conditions], key("Further conditions by participant [no unit].")
    ]
    tasks: Annotated[
        list[TrialName],
        key("Daily tasks whose arm the healthy shoulder follows [no unit]."),
        Once,
    ]
    task_time_step_s: Annotated[
        Real, key("Length of one mesh interval of a predicted daily task [s].", ge=0.005, le=0.2)
    ]
    generic_muscles: Annotated[
        list[FolderName],
        key("Participants predicted with generic muscles, whatever conditions say [no unit]."),
        Once,
    ]
    scaler_spread: Annotated[
        Conditions, key("Conditions with a spread from that of the scalers [no unit].")
    ]
    max_iterations: Annotated[
        Whole,
        key("As in section solve, of solves on the way to a prediction [1].", ge=1, le=20000),
    ]
    audit_every: Annotated[
        Whole,
        key("Every so manyth node of a prediction is audited against OpenSim [1].", ge=1, le=1000),
    ]
    guidance: Annotated[
        list[Share], key("Shares of the tracking weight on the way from tracking to zero [1].")
    ]
    capacity_steps: Annotated[
        list[Share], key("Capacities on the way from the healthy to a limited shoulder [1].")
    ]
    conditions: Annotated[
        dict[ConditionName, Condition],
        key("Shoulders that can be predicted, by name [no unit].", min_length=1),
    ]


@dataclass(frozen=True)
class VariantChoices(Section):
    """Choices of one variant."""

    model: Annotated[dict[str, str], key("Keys of section model with other words [no unit].")]
    problem: Annotated[
        dict[str, Any], key("Choices of the optimal control problem, each in its own unit [any].")
    ]


@dataclass(frozen=True)
class Ladder(Section):
    """Rungs between a variant and the study."""

    start: Annotated[str, key("Variant that the ladder starts from [no unit].")]
    max_iterations: Annotated[
        Whole,
        key("As in prediction, of solves from another variant [1].", ge=1, le=20000),
    ]
    participant: Annotated[FolderName, key("Participant of every rung [no unit].")]
    conditions: Annotated[Conditions, key("Conditions of every rung [no unit].")]
    alone: Annotated[
        list[ConditionName], key("Steps that are also taken back alone [no unit]."), Once
    ]
    steps: Annotated[
        dict[ConditionName, list[str]],
        key("Choices that each step takes back, in order [no unit]."),
    ]


@dataclass(frozen=True)
class Tried(Section):
    """Variants beside the study's own model that were tried against the recordings."""

    participants: Annotated[list[FolderName], key("Whose recordings [no unit]."), Once]
    condition: Annotated[ConditionName, key("Condition of every variant [no unit].")]
    variants: Annotated[list[ConditionName], key("Names of variants [no unit]."), Once]


@dataclass(frozen=True)
class Held(Section):
    """What it costs a prediction to hold its girdle to a motion."""

    condition: Annotated[ConditionName, key("Condition that is held [no unit].")]
    shares: Annotated[
        list[Share], key("Shares of the tracking weight that hold the girdle, firmest first [1].")
    ]
    variants: Annotated[
        dict[ConditionName, list[FolderName]],
        key("Participants by variant [no unit]."),
    ]


@dataclass(frozen=True)
class Variants(Section):
    """Variants of model and problem beside the study's own."""

    named: Annotated[
        dict[ConditionName, VariantChoices],
        key("Choices that differ from the study's own, by name of the variant [no unit]."),
    ]
    predict: Annotated[
        dict[ConditionName, dict[FolderName, Conditions]],
        key("Conditions to predict by variant and participant [no unit]."),
    ]
    ladder: Annotated[Ladder, key("Rungs between a variant and the study.")]
    tried: Annotated[Tried, key("Variants against the recordings of all participants.")]
    held: Annotated[Held, key("Predictions whose girdle is held to a motion.")]


@dataclass(frozen=True)
class Envelope(Section):
    """From raw signals to envelopes."""

    band_low_hz: Annotated[Real, key("Lower half-power edge of the band-pass [Hz].", ge=1, lt=100)]
    band_high_hz: Annotated[
        Real, key("Upper half-power edge of the band-pass [Hz].", ge=100, le=1000)
    ]
    cutoff_hz: Annotated[
        Real, key("Half-power edge of the low-pass after rectification [Hz].", ge=0.5, le=10)
    ]
    rate_hz: Annotated[Real, key("Sampling rate of the envelope [Hz].", ge=20, le=1000)]
    mvc_window_s: Annotated[
        Real,
        key("Time over which the envelope of a maximal contraction is averaged [s].", ge=0, le=10),
    ]


@dataclass(frozen=True)
class Quality(Section):
    """What a recording has to pass."""

    clipped_share: Annotated[Share, key("Largest share of samples at the extreme values [1].")]
    hum_share: Annotated[Share, key("Largest share of the power that 50 or 60 Hz add [1].")]
    dead_rms_v: Annotated[
        Real, key("Least root mean square of the band-passed signal [V].", ge=0, le=1.0e-3)
    ]
    largest_envelope: Annotated[
        Real, key("Largest envelope of a trial [fraction of MVC].", gt=0, le=10)
    ]


@dataclass(frozen=True)
class Simulation(Section):
    """Electrodes of participants without measured EMG."""

    rate_hz: Annotated[Real, key("Sampling rate [Hz].", ge=1200, le=20000)]
    full_rms_v: Annotated[Real, key("Root mean square at full excitation [V].", gt=0, le=1.0e-2)]
    electrode_noise_v: Annotated[
        Real,
        key("Root mean square of the noise of electrode and amplifier [V].", ge=0, le=1.0e-3),
    ]
    cross_talk: Annotated[
        Real,
        key(
            "Share of a neighbouring channel's amplitude that an electrode sees [1].", ge=0, le=0.5
        ),
    ]
    mvc_hold_s: Annotated[Real, key("How long a maximal contraction is held [s].", ge=1, le=20)]
    seed: Annotated[Seed, key("Seed of the noise [1].")]


@dataclass(frozen=True)
class Emg(Section):
    """Electromyography (EMG)."""

    envelope: Annotated[Envelope, key("From raw signals to envelopes.")]
    quality: Annotated[Quality, key("What a recording has to pass.")]
    simulation: Annotated[Simulation, key("Electrodes of participants without measured EMG.")]


@dataclass(frozen=True)
class StudyConfig(Section):
    """Configuration of the study; units stand in brackets."""

    report: Annotated[
        str,
        key(
            "Name of the report file in reports/, without ending [no unit].", pattern="^[a-z0-9_]+$"
        ),
    ]
    participants_folder: Annotated[
        str,
        key("Folder of all participants, from the repository or absolute [no unit].", min_length=1),
    ]
    participants: Annotated[
        list[FolderName],
        key("Folders of participants_folder to simulate [no unit].", min_length=1),
        Once,
    ]
    planes: Annotated[
        list[TrialName],
        key("Trials to track, one recorded arm elevation per plane [no unit].", min_length=1),
        Once,
    ]
    formulations: Annotated[
        list[Literal["quaternion", "euler"]],
        key("Coordinates of the spherical joints [no unit].", min_length=1),
        Once,
    ]
    model: Annotated[Model, key("The OpenSim model of every participant.")]
    geometry: Annotated[
        Geometry, key("Sampling of the muscle lengths and their fit by smooth functions.")
    ]
    solve: Annotated[Solve, key("Discretisation and solver.")]
    weights: Annotated[Weights, key("Weights of the terms of the objective, by problem.")]
    composite: Annotated[Composite, key("The three elevations in one motion.")]
    calibration: Annotated[Calibration, key("Strength and fibre length of muscle groups from EMG.")]
    validation: Annotated[Validation, key("Daily tasks that no calibration sees.")]
    prediction: Annotated[
        Prediction, key("Prediction of scapula and clavicle from the motion of the humerus.")
    ]
    variants: Annotated[Variants, key("Variants of model and problem beside the study's own.")]
    emg: Annotated[Emg, key("Electromyography (EMG).")]
    diagnose: Annotated[
        list[FolderName],
        key("Participants whose recorded elevations are diagnosed for the report [no unit]."),
        Once,
    ]
    recordings: Annotated[
        str,
        key("Folder of the recordings of gap/real_cases.yaml, or none [no unit].", min_length=1),
    ]
