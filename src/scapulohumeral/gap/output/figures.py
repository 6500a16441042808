"""Figures of a diagnosis. Every number comes from the `Diagnosis` and its tables.

Readable without colour: sign and significance are also told by marks, hatches and line styles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from scapulohumeral.gap.curve_files import MODEL, REFERENCE
from scapulohumeral.gap.labels import JOIN, NO_GAP, NONE
from scapulohumeral.gap.result import Diagnosis, Shrinkage
from scapulohumeral.report.drawing.svg import COLOURS, LETTERS_PER_INCH, Drawing, Picture, styled

# Orange to purple: told apart by colour-blind people, symmetric about white.
DIVERGING = "PuOr_r"
DARK, GREY = "#333333", "#9a9a9a"
CIRCLES = "In a circle: not found in both halves of the test trials."
NO_HALVES = "There are too few test trials to look for it in two halves of them."
WORDS = {NONE: "none of the known effects", NO_GAP: "no gap"}
# Panels of differences; the others are in the table.
MOST_PANELS = 9
CURVES = {
    "difference": {"color": COLOURS["recorded"], "linewidth": 3.5, "alpha": 0.7},
    "no_effect": {"color": COLOURS["quaternion"], "linewidth": 1.3, "linestyle": (0, (4, 2))},
    "with_effect": {"color": COLOURS["euler"], "linewidth": 1.4},
}
DIFFERENCES = {REFERENCE: "test minus reference trials", MODEL: "recorded minus model"}
SPLITS = {
    "in_sample": "trials fitted to",
    "held_out_trial": "trials left out",
    "new_task": "one more task, expected",
}


def figures(diagnosis: Diagnosis) -> dict[str, Picture]:
    """All figures that a diagnosis has numbers for, by name."""
    drawn = {
        "shows": shows_figure,
        "enters": enters_figure,
        "overlay": overlay_figure,
        "signature": signature_figure,
        "isolability": isolability_figure,
        "amplitude": amplitude_figure,
    }
    pictures = {
        name: draw(diagnosis.curves[name])
        for name, draw in drawn.items()
        if name in diagnosis.curves and len(diagnosis.curves[name])
    }
    if diagnosis.status != "failed":
        pictures["candidates"] = candidates_figure(diagnosis)
    if diagnosis.shrinkage is not None:
        pictures["shrinkage"] = shrinkage_figure(
            diagnosis.shrinkage, diagnosis.curves.get("controls")
        )
    return pictures


@styled
def shows_figure(table: pd.DataFrame) -> Picture:
    """Heat map channel by phase [sigma], hatched below the threshold, marked if not repeated."""
    drawing = Drawing(1, 1, (8.0, 0.6 + 0.22 * table["channel"].nunique()))
    table = table.assign(below=table["effect_sigma"].abs() < table["threshold_sigma"])
    _heat_map(drawing, table, "channel", "effect_sigma", "gap [σ]")
    above = _peaks(table)
    _marks(drawing.panels(1)[0], above)
    known = all(pd.notna(peak["repeated"]) for peak in above.values())
    return drawing.finish(
        "gap_shows",
        "Where the gap shows: mean difference of each channel over its standard error. Hatched: "
        "below the threshold. + and − give the sign of what is above it. "
        f"{CIRCLES if known else NO_HALVES}",
    )


@styled
def enters_figure(table: pd.DataFrame) -> Picture:
    """Heat map of what is missing by degree of freedom or channel, one panel per unit."""
    units = list(table["unit"].unique())
    drawing = Drawing(len(units), 1, (8.0, 0.9 * len(units) + 0.22 * table["name"].nunique()))
    for row, unit in enumerate(units):
        part = table[table["unit"] == unit]
        part = part.assign(below=part["effect"].abs() < part["threshold"])
        _heat_map(drawing, part, "name", "effect", f"missing [{unit}]", row)
    return drawing.finish(
        "gap_enters",
        "Where the gap enters: generalised forces and errors of channels that would explain "
        "the difference. Forces of ball joints act about axes of the distal segment; rotations in "
        "the other maps are about those of the proximal one. Hatched: below the threshold.",
    )


def _heat_map(
    drawing: Drawing, table: pd.DataFrame, key: str, value: str, label: str, row: int = 0
) -> None:
    axes = drawing.axes[row, 0]
    names = [str(name) for name in table[key].unique()]
    grid = table.pivot(index=key, columns="phase_percent", values=value).loc[names]
    below = table.pivot(index=key, columns="phase_percent", values="below").loc[names]
    phase = grid.columns.to_numpy(float)
    # A cell about each node, half a step to both sides.
    half = 0.5 * (phase[-1] - phase[0]) / (len(phase) - 1)
    limit = max(float(np.abs(grid.to_numpy()).max()), np.finfo(float).tiny)
    image = axes.imshow(
        grid.to_numpy(),
        aspect="auto",
        cmap=DIVERGING,
        vmin=-limit,
        vmax=limit,
        extent=(phase[0] - half, phase[-1] + half, len(names) - 0.5, -0.5),
        interpolation="nearest",
    )
    for i, name in enumerate(names):
        hidden = phase[below.loc[name].to_numpy(bool)]
        axes.bar(
            hidden, 1.0, 2.0 * half, i - 0.5, facecolor="none", edgecolor=GREY, hatch="////",
            linewidth=0.0,
        )  # fmt: skip
        drawing.keep(label, name, phase, grid.loc[name].to_numpy())
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("movement [%]")
    axes.grid(visible=False)
    axes.set_title(label, loc="left")
    drawing.figure.colorbar(image, ax=axes)


def _peaks(table: pd.DataFrame) -> dict[int, pd.Series]:
    """Row of the peak of each channel that is above the threshold, by the channel's number."""
    parts = (part for _, part in table.groupby("channel", sort=False))
    peaks = {
        i: part.iloc[int(np.argmax(part["effect_sigma"].abs()))] for i, part in enumerate(parts)
    }
    return {i: peak for i, peak in peaks.items() if not peak["below"]}


def _marks(axes: Axes, peaks: Mapping[int, pd.Series]) -> None:
    """Sign at the peaks; in a circle if it is known that they are not repeated."""
    for i, peak in peaks.items():
        sign = "+" if peak["effect_sigma"] > 0 else "−"
        circle = {"boxstyle": "circle,pad=0.1", "fc": "white", "ec": "none"}
        if pd.notna(peak["repeated"]) and not peak["repeated"]:
            circle["ec"] = DARK
        place = np.clip(peak["phase_percent"], 2.0, 98.0)
        axes.text(place, i, sign, ha="center", va="center", bbox=circle)


@styled
def overlay_figure(table: pd.DataFrame) -> Picture:
    """Difference recorded and predicted, in the channels that gap most, with the floor."""
    [compared_with] = table["compared_with"].unique()
    names = {
        "difference": DIFFERENCES[compared_with],
        "no_effect": "no effect",
        "with_effect": "most probable effect",
    }
    gap, spread = table["difference"].abs(), (table["floor_high"] - table["floor_low"]).abs()
    keys = [table["task"], table["channel"]]
    ratio = gap / spread.clip(lower=1e-9)
    worst = ratio.groupby(keys, sort=False).max().nlargest(MOST_PANELS).index
    rows = -(-len(worst) // 3)
    drawing = Drawing(rows, 3, (9.0, 2.1 * rows))
    for axes, (task, channel) in zip(drawing.panels(len(worst)), worst, strict=True):
        part = table[(table["task"] == task) & (table["channel"] == channel)].assign(no_effect=0.0)
        axes.set_title(f"{task}, {channel}", loc="left")
        phase = part["phase_percent"].to_numpy(float)
        axes.fill_between(phase, part["floor_low"], part["floor_high"], color="#e6e6e6")
        for name, line in CURVES.items():
            drawing.curve(axes, names[name], phase, part[name].to_numpy(float), **line)
        axes.set_ylabel(part["unit"].iloc[0])
        axes.set_xlabel("movement [%]")
    drawing.legend({names[name]: line for name, line in CURVES.items()})
    return drawing.finish(
        "overlay",
        f"Mean difference, {names['difference']}, and what the most probable effect predicts of "
        "it, in the channels where it is largest over the floor. Grey band: 95 % of the "
        "differences without any effect.",
    )


@styled
def signature_figure(table: pd.DataFrame) -> Picture:
    """The gap, the best signature and the rest, as three rows of one scale."""
    columns = {"residual_sigma": "gap", "signature_sigma": "best effect", "rest_sigma": "rest"}
    channels = list(table["channel"].unique())
    drawing = Drawing(1, 1, (8.0, 3.0))
    [axes] = drawing.panels(1)
    axes.set_title("root mean square over the movement", loc="left")
    axes.set_axisbelow(True)
    x = np.arange(len(channels))
    for k, (column, label) in enumerate(columns.items()):
        rms = table.groupby("channel", sort=False)[column].apply(lambda v: np.sqrt((v**2).mean()))
        shade = str(0.2 + 0.3 * k)
        axes.bar(x + 0.27 * (k - 1), rms.to_numpy(float), 0.25, color=shade, label=label)
        drawing.keep("rms", label, channels, rms.to_numpy(float))
    axes.set_xticks(x, channels, rotation=60, ha="right")
    axes.set_ylabel("σ")
    axes.legend(frameon=False, ncols=3)
    return drawing.finish(
        "signature",
        "The gap of each channel, what the most probable effect would cause, and what it leaves. "
        "Numbers over the movement are in curves/signature.csv.",
    )


@styled
def candidates_figure(diagnosis: Diagnosis) -> Picture:
    """Probabilities of the causes, none of them, and no gap; the 90 % set has a frame."""
    entries = [(candidate.label, candidate.p) for candidate in diagnosis.candidates]
    entries += [(NONE, diagnosis.none_p or 0.0), (NO_GAP, diagnosis.no_gap_p or 0.0)]
    labels, p = [e[0] for e in entries], np.array([e[1] for e in entries])
    names = [WORDS.get(label, label) for label in labels]
    drawing = Drawing(1, 1, (8.0, 0.7 + 0.27 * len(entries)))
    [axes] = drawing.panels(1)
    frames = [DARK if label in diagnosis.set90 else "none" for label in labels]
    axes.set_axisbelow(True)
    axes.barh(names, p, color="#9ecae1", edgecolor=frames, linewidth=1.8)
    for i, value in enumerate(p):
        axes.text(value + 0.01, i, f"{value:.2f}", va="center")
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.1)
    axes.set_xlabel("probability, if the cause is one of the known effects or none of them")
    drawing.keep("probability", "p", names, p)
    return drawing.finish("candidates", "Probability of each cause. Framed: what is not excluded.")


@styled
def isolability_figure(table: pd.DataFrame) -> Picture:
    """Matrix of the probability that two effects are told apart by these trials."""
    labels = list(dict.fromkeys([*table["label_a"], *table["label_b"]]))
    place = {label: i for i, label in enumerate(labels)}
    grid = np.full((len(labels), len(labels)), np.nan)
    for a, b, p in table.itertuples(index=False):
        grid[place[a], place[b]] = grid[place[b], place[a]] = p
    names = [label.replace(JOIN, f"\n{JOIN.strip()} ") for label in labels]
    longest = max(len(line) for name in names for line in name.split("\n"))
    size = 1.0 + longest / LETTERS_PER_INCH + 0.4 * len(labels)
    drawing = Drawing(1, 1, (size + 1.0, size))
    [axes] = drawing.panels(1)
    image = axes.imshow(grid, cmap="Greys", vmin=0.5, vmax=1.0)
    axes.set_xticks(range(len(labels)), names, rotation=90)
    axes.set_yticks(range(len(labels)), names)
    axes.grid(visible=False)
    axes.set_title("probability of telling apart", loc="left")
    drawing.figure.colorbar(image, ax=axes)
    for label, row in zip(labels, grid, strict=True):
        drawing.keep("p", label, labels, row)
    return drawing.finish(
        "isolability", "Which effects these trials can tell apart: black yes, white by chance only."
    )


@styled
def amplitude_figure(table: pd.DataFrame) -> Picture:
    """Amplitude of the best effect by task with its interval."""
    parameters = list(table["parameter"].unique())
    drawing = Drawing(1, len(parameters), (3.2 * len(parameters) + 1.0, 2.6))
    for axes, name in zip(drawing.panels(len(parameters)), parameters, strict=True):
        part = table[table["parameter"] == name]
        axes.set_title(f"{name} [{part['unit'].iloc[0]}]", loc="left")
        ends = np.abs(part[["low", "high"]].to_numpy(float).T - part["value"].to_numpy(float))
        axes.errorbar(part["task"], part["value"], yerr=ends, fmt="o", color=DARK, capsize=3)
        drawing.keep(name, "value", part["task"].tolist(), part["value"].to_numpy(float))
    return drawing.finish(
        "amplitude",
        "Amplitude fitted to each task alone, with 95 % interval: different amplitudes speak "
        "against the cause.",
    )


@styled
def shrinkage_figure(shrinkage: Shrinkage, controls: pd.DataFrame | None) -> Picture:
    """Share of the reducible gap that disappears, by split; controls in grey."""
    shares = {label: getattr(shrinkage, name) for name, label in SPLITS.items()}
    given = {label: share for label, share in shares.items() if share is not None}
    extra: Sequence = [] if controls is None else list(controls.itertuples(index=False))
    names = [*given, *(row[0] for row in extra)]
    values = np.array([*(share.value for share in given.values()), *(row[1] for row in extra)])
    drawing = Drawing(1, 1, (8.0, 0.9 + 0.32 * max(len(names), 1)))
    [axes] = drawing.panels(1)
    colours = [DARK] * len(given) + [GREY] * len(extra)
    axes.set_axisbelow(True)
    axes.barh(names, 100.0 * values, color=colours, height=0.6)
    for i, share in enumerate(given.values()):
        if share.ci95 is not None:
            axes.plot(100.0 * np.array(share.ci95), [i, i], color=COLOURS["euler"], linewidth=2.5)
    axes.axvline(100.0, color=DARK, linestyle="--", linewidth=1.0)
    axes.invert_yaxis()
    axes.set_xlabel("share of the reducible gap that disappears [%]; dashed: down to the floor")
    drawing.keep("shrinkage", "share", names, values)
    return drawing.finish(
        "shrinkage",
        "How far the gap shrinks with the effect added, as much of it as other trials of this "
        "person show in each channel; coloured lines: 95 % interval. Share and interval of "
        "one more task are expected, as errors of predictions say; what tasks left out of the fit "
        "showed is in left_out.csv. A right cause keeps its shrinkage on a task that was not used "
        "for fitting.",
    )
