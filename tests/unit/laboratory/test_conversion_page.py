"""The page of a conversion: everything in one file, bones where the landmarks are."""

import re
from pathlib import Path

import made_recordings as made
import numpy as np
import pytest

from scapulohumeral import cli
from scapulohumeral.laboratory.checks import Limits
from scapulohumeral.laboratory.convert import Settings, convert_markers
from scapulohumeral.laboratory.markers.landmarks import calibrate
from scapulohumeral.laboratory.markers.marker_map import read_marker_map
from scapulohumeral.laboratory.page import scene_of
from scapulohumeral.player.scene import positions

pytestmark = pytest.mark.unit
MODEL = made.tables()


def test_bones_pass_through_rigid_landmarks(tmp_path: Path) -> None:
    made.write_c3d(tmp_path / "reach.c3d", made.marked(made.landmarks(made.arm_angles(), MODEL)))
    calibration = calibrate(read_marker_map(made.write_map(tmp_path / "map.yaml")), MODEL)
    settings = Settings(MODEL, Limits())
    [found] = convert_markers([tmp_path / "reach.c3d"], calibration, settings, lambda line: None)
    assert found.converted is not None
    scene = scene_of("reach", found.converted, found.points, MODEL)
    names = [name for name in scene.landmarks if name in scene.measured_m]
    assert set(names) >= {"IJ", "SC", "AA", "TS", "AI", "GH", "EL", "EM"}
    bones = positions(scene, [scene.landmarks[name] for name in names])
    dots = np.stack([scene.measured_m[name] for name in names], axis=1)
    assert np.abs(bones - dots).max() < 2e-4
    # Twenty frames per second are enough to look at.
    assert len(scene.time_s) == made.FRAMES // 5


def test_the_page_names_findings_and_needs_no_network(tmp_path: Path) -> None:
    points = made.landmarks(made.arm_angles(), MODEL)
    made.write_c3d(tmp_path / "sound.c3d", made.marked(points))
    points["EM"] = points["EM"] + 1.5 * (points["EM"] - points["EL"])
    made.write_c3d(tmp_path / "faulty.c3d", made.marked(points))
    made.write_c3d(tmp_path / "bare.c3d", made.marked(made.without(points, ("AI",))))
    files = [str(tmp_path / f"{name}.c3d") for name in ("sound", "faulty", "bare")]
    map_file, out = str(made.write_map(tmp_path / "map.yaml")), tmp_path / "out"
    assert cli.main(["convert", *files, "--map", map_file, "--out", str(out)]) == 2
    page = (out / "conversion.html").read_text(encoding="utf-8")
    assert "<strong>1 of 3</strong>" in page
    assert "epicondyles_apart" in page
    assert "no marker &#39;mAI&#39;" in page
    assert "SC_x, AC_y, AC_z, AC_x: estimated, +-20 deg" in page
    assert page.count('class="shoulder-player"') == 1
    assert not re.findall(r'(?:src|href)="(?!data:|#)[^"]', page)
