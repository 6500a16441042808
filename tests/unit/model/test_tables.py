"""The tables of the model are complete, and each kind of damage is refused with its place."""

import shutil
from dataclasses import asdict
from pathlib import Path

import pytest
from places import REPOSITORY

from scapulohumeral.errors import DataError, ModelError
from scapulohumeral.model.tables import read_tables

pytestmark = pytest.mark.unit

MODEL = REPOSITORY / "config" / "model"
TABLES = read_tables(MODEL)


@pytest.fixture
def model(tmp_path):
    """A copy of the tables that a test may damage."""
    return Path(shutil.copytree(MODEL, tmp_path / "model"))


def damage(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_counts_are_those_of_the_paper():
    assert len(TABLES.muscles) == 137
    assert len(TABLES.active_muscles) == 126
    assert len(TABLES.excluded_muscles) == 11
    assert len(TABLES.coordinates) == 14


def test_every_muscle_has_a_group_and_plausible_time_constants():
    for muscle in TABLES.muscles.values():
        assert muscle.group, muscle.name
        assert 0.005 < muscle.activation_time_s < muscle.deactivation_time_s < 0.1


def test_hill_constants_are_those_of_the_supplement():
    assert asdict(TABLES.constants.hill) == {
        "f_gauss": 0.25,
        "k_pe": 5.0,
        "epsilon_m0": 0.6,
        "d1": -0.318,
        "d2": -8.149,
        "d3": -0.374,
        "d4": 0.886,
        "v_max": 10.0,
    }


def test_missing_file(model):
    (model / "joints.csv").unlink()
    with pytest.raises(DataError, match=r"joints\.csv: no such file"):
        read_tables(model)


@pytest.mark.parametrize(
    ("file", "old", "new", "error", "message"),
    [
        ("segments.csv", "mass_kg", "mass_g", DataError, "row 1: missing column mass_kg"),
        ("segments.csv", "20.0", "heavy", DataError, "row 2, column mass_kg: 'heavy'"),
        ("segments.csv", "20.0", "nan", DataError, "row 2, column mass_kg: nan"),
        ("segments.csv", "20.0", "-20.0", ModelError, "segment thorax: mass -20.0 kg"),
        ("segments.csv", ",20.0", ",20.0,1", DataError, "row 2: 12 cells, expected 11"),
        ("segments.csv", "\nhand_r", "\nulna_r", ModelError, "ulna_r more than once"),
        ("joints.csv", "thorax,clavicle_1", "chest,clavicle_1", ModelError, "parent: chest not in"),
        ("joints.csv", "radius_r,hand_r", "radius_r,ulna_r", ModelError, "ulna_r occurs 2 times"),
        ("coordinates.csv", "SC_y,sc1", "SC_y,sc9", ModelError, "column joint: sc9 not in"),
        ("coordinates.csv", "-1.1345", "1.1345", ModelError, "SC_y: min_rad 1.1345 is not below"),
        ("wrap_objects.csv", "sphere", "torus", ModelError, "column type: 'torus'"),
        ("path_points.csv", "bic_l,2", "bic_l,7", ModelError, "column point: 7, expected 2"),
        ("path_points.csv", "bic_l,3", "bic_x,1", ModelError, "bic_x not in muscles.csv"),
        ("path_wraps.csv", "deltoid", "delta", ModelError, "wrap_object: delta not in"),
        ("muscles.csv", "trap_scap,118.0", "trap_scap,0", ModelError, "max_isometric_force_N: 0"),
        ("muscles.csv", "tendon_slack_length_m", "slack_m", DataError, "missing column tendon_sl"),
        ("muscles.csv", "0.014399998848000091", "0", ModelError, " activation_time_s: 0.0 is not"),
        ("muscles.csv", "0.01,0.0,", "0.01,25,", ModelError, "pennation_rad: 25.0; expected 0 to"),
        ("joints.csv", "location_y_m", "y", DataError, "row 1: missing column location_y_m"),
        ("path_wraps.csv", "d,-1,-1", "d,-1,99", ModelError, "last_point: 99; its path has"),
        ("wrap_objects.csv", "0.0591,0.0,0.0", "0.0591,0.0,0.3", ModelError, "serr_ant: turned by"),
        ("constants.yaml", "[serr_", "[serr", ModelError, "muscles: serrant not in muscles.c"),
        ("constants.yaml", "[TSproj", "[TZproj", ModelError, "points: TZprojection not in markers"),
        ("markers.csv", "AI,scapula_r", "AI,blade", ModelError, "column segment: blade not in"),
        ("constants.yaml", "unit: m/s2, ", "", ModelError, "gravity.vector_mps2: expected the"),
        ("constants.yaml", "subscap11:", "subscap12:", ModelError, "subscap12 not in muscles.csv"),
        ("constants.yaml", "excluded_muscles:", "left_out:", ModelError, "no excluded_muscles"),
        ("constants.yaml", "hill:", "hill: [", ModelError, "cannot be read"),
        ("constants.yaml", "k_pe: {value: 5.0", "k_pe: {value: '5'", ModelError, "hill.k_pe: '5'"),
        ("constants.yaml", "  k_pe:", "  k_po:", ModelError, "hill.k_p"),
        (
            "constants.yaml",
            "9.80665, 0.0]",
            "9.80665]",
            ModelError,
            "gravity.vector_mps2.2: is mis",
        ),
    ],
)
def test_damage_is_refused_with_its_place(model, file, old, new, error, message):
    damage(model / file, old, new)
    with pytest.raises(error, match=message) as refusal:
        read_tables(model)
    assert file in str(refusal.value)
