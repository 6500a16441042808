"""Numbers printed in the paper, to compare with.

Zoufaly, Chadwick, Blana, Daniel 2026, arXiv 2604.01124.
"""

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
