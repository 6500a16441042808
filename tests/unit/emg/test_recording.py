"""Raw EMG is read from CSV and C3D in volts, and a wrong file is refused with its place."""

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from scapulohumeral.emg.recording import Recording, read_recording, write_recording
from scapulohumeral.errors import DataError

pytestmark = pytest.mark.unit

CHANNELS = ("infraspinatus", "anterior_deltoid")


def signals(samples: int = 2400) -> np.ndarray:
    """Two channels of noise [V]."""
    return 1e-4 * np.random.default_rng(5).standard_normal((samples, 2))


def write_c3d(path: Path, volts: np.ndarray, units: list[str], first: str = "EMG 5") -> Path:
    """A C3D file with three analog channels, the last of which is silent."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    analog = file["parameters"]["ANALOG"]
    analog["RATE"]["value"] = [2000]
    analog["LABELS"]["value"] = [first, "anterior_deltoid", "force"]
    analog["UNITS"]["value"] = units
    file["data"]["points"] = np.zeros((4, 0, len(volts) // 20))
    file["data"]["analogs"] = np.vstack([volts.T, np.zeros(len(volts))])[None]
    file.write(str(path))
    return path


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A recording as CSV, sampled at 2000 Hz from 0.1 s on."""
    path = tmp_path / "raw.csv"
    write_recording(path, Recording("test", CHANNELS, 0.1, 2000.0, signals(), simulated=False))
    return path


def test_csv_round_trip(table: Path) -> None:
    recording = read_recording(table, CHANNELS)
    assert recording.rate_hz == pytest.approx(2000.0, rel=1e-9)
    assert recording.time_s[[0, -1]] == pytest.approx([0.1, 0.1 + 2399 / 2000])
    np.testing.assert_allclose(recording.volts, signals(), rtol=1e-5)
    assert not recording.simulated


def test_times_of_four_decimals_are_uniform_at_1500_hz(tmp_path: Path) -> None:
    path = tmp_path / "raw.csv"
    rows = [f"{k / 1500.0:.4f},1e-4,2e-4" for k in range(2400)]
    path.write_text("\n".join(["time_s,infraspinatus_V,anterior_deltoid_V", *rows]))
    assert read_recording(path, CHANNELS).rate_hz == pytest.approx(1500.0, rel=1e-6)


def test_simulated_recording_says_so_in_every_row(tmp_path: Path) -> None:
    path = tmp_path / "raw.csv"
    write_recording(path, Recording("test", CHANNELS, 0.0, 2000.0, signals(), simulated=True))
    header, *rows = path.read_text().splitlines()
    assert header == "time_s,infraspinatus_V,anterior_deltoid_V,simulated"
    assert all(row.endswith(",true") for row in rows)
    assert read_recording(path, CHANNELS).simulated


def test_table_without_the_mark_is_measured(table: Path) -> None:
    lines = [line.rpartition(",")[0] for line in table.read_text().splitlines()]
    table.write_text("\n".join(lines))
    assert not read_recording(table, CHANNELS).simulated


@pytest.mark.parametrize("micro", ["uV", "\N{MICRO SIGN}V", "\N{GREEK SMALL LETTER MU}V"])
def test_c3d_is_read_in_volts(tmp_path: Path, micro: str) -> None:
    raw = signals() * [1e3, 1e6]
    path = write_c3d(tmp_path / "raw.c3d", raw, ["mV", micro, "N"])
    recording = read_recording(path, CHANNELS, {"infraspinatus": "EMG 5"})
    np.testing.assert_allclose(recording.volts, signals(), rtol=1e-5)
    assert recording.rate_hz == 2000.0
    assert recording.start_s == 0.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("infraspinatus_V", "infraspinatus_mV", "row 1: missing column infraspinatus_V"),
        ("\n0.100000,", "\n0.100000,nan,", "row 2: 5 cells, expected 4"),
        ("\n0.100500", "\n0.100000", "row 3, column time_s: 0.1 s does not follow 0.1 s"),
        ("\n0.100500", "\n0.100250", "row 3, column time_s: 0.000250 s after .* 0.000500 s"),
        ("false", "maybe", "row 2, column simulated: 'maybe'; expected true or false"),
    ],
)
def test_wrong_table_is_refused(table: Path, old: str, new: str, message: str) -> None:
    text = table.read_text()
    assert old in text
    table.write_text(text.replace(old, new, 1))
    with pytest.raises(DataError, match=message) as refusal:
        read_recording(table, CHANNELS)
    assert "raw.csv" in str(refusal.value)


def test_gap_is_refused_with_row_and_column(table: Path) -> None:
    lines = table.read_text().splitlines()
    cells = lines[6].split(",")
    lines[6] = ",".join([cells[0], cells[1], "NaN", cells[3]])
    table.write_text("\n".join(lines))
    with pytest.raises(DataError, match="row 7, column anterior_deltoid_V: NaN"):
        read_recording(table, CHANNELS)


def test_wrong_c3d_is_refused(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "raw.c3d", signals(), ["V", "Pa", "N"])
    with pytest.raises(DataError, match="no analog channel 'infraspinatus'; found EMG 5, ant"):
        read_recording(path, CHANNELS)
    with pytest.raises(DataError, match="channel anterior_deltoid: unit 'Pa'; expected V, mV"):
        read_recording(path, CHANNELS, {"infraspinatus": "EMG 5"})
    path = write_c3d(tmp_path / "twice.c3d", signals(), ["V", "V", "N"], first="force")
    with pytest.raises(DataError, match="twice.c3d: 2 analog channels 'force'; expected one"):
        read_recording(path, ["force"])
    assert read_recording(path, ["anterior_deltoid"]).channels == ("anterior_deltoid",)
    holes = signals()
    holes[7, 1] = np.nan
    path = write_c3d(tmp_path / "holes.c3d", holes, ["V", "V", "N"])
    with pytest.raises(DataError, match="sample 8, channel anterior_deltoid: nan"):
        read_recording(path, CHANNELS, {"infraspinatus": "EMG 5"})


def test_other_files_are_refused(tmp_path: Path, table: Path) -> None:
    with pytest.raises(DataError, match="none.csv: no such file"):
        read_recording(tmp_path / "none.csv", CHANNELS)
    with pytest.raises(DataError, match="a folder; expected a file"):
        read_recording(tmp_path, CHANNELS)
    with pytest.raises(DataError, match="expected .csv or .c3d"):
        read_recording(table.rename(tmp_path / "raw.txt"), CHANNELS)
    (tmp_path / "broken.c3d").write_bytes(b"not a recording")
    with pytest.raises(DataError, match="broken.c3d: not a C3D file"):
        read_recording(tmp_path / "broken.c3d", CHANNELS)


def test_short_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "raw.csv"
    write_recording(path, Recording("test", CHANNELS, 0.0, 2000.0, signals(1000), simulated=False))
    with pytest.raises(DataError, match="0.500 s; an envelope needs at least 1.0 s"):
        read_recording(path, CHANNELS)
