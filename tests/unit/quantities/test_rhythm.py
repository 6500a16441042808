"""Scapulohumeral rhythm of made-up motions whose rhythm is known."""

import numpy as np
import pytest
import synthetic_study

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
)
from scapulohumeral.quantities.rhythm import (
    PHASES,
    phase_rhythm,
    range_rhythm,
    rhythm_by_plane,
    rising_part,
)
from scapulohumeral.quantities.segment_angles import thorax_angles

pytestmark = pytest.mark.unit

CLAVICLE_DEG = (-20.0, 5.0, 10.0)


def motion(elevation_deg: np.ndarray, upward_deg: np.ndarray) -> np.ndarray:
    """Poses (N, 13) with given thoracohumeral elevation and scapular upward rotation."""
    count = len(elevation_deg)

    def turned(sequence, first, second, third) -> np.ndarray:
        angles = np.column_stack([np.full(count, first), second, np.full(count, third)])
        return euler_to_quaternion(np.deg2rad(angles), sequence)

    clavicle = euler_to_quaternion(np.deg2rad(np.tile(CLAVICLE_DEG, (count, 1))), "YZX")
    scapula = turned("YZX", 30.0, upward_deg, -10.0)
    humerus = turned("YZY", 40.0, elevation_deg, 20.0)
    return np.hstack(
        [
            clavicle,
            quaternion_multiply(quaternion_conjugate(clavicle), scapula),
            quaternion_multiply(quaternion_conjugate(scapula), humerus),
            np.full((count, 1), 0.3),
        ]
    )


def up_and_down(low: float, high: float, nodes: int) -> np.ndarray:
    """Elevation [deg] that rises smoothly and falls again."""
    return low + (high - low) * np.sin(np.linspace(0.0, np.pi, nodes)) ** 2


def test_angles_are_those_in_the_thorax() -> None:
    angles = thorax_angles(motion(np.array([5.0, 60.0]), np.array([-3.0, 25.0])))
    np.testing.assert_allclose(angles[:, :3], [CLAVICLE_DEG] * 2, atol=1e-9)
    np.testing.assert_allclose(angles[:, 3:6], [[30, -3, -10], [30, 25, -10]], atol=1e-9)
    np.testing.assert_allclose(angles[1, 6:9], [40, 60, 20], atol=1e-9)
    # Too low for the first and third angle of Y-Z-Y to mean anything.
    np.testing.assert_allclose(angles[0, 6:9], [np.nan, 5, np.nan], atol=1e-9)


def test_constant_ratio_is_found_in_every_phase_and_plane() -> None:
    first, second = up_and_down(12.0, 100.0, 81), up_and_down(9.0, 95.0, 60)
    pause = np.full(20, 12.0)
    elevation = np.concatenate([first, pause, second])
    # Rhythm 2: a third of the elevation comes from the scapula; rhythm 4 in the second motion.
    upward = np.concatenate([7.0 + first / 3, np.linspace(11.0, 3.0, 20), 4.0 + second / 5])
    nodes = {"frontal": (0, 81), "sagittal": (101, 161)}
    found = rhythm_by_plane(motion(elevation, upward), nodes)
    assert [(r.plane, r.phase) for r in found] == [(p, f) for p in nodes for f in PHASES]
    np.testing.assert_allclose([r.shr for r in found], [2.0] * 4 + [4.0] * 4, rtol=1e-6)
    np.testing.assert_allclose(found[3].from_deg, 12.0, atol=0.1)
    assert [r.to_deg for r in found[:4]] == [30.0, 60.0, 90.0, 90.0]
    assert not any(r.note for r in found)


def test_bounds_between_nodes_are_interpolated() -> None:
    start, low, middle, whole = phase_rhythm(
        np.array([20.0, 40, 80, 100]), np.array([0.0, 4, 12, 20])
    )
    # Upward rotation 2 at 30 deg, 8 at 60, 16 at 90.
    np.testing.assert_allclose([p.delta_ts_deg for p in (start, low, middle, whole)], [2, 6, 8, 16])
    np.testing.assert_allclose([p.shr for p in (start, low, middle, whole)], [4, 4, 2.75, 3.375])


def test_rhythm_does_not_depend_on_speed_offset_or_descent() -> None:
    s = np.linspace(0.0, 1.0, 400)
    elevation, upward = 10 + 88 * s, 5 + 20 * s + 10 * s**2
    slow = phase_rhythm(elevation, upward)
    fast = phase_rhythm(np.append(elevation[::3], [50.0, 10.0]), np.append(upward[::3] - 9, [0, 0]))
    np.testing.assert_allclose([p.shr for p in fast], [p.shr for p in slow], rtol=1e-3)


def test_waiting_before_the_rise_does_not_count() -> None:
    elevation = np.array([10.05, 10.0, 10.02, 10.0, 50.0, 95.0, 20.0])
    assert rising_part(elevation) == slice(3, 6)
    upward = np.array([30.0, 20.0, 10.0, 5.0, 15.0, 26.25, 0.0])
    assert phase_rhythm(elevation, upward)[3].shr == pytest.approx(3.0)


def test_low_peak_is_said() -> None:
    elevation = np.linspace(10.0, 72.0, 50)
    _, _, last, whole = phase_rhythm(elevation, elevation / 3)
    assert (last.to_deg, whole.to_deg) == (72.0, 72.0)
    assert last.note == whole.note == "ends at the peak of 72.0 deg"
    np.testing.assert_allclose([last.shr, whole.shr], 2.0)
    missed = phase_rhythm(elevation[:30], elevation[:30] / 3)[2]
    assert np.isnan(missed.shr)
    assert missed.note.startswith("not reached")


def test_high_start_is_said() -> None:
    elevation = np.linspace(35.0, 100.0, 50)
    first, second, _, _ = phase_rhythm(elevation, elevation / 3)
    assert np.isnan(first.shr)
    assert first.note.startswith("not reached")
    assert second.note == "begins with the motion at 35.0 deg"
    assert second.from_deg == 35.0


@pytest.mark.parametrize("slope", [0.0, -0.2, 0.01])
def test_scapula_that_does_not_follow_has_no_ratio(slope: float) -> None:
    elevation = np.linspace(10.0, 95.0, 50)
    for phase in phase_rhythm(elevation, slope * elevation)[:3]:
        assert np.isnan(phase.shr)
        assert phase.note.endswith("no ratio")


@pytest.mark.filterwarnings("error")
def test_scapula_that_stands_still_has_an_infinite_rhythm_by_the_estimator_of_the_paper() -> None:
    elevation = np.linspace(10.0, 95.0, 50)
    assert range_rhythm(elevation, np.zeros(50)) == dict.fromkeys(PHASES, np.inf)
    still = range_rhythm(np.full(3, 20.0), np.ones(3))
    assert np.isnan(list(still.values())).all()


def test_arm_that_does_not_rise_has_no_rhythm() -> None:
    assert all(p.note.startswith("not reached") for p in phase_rhythm(np.full(9, 20.0), np.ones(9)))


@pytest.mark.parametrize("limits", [(5, 5), (-1, 5), (0, 999)])
def test_wrong_ranges_are_refused(limits: tuple[int, int]) -> None:
    pose = synthetic_study.solution("par2", "frontal", "quaternion").pose
    with pytest.raises(DataError, match="plane frontal"):
        rhythm_by_plane(pose, {"frontal": limits})


def test_recorded_elevation_of_a_healthy_shoulder() -> None:
    """Upward rotation is positive and grows; the rhythm is one that people have."""
    solution = synthetic_study.solution("par2", "sagittal", "quaternion")
    whole = rhythm_by_plane(solution.reference_pose, {"sagittal": (0, len(solution.time_s))})[3]
    assert whole.delta_ts_deg > 10.0
    assert 1.0 < whole.shr < 4.0
