"""Tables of numbers: those without fault are read fast, and no fault passes for that."""

from pathlib import Path

import numpy as np
import pytest

from scapulohumeral.errors import DataError
from scapulohumeral.model.csv_table import read_numbers, uniform_rate

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


def rate_of(time_s: np.ndarray) -> float:
    """Rate of times that a table holds."""
    return uniform_rate(Path("table.csv"), "time_s", time_s)


@pytest.mark.parametrize(
    ("rate_hz", "decimals"),
    [(60.0, 3), (120.0, 3), (128.0, 3), (240.0, 3), (300.0, 3), (1500.0, 4), (30.0, 2)],
)
def test_rounded_times_have_the_rate_that_they_were_rounded_from(
    rate_hz: float, decimals: int
) -> None:
    exact = 0.25 + np.arange(240) / rate_hz
    assert rate_of(exact) == pytest.approx(rate_hz, rel=1e-12)
    assert rate_of(np.round(exact, decimals)) == pytest.approx(rate_hz, rel=5e-4)


def test_a_lost_row_or_another_rate_is_not_taken_for_rounding() -> None:
    for rate_hz in (120.0, 300.0):
        lost = np.delete(np.round(np.arange(240) / rate_hz, 3), 100)
        with pytest.raises(DataError, match=r"table.csv, row 102, column time_s: .* rows without"):
            rate_of(lost)
    changed = np.round(np.cumsum(np.repeat([0.004, 0.005], 120)), 3)
    with pytest.raises(DataError, match="expected 0.004502 s throughout"):
        rate_of(changed)
    with pytest.raises(DataError, match="1 rows of data; expected at least two"):
        rate_of(np.zeros(1))
