"""The 3-D view: where bones and muscles are, what the page carries, what it does in a browser."""

import base64
import json
import re
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import synthetic_study
from arm import SEGMENTS as ARM_SEGMENTS
from arm import arm_from_angles, parameters
from places import SUPPORT
from skeleton import BALL, skeleton_record

from scapulohumeral.errors import DataError, ModelError
from scapulohumeral.model.muscle_paths.geometry import straight_coefficients
from scapulohumeral.model.rotations import quaternion_to_matrix, trial_to_pose
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.player.page import LENGTH_STEP_M, player_html
from scapulohumeral.player.scene import SEGMENTS, Scene, positions
from scapulohumeral.quantities.joint_loading import glenohumeral_load
from scapulohumeral.report.player import build_scene, segment_poses

pytestmark = pytest.mark.unit

THORAX = {"centre_m": [0.0, -0.12, 0.04], "radii_m": [0.12, 0.17, 0.08]}
NAMES = ("trapezius_1", "deltoid_1", "biceps_1", "round_1")
BROWSER = SUPPORT / "headless_browser.py"
NO_BROWSER = 3


def random_poses(count: int) -> np.ndarray:
    """Poses in the working range of an arm."""
    angles = np.random.default_rng(4).uniform(-0.8, 0.8, (count, 10))
    return trial_to_pose(angles + [-0.4, 0.1, 0.2, 0.8, 0.0, 0.0, 0.2, 1.0, 0.0, 0.9])


def solution(nodes: int = 41, status: str = "optimal") -> Solution:
    """An elevation to the right with muscles of the skeleton, all forces rising from zero."""
    share = np.linspace(0.0, 1.0, nodes)
    angles = np.zeros((nodes, 10))
    angles[:, [0, 3]] = [-0.4, 0.8]
    angles[:, 7] = 0.1 + 1.4 * share
    angles[:, 9] = 0.5
    effort = np.outer(share, [0.2, 0.5, 0.1, 0.0])
    towards = [1.0, -0.2, 0.2]
    return replace(
        synthetic_study.solution("par2", "frontal", "quaternion", status),
        time_s=0.5 + 2.0 * share,
        pose=trial_to_pose(angles),
        reference_pose=trial_to_pose(angles + 0.05),
        activation=effort,
        muscle_force_N=400.0 * effort,
        reaction_N=np.outer(600.0 * share, towards),
        muscles=np.array(NAMES),
    )


def scene(**options: Any) -> Scene:
    """Scene of that motion."""
    return build_scene(solution(), skeleton_record(), THORAX, **{"label": "healthy", **options})


def data_of(html: str) -> list[dict]:
    """The data in a page, read as the script reads them."""
    match = re.search(r'<script type="application/json">(.*?)</script>', html, re.S)
    assert match
    return json.loads(match[1])


def unpacked(packed: dict) -> np.ndarray:
    return packed["step"] * np.frombuffer(base64.b64decode(packed["data"]), "<i2")


def test_segments_are_where_plain_vector_mechanics_puts_them() -> None:
    """An independent arm; its elbow turns about the axis that the record names."""
    record = skeleton_record()
    offsets = {"SC": "sc1", "AC": "ac1", "GH": "gh1", "EL": "hu"}
    values = {f"offset_{k}": record.joints[j].location_m for k, j in offsets.items()}
    p = parameters(**values, axis_EL=np.array(record.axes["EL_x"]))
    angles = np.random.default_rng(2).uniform(-1.0, 1.0, (20, 10))
    origins, rotations = segment_poses(record, trial_to_pose(angles))
    for node, row in enumerate(angles):
        expected = arm_from_angles(p, row, np.zeros(10))
        np.testing.assert_allclose(origins[node, 1:], expected.origins, atol=1e-12)
        matrices = quaternion_to_matrix(rotations[node, 1:])
        np.testing.assert_allclose(matrices, expected.rotations, atol=1e-12)
    assert len(SEGMENTS) == 1 + len(ARM_SEGMENTS)


@pytest.mark.parametrize("name", ["trapezius_1", "deltoid_1"])
def test_straight_lines_are_as_long_as_the_muscle_geometry_says(name: str) -> None:
    """Length from shared rotation features, which the simulation uses, against drawn points."""
    record, poses = skeleton_record(), random_poses(30)
    [muscle] = [m for m in record.muscles if m.name == name]
    squared, _ = straight_coefficients(record, muscle)
    sc, ac, gh = (quaternion_to_matrix(poses[:, k : k + 4]) for k in (0, 4, 8))
    features = [matrix.reshape(-1, 9) for matrix in (sc, ac, sc @ ac, gh)]
    expected = np.sqrt(squared[0] + np.hstack(features) @ squared[1:])
    origin, rotation = segment_poses(record, poses)
    drawn = replace(scene(), origin_m=origin, rotation=rotation)
    ends = positions(drawn, drawn.muscles[NAMES.index(name)].points)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    np.testing.assert_allclose(length, expected, atol=1e-9)


def test_forearm_bends_forwards() -> None:
    """Hanging arm, elbow at a right angle: the wrist is in front of the elbow (z is back)."""
    record = skeleton_record()
    angles = np.zeros((1, 10))
    angles[0, 9] = np.pi / 2
    origin, rotation = segment_poses(record, trial_to_pose(angles))
    posed = replace(scene(), origin_m=origin, rotation=rotation)
    elbow, wrist = origin[0, 4], positions(posed, [posed.landmarks["Wrist"]])[0, 0]
    np.testing.assert_allclose(wrist - elbow, [0.01, 0.0, -0.25], atol=1e-12)


def test_force_through_the_rim_has_eccentricity_one() -> None:
    record = skeleton_record()
    centre = np.array(record.joints["gh1"].location_m)
    pushes = 500.0 * (centre - scene().rim_m)
    load = glenohumeral_load(pushes, record)
    np.testing.assert_allclose(load.eccentricity, 1.0, rtol=1e-9)


def test_every_second_node_and_the_last_are_kept() -> None:
    solved = solution(nodes=40)
    built = build_scene(solved, skeleton_record(), THORAX, "even")
    np.testing.assert_allclose(built.time_s, solved.time_s[[*range(0, 40, 2), 39]])
    assert len(built.activation) == len(built.origin_m) == len(built.time_s)


def test_recorded_motion_has_bones_only() -> None:
    recorded = scene(recorded=True)
    assert recorded.muscles == ()
    assert not recorded.reaction_N.any()
    assert np.abs(recorded.rotation - scene().rotation).max() > 0.01


def test_page_carries_the_scene_to_a_tenth_of_a_millimetre() -> None:
    original = scene()
    [read] = data_of(player_html([original]))
    origin = unpacked(read["origin"]).reshape(original.origin_m.shape)
    np.testing.assert_allclose(origin, original.origin_m, atol=0.51 * LENGTH_STEP_M)
    activation = unpacked(read["activation"]).reshape(original.activation.shape)
    np.testing.assert_allclose(activation, original.activation, atol=2e-5)
    force = unpacked(read["force"]).reshape(original.force_N.shape)
    np.testing.assert_allclose(force, original.force_N, atol=0.051)


def test_long_motion_of_many_muscles_stays_small() -> None:
    """270 nodes, 126 muscle elements of three points."""
    solved = solution(nodes=270)
    copies = {"activation": solved.activation[:, [1] * 126]}
    copies["muscle_force_N"] = 400.0 * copies["activation"]
    solved = replace(solved, muscles=np.array(["biceps_1"] * 126), **copies)
    html = player_html([build_scene(solved, skeleton_record(), THORAX, "long")])
    assert len(html) < 400_000


def test_page_needs_nothing_from_elsewhere_and_labels_stay_text() -> None:
    html = player_html([scene(label="</script><b>bold</b>")])
    assert not re.search(r"https?://|src=|@import|url\(", html)
    assert "<b>" not in html
    assert data_of(html)[0]["label"] == "</script><b>bold</b>"


def test_group_names_are_those_of_the_caller() -> None:
    html = player_html([scene()], {"deltoid": "deltoid, all parts"})
    assert "<option>deltoid, all parts</option>" in html
    assert "<option>biceps</option>" in html


def test_unknown_muscle_missing_marker_and_bad_numbers_are_refused() -> None:
    record = skeleton_record()
    stranger = replace(
        solution(), muscles=np.array(["trapezius_1", "deltoid_1", "heart", "round_1"])
    )
    with pytest.raises(ModelError, match="heart is not in the model record of par9"):
        build_scene(stranger, record, THORAX, "x")
    unmarked = {name: marker for name, marker in record.markers.items() if name != "TS"}
    with pytest.raises(ModelError, match="no TS"):
        build_scene(solution(), replace(record, markers=unmarked), THORAX, "x")
    with pytest.raises(DataError, match="no scene"):
        player_html([])
    for wrong in (np.nan, 1e5):
        with pytest.raises(DataError, match="largest number"):
            player_html([replace(scene(), force_N=np.full_like(scene().force_N, wrong))])


# What the browser does, in order: name, script, milliseconds until the next.
PLAYER = "document.querySelector('.shoulder-player').player"
PRELUDE = f"""
window.player = {PLAYER};
window.control = (name) => document.querySelector(`[data-control=${{name}}]`);
window.set = (name, value, event) => {{
  control(name).value = value; control(name).dispatchEvent(new Event(event)); }};
window.picture = () => player.canvas.toDataURL();
window.coloured = (test) => {{
  const {{ width, height }} = player.canvas, found = [];
  const copy = Object.assign(document.createElement("canvas"), {{ width, height }})
    .getContext("2d", {{ willReadFrequently: true }});
  copy.drawImage(player.canvas, 0, 0);
  const d = copy.getImageData(0, 0, width, height).data;
  for (let i = 0; i < d.length; i += 4)
    if (test(d[i], d[i + 1], d[i + 2]))
      found.push([(i / 4) % width / width, i / 4 / width / height]);
  return found; }};
window.blue = () => coloured((r, g, b) => b > 150 && r < 60).length;
window.bones = () => coloured((r, g, b) => r > g && g > b && r - b > 25 && r > 225)
  .filter(([x, y]) => y > 0.1 && y < 0.85).map(([x]) => x);
window.reach = (x) => [0.5 - Math.min(...x), Math.max(...x) - 0.5].join();
window.key = (name) => player.canvas.dispatchEvent(new KeyboardEvent("keydown", {{ key: name }}));
window.wheel = () => player.canvas.dispatchEvent(new WheelEvent("wheel", {{ deltaY: -200 }}));
window.drag = (x, y) => player.canvas.dispatchEvent(
  new PointerEvent("pointermove", {{ buttons: 1, movementX: x, movementY: y }}));
window.point = ([a, b]) => {{
  const {{ x, y }} = player.canvas.getBoundingClientRect();
  const clientX = x + player.canvas.clientLeft + (a[0] + b[0]) / 2;
  const clientY = y + player.canvas.clientTop + (a[1] + b[1]) / 2;
  player.canvas.dispatchEvent(new PointerEvent("pointermove", {{ clientX, clientY }})); }};
window.first = picture(); true;
"""
STEPS: list[tuple[str, str, int]] = [
    ("ready", PRELUDE, 0),
    ("started", "player.state.time", 0),
    ("marks", "JSON.stringify(player.pose(player.end).marks)", 0),
    ("lines", "JSON.stringify(player.pose(player.end).lines)", 0),
    ("between", "JSON.stringify(player.pose(0.025).marks.Wrist)", 0),
    ("slider", "set('time', 0.3, 'input'); player.state.time", 0),
    ("redrawn", "picture() !== first", 0),
    ("title", "player.canvas.getAttribute('aria-label')", 0),
    ("scene", "set('scene', 1, 'change'); player.scene.label", 0),
    ("bones only", "player.drawn.length", 0),
    ("back again", "set('scene', 0, 'change'); player.drawn.length", 0),
    ("group", "set('group', 'deltoid', 'change'); player.drawn.length", 0),
    ("no group", "set('group', '', 'change'); player.drawn.length", 0),
    ("without ghost", "blue()", 0),
    ("ghost", "set('ghost', 1, 'change'); blue()", 0),
    ("ghost off", "set('ghost', '', 'change'); blue()", 0),
    ("names", "window.bare = picture(); control('names').click(); picture() !== bare", 0),
    ("front", "player.change({time: 9}); document.querySelector('[data-view=front]').click(); "
     "reach(bones())", 0),
    ("back", "document.querySelector('[data-view=back]').click(); reach(bones())", 0),
    ("side", "document.querySelector('[data-view=side]').click(); player.state.yaw", 0),
    ("drag", "drag(20, -10); [player.state.yaw, player.state.pitch].join()", 0),
    ("scroll", "wheel(); player.state.zoom", 0),
    ("zoom", "player.canvas.focus(); wheel(); player.state.zoom", 0),
    ("button", "document.querySelector(\"[data-zoom='0.8']\").click(); player.state.zoom", 0),
    ("keys", "key('ArrowLeft'); key('ArrowUp'); key('.'); "
     "[player.state.yaw, player.state.pitch, player.state.time].join()", 0),
    ("pick", "point(player.drawn[1].seen); control('readout').textContent", 0),
    ("play", "player.change({time: 0}); set('speed', 0.25, 'change'); key(' '); "
     "control('play').textContent", 500),
    ("played", "window.reached = player.state.time", 0),
    ("pause", "key(' '); window.stopped = player.state.time; control('play').textContent", 200),
    ("paused", "player.state.time - stopped", 0),
    ("loop", "player.change({time: player.end - 0.01}); key(' '); 0", 300),
    ("looped", "key(' '); player.state.time", 0),
    ("failed", "player.change({scene: 2}); coloured((r, g, b) => r > 150 && g < 40 && b < 70)"
     ".filter(([x, y]) => y < 0.05).length", 0),
]  # fmt: skip


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the page did: the value of every step, and `console` and `requests`."""
    failed = build_scene(solution(status="failed"), skeleton_record(), THORAX, "failed")
    scenes = [scene(every=1), scene(label="recorded", recorded=True), failed]
    page = tmp_path_factory.mktemp("player") / "page.html"
    page.write_text(f"<!doctype html><meta charset=utf-8>{player_html(scenes)}", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(BROWSER), str(page)],
        input=json.dumps([step[1:] for step in STEPS]),
        capture_output=True,
        text=True,
        timeout=120,
    )
    if done.returncode == NO_BROWSER:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    names = [step[0] for step in STEPS]
    values = dict(zip(names, report["values"], strict=True))
    return {**values, "console": report["console"], "requests": report["requests"]}


def test_browser_reports_no_error_and_asks_for_nothing(browser: dict[str, Any]) -> None:
    assert browser["ready"] is True
    assert browser["console"] == []
    assert [a for a in browser["requests"] if not a.startswith("file://")] == []
    assert len(browser["requests"]) == 1


def test_browser_puts_landmarks_and_muscles_where_python_does(browser: dict[str, Any]) -> None:
    shown = scene(every=1)
    marks = json.loads(browser["marks"])
    for name, point in shown.landmarks.items():
        expected = positions(shown, [point])[-1, 0]
        np.testing.assert_allclose(marks[name], expected, atol=3e-4, err_msg=name)
    for line, muscle in zip(json.loads(browser["lines"])[:3], shown.muscles, strict=False):
        np.testing.assert_allclose(line, positions(shown, muscle.points)[-1], atol=3e-4)


def test_motion_between_frames_is_interpolated(browser: dict[str, Any]) -> None:
    shown = scene(every=1)
    wrist = positions(shown, [shown.landmarks["Wrist"]])[:2, 0]
    np.testing.assert_allclose(json.loads(browser["between"]), wrist.mean(axis=0), atol=5e-4)


def test_wrapping_muscle_is_a_taut_band(browser: dict[str, Any]) -> None:
    """Two tangents and an arc over the sphere, by hand."""
    line = np.array(json.loads(browser["lines"])[3])
    radius, height, half = BALL["radius"], 0.001, 2.0 * BALL["radius"]
    distances = np.linalg.norm(line - BALL["centre"], axis=1)
    assert distances.min() > radius - 3e-4
    far = np.hypot(half, height)
    tangent, turn = np.sqrt(far**2 - radius**2), np.arccos(radius / far)
    arc = radius * (2.0 * np.arctan2(half, height) - 2.0 * turn)
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    # The chords of the drawing are shorter than the arc by a small amount.
    assert 0.985 * (2.0 * tangent + arc) < length < 1.01 * (2.0 * tangent + arc)


def test_time_and_choice_of_motion_change_the_picture(browser: dict[str, Any]) -> None:
    assert browser["started"] == pytest.approx(1.0)
    assert browser["slider"] == pytest.approx(0.3)
    assert browser["redrawn"] is True
    assert "healthy, at 0.3 s: arm elevation" in browser["title"]
    assert browser["scene"] == "recorded"
    assert browser["bones only"] == 0
    assert browser["back again"] == len(NAMES)
    assert browser["group"] == 1
    assert browser["no group"] == len(NAMES)
    assert browser["names"] is True


def test_ghost_is_drawn_over_the_motion(browser: dict[str, Any]) -> None:
    assert browser["ghost"] > browser["without ghost"] + 100
    assert browser["ghost off"] == browser["without ghost"]


def test_views_show_the_right_arm_on_the_correct_side(browser: dict[str, Any]) -> None:
    """Seen from the front the right arm reaches to the left, seen from the back to the right."""
    left, right = map(float, browser["front"].split(","))
    assert left > right + 0.1
    left, right = map(float, browser["back"].split(","))
    assert right > left + 0.1
    assert browser["side"] == 90


def test_mouse_wheel_and_keys_move_the_camera(browser: dict[str, Any]) -> None:
    assert browser["drag"] == "100,-5"
    assert browser["scroll"] == 1, "without focus the wheel belongs to the page"
    assert browser["zoom"] == pytest.approx(np.exp(0.3))
    assert browser["button"] == pytest.approx(0.8 * np.exp(0.3))
    yaw, pitch, time = map(float, browser["keys"].split(","))
    assert (yaw, pitch) == (95.0, 0.0)
    assert time == pytest.approx(2.0)
    assert "deltoid_1 (deltoid): activation 0.50, 200 N" in browser["pick"]


def test_playing_moves_time_until_paused_and_starts_over(browser: dict[str, Any]) -> None:
    assert browser["play"] == "Pause"
    assert 0.05 < browser["played"] < 1.9
    assert browser["pause"] == "Play"
    assert browser["paused"] == 0.0
    assert browser["looped"] < 1.5


def test_failed_solve_is_marked_in_the_picture(browser: dict[str, Any]) -> None:
    assert browser["failed"] > 50
