"""Frames are named by the numbers of the file, which a viewer shows, wherever it was cut."""

from collections.abc import Callable
from pathlib import Path

import ezc3d
import made_recordings as made
import numpy as np
import pytest

from scapulohumeral import cli
from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.markers.files import read_markers
from scapulohumeral.laboratory.markers.landmarks import calibrate
from scapulohumeral.laboratory.markers.marker_map import read_marker_map

pytestmark = pytest.mark.unit
MODEL = made.tables()
Points = dict[str, np.ndarray]
# A recording that was cut before this frame; a fault in its frame `k` from zero is in `FIRST + k`.
FIRST = 201


def hidden(name: str, frames: slice) -> Callable[[Points], None]:
    """A marker is not seen for some frames."""

    def change(points: Points) -> None:
        points[name][frames] = np.nan

    return change


def moved(names: tuple[str, ...], frame: int, by_m: float) -> Callable[[Points], None]:
    """Markers are elsewhere in one frame."""

    def change(points: Points) -> None:
        for name in names:
            points[name][frame] += [0.0, 0.0, by_m]

    return change


def merged(frame: int) -> Callable[[Points], None]:
    """A marker of the scapula carries the place of another one in one frame."""

    def change(points: Points) -> None:
        points["TS"][frame] = points["AI"][frame] = points["AA"][frame]

    return change


def slid(points: Points) -> None:
    """The wrist leaves the arm slowly, and most in the last frame."""
    away = points["US"] - points["EL"]
    points["US"] += np.linspace(0.0, 0.05, len(away))[:, None] * away / np.linalg.norm(away[0])


SAID = [
    ("long gap", hidden("AI", slice(30, 60)), "marker mAI, frames 231 to 260: not seen for 0.30 s"),
    ("filled gap", hidden("AI", slice(30, 40)), "gap filled: mAI, frames 231 to 240"),
    ("gap at the start", hidden("AI", slice(0, 9)), "frames 201 to 209: not seen at the start"),
    ("gap at the end", hidden("AI", slice(110, None)), "frames 311 to 320: not seen at the end"),
    ("on a line", merged(40), "frame 241: landmarks AA, TS, AI of the scapula"),
    ("ghost", moved(("US",), 60, 4.0), "m from IJ in frame 261;"),
    ("thorax", moved(("PX",), 50, 0.3), "at frame 251, median"),
    ("jump", moved(("AC", "AA", "TS", "AI"), 60, 0.06), "deg between frames 261 and 262"),
    ("skin", slid, "most at frame 320; expected"),
]


@pytest.mark.parametrize("suffix", [".c3d", ".trc"])
@pytest.mark.parametrize(("name", "change", "said"), SAID, ids=[row[0] for row in SAID])
def test_findings_name_frames_of_a_cut_recording_as_its_file_does(
    name: str, change: Callable[[Points], None], said: str, suffix: str, tmp_path: Path
) -> None:
    points = {key: p.copy() for key, p in made.landmarks(made.arm_angles(), MODEL).items()}
    change(points)
    file = tmp_path / f"trial{suffix}"
    made.WRITERS[suffix](file, made.marked(points), first_frame=FIRST)
    map_file, out = str(made.write_map(tmp_path / "map.yaml")), tmp_path / "out"
    cli.main(["convert", str(file), "--map", map_file, "--out", str(out)])
    assert said in (out / "conversion.html").read_text(encoding="utf-8"), name


def test_a_functional_trial_is_named_with_its_own_frame(tmp_path: Path) -> None:
    points = made.landmarks(made.arm_angles(), MODEL)
    merged(40)(points)
    made.write_c3d(tmp_path / "wide.c3d", made.marked(points), first_frame=FIRST)
    text = made.MAP.format(side="right").replace(" GH: mGH,", "")
    text = text.replace("{method: marker}", "{method: functional, trial: wide.c3d}")
    map_file = made.write_map(tmp_path / "map.yaml", text)
    with pytest.raises(DataError, match=r"wide\.c3d, frame 241: landmarks AA, TS, AI"):
        calibrate(read_marker_map(map_file), MODEL)


def test_numbers_that_the_header_of_a_c3d_cannot_hold_are_read(tmp_path: Path) -> None:
    """Two words of 16 bits in TRIAL:ACTUAL_START_FIELD, read as signed ones."""
    path = tmp_path / "long.c3d"
    made.write_c3d(path, {"mIJ": np.ones((5, 3))})
    file = ezc3d.c3d(str(path))
    file.add_parameter("TRIAL", "ACTUAL_START_FIELD", [40000 - 65536, 1])
    file.write(str(path))
    assert read_markers(path).first_frame == 65536 + 40000
    file.add_parameter("TRIAL", "ACTUAL_START_FIELD", [0, 0])
    file.write(str(path))
    assert read_markers(path).first_frame == 1, "never set"


def test_numbers_of_a_trc_that_skip_frames_are_not_counted_on(tmp_path: Path) -> None:
    path = tmp_path / "trial.trc"
    made.write_trc(path, {"mIJ": np.ones((5, 3))}, first_frame=FIRST)
    assert read_markers(path).first_frame == FIRST
    path.write_text(path.read_text(encoding="utf-8").replace("\n203\t", "\n\t"), encoding="utf-8")
    assert read_markers(path).first_frame == 1


def test_a_table_without_numbers_of_frames_counts_its_rows(tmp_path: Path) -> None:
    made.write_csv(tmp_path / "trial.csv", {"mIJ": np.ones((5, 3))})
    assert read_markers(tmp_path / "trial.csv").first_frame == 1
