"""The error of the mesh: solutions on halved steps, and solutions integrated again.

On three muscles, for speed. With all 126, the sagittal elevation of par2 tracked at 0.02 s differs
from that at 0.04 s by at most 0.13 deg in any joint, 0.03 deg root mean square.
"""

from dataclasses import replace

import numpy as np
import pytest
from reintegration import reintegrated
from small_posed import small_posed, small_settings, small_target

from scapulohumeral.problems.posed_problem import read_result, solve_posed

pytestmark = pytest.mark.unit

DURATION_S = 0.64
# From 0.04 to 0.02 s, root mean square of the coordinates; it is 1.3e-3.
LARGEST_CHANGE = 3e-3


def solution(equations, step: float):
    """The slow elevation solved on a mesh."""
    nodes = round(DURATION_S / step) + 1
    settings = small_settings(step)
    posed = small_posed(equations, small_target(nodes, step), settings)
    result = solve_posed(posed, posed.cold_start(), settings, None)
    assert result.optimal
    return read_result(posed, result, {}), posed


@pytest.fixture(scope="module")
def halved(quaternion_equations):
    """Solutions at steps of 0.08, 0.04 and 0.02 s."""
    return [solution(quaternion_equations, step) for step in (0.08, 0.04, 0.02)]


def test_motion_on_halved_meshes_converges(halved) -> None:
    """The midpoint rule is of second order, a quarter for each halving; a half is allowed."""
    coarse, middle, fine = (found.q for found, _ in halved)
    first, second = root_mean_square(coarse - middle[::2]), root_mean_square(middle - fine[::2])
    print(f"0.08 to 0.04 s: {first:.1e}; 0.04 to 0.02 s: {second:.1e}")
    assert second < 0.5 * first
    assert second < LARGEST_CHANGE


def test_integrating_again_misses_less_on_a_finer_mesh(halved) -> None:
    """The error of one interval is of third order, an eighth for each halving."""
    drifts = [reintegrated(f, posed.model.forces, posed.parameters) for f, posed in halved]
    missed = [root_mean_square(drift.q) for drift in drifts]
    print("missed per interval:", missed)
    assert missed[2] < 0.5 * missed[1] < 0.25 * missed[0]
    assert all(np.abs(drift.norm).max() < 1e-8 for drift in drifts)


def test_a_solution_of_other_forces_is_seen(halved) -> None:
    """Muscles without force and the same states satisfy no equation of motion."""
    found, posed = halved[1]
    spoilt = replace(found, muscle_force_N=0.0 * found.muscle_force_N)
    speeds = [
        root_mean_square(reintegrated(one, posed.model.forces, posed.parameters).u)
        for one in (found, spoilt)
    ]
    print("missed speed:", speeds)
    assert speeds[1] > 5.0 * speeds[0]


def root_mean_square(values: np.ndarray) -> float:
    """Over everything."""
    return float(np.sqrt(np.mean(values**2)))
