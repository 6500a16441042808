"""Tables of the report: what each row says comes from result files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.quantities.joint_loading import percent_body_weight
from scapulohumeral.quantities.paper import (
    BODY_MASS_MEAN_KG,
    BODY_MASS_SD_KG,
    TRACKING_RMSE_DEG,
)
from scapulohumeral.report.study import FORMULATIONS, Run, Study
from scapulohumeral.report.targets import MEASURE_NAMES
from scapulohumeral.report.tracking.figures import GROUP_NAMES
from scapulohumeral.report.words import in_words, variant_in_words

ARM_SEGMENTS = {
    "upper_arm": ("humerus_r",),
    "forearm": ("ulna_r", "radius_r"),
    "hand": ("hand_r",),
}
# An arm whose mass belongs to a body more than twice, or less than half, as heavy is no arm.
IMPLAUSIBLE_RATIO = 2.0
# What a model record says of a body mass that is the participant's own.
OWN_MASS = "participant"
# Weights of terms that daily tasks do not have, in the section of the configuration that both use.
ONLY_OF_CALIBRATION = ("weight emg", "weight parameters")

# Columns that hold a variant, or in the ladder the one that it starts from.
OF_VARIANTS = ("variant", "rung", "step")

AGREES_WITHIN_DEG = 1.0
REASONS = {
    "rmse_clavicle_deg": (
        "the weight of the clavicle is a choice: quaternion solves track a point of its axis, "
        "whose distance from the sternum sets the weight (see the deviation below)"
    ),
    "rmse_thoracoscapular_deg": (
        "follows from the thorax surface, which is fitted here and was adjusted by hand in the "
        "paper, and from the balance of tracking against activation"
    ),
    "rmse_thoracohumeral_deg": (
        "near the singularity of Y-Z-Y the first and third angle are arbitrary, so a small "
        "rotation counts as many degrees; compare the angle between the orientations"
    ),
}


@dataclass(frozen=True)
class Table:
    """A table: names of the columns, rows of text, and the numbers of the rows to point out."""

    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    flagged: frozenset[int] = frozenset()


@dataclass(frozen=True)
class MeanError:
    """A tracking error [deg], mean over `solves` of a formulation, and the paper's."""

    formulation: str
    key: str
    solves: int
    ours_deg: float
    published_deg: float

    @property
    def why(self) -> str:
        """Where a difference comes from."""
        near = abs(self.ours_deg - self.published_deg) < AGREES_WITHIN_DEG
        return f"agrees within {AGREES_WITHIN_DEG:g} deg" if near else REASONS[self.key]


def named_rows(table: pd.DataFrame) -> list[Any]:
    """Rows of a table, whose columns are attributes."""
    return list(table.itertuples(index=False))


def solves(table: pd.DataFrame, names: Sequence[str], digits: int) -> Table:
    """Rows of solves as text; marked: not converged.

    Parameters
    ----------
    table : with a column "status"
    names : columns of words, which come first; all others hold numbers
    digits : significant ones
    """
    numbers = [column for column in table.columns if column not in names]
    rows = [
        (
            *("" if pd.isna(row[name]) else cell_in_words(name, row[name]) for name in names),
            *("" if pd.isna(row[key]) else f"{row[key]:.{digits}g}" for key in numbers),
        )
        for row in table.to_dict("records")
    ]
    flagged = frozenset(k for k, row in enumerate(table.status) if row != "optimal")
    return Table(tuple(map(in_words, (*names, *numbers))), rows, flagged)


def cell_in_words(column: str, value: Any) -> str:
    """A cell of words of a table of solves."""
    return variant_in_words(str(value)) if column in OF_VARIANTS else str(value)


def number_or_none(value: float, digits: int = 2) -> str:
    """A number as text; "none" for what is not a number."""
    return "none" if np.isnan(value) else f"{value:.{digits}f}"


def masses(study: Study) -> Table:
    """Arm mass of each participant against de Leva's anthropometry."""
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for name, record in study.models.items():
        body = record.body_mass_kg
        kg = [sum(record.segments[s].mass_kg for s in part) for part in ARM_SEGMENTS.values()]
        expected = body * arm_share(record)
        ratio = sum(kg) / expected
        if max(ratio, 1.0 / ratio) > IMPLAUSIBLE_RATIO:
            flagged.add(len(rows))
        rows.append(
            (
                name,
                *(f"{value:.2f}" for value in kg),
                f"{sum(kg):.2f}",
                f"{expected:.2f}",
                f"{ratio:.2f}",
                f"{body * ratio:.0f}",
                mass_judgement(body, ratio, known=record.body_mass_source == OWN_MASS),
            )
        )
    columns = (
        "participant", "upper arm [kg]", "forearm [kg]", "hand [kg]", "arm [kg]",
        "anthropometry [kg]", "ratio", "body it would belong to [kg]", "judgement",
    )  # fmt: skip
    return Table(columns, rows, frozenset(flagged))


def arm_share(record: ModelRecord) -> float:
    """Arm mass over body mass: mean of women and men after de Leva 1996."""
    return sum(record.constants.anthropometry.share(part, None) for part in ARM_SEGMENTS)


def mass_judgement(body_mass_kg: float, ratio: float, known: bool) -> str:
    """What a ratio of arm mass to anthropometry means.

    `known` says whether the body mass is the participant's own, and not the mean of the group, from
    which a single one may differ.
    """
    if max(ratio, 1.0 / ratio) > IMPLAUSIBLE_RATIO:
        return "implausible: no arm weighs this"
    if known:
        return "plausible"
    lightest, heaviest = (BODY_MASS_MEAN_KG + k * BODY_MASS_SD_KG for k in (-2.0, 2.0))
    if lightest <= body_mass_kg * ratio <= heaviest:
        return "plausible"
    return f"outside {lightest:.0f} to {heaviest:.0f} kg, two standard deviations of the group"


def mean_errors(study: Study) -> Iterator[MeanError]:
    """Mean tracking RMSE over all converged solves, next to the paper's."""
    for formulation in FORMULATIONS:
        runs = study.solved(formulation)
        for key, published in TRACKING_RMSE_DEG.items():
            if runs:
                ours = float(np.mean([run.summary[key] for run in runs]))
                yield MeanError(formulation, key, len(runs), ours, published[formulation])


def tracking_errors(study: Study) -> Table:
    """All tracking measures of every solve, and their means over converged solves."""
    rows = [_error_row(run) for run in study.runs]
    flagged = frozenset(i for i, run in enumerate(study.runs) if run.failed)
    for formulation in FORMULATIONS:
        solved = study.solved(formulation)
        if solved:
            means = [np.mean([run.summary[key] for run in solved]) for key in MEASURE_NAMES]
            cells = (f"{mean:.2f}" for mean in means)
            rows.append((f"mean of {len(solved)}", "", formulation, *cells))
    measures = tuple(f"{name} [deg]" for name in MEASURE_NAMES.values())
    return Table(("participant", "plane", "formulation", *measures), rows, flagged)


def _error_row(run: Run) -> tuple[str, ...]:
    if run.failed:
        cells = ("not converged",) * len(MEASURE_NAMES)
    else:
        cells = tuple(f"{run.summary[key]:.2f}" for key in MEASURE_NAMES)
    return (run.participant, run.trial, run.formulation, *cells)


def solver(study: Study) -> Table:
    """Statistics of every solve."""
    rows = [
        (
            run.participant,
            run.trial,
            run.formulation,
            "NOT CONVERGED" if run.failed else "optimal",
            str(run.summary["iterations"]),
            f"{run.summary['seconds']:.1f}",
            f"{run.summary['objective']:.5g}",
            f"{run.summary['constraint_violation']:.1e}",
            f"{run.summary['norm_rmse']:.1e}" if run.formulation == "quaternion" else "",
            _largest_activation(run),
            _largest_activation_step(run),
            run.summary["message"] if run.failed else "",
        )
        for run in study.runs
    ]
    columns = (
        "participant", "plane", "formulation", "status", "iterations", "time [s]", "objective",
        "violation", "norm RMSE", "largest activation",
        "largest activation step", "why it stopped",
    )  # fmt: skip
    return Table(columns, rows, frozenset(i for i, run in enumerate(study.runs) if run.failed))


def _largest_activation(run: Run) -> str:
    """Largest activation of any element, and which it is: at 1 an element can do no more."""
    largest = run.solution.activation.max(axis=0)
    return f"{largest.max():.2f} ({run.solution.muscles[largest.argmax()]})"


def _largest_activation_step(run: Run) -> str:
    """Largest change between neighbouring nodes, and the element that makes it."""
    steps = np.abs(np.diff(run.solution.activation, axis=0)).max(axis=0)
    return f"{run.summary['max_activation_step']:.3f} ({run.solution.muscles[steps.argmax()]})"


def cost_terms(study: Study) -> Table:
    """Value of every term of the objective."""
    names = list(dict.fromkeys(name for run in study.runs for name in run.summary["terms"]))
    rows = []
    for run in study.runs:
        terms = run.summary["terms"]
        cells = (f"{terms[name]:.2e}" if name in terms else "" for name in names)
        rows.append((run.participant, run.trial, run.formulation, *cells))
    flagged = frozenset(i for i, run in enumerate(study.runs) if run.failed)
    return Table(
        ("participant", "plane", "formulation", *(n.replace("_", " ") for n in names)),
        rows,
        flagged,
    )


def geometry(study: Study) -> Table:
    """Quality of the muscle length functions of each participant and formulation."""
    fits = study.quality.groupby(["participant", "formulation"])
    rows = [tuple(map(str, name)) + _geometry_cells(table) for name, table in fits]
    columns = (
        "participant", "formulation", "wrapping elements", "length RMSE, median [mm]",
        "worst [mm]", "arm RMSE, median [mm]", "worst [mm]", "direction RMSE, worst",
        "condition, worst", "left out", "fibre length outside 0.4 to 1.8",
    )  # fmt: skip
    return Table(columns, rows)


def _geometry_cells(table: pd.DataFrame) -> tuple[str, ...]:
    wrapping = table[table.path != "straight"]
    return (
        f"{len(wrapping)} of {len(table)}",
        f"{wrapping.length_rmse_mm.median():.2f}",
        _worst(wrapping, "length_rmse_mm"),
        f"{wrapping.arm_rmse_median_mm.median():.2f}",
        _worst(wrapping, "arm_rmse_worst_mm"),
        f"{wrapping.direction_rmse.max():.3f}",
        f"{table.condition.max():.1e}",
        str(int(wrapping.left_out_held_out.sum())),
        _fibre_exceptions(table),
    )


def _worst(table: pd.DataFrame, column: str) -> str:
    """Largest number of a column and the muscle that has it."""
    row = int(table[column].to_numpy().argmax())
    return f"{table[column].iloc[row]:.2f} ({table.muscle.iloc[row]})"


def _fibre_exceptions(table: pd.DataFrame) -> str:
    outside = table[table.fibre_outside]
    return ", ".join(
        f"{r.muscle} {r.fibre_min:.2f}–{r.fibre_max:.2f}" for r in outside.itertuples()
    )


def thoraxes(study: Study) -> Table:
    """Fitted thorax surfaces, and how far the contact points are from them."""
    rows = [
        (
            name,
            " ".join(f"{1e3 * x:.0f}" for x in record["centre_m"]),
            " ".join(f"{1e3 * x:.0f}" for x in record["radii_m"]),
            f"{record['level_mean']:.2f} ± {record['level_sd']:.2f}",
            f"{record['level_min']:.2f} to {record['level_max']:.2f}",
            f"{record['prior']['level_mean']:.2f}",
        )
        for name, record in study.thoraxes.items()
    ]
    columns = (
        "participant", "centre x y z [mm]", "radii x y z [mm]", "level set", "range",
        "level set before the fit",
    )  # fmt: skip
    return Table(columns, rows)


def reactions(study: Study) -> Table:
    """Peak of the glenohumeral reaction of every converged solve."""
    rows = []
    for run in study.runs:
        if not run.failed:
            force = np.linalg.norm(run.solution.reaction_N, axis=1)
            share = percent_body_weight(force, study.models[run.participant].body_mass_kg)
            peak = int(force.argmax())
            cells = (
                f"{force[peak]:.0f}",
                f"{share[peak]:.0f}",
                f"{run.solution.time_s[peak]:.2f}",
            )
            rows.append((run.participant, run.trial, run.formulation, *cells))
    columns = ("participant", "plane", "formulation", "peak [N]", "[% body weight]", "at time [s]")
    return Table(columns, rows)


def muscle_groups(study: Study) -> Table:
    """Muscle groups of the model and their elements."""
    record = next(iter(study.models.values()))
    groups: dict[str, list[str]] = {}
    for muscle in record.muscles:
        groups.setdefault(muscle.group, []).append(muscle.name)
    rows = [
        (GROUP_NAMES.get(g, g), str(len(names)), ", ".join(names)) for g, names in groups.items()
    ]
    return Table(("group", "elements", "names"), rows)


def timing(study: Study) -> Table:
    """Wall time and memory by rule of the workflow."""
    rows = []
    for rule, jobs in study.benchmarks.groupby("rule", sort=False):
        memory = jobs.memory_MB.max()
        rows.append(
            (
                str(rule),
                str(len(jobs)),
                f"{jobs.seconds.mean():.1f}",
                f"{jobs.seconds.max():.1f}",
                "" if np.isnan(memory) else f"{memory:.0f}",
            )
        )
    columns = ("rule", "jobs", "mean time [s]", "longest [s]", "largest memory [MB]")
    return Table(columns, rows)


def versions(study: Study) -> Table:
    """Software that the solves ran with; more than one version is listed with all."""
    found: dict[str, list[str]] = {}
    for run in study.runs:
        for package, version in run.solution.header["versions"].items():
            known = found.setdefault(package, [])
            if version not in known:
                known.append(version)
    return Table(("software", "version"), [(k, ", ".join(v)) for k, v in found.items()])


def hashes(study: Study) -> Table:
    """Fingerprints of what each solve was made from."""
    rows = [(f"tracking {run.name}", *_fingerprints(run.solution)) for run in study.runs]
    rows += [
        (f"{p.participant} prediction {p.condition.name}", *_fingerprints(p.solution))
        for p in study.coordination.predictions
    ]
    rows += [
        (" ".join(("validation", *names)), *_fingerprints(solution))
        for names, solution in study.coordination.tasks.items()
    ]
    rows += [
        (f"equations of motion, {name}", header["expression_hash"][:16], "")
        for name, header in study.equations.items()
    ]
    return Table(("result", "inputs (SHA-256, first 16)", "code (SHA-256, first 16)"), rows)


def _fingerprints(solution: Solution) -> tuple[str, str]:
    hashes = solution.header["hashes"]
    return hashes["inputs"][:16], hashes["code"][:16]


def settings(study: Study) -> Table:
    """Settings of the solves by stage; what differs between solves of one is listed with all."""
    coordination, config = study.coordination, study.config
    # Documents of calibrations do not hold their settings.
    configured = {**config["solve"], "weights": config["weights"]["calibration"]}
    calibrated = coordination.calibrations or coordination.uncalibrated
    stages = {
        "tracking": [run.solution.header["settings"] for run in study.runs],
        "calibration": [configured] if calibrated else [],
        "validation": [task.header["settings"] for task in coordination.tasks.values()],
        "prediction": [one.solution.header["settings"] for one in coordination.predictions],
    }
    found = {stage: _settings(solves) for stage, solves in stages.items() if solves}
    for name in ONLY_OF_CALIBRATION:
        found.get("validation", {}).pop(name, None)
    names = dict.fromkeys(name for values in found.values() for name in values)
    rows = [
        (name, *(", ".join(values.get(name, ())) for values in found.values())) for name in names
    ]
    return Table(("setting", *found), rows)


def _settings(solves: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Values of every setting, in the order in which solves bring them."""
    found: dict[str, list[str]] = {}
    for settings in solves:
        flat = dict(settings)
        weights = flat.pop("weights")
        flat |= {f"weight {name}": value for name, value in weights.items()}
        for key, value in flat.items():
            known = found.setdefault(in_words(key), [])
            if str(value) not in known:
                known.append(str(value))
    return found
