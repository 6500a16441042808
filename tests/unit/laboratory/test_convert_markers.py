"""Known joint angles, written as marker files of all kinds, come back."""

from dataclasses import replace
from pathlib import Path

import made_recordings as made
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scapulohumeral import cli
from scapulohumeral.emg.c3d_file import text_of
from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.checks import Limits
from scapulohumeral.laboratory.convert import Outcome, Settings, convert_markers, write_outcomes
from scapulohumeral.laboratory.girdle_rules import (
    REST_CLAVICLE_DEG,
    REST_SCAPULA_DEG,
    regressed_girdle,
)
from scapulohumeral.laboratory.joint_angles import elbow_flexion
from scapulohumeral.laboratory.markers.files import read_markers
from scapulohumeral.laboratory.markers.frames import scapula_frame
from scapulohumeral.laboratory.markers.gaps import fill_gaps
from scapulohumeral.laboratory.markers.glenohumeral import fit_centre, meskers_centre
from scapulohumeral.laboratory.markers.landmarks import calibrate, read_landmarks
from scapulohumeral.laboratory.markers.marker_map import read_marker_map
from scapulohumeral.laboratory.record import read_channels
from scapulohumeral.model.motion import read_motion

pytestmark = pytest.mark.unit
MODEL = made.tables()


def convert(
    folder: Path, points: dict[str, np.ndarray], suffix: str = ".c3d", text: str = "", **more: str
) -> Outcome:
    """Write markers, convert them, and return what became of them."""
    file = folder / f"trial{suffix}"
    made.WRITERS[suffix](file, made.marked(points), **more)
    calibration = calibrate(
        read_marker_map(made.write_map(folder / "map.yaml", text or made.MAP)), MODEL
    )
    [outcome] = convert_markers([file], calibration, Settings(MODEL, Limits()), lambda line: None)
    return outcome


def angles_of(outcome: Outcome) -> np.ndarray:
    """Joint angles [deg] of a conversion that worked."""
    assert outcome.converted is not None, outcome.refusal
    return np.rad2deg(outcome.converted.angles_rad)


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
@pytest.mark.parametrize("unit", ["mm", "m"])
def test_joint_angles_come_back(tmp_path: Path, suffix: str, unit: str) -> None:
    angles = made.arm_angles()
    outcome = convert(tmp_path, made.landmarks(angles, MODEL), suffix, unit=unit)
    assert not outcome.findings
    error = angles_of(outcome) - np.rad2deg(angles)
    # Single precision of C3D, and rounding of the texts, over levers of centimetres.
    assert np.abs(error[:, :9]).max() < 0.02
    # The hinge of the elbow and the midpoint of the epicondyles part by 8 mm.
    assert np.abs(error[:, 9]).max() < 0.05


def test_times_rounded_to_milliseconds_are_read_as_uniform_ones(tmp_path: Path) -> None:
    file = tmp_path / "trial.trc"
    made.write_trc(file, made.marked(made.landmarks(made.arm_angles(), MODEL)))
    head, body = file.read_text().splitlines()[:5], file.read_text().splitlines()[5:]
    head[2] = head[2].replace("100.0", "120.00")
    rows = [row.split("\t") for row in body]
    rows = ["\t".join([row[0], f"{k / 120.0:.3f}", *row[2:]]) for k, row in enumerate(rows)]
    file.write_text("\n".join([*head, *rows]) + "\n")
    markers = read_markers(file)
    assert markers.rate_hz == pytest.approx(120.0, rel=1e-4)
    assert np.diff(markers.time_s) == pytest.approx(1.0 / 120.0, rel=1e-4)


def test_text_in_a_cell_of_a_marker_is_refused_with_its_column(tmp_path: Path) -> None:
    file = tmp_path / "trial.trc"
    made.write_trc(file, {"mIJ": np.ones((3, 3)), "mC7": np.full((3, 3), 2.0)})
    file.write_text(file.read_text().replace("2000.000000", "lost", 1))
    with pytest.raises(DataError, match=r"trial.trc, row 6, column mC7 X: 'lost' is not"):
        read_markers(file)


def test_elbow_of_a_hinge_that_is_turned_about_all_axes() -> None:
    hinge = replace(MODEL.joints["hu"], orientation_rad=(0.2, -0.1, 0.3))
    model = replace(MODEL, joints={**MODEL.joints, "hu": hinge})
    angles = made.arm_angles()
    points = made.landmarks(angles, model)
    humerus = made.TO_LABORATORY @ made.segments(angles, model)["humerus_r"][1]
    forearm = points["US"] - (points["EL"] + points["EM"]) / 2.0
    error = elbow_flexion(model, humerus, forearm) - angles[:, 9]
    assert np.abs(error).max() < np.deg2rad(0.05)


def test_table_holds_what_was_converted(tmp_path: Path) -> None:
    angles = made.arm_angles()
    outcome = convert(tmp_path, made.landmarks(angles, MODEL))
    write_outcomes(tmp_path / "out", [outcome], False, "a command")
    motion = read_motion(tmp_path / "out" / "trial.csv")
    assert outcome.converted is not None
    assert np.abs(motion.angles_rad - outcome.converted.angles_rad).max() < 1e-6
    assert motion.time_s[1] - motion.time_s[0] == pytest.approx(1.0 / made.RATE_HZ)
    channels = read_channels(tmp_path / "out" / "trial.csv")
    assert channels["GH_z"].status == "measured"
    assert channels["SC_x"].status == "estimated"
    assert channels["SC_x"].uncertainty_deg == 20.0


def test_scapula_and_humerus_come_back_whatever_the_clavicle_turns(tmp_path: Path) -> None:
    angles = made.arm_angles()
    angles[:, 3:6] += np.deg2rad([6.0, -9.0, 11.0]) * np.linspace(0, 1, len(angles))[:, None]
    outcome = convert(tmp_path, made.landmarks(angles, MODEL))
    assert outcome.converted is not None
    for segment, (_, rotation) in made.segments(angles, MODEL).items():
        if segment in ("scapula_r", "humerus_r"):
            found = outcome.converted.rotations[segment]
            turn = Rotation.from_matrix(found.swapaxes(1, 2) @ rotation).magnitude()
            assert np.rad2deg(turn).max() < 0.02
    # The rule takes part of what the scapula does on the clavicle for a turn of the clavicle.
    assert np.abs(angles_of(outcome)[:, 2] - np.rad2deg(angles[:, 2])).max() > 2.0


def test_left_arms_are_mirrored(tmp_path: Path) -> None:
    angles = made.arm_angles()
    points = {name: p * [-1, 1, 1] for name, p in made.landmarks(angles, MODEL).items()}
    outcome = convert(tmp_path, points, text=made.MAP.format(side="left"))
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.05


def test_short_gaps_are_filled_and_reported(tmp_path: Path) -> None:
    angles = made.arm_angles()
    points = made.landmarks(angles, MODEL)
    points["AI"] = points["AI"].copy()
    points["AI"][50:70] = np.nan
    outcome = convert(tmp_path, points)
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.1
    assert outcome.source is not None
    [gap] = outcome.source.gaps
    assert (gap.marker, gap.first, gap.last) == ("mAI", 51, 70)


@pytest.mark.parametrize("rate_hz", [100, 200, 500, 1000])
def test_noise_of_single_frames_does_not_grow_in_a_gap(rate_hz: int) -> None:
    time = np.arange(rate_hz) / rate_hz
    true = 0.2 * np.column_stack([np.sin(np.pi * time), np.cos(np.pi * time), time])
    rng = np.random.default_rng(1)
    inside = slice(2 * rate_hz // 5, 3 * rate_hz // 5)
    worst = []
    for _ in range(5):
        noisy = true + 2e-4 * rng.standard_normal(true.shape)
        noisy[inside] = np.nan
        filled, _ = fill_gaps(Path("trial.c3d"), "mAI", noisy, rate_hz)
        worst.append(np.linalg.norm(filled - true, axis=1)[inside].max())
    assert np.median(worst) < 2e-3


def test_a_gap_with_hardly_a_frame_beside_it_is_refused() -> None:
    points = np.full((40, 3), np.nan)
    points[::13] = 0.1
    with pytest.raises(DataError, match=r"marker mAI, frames 2 to 13: not seen, and in only 2 of"):
        fill_gaps(Path("trial.c3d"), "mAI", points, 100.0)


CLUSTER_MAP = made.MAP.format(side="right") + (
    "static: static.c3d\nclusters: {acromion: {markers: [mK1, mK2, mK3],"
    " landmarks: [AA, TS, AI]}}\n"
)


def with_cluster(angles: np.ndarray) -> dict[str, np.ndarray]:
    """Landmarks, and four markers of a cluster on the acromion; K1, K2 and K4 are on a line."""
    place, turn = made.segments(angles, MODEL)["scapula_r"]
    cluster = {
        name: (place + turn @ np.array(local)) @ made.TO_LABORATORY.T + made.PLACE
        for name, local in (
            ("K1", [-0.03, 0.02, 0.05]), ("K2", [-0.07, 0.03, 0.06]), ("K3", [-0.05, 0.06, 0.05]),
            ("K4", [-0.05, 0.025, 0.055]),
        )
    }  # fmt: skip
    return made.landmarks(angles, MODEL) | cluster


def test_clusters_carry_landmarks_that_the_trial_does_not_show(tmp_path: Path) -> None:
    angles = made.arm_angles()
    points = with_cluster(angles)
    made.write_c3d(
        tmp_path / "static.c3d", made.marked({name: p[:20] for name, p in points.items()})
    )
    outcome = convert(tmp_path, made.without(points, ("AA", "TS", "AI")), text=CLUSTER_MAP)
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.05


@pytest.mark.parametrize(("moved_mm", "faulty"), [(0.0, False), (15.0, False), (60.0, True)])
def test_a_knocked_marker_of_a_cluster_is_named(
    tmp_path: Path, moved_mm: float, faulty: bool
) -> None:
    angles = made.arm_angles()
    points = with_cluster(angles)
    made.write_c3d(
        tmp_path / "static.c3d", made.marked({name: p[:20] for name, p in points.items()})
    )
    # Along a side of the triangle, as the scapula goes.
    side = points["K3"] - points["K1"]
    side = side / np.linalg.norm(side, axis=1, keepdims=True)
    points["K3"] = points["K3"] + 1e-3 * moved_mm * side
    outcome = convert(tmp_path, made.without(points, ("AA", "TS", "AI")), text=CLUSTER_MAP)
    bent = [finding for finding in outcome.findings if finding.name == "cluster_bent"]
    assert len(bent) == (moved_mm > 0.0)
    assert any(f.severity == "fault" for f in bent) == faulty
    for finding in bent:
        assert "cluster acromion: markers leave its shape" in finding.text
        assert "mK3 most" in finding.text


FOUR_MAP = CLUSTER_MAP.replace("mK3]", "mK3, mK4]")


def convert_four(folder: Path, static: tuple[str, ...], trial: tuple[str, ...]) -> Outcome:
    """Convert with a cluster of four, of which some are hidden in the static or in the trial."""
    points = with_cluster(made.arm_angles())
    never = np.full_like(points["K1"], np.nan)
    still = {name: p[:20] for name, p in (points | dict.fromkeys(static, never)).items()}
    made.write_c3d(folder / "static.c3d", made.marked(still))
    moving = made.without(points | dict.fromkeys(trial, never), ("AA", "TS", "AI"))
    return convert(folder, moving, text=FOUR_MAP)


@pytest.mark.parametrize(
    ("static", "trial", "said"),
    [
        ((), ("K4",), "trial.c3d, marker mK4: not seen in any of 120 frames"),
        (("K4",), (), "static.c3d, marker mK4: not seen in any of 20 frames"),
        (("K4",), ("K4",), "static.c3d, marker mK4: not seen in any of 20 frames"),
    ],
)
def test_a_cluster_goes_by_the_markers_that_are_seen(
    tmp_path: Path, static: tuple[str, ...], trial: tuple[str, ...], said: str
) -> None:
    outcome = convert_four(tmp_path, static, trial)
    assert np.abs(angles_of(outcome) - np.rad2deg(made.arm_angles())).max() < 0.05
    [finding] = outcome.findings
    assert (finding.name, finding.severity) == ("cluster_incomplete", "note")
    assert "cluster acromion: only mK1, mK2, mK3 carry its landmarks." in finding.text
    assert said in finding.text


def test_a_label_that_a_recording_lacks_is_a_marker_that_it_does_not_show(tmp_path: Path) -> None:
    points = with_cluster(made.arm_angles())
    made.write_c3d(tmp_path / "static.c3d", made.marked({n: p[:20] for n, p in points.items()}))
    outcome = convert(tmp_path, made.without(points, ("AA", "TS", "AI", "K4")), text=FOUR_MAP)
    assert np.abs(angles_of(outcome) - np.rad2deg(made.arm_angles())).max() < 0.05
    [finding] = outcome.findings
    assert "no marker 'mK4'" in finding.text


def test_a_cluster_goes_without_a_marker_that_is_hidden_for_too_long(tmp_path: Path) -> None:
    points = with_cluster(made.arm_angles())
    made.write_c3d(tmp_path / "static.c3d", made.marked({n: p[:20] for n, p in points.items()}))
    points["K4"][30:90] = np.nan
    outcome = convert(tmp_path, made.without(points, ("AA", "TS", "AI")), text=FOUR_MAP)
    assert np.abs(angles_of(outcome) - np.rad2deg(made.arm_angles())).max() < 0.05
    [finding] = outcome.findings
    assert (finding.name, finding.severity) == ("cluster_incomplete", "note")
    assert "trial.c3d, marker mK4, frames 31 to 90: not seen for 0.60 s" in finding.text


@pytest.mark.parametrize(
    ("static", "trial", "said"),
    [
        ((), ("K3", "K4"), "Cluster acromion needs 3 markers; found mK1, mK2."),
        (("K1",), ("K4",), "Cluster acromion needs 3 markers; found mK2, mK3."),
        ((), ("K3",), "markers mK1, mK2, mK4 lie within 0.0 mm of a line; expected a triangle."),
    ],
)
def test_a_cluster_of_too_few_markers_is_refused(
    tmp_path: Path, static: tuple[str, ...], trial: tuple[str, ...], said: str
) -> None:
    outcome = convert_four(tmp_path, static, trial)
    assert outcome.converted is None
    assert said in outcome.refusal
    assert f"trial.c3d, marker m{trial[0]}: not seen in any of 120 frames" in outcome.refusal


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_one_frame_is_a_posture_that_sizes_are_taken_from(tmp_path: Path, suffix: str) -> None:
    points = {name: p[:1] for name, p in made.landmarks(made.arm_angles(), MODEL).items()}
    static = tmp_path / f"static{suffix}"
    made.WRITERS[suffix](static, made.marked(points))
    calibration = calibrate(read_marker_map(made.write_map(tmp_path / "map.yaml")), MODEL)
    with pytest.raises(DataError, match="one frame, which is a posture and no motion"):
        read_landmarks(static, calibration)
    found = read_landmarks(static, calibration, posture=True)
    np.testing.assert_allclose(found.points["AI"], points["AI"], atol=1e-6)
    np.testing.assert_array_equal(found.time_s, [0.0])


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_one_frame_shows_where_landmarks_are_in_a_cluster(tmp_path: Path, suffix: str) -> None:
    angles = made.arm_angles()
    points = with_cluster(angles)
    still = {name: p[:1] for name, p in points.items()}
    made.WRITERS[suffix](tmp_path / f"static{suffix}", made.marked(still))
    text = CLUSTER_MAP.replace("static.c3d", f"static{suffix}")
    outcome = convert(tmp_path, made.without(points, ("AA", "TS", "AI")), text=text)
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.05


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_one_frame_is_no_motion_of_a_functional_centre(tmp_path: Path, suffix: str) -> None:
    points = {name: p[:1] for name, p in made.landmarks(made.arm_angles(), MODEL).items()}
    made.WRITERS[suffix](tmp_path / f"wide{suffix}", made.marked(points))
    text = made.MAP.format(side="right").replace(" GH: mGH,", "")
    text = text.replace("{method: marker}", f"{{method: functional, trial: wide{suffix}}}")
    marker_map = read_marker_map(made.write_map(tmp_path / "map.yaml", text))
    with pytest.raises(DataError, match="the arm moves too little for a centre"):
        calibrate(marker_map, MODEL)


def test_landmarks_on_a_line_are_named_with_their_file(tmp_path: Path) -> None:
    points = made.landmarks(made.arm_angles(), MODEL)
    points |= {"PX": points["IJ"], "T8": points["C7"]}
    made.write_c3d(tmp_path / "line.c3d", made.marked(points))
    calibration = calibrate(read_marker_map(made.write_map(tmp_path / "map.yaml")), MODEL)
    with pytest.raises(DataError, match=r"line\.c3d, frame 1: landmarks IJ, PX, C7, T8"):
        read_landmarks(tmp_path / "line.c3d", calibration)


def test_an_empty_row_before_the_numbers_of_a_trc_counts(tmp_path: Path) -> None:
    file = tmp_path / "trial.trc"
    made.write_trc(file, made.marked(made.landmarks(made.arm_angles(), MODEL)))
    lines = file.read_text(encoding="utf-8").splitlines()
    del lines[30]
    file.write_text("\n".join([*lines[:5], "", *lines[5:]]) + "\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"row 32, column Time"):
        read_markers(file)


def test_swaying_with_hidden_markers_does_not_bend_a_cluster(tmp_path: Path) -> None:
    angles = made.arm_angles()
    points = with_cluster(angles)
    turn = Rotation.from_rotvec(np.outer(np.linspace(0.0, 0.3, 40), [0.0, 0.0, 1.0])).as_matrix()
    sway = np.linspace(0.0, 1.0, 40)[:, None] * [0.06, 0.0, 0.0]
    static = {name: np.einsum("tij,j->ti", turn, p[0]) + sway for name, p in points.items()}
    static["AI"][25:] = np.nan
    static["K2"][:10] = np.nan
    made.write_c3d(tmp_path / "static.c3d", made.marked(static))
    moving = made.without(points, ("AA", "TS", "AI"))
    outcome = convert(tmp_path, moving, text=CLUSTER_MAP)
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.05
    static["K2"][:25] = np.nan
    made.write_c3d(tmp_path / "static.c3d", made.marked(static))
    with pytest.raises(
        DataError, match="static.c3d, cluster acromion: no frame shows mAI and all of mK1"
    ):
        convert(tmp_path, moving, text=CLUSTER_MAP)


def test_a_functional_centre_is_where_the_arm_turns(tmp_path: Path) -> None:
    angles = made.arm_angles()
    share = np.linspace(0.0, 1.0, len(angles))
    wide = angles.copy()
    wide[:, 6] = np.deg2rad(360.0) * share
    wide[:, 7] = np.deg2rad(60.0 + 25.0 * np.sin(20.0 * share))
    made.write_c3d(tmp_path / "wide.c3d", made.marked(made.landmarks(wide, MODEL)))
    text = made.MAP.format(side="right").replace(" GH: mGH,", "")
    text = text.replace("{method: marker}", "{method: functional, trial: wide.c3d}")
    outcome = convert(tmp_path, made.landmarks(angles, MODEL), text=text)
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.05
    assert outcome.source is not None
    assert "0.0 mm RMS" in outcome.source.settings["glenohumeral_centre"]


def test_arms_that_rise_in_three_planes_have_a_functional_centre() -> None:
    """Elevations to 120 deg with an arm that turns with its plane, and circles between them."""
    up = np.concatenate([np.linspace(5.0, 120.0, 40), np.linspace(120.0, 5.0, 40)])
    rises = [np.column_stack([np.full(80, p), up, np.full(80, -p)]) for p in (0.0, 45.0, 90.0)]
    turn = np.linspace(0.0, 6.0 * np.pi, 200)
    circles = np.column_stack([45.0 + 50.0 * np.sin(turn), 60.0 + 40.0 * np.cos(turn)])
    circles = np.column_stack([circles, np.full(200, -45.0)])
    humerus = np.deg2rad(np.concatenate([*rises, circles]))
    angles = np.repeat(made.arm_angles()[:1], len(humerus), axis=0)
    angles[:, 6:9] = humerus
    points = made.landmarks(angles, MODEL)
    scapula = scapula_frame(points)
    local = {n: np.einsum("tji,tj->ti", scapula, points[n] - points["AA"]) for n in points}
    # Skin slides by 5 mm as the arm rises: the centre is off by less.
    slides = 0.005 * (humerus[:, 1] / humerus[:, 1].max())[:, None] * [0.6, 0.0, 0.8]
    found = fit_centre("wide.c3d", [local["EL"] + slides, local["EM"] + slides], ["EL", "EM"])
    assert np.linalg.norm(found.position_m - local["GH"][0]) < 0.005


def test_a_functional_centre_needs_motion_about_two_axes() -> None:
    angle = np.linspace(0.0, 1.5, 50)
    arc = 0.3 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(50)])
    with pytest.raises(DataError, match="moves too little"):
        fit_centre("plane.c3d", [arc, arc + [0.0, 0.0, 0.03]], ["EL", "EM"])


def test_model_centre_is_that_of_the_model(tmp_path: Path) -> None:
    angles = made.arm_angles()
    text = made.MAP.format(side="right").replace(" GH: mGH,", "").replace("marker}", "model}")
    outcome = convert(tmp_path, made.landmarks(angles, MODEL), text=text)
    assert np.abs(angles_of(outcome) - np.rad2deg(angles)).max() < 0.05


def test_regression_of_the_centre_follows_the_scapula() -> None:
    """Close to the centre of the model, and carried by the scapula wherever it goes."""
    angles = made.arm_angles(5)
    points = made.landmarks(angles, MODEL)
    scapula = made.segments(angles, MODEL)["scapula_r"]
    # Coracoid of the model: origin of the short head of biceps.
    coracoid = next(
        np.array(p.location_m) for p in MODEL.muscles["bic_b_1"].points if p.segment == "scapula_r"
    )
    points["PC"] = (scapula[0] + scapula[1] @ coracoid) @ made.TO_LABORATORY.T + made.PLACE
    away = np.linalg.norm(meskers_centre(points) - points["GH"], axis=1)
    assert away.max() < 0.03
    assert np.ptp(away) < 1e-9


def test_what_was_not_measured_is_said(tmp_path: Path) -> None:
    angles = made.arm_angles()
    points = made.landmarks(angles, MODEL)
    text = made.MAP.format(side="right")
    bare = convert(tmp_path, points, text=text.replace("SC: mSC, AC: mAC, ", "").replace(
        ", US: mUS", ""))  # fmt: skip
    assert bare.converted is not None
    channels = bare.converted.channels
    assert channels["EL_x"].status == "assumed"
    assert channels["SC_y"].status == "estimated"
    assert "IJ" in channels["SC_y"].rule
    assert channels["GH_z"].status == "measured"
    # The offsets are those of the model, so its own landmarks give its own clavicle.
    assert np.abs(angles_of(bare)[:, :9] - np.rad2deg(angles[:, :9])).max() < 0.1
    assert np.ptp(angles_of(bare)[:, 9]) == 0.0


def test_without_scapula_the_regression_stands_for_it(tmp_path: Path) -> None:
    angles = made.arm_angles()
    text = made.MAP.format(side="right").replace("AA: mAA, TS: mTS, AI: mAI,", "")
    text = text.replace("SC: mSC, AC: mAC, ", "")
    outcome = convert(tmp_path, made.landmarks(angles, MODEL), text=text)
    assert outcome.converted is not None
    channels = outcome.converted.channels
    assert {channels[name].status for name in ("SC_y", "AC_x", "GH_z")} == {"estimated"}
    humerus = made.segments(angles, MODEL)["humerus_r"][1]
    turn = Rotation.from_matrix(
        outcome.converted.rotations["humerus_r"].swapaxes(1, 2) @ humerus
    ).magnitude()
    assert np.rad2deg(turn).max() < 0.02


def test_regressed_girdle_turns_up_with_the_arm() -> None:
    """Slopes of de Groot and Brand 2001: 0.396 deg of scapula and 0.123 of clavicle per degree."""
    raised = Rotation.from_euler("YZY", [[0, 40, 0], [0, 100, 0]], degrees=True).as_matrix()
    direction, scapula = regressed_girdle(raised)
    upward = Rotation.from_matrix(scapula).as_euler("YZX", degrees=True)[:, 1]
    assert np.diff(upward) == pytest.approx(60 * 0.396)
    assert upward[0] == pytest.approx(3.095 + 0.396 * 40 + 0.414 * REST_SCAPULA_DEG[1])
    clavicle = np.rad2deg(np.arcsin(direction[:, 1]))
    assert clavicle[0] == pytest.approx(3.917 + 0.123 * 40 + 0.493 * REST_CLAVICLE_DEG[1])


def test_angles_have_no_jumps_where_the_arm_has_none(tmp_path: Path) -> None:
    """The arm swings through GH_z = 0 and turns beyond half a turn."""
    angles = made.arm_angles()
    share = np.linspace(0.0, 1.0, len(angles))
    angles[:, 6] = np.deg2rad(100.0 + 150.0 * share)
    angles[:, 7] = np.deg2rad(20.0 - 40.0 * share)
    outcome = convert(tmp_path, made.landmarks(angles, MODEL))
    assert np.abs(np.diff(angles_of(outcome), axis=0)).max() < 3.0


def test_an_arm_that_circles_on_can_be_read_again(tmp_path: Path) -> None:
    """Angles wound up by three turns, as circles of the arm do."""
    angles = made.arm_angles()
    angles[:, 6] += np.linspace(0.0, 6.0 * np.pi, len(angles))
    angles[:, 7] = np.deg2rad(40.0)
    outcome = convert(tmp_path, made.landmarks(angles, MODEL))
    write_outcomes(tmp_path / "out", [outcome], True, "a command")
    read = read_motion(tmp_path / "out" / "trial.csv").angles_rad
    turns = (read - angles)[:, 6:9] / (2.0 * np.pi)
    assert np.abs(turns - np.round(turns)).max() < 1e-4


def test_a_trial_with_a_fault_gets_no_table(tmp_path: Path) -> None:
    points = made.landmarks(made.arm_angles(), MODEL)
    points["EM"] = points["EM"] + 1.5 * (points["EM"] - points["EL"])
    outcome = convert(tmp_path, points)
    assert "epicondyles_apart" in {f.name for f in outcome.findings}
    write_outcomes(tmp_path / "out", [outcome], False, "a command")
    assert not (tmp_path / "out" / "trial.csv").exists()
    assert (tmp_path / "out" / "trial.recording.json").exists()
    write_outcomes(tmp_path / "out", [outcome], True, "a command")
    assert (tmp_path / "out" / "trial.csv").exists()


@pytest.mark.parametrize("hidden", ["PC", "RS"])
def test_a_landmark_that_no_angle_needs_may_be_hidden(tmp_path: Path, hidden: str) -> None:
    """The coracoid counts by one method only, and the radial styloid in the picture."""
    tables = made.tables()
    points = made.landmarks(made.arm_angles(), tables)
    points |= {"PC": points["AA"] + [0.0, 0.05, 0.0], "RS": points["US"] + [0.05, 0.0, 0.0]}
    points[hidden] = points[hidden].copy()
    points[hidden][:8] = np.nan
    made.write_c3d(tmp_path / "lift.c3d", made.marked(points))
    text = made.MAP.replace("US: mUS", "US: mUS, PC: mPC, RS: mRS").replace("GH: mGH, ", "")
    text = text.replace("method: marker", "method: model").format(side="right")
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    calibration = calibrate(read_marker_map(tmp_path / "map.yaml"), tables)
    read = read_landmarks(tmp_path / "lift.c3d", calibration)
    assert "PC" not in read.points
    assert ("RS" in read.points) == (hidden == "PC")


def test_labels_of_western_windows_software_are_read(tmp_path: Path) -> None:
    """The format names no encoding, and such labels are no UTF-8."""
    assert text_of("m\udcfcS ") == "müS"
    assert text_of("\udcb5V") == "µV"
    assert text_of("mÉJ") == "mÉJ"
    points = made.marked(made.landmarks(made.arm_angles(), made.tables()))
    points["mxUS"] = points.pop("mUS")
    made.write_c3d(tmp_path / "lift.c3d", points)
    raw = (tmp_path / "lift.c3d").read_bytes()
    assert raw.count(b"mxUS") == 1
    (tmp_path / "lift.c3d").write_bytes(raw.replace(b"mxUS", "müUS".encode("cp1252")))
    text = made.MAP.replace("US: mUS", "US: müUS").format(side="right")
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    call = ["convert", str(tmp_path / "lift.c3d"), "--map", str(tmp_path / "map.yaml")]
    assert cli.main([*call, "--out", str(tmp_path / "out")]) == 0
    wrong = text.replace("müUS", "mUS")
    (tmp_path / "map.yaml").write_text(wrong, encoding="utf-8")
    assert cli.main([*call, "--out", str(tmp_path / "other")]) == 2
    assert "müUS" in (tmp_path / "other" / "conversion.html").read_text(encoding="utf-8")
