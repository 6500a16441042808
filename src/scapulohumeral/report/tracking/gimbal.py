"""What gimbal lock does to the excitations: spikes of the Euler solve against the quaternion one.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.model.rotations import Array
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.quantities.paper import GIMBAL_CASE, GIMBAL_MUSCLES
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN
from scapulohumeral.report.drawing.curves import largest_bend, largest_step, passes_gimbal_lock
from scapulohumeral.report.drawing.svg import Picture
from scapulohumeral.report.study import FORMULATIONS, Study, TrialRuns
from scapulohumeral.report.tables import Table
from scapulohumeral.report.tracking.figures import gimbal_figure

MEASURES = {"step": largest_step, "second difference": largest_bend}
# How many times as large as with quaternions a change must be to be called a spike.
SPIKE_RATIO = 2.0


@dataclass(frozen=True)
class GimbalLock:
    """What there is to say about gimbal lock.

    Attributes
    ----------
    finding : a sentence about the paper's case
    trials : abruptness of every trial that both formulations solve
    figure, table : the paper's case, or None where the study does not have it
    """

    finding: str
    trials: Table
    figure: Picture | None = None
    table: Table | None = None


def gimbal_lock(study: Study) -> GimbalLock:
    """Compare both formulations in the paper's case, as far as the study has it."""
    trial = study.trial(*GIMBAL_CASE)
    case = " ".join(GIMBAL_CASE)
    everywhere = abruptness(study)
    if trial is None or set(trial.runs) != set(FORMULATIONS):
        return GimbalLock(f"This study does not solve {case} in both formulations.", everywhere)
    if not comparable(trial):
        finding = f"Not every solve of {case} converged, so there is nothing to compare."
        return GimbalLock(finding, everywhere, gimbal_figure(trial))
    return GimbalLock(spike_sentence(trial), everywhere, gimbal_figure(trial), spikes(trial))


def comparable(trial: TrialRuns) -> bool:
    """Whether both formulations solved a trial."""
    return set(trial.runs) == set(FORMULATIONS) and not any(r.failed for r in trial.runs.values())


def abruptness(study: Study) -> Table:
    """Largest second difference of any activation, in every trial that both formulations solve."""
    rows = []
    for trial in filter(comparable, study.trials):
        euler, quaternion = measure_pair(trial, "activation", None, "second difference")
        recorded = trial.any_run.solution.reference_rad[:, ELEVATION_COLUMN]
        near = "yes" if passes_gimbal_lock(recorded) else "no"
        numbers = (f"{euler:.4f}", f"{quaternion:.4f}", f"{ratio(euler, quaternion):.2f}")
        rows.append((trial.participant, trial.trial, near, *numbers))
    return Table(("participant", "plane", "near gimbal lock", "Euler", "quaternion", "ratio"), rows)


def spikes(trial: TrialRuns) -> Table:
    """Largest step and second difference of the signals: Euler, quaternion and their ratio."""
    rows = []
    for muscle in (*GIMBAL_MUSCLES, None):
        for signal in ("excitation", "activation"):
            for name in MEASURES:
                euler, quaternion = measure_pair(trial, signal, muscle, name)
                cells = (f"{euler:.4f}", f"{quaternion:.4f}", f"{ratio(euler, quaternion):.2f}")
                rows.append((muscle or "any element", signal, f"largest {name}", *cells))
    return Table(("element", "signal", "between nodes", "Euler", "quaternion", "ratio"), rows)


def measure_pair(
    trial: TrialRuns, signal: str, muscle: str | None, measure: str
) -> tuple[float, float]:
    """A measure of a signal with Euler angles and with quaternions; None takes all muscles."""
    euler, quaternion = (
        MEASURES[measure](signal_of(trial.runs[name].solution, signal, muscle))
        for name in ("euler", "quaternion")
    )
    return euler, quaternion


def signal_of(solution: Solution, signal: str, muscle: str | None) -> Array:
    """Excitation or activation of one muscle element (N,), or of all (N, M)."""
    values = getattr(solution, signal)
    return values if muscle is None else values[:, list(solution.muscles).index(muscle)]


def ratio(euler: float, quaternion: float) -> float:
    """Euler over quaternion; infinite if the quaternion signal is constant."""
    return euler / quaternion if quaternion > 0.0 else np.inf


def _which(spiky: list[str]) -> str:
    if not spiky:
        return "none has one"
    if len(spiky) == len(GIMBAL_MUSCLES):
        return "both have one"
    return f"{spiky[0]} alone has one"


def spike_sentence(trial: TrialRuns) -> str:
    """Whether the activations of the paper's two elements spike with Euler angles."""
    parts, spiky = [], []
    for muscle in GIMBAL_MUSCLES:
        euler, quaternion = measure_pair(trial, "activation", muscle, "second difference")
        times = ratio(euler, quaternion)
        parts.append(f"{muscle} {euler:.4f} against {quaternion:.4f} ({times:.1f} times)")
        if times > SPIKE_RATIO:
            spiky.append(muscle)
    verdict = (
        f"Of the two elements in which the paper finds spikes with Euler angles, {_which(spiky)} "
        "here."
    )
    return (
        f"{verdict} Largest second difference of the activation between nodes, Euler angles "
        f"against quaternions: {'; '.join(parts)}. Called a spike above {SPIKE_RATIO:g} times."
    )
