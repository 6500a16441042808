"""A model record on disk is read as what was written, or refused with file and key."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from skeleton import skeleton_record

from scapulohumeral.errors import ModelError
from scapulohumeral.model.record import read_record, write_record

pytestmark = pytest.mark.unit


@pytest.fixture
def file(tmp_path: Path) -> Path:
    write_record(skeleton_record(), tmp_path / "par9.json")
    return tmp_path / "par9.json"


def test_record_comes_back_as_it_was_written(file: Path) -> None:
    assert read_record(file) == skeleton_record()


def test_file_has_the_parts_in_the_order_of_the_schema(file: Path) -> None:
    document = json.loads(file.read_text(encoding="utf-8"))
    assert list(document)[:3] == ["schema", "participant", "masses"]
    assert list(document)[-2:] == ["published_thorax_ellipsoid", "constants"]
    assert document["muscles"][0]["points"][0] == {
        "body": "thorax",
        "location_m": [0.0, 0.05, 0.1],
    }


def muscle_key(document: dict) -> None:
    document["muscles"][2]["strength"] = 3.0


def segment_mass(document: dict) -> None:
    document["segments"]["hand_r"]["mass_kg"] = "0.5"


def conoid_length(document: dict) -> None:
    document["conoid"]["length_m"] = float("nan")


def no_joints(document: dict) -> None:
    del document["joints"]


def other_schema(document: dict) -> None:
    document["schema"] = "model/2"


def hill_constant(document: dict) -> None:
    del document["constants"]["hill"]["d4"]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (muscle_key, r"muscles\.2\.strength: there is no such key"),
        (segment_mass, r"segments\.hand_r\.mass_kg: '0\.5'; expected a valid number"),
        (conoid_length, r"conoid\.length_m: nan; expected"),
        (no_joints, "joints: is missing"),
        (other_schema, "schema: 'model/2'; expected 'model/1'"),
        (hill_constant, r"constants\.hill\.d4: is missing"),
    ],
)
def test_damaged_record_is_refused_with_its_key(
    file: Path, damage: Callable[[dict], None], message: str
) -> None:
    document = json.loads(file.read_text(encoding="utf-8"))
    damage(document)
    file.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(ModelError, match=rf"par9\.json, {message}.*Build the model"):
        read_record(file)


@pytest.mark.parametrize("content", [b"", b"[1, 2", b"\xff\xfe\x00"])
def test_file_that_is_no_record_is_refused(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    with pytest.raises(ModelError, match=r"par9\.json: cannot be read as JSON.*Build the model"):
        read_record(file)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such file|No such file"):
        read_record(tmp_path / "par9.json")


def test_other_masses_bring_their_inertia_along() -> None:
    record = skeleton_record()
    heavy = record.with_masses({"humerus_r": 3.0 * record.segments["humerus_r"].mass_kg})
    assert heavy.segments["humerus_r"].inertia_kgm2 == pytest.approx(
        [3.0 * value for value in record.segments["humerus_r"].inertia_kgm2]
    )
    assert heavy.segments["ulna_r"] == record.segments["ulna_r"]


def test_another_size_of_a_surface_leaves_the_others() -> None:
    record = skeleton_record()
    large = record.with_surface("ball", (0.07,))
    assert [w.dimensions_m for w in large.wrap_objects] == [(0.02,), (0.07,), (0.02, 0.05)]
    assert replace(large, wrap_objects=record.wrap_objects) == record
