"""Numbers printed in the paper, to compare with.

Zoufaly, Chadwick, Blana, Daniel 2026, arXiv 2604.01124.
"""

from scapulohumeral.model.published_arm import NODE_S, PUBLISHED_PLANES

# Root mean square errors of tracking [deg] over three participants and three planes, by
# formulation (section on results, quaternions against Euler angles).
TRACKING_RMSE_DEG = {
    "rmse_clavicle_deg": {"euler": 1.90, "quaternion": 2.79},
    "rmse_thoracoscapular_deg": {"euler": 2.72, "quaternion": 3.67},
    "rmse_thoracohumeral_deg": {"euler": 0.61, "quaternion": 4.26},
}

# Case and muscle elements of the figure on gimbal lock.
GIMBAL_CASE = ("par2", "frontal")
GIMBAL_MUSCLES = ("pect_maj_c_2", "delt_scap_6")

# Body mass of the participants [kg], mean and standard deviation (section on experimental data).
BODY_MASS_MEAN_KG = 83.0
BODY_MASS_SD_KG = 12.8

# Muscle elements without active force in the cuff-limited shoulder, by group of the model, and its
# headline weight of joint stability (section on the sensitivity to that weight).
CUFF_MUSCLES = frozenset({"supra", "infra"})
CUFF_STABILITY_WEIGHT = 10.0
# Participant of calibration, validation and prediction.
PREDICTED_PARTICIPANT = "par2"

# Scalers of maximum isometric force and optimal fibre length, by virtual muscle group (section on
# the adjustment of muscle parameters; only changes above 10 % are printed).
SCALERS = {
    "scapular_deltoid": {"force": 1.16, "fibre": 0.96},
    "clavicular_trapezius": {"force": 1.02, "fibre": 0.74},
    "serratus_anterior": {"force": 1.17, "fibre": 0.92},
}

# Root mean square of excitation minus EMG on daily tasks, before and after calibration [1].
VALIDATION_RMSE = {
    "lateral_deltoid": (0.126, 0.122),
    "posterior_deltoid": (0.075, 0.076),
    "clavicular_trapezius": (0.138, 0.055),
    "serratus_anterior": (0.255, 0.189),
}

# Rhythm by condition, plane and phase (table of phase-specific rhythm).
_PHASES = ("start-30", "30-60", "60-90", "start-90")
RHYTHM = {
    condition: {plane: dict(zip(_PHASES, row, strict=True)) for plane, row in planes.items()}
    for condition, planes in {
        "healthy": {
            "frontal": (2.96, 2.25, 1.10, 1.89),
            "scapular": (3.33, 1.60, 2.10, 2.10),
            "sagittal": (2.88, 2.05, 2.39, 2.29),
        },
        "rc_limited": {
            "frontal": (5.44, 2.77, 1.85, 2.89),
            "scapular": (4.88, 4.61, 2.28, 5.17),
            "sagittal": (5.93, 2.36, 1.55, 2.85),
        },
    }.items()
}

# Fall of peak upward rotation from the healthy to the cuff-limited shoulder [deg], at the headline
# weight; at the healthy weight the paper gives a range over the planes.
UPWARD_ROTATION_FALL_DEG = {"frontal": 10.0, "scapular": 18.0, "sagittal": 12.0}
UPWARD_ROTATION_FALL_AT_HEALTHY_WEIGHT_DEG = (8.0, 15.0)

# Peak glenohumeral force of the healthy prediction [% of body weight], and what the paper compares
# it with: mean, standard deviation and number of implants in the Orthoload database.
PEAK_FORCE_BW = {"frontal": 107.5, "sagittal": 85.5}
# Body weight that the authors' figures divide by [N] (plot_results.m): 66 kg, not the mean mass.
BODY_WEIGHT_OF_FIGURES_N = 650.0
ORTHOLOAD_BW = {"frontal": (85.3, 26.4, 6), "sagittal": (71.0, 9.0, 3)}

# Range of the clavicle in predicted scapular-plane elevation [deg]: lowest and highest elevation,
# most and least retraction (discussion); the paper gives no least retraction of generic muscles.
CLAVICLE_RANGE_DEG: dict[str, dict[str, tuple[float, float | None]]] = {
    "calibrated": {"elevation": (5.0, 12.0), "retraction": (-32.0, -20.0)},
    "generic": {"elevation": (-8.0, 10.0), "retraction": (-45.0, None)},
}

# When the elevations of the published composite predictions begin and end [s].
COMPOSITE_ELEVATIONS_S = {
    plane: (NODE_S * first, NODE_S * (stop - 1))
    for plane, (first, stop) in PUBLISHED_PLANES.items()
}
