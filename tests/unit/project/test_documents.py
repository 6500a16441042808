"""Documents are read or refused: file, key, reason, and the remedy of the caller."""

from pathlib import Path

import pytest

from scapulohumeral.documents import check_schema, read_json, read_mapping, read_yaml
from scapulohumeral.errors import ConfigError, DataError, ModelError

pytestmark = pytest.mark.unit

REMEDY = "Do this."


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.yaml"


def test_plain_data_are_read(file: Path) -> None:
    file.write_text("a: [1, 2.5, null]\nb: {c: true}\n", encoding="utf-8")
    assert read_yaml(file, REMEDY) == {"a": [1, 2.5, None], "b": {"c": True}}
    assert read_mapping(file, "a and b", REMEDY)["b"] == {"c": True}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a: 1\nb: {c: 2, c: 3}\n", r"key 'c' more than once(.|\n)*line 2(.|\n)*Do this"),
        (b"a: [1, 2\n", r"cannot be read as YAML(.|\n)*Do this"),
        (b"a: !!python/object/apply:os.getcwd []\n", r"constructor(.|\n)*Do this"),
        (b"a: \xff\xfe\n", "no text in UTF-8.*Save it as UTF-8"),
    ],
)
@pytest.mark.parametrize("refusal", [ConfigError, ModelError])
def test_what_is_no_yaml_is_refused(file: Path, content: bytes, message: str, refusal) -> None:
    file.write_bytes(content)
    with pytest.raises(refusal, match=rf"a\.yaml: {message}|a\.yaml(.|\n)*{message}"):
        read_yaml(file, REMEDY, refusal)


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    reasons = {tmp_path / "none.yaml": "No such file", tmp_path: "Is a directory"}
    for path, said in reasons.items():
        with pytest.raises(ConfigError, match=rf"{path}: {said}.*Do this"):
            read_yaml(path, REMEDY)
        with pytest.raises(DataError, match=rf"{path}: {said}.*Do this"):
            read_json(path, REMEDY)


@pytest.mark.parametrize("content", ["", "a\n", "- a\n"])
def test_document_without_keys_is_refused_where_keys_are_needed(file: Path, content: str) -> None:
    file.write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"a\.yaml: no keys; expected schema\. Add them"):
        read_mapping(file, "schema", REMEDY)


def test_what_is_no_json_is_refused(file: Path) -> None:
    file.write_text("{", encoding="utf-8")
    with pytest.raises(DataError, match=r"a\.yaml: cannot be read as JSON.*Do this"):
        read_json(file, REMEDY)


def test_schema_refuses_with_key_and_meaning() -> None:
    schema = {
        "type": "object",
        "properties": {
            "side": {"enum": ["left", "right"], "description": "side of the body"},
            "size": {"type": "number"},
        },
    }
    check_schema(Path("a.yaml"), {"side": "left", "size": 1}, schema, "as usual")
    with pytest.raises(ConfigError, match=r"a\.yaml, side: 'up'.*expected: side of the body"):
        check_schema(Path("a.yaml"), {"side": "up"}, schema, "as usual")
    with pytest.raises(ConfigError, match=r"a\.yaml, size: 'x'.*expected: as usual"):
        check_schema(Path("a.yaml"), {"size": "x"}, schema, "as usual")
