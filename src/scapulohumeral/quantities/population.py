"""How healthy scapulae move: means and spread across published studies, to compare with.

Summary statistics across in vivo studies of upright subjects in the dataset Spartacus (Moissenet,
Puchaud, Naaïm, Holzer, Begon 2024, doi:10.5281/zenodo.11455521), from its curves of arm raising in
frames of the International Society of Biomechanics (scapula: inferior angle, root of the spine,
acromial angle; thorax as recommended or close to it). Mean and standard deviation are across
studies, each of which counts once.

Letters: N nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CITATION = (
    "Spartacus dataset (Moissenet, Puchaud, Naaïm, Holzer, Begon 2024, "
    "doi:10.5281/zenodo.11455521), mean ± one standard deviation across in vivo studies in "
    "frames close to those used here"
)
# Thoracohumeral elevations of the statistics [deg].
ELEVATION_DEG = (30.0, 60.0, 90.0, 120.0)
# Column of `thorax_angles`: by plane, mean and standard deviation at each elevation [deg].
INTERNAL_ROTATION, UPWARD_ROTATION, POSTERIOR_TILT = 3, 4, 5
_ROTATIONS: dict[int, dict[str, tuple[tuple[float, float], ...]]] = {
    INTERNAL_ROTATION: {
        "frontal": ((21.6, 7.1), (20.6, 8.7), (20.5, 9.9), (16.8, 9.1)),
        "scapular": ((24.0, 4.7), (23.7, 4.2), (23.2, 4.5), (20.8, 6.4)),
        "sagittal": ((31.3, 6.5), (33.2, 7.3), (33.9, 8.1), (29.3, 5.0)),
    },
    UPWARD_ROTATION: {
        "frontal": ((12.1, 3.2), (22.2, 3.5), (31.8, 4.3), (38.8, 3.8)),
        "scapular": ((8.2, 0.8), (17.3, 2.4), (26.3, 3.3), (36.4, 4.1)),
        "sagittal": ((12.2, 4.6), (20.8, 5.3), (29.5, 5.6), (36.4, 4.0)),
    },
    POSTERIOR_TILT: {
        "frontal": ((-4.4, 9.4), (-0.4, 11.0), (3.1, 12.3), (11.8, 11.8)),
        "scapular": ((-4.7, 7.6), (-0.5, 7.6), (4.0, 8.4), (10.1, 10.3)),
        "sagittal": ((-4.5, 7.7), (0.5, 7.9), (5.5, 8.9), (14.9, 7.1)),
    },
}
# Rhythm from thoracohumeral elevation by plane and phase: mean, standard deviation, studies.
RHYTHM = {
    "frontal": {
        "start-30": (2.15, 0.15, 2), "30-60": (1.97, 0.18, 5), "60-90": (2.30, 0.91, 5),
        "start-90": (2.10, 0.42, 5),
    },
    "scapular": {
        "start-30": (2.09, 0.64, 3), "30-60": (2.32, 0.63, 8), "60-90": (2.43, 0.63, 8),
        "start-90": (2.44, 0.63, 8),
    },
    "sagittal": {
        "start-30": (2.01, 1.04, 3), "30-60": (2.56, 0.47, 5), "60-90": (2.49, 0.48, 5),
        "start-90": (2.45, 0.50, 5),
    },
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Band:
    """Healthy range of an angle: ends (N,) [deg], not a number where the statistics end."""

    low: np.ndarray
    high: np.ndarray


def healthy_band(plane: str, column: int, elevation_deg: np.ndarray) -> Band | None:
    """Mean ± one standard deviation across studies; None for planes and angles without statistics.

    Parameters
    ----------
    plane : name of the elevation
    column : of :func:`segment_angles.thorax_angles`
    elevation_deg : (N,) thoracohumeral elevations, between which is interpolated linearly
    """
    if column not in _ROTATIONS or plane not in _ROTATIONS[column]:
        return None
    mean, sd = (
        np.interp(elevation_deg, ELEVATION_DEG, values, left=np.nan, right=np.nan)
        for values in zip(*_ROTATIONS[column][plane], strict=True)
    )
    return Band(mean - sd, mean + sd)
