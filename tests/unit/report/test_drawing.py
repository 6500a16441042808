"""Numbers that a figure offers beside its curves."""

import base64
import io

import numpy as np
import pandas as pd
import pytest

from scapulohumeral.report.drawing.svg import Drawing

pytestmark = pytest.mark.unit


def numbers(drawing: Drawing) -> pd.DataFrame:
    coded = drawing.finish("name", "caption").data_uri.split(",", 1)[1]
    return pd.read_csv(io.BytesIO(base64.b64decode(coded)))


def test_columns_have_the_labels_of_their_axes() -> None:
    """Also where one panel, or the figure, has the label for all."""
    drawing = Drawing(2, 1, (4.0, 4.0), sharex="all")
    for axes, title in zip(drawing.axes.flat, ("upper", "lower"), strict=True):
        axes.set_title(title, loc="left")
        drawing.curve(axes, "a", np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    drawing.axes[1, 0].set_xlabel("time [s]")
    drawing.figure.supylabel("force [N]")
    assert list(numbers(drawing).columns) == [
        "time [s]",
        "lower | a, force [N]",
        "upper | a, force [N]",
    ]


def test_rows_with_names_keep_their_order_and_a_unit_is_not_said_twice() -> None:
    drawing = Drawing(1, 1, (4.0, 4.0))
    drawing.keep("error [mm]", "a", ["second", "first"], np.array([2.0, 1.0]), across="muscle",
                 along="error [mm]")  # fmt: skip
    table = numbers(drawing)
    assert list(table.columns) == ["muscle", "error [mm] | a"]
    assert table.muscle.tolist() == ["second", "first"]
