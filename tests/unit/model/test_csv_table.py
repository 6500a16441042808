"""Tables of numbers: those without fault are read fast, and no fault passes for that."""

from pathlib import Path

import numpy as np
import pytest

from scapulohumeral.errors import DataError
from scapulohumeral.model.csv_table import read_numbers

pytestmark = pytest.mark.unit


def numbers(folder: Path, text: str) -> np.ndarray:
    """Columns b and a of a table."""
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return read_numbers(path, ("b", "a"))


@pytest.mark.parametrize(
    "text",
    ["a,b,c\n1,2,x\n3,4,\n", "\ufeffa,b,c\r\n1,2,x\r\n3,4,\r\n", 'a, b,c\n1,2,"x, y"\n3,4,\n'],
)
def test_columns_are_in_the_order_asked_for(tmp_path: Path, text: str) -> None:
    np.testing.assert_array_equal(numbers(tmp_path, text), [[2.0, 1.0], [4.0, 3.0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b,a\n1,2,3\n", "row 1: column a more than once. Keep one of them"),
        ("a,b,c\n1,2\n3,4\n", "row 2: 2 cells, expected 3 as in the header"),
        ("a,b,c\n1,2,3\n3,4\n", "row 3: 2 cells, expected 3 as in the header"),
        ("a,b\n1,2\n3,4,5\n", "row 3: 3 cells, expected 2 as in the header"),
        ("a,b\n1,2,3\n3,4,5\n", "row 2: 3 cells, expected 2 as in the header"),
        ("a,b\n1,2\n\n3,4\n", "row 3: 0 cells, expected 2 as in the header"),
        ("a,b\n1,\n", "row 2, column b: '' is not a number"),
        ("a\n1\n", "row 1: missing column b; found a"),
        ("", "0 lines; expected a header and at least one row"),
    ],
)
def test_faults_are_refused_with_their_place(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DataError) as refusal:
        numbers(tmp_path, text)
    assert f"{tmp_path / 'table.csv'}" in str(refusal.value)
    assert said in str(refusal.value)
