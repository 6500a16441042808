"""Figures as SVG text, with the numbers that they draw."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

# Okabe and Ito's colours, told apart by colour-blind people; the same meaning in every figure.
COLOURS = {
    "recorded": "#9a9a9a",
    "quaternion": "#0072b2",
    "euler": "#d55e00",
    "published": "#009e73",
}
LABELS = {
    "recorded": "recorded",
    "quaternion": "quaternion",
    "euler": "Euler angles",
    "published": "published simulation",
}
LINES: dict[str, dict[str, Any]] = {
    "recorded": {"linewidth": 4.0, "zorder": 1, "alpha": 0.6},
    "quaternion": {"linewidth": 1.4, "zorder": 4},
    "euler": {"linewidth": 1.2, "zorder": 3},
    "published": {"linewidth": 1.1, "linestyle": (0, (4, 2)), "zorder": 2},
}
FAILED_LINE = (0, (1, 1.5))
# Letters of a label that fit into an inch, and the room that a line and its spaces take.
LETTERS_PER_INCH = 14
HANDLE_LETTERS = 7
STYLE: Any = {
    # Text stays text, and identifiers follow from the content: equal results give equal files.
    "svg.fonttype": "none",
    "svg.hashsalt": "scapulohumeral",
    "font.family": "sans-serif",
    "font.size": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "axes.titlesize": 9,
}
# Decorator of every function that draws.
styled = mpl.rc_context(STYLE)


@dataclass(frozen=True)
class Picture:
    """A finished figure: SVG text, a sentence of what it shows, and its numbers as a data link."""

    name: str
    svg: str
    caption: str
    data_uri: str


@dataclass(frozen=True, eq=False)
class Kept:
    """Numbers of a curve: `y` over `x`, and what the two are, where its axes do not say so."""

    panel: str
    curve: str
    x: Sequence | np.ndarray
    y: np.ndarray
    axes: Axes | None = None
    across: str = ""
    along: str = ""


class Drawing:
    """A figure that remembers every curve drawn into it. Use it under ``styled``."""

    def __init__(self, rows: int, columns: int, size: tuple[float, float], **shared: Any) -> None:
        self.figure = Figure(figsize=size, layout="constrained")
        self.axes = self.figure.subplots(rows, columns, squeeze=False, **shared)
        self._curves: list[Kept] = []

    def panels(self, count: int) -> list[Axes]:
        """The first panels, row by row; the others are taken away."""
        panels = list(self.axes.flat)
        for unused in panels[count:]:
            unused.set_visible(False)
        return panels[:count]

    def curve(self, axes: Axes, curve: str, x: np.ndarray, y: np.ndarray, **line: Any) -> None:
        """Draw a curve and keep its numbers under the title of its panel."""
        axes.plot(x, y, **line)
        self._curves.append(Kept(axes.get_title(loc="left"), curve, x, y, axes))

    def keep(
        self,
        panel: str,
        curve: str,
        x: Sequence | np.ndarray,
        y: np.ndarray,
        *,
        across: str = "",
        along: str = "",
    ) -> None:
        """Keep numbers that are drawn by other means.

        Parameters
        ----------
        x : numbers, or names of rows
        across, along : what `x` and `y` are, with their units
        """
        self._curves.append(Kept(panel, curve, x, y, None, across, along))

    def legend(self, entries: Mapping[str, Mapping[str, Any]]) -> None:
        """One legend for all panels, above them, in as many rows as its labels need."""
        handles = [mpl.lines.Line2D([], [], label=label, **line) for label, line in entries.items()]
        letters = sum(len(label) + HANDLE_LETTERS for label in entries)
        rows = math.ceil(letters / (LETTERS_PER_INCH * self.figure.get_figwidth()))
        self.figure.legend(
            handles=handles,
            loc="outside upper center",
            ncols=math.ceil(len(handles) / rows),
            frameon=False,
        )

    def watermark(self, text: str) -> None:
        """Cover the figure with a text: its results are none."""
        width, height = self.figure.get_size_inches()
        self.figure.text(
            0.5, 0.5, text, ha="center", va="center", rotation=8, color="#b00020", alpha=0.28,
            zorder=20, fontsize=min(10.0 * height, 100.0 * width / len(text)),
        )  # fmt: skip

    def finish(self, name: str, caption: str) -> Picture:
        """SVG text and numbers of the figure."""
        numbers = self._numbers().to_csv(float_format="%.5g", lineterminator="\n")
        data = base64.b64encode(numbers.encode()).decode()
        return Picture(name, _svg(self.figure), caption, f"data:text/csv;base64,{data}")

    def _numbers(self) -> pd.DataFrame:
        """Numbers of all curves: names of rows in their order, other first columns ascending.

        One column per curve: the names of panel and curve in every row would fill megabytes.
        """
        rows = []
        for kept in self._curves:
            along = kept.along or self._label(kept.axes, "y")
            unit = f", {along}" if along and along != kept.panel else ""
            name = f"{kept.panel} | {kept.curve}{unit}"
            rows.append(pd.DataFrame({"curve": name, "x": kept.x, "y": kept.y}))
        whole = pd.concat(rows)
        table = whole.pivot(index="x", columns="curve", values="y")
        if not pd.api.types.is_numeric_dtype(whole.x):
            table = table.reindex(whole.x.unique())
        across = dict.fromkeys(k.across or self._label(k.axes, "x") for k in self._curves)
        return table.rename_axis(index=", ".join(filter(None, across)) or "x")

    def _label(self, axes: Axes | None, side: str) -> str:
        """Label of an axis; panels that share it have it once, and a figure may have it alone."""
        if axes is None:
            return ""
        panels = [getattr(one, f"get_{side}label")() for one in (axes, *self.axes.flat)]
        return next(filter(None, panels), getattr(self.figure, f"get_sup{side}label")())


def _svg(figure: Figure) -> str:
    """SVG element that scales with the page, without preamble, metadata and needless digits."""
    stream = io.StringIO()
    # The same text as `savefig`, which draws every figure twice: first without output, for backends
    # whose sizes depend on the resolution.
    FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    # Nothing refers to the names of groups, and they would repeat from figure to figure.
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r' d="([^"]*)"', _short_path, text)
    return re.sub(r"\n\s*", "\n", text)


def _short_path(match: re.Match[str]) -> str:
    """Path data in hundredths of a point."""
    return ' d="' + re.sub(r"(\.\d\d)\d+", r"\1", match[1]).replace("\n", " ") + '"'
