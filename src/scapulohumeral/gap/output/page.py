"""The page of a diagnosis: one offline HTML file, verdict first, every number from `Diagnosis`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from scapulohumeral.gap.curve_files import MISFIT, SCATTER_OF
from scapulohumeral.gap.explained import removed_of_tasks
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.gap.left_over import said_to_be_left
from scapulohumeral.gap.output.figures import SPLITS, WORDS, figures
from scapulohumeral.gap.recording.one_movement import ONE_MOVEMENT
from scapulohumeral.gap.result import Amplitude, Candidate, Diagnosis, Interval, explained_by_any
from scapulohumeral.quantities.proportion import percent
from scapulohumeral.templates import page_template

TEMPLATE = "page.html.j2"
# What the answers of the 90 % set are: with a gap, without one, and where nothing excludes a cause.
NOT_EXCLUDED = "What is not excluded (nine in ten such sets hold the cause"
HIDDEN = (
    "What may be below the noise, though no gap was found (answers as probable as truths of nine "
    "in ten opened cases, with and without a gap"
)
NOTHING_EXCLUDES = (
    "These trials do not tell causes apart (the most probable answers that together reach 0.9"
)
# Below this probability of no gap a page says that its "no" says little.
HARDLY_TOLD = 0.5
# What each kind of missing data costs, said at the top of the page.
COSTS = {
    "reference": "No reference trials of the same person: errors of the model itself cannot be "
    "told from effects as well, nor how this person drives muscles without an effect. Lower "
    "confidence.",
    "emg": "No EMG: effects on muscles show only as far as they change the movement, effects on "
    "EMG cannot be tested, and the model's least effort stands for the person's own. Most causes "
    "are then told apart only as classes.",
}

# What was found most probable of person and sessions, by the names of the table "errors".
ASSUMED = {
    "stiffness": "the person keeps a movement {} times as firmly as the model follows recordings",
    "other_movement_deg": "another movement was intended, by {} deg (0: the same one)",
    "marker_share": "two sessions differ in markers and posture by {} of the configured spread",
    "electrode_share": "in electrodes by {} of it",
    MISFIT: "the likeliest explanation leaves {} times the square of what errors were taken to be",
    "signature_error": "changes that the model predicts are off by {} of their size",
}

# Kinds of channels, as they stand before the task in the names of the same table.
SCATTERING = {"kinematics_": "motion", "emg_": "EMG", "contact_force_": "the joint force"}


def render_report(diagnosis: Diagnosis, command: str) -> str:
    """HTML text of the page; it needs nothing but itself to be read.

    Parameters
    ----------
    diagnosis : Diagnosis
    command : the command that made it, printed under Downloads
    """
    filters: dict[str, Callable[..., str]] = {
        "number": number,
        "interval": interval,
        "percent": percent,
        "yes_or_no": yes_or_no,
    }
    return page_template("scapulohumeral.gap.output", TEMPLATE, filters).render(
        d=diagnosis,
        verdict=verdict(diagnosis),
        badges=badges(diagnosis),
        costs=list(missing_data(diagnosis)),
        not_excluded=not_excluded(diagnosis),
        splits={**SPLITS, "new_task": "tasks left out, observed"},
        shares_told=explained_by_any(diagnosis.candidates),
        # Another movement explains itself, whatever it is.
        moved=MOVED,
        alone_unclear=bool(diagnosis.regions.shows) and not stands_out(diagnosis),
        assumed=assumed(diagnosis),
        pictures=figures(diagnosis),
        words=WORDS,
        command=command,
        curves=sorted(diagnosis.curves),
    )


def stands_out(diagnosis: Diagnosis) -> bool:
    """Whether any channel stands out of the whole map by itself."""
    shows = diagnosis.curves["shows"]
    return bool((shows["effect_sigma"].abs() > shows["threshold_sigma"]).any())


def write_report(diagnosis: Diagnosis, command: str, out: Path) -> None:
    """Write ``report.html`` into a folder."""
    text = render_report(diagnosis, command)
    (out / "report.html").write_text(text, encoding="utf-8")


def verdict(diagnosis: Diagnosis) -> dict[str, str]:
    """One sentence per question: gap, where, cause, what it leaves, how far."""
    if diagnosis.gap is None:
        return {"Gap": f"no verdict: {diagnosis.status_reason}"}
    gap = diagnosis.gap
    size = f"{number(gap.value)} against a threshold of {number(gap.threshold)} ({gap.statistic})"
    sentences = {"Gap": f"{'yes' if gap.present else 'no, none above the floor'}; {size}."}
    no_gap = diagnosis.no_gap_p or 0.0
    if not gap.present and no_gap < HARDLY_TOLD:
        sentences["Gap"] += (
            f" That there is none has p {number(no_gap)} only: these trials show little, see the "
            "effects that are not excluded."
        )
    if gap.present:
        sentences["Where"] = where(diagnosis)
        sentences["Cause"] = cause(diagnosis)
        sentences["Left"] = left(diagnosis)
        sentences["How far"] = how_far(diagnosis)
    return sentences


def where(diagnosis: Diagnosis) -> str:
    """The largest region of each map in words."""
    parts = []
    if diagnosis.regions.enters:
        region = max(diagnosis.regions.enters, key=lambda r: r.share)
        parts.append(f"enters at {region.name}, {phase(region.phase_percent)}")
    if diagnosis.regions.shows:
        shown = max(diagnosis.regions.shows, key=lambda r: r.share)
        parts.append(f"shows most in {shown.channel}, {phase(shown.phase_percent)}")
    return "; ".join(parts) + "." if parts else "no region stands out."


def cause(diagnosis: Diagnosis) -> str:
    """The most probable cause with its amplitude, and what it cannot be told from."""
    if diagnosis.status == "abstained":
        return f"not decided: {diagnosis.status_reason}"
    if not named(diagnosis):
        none, no_gap = diagnosis.none_p or 0.0, diagnosis.no_gap_p or 0.0
        if no_gap > none:
            return f"none is as probable as no gap at all (p {number(no_gap)})."
        return f"none of the known effects (p {number(none)})."
    best = diagnosis.candidates[0]
    text = f"{described(best)}, p {number(best.p)}."
    if best.label == MOVED:
        text = f"the movement was done differently ({text[:-1]})."
    for entry in diagnosis.classes:
        if entry.id == best.class_id and len(entry.labels) > 1:
            others = [label for label in entry.labels if label != best.label]
            text += f" Not told apart from {', '.join(others)}; together p {number(entry.p)}."
    return text


def named(diagnosis: Diagnosis) -> bool:
    """Whether the first candidate is named as the cause."""
    if diagnosis.status != "ok" or not diagnosis.candidates:
        return False
    return diagnosis.candidates[0].p >= max(diagnosis.none_p or 0.0, diagnosis.no_gap_p or 0.0)


def left(diagnosis: Diagnosis) -> str:
    """What the most probable cause leaves."""
    remark = said_to_be_left(diagnosis.warnings)
    what = "the most probable cause"
    if not named(diagnosis) and diagnosis.candidates:
        what = f"{diagnosis.candidates[0].label}, not named as the cause,"
    return f"{remark or f'nothing that shows, once {what} is added'}."


def not_excluded(diagnosis: Diagnosis) -> str:
    """What the answers are that are not excluded, and their probability together."""
    p = {candidate.label: candidate.p for candidate in diagnosis.candidates}
    p |= {NONE: diagnosis.none_p or 0.0, NO_GAP: diagnosis.no_gap_p or 0.0}
    what = NOT_EXCLUDED
    if not diagnosis.told:
        what = NOTHING_EXCLUDES
    elif diagnosis.gap is None or not diagnosis.gap.present:
        what = HIDDEN
    return f"{what}; together p {number(sum(p[label] for label in diagnosis.set90))}):"


def described(candidate: Candidate) -> str:
    """Label and amplitudes, for example ``body/hand_load: mass_kg 1.2 kg [0.9, 1.5]``."""
    amplitudes = ", ".join(map(amplitude, candidate.parameters))
    return f"{candidate.label}: {amplitudes}" if amplitudes else candidate.label


def amplitude(value: Amplitude) -> str:
    """Name, value, unit and interval of a fitted parameter."""
    unit = "" if value.unit == "1" else f" {value.unit}"
    bound = ", on its bound" if value.at_bound else ""
    return f"{value.name} {number(value.value)}{unit} {interval(value.ci95)}{bound}"


def assumed(diagnosis: Diagnosis) -> list[str]:
    """What was found most probable of the person and the sessions, on which causes are compared."""
    if "errors" not in diagnosis.curves:
        return []
    table = diagnosis.curves["errors"]
    found = dict(zip(table["error"], table["value"], strict=True))
    told = [words.format(number(found[name])) for name, words in ASSUMED.items() if name in found]
    return [*told, *_scattering(found)]


def _scattering(found: Mapping[str, float]) -> Iterator[str]:
    """What repeats scatter otherwise than they say, of a table "errors"."""
    for kind, words in SCATTERING.items():
        start = f"{SCATTER_OF}{kind}"
        for name, value in found.items():
            if name.startswith(start) and value != 1.0:
                task = name.removeprefix(start)
                yield f"{words} in {task} scatters {number(value)} times as much as repeats say"


def how_far(diagnosis: Diagnosis) -> str:
    """The hardest shrinkage that could be measured, and beside what is expected what was seen."""
    shrinkage = diagnosis.shrinkage
    if shrinkage is None:
        return "not measured."
    hardest = (
        (shrinkage.new_task, f"on one more task, as is expected{seen_on_tasks(diagnosis)}"),
        (shrinkage.held_out_trial, "on trials not used for fitting"),
        (shrinkage.in_sample, "on the trials fitted to; nothing was left to check it"),
    )
    for share, words in hardest:
        if share is not None:
            ends = interval(tuple(100.0 * end for end in share.ci95) if share.ci95 else None)
            it = "adding it removes"
            if not named(diagnosis):
                it = f"{diagnosis.candidates[0].label}, not named as the cause, would remove"
            return (
                f"{it} {percent(share.value)} {ends} of the reducible gap {words} "
                f"({share.n_trials} trials)."
            )
    return "over all channels together the gap hardly exceeds the floor: nothing to remove."


def seen_on_tasks(diagnosis: Diagnosis) -> str:
    """What was removed of the tasks left out of the fit; empty if no gap was left in them."""
    if "left_out" not in diagnosis.curves:
        return ""
    table = diagnosis.curves["left_out"]
    share = removed_of_tasks(list(zip(table["before"], table["after"], strict=True)))
    if share is None:
        return ""
    change = f"it grew by {percent(-share)}" if share < 0.0 else f"{percent(share)} went"
    return f"; on those left out of the fit, {change}"


def badges(diagnosis: Diagnosis) -> list[str]:
    """Short facts on which confidence rests."""
    inputs, robust = diagnosis.inputs, diagnosis.robustness
    facts = [
        f"status: {diagnosis.status}",
        f"reference: {'yes' if diagnosis.mode == 'reference' else 'no'}",
        f"EMG: {'yes' if inputs.channels.emg else 'no'}",
        f"contact force: {'yes' if inputs.channels.contact_force else 'no'}",
        f"trials: {len(inputs.test)} test, {len(inputs.reference)} reference",
        "probabilities hold if the cause is in the library",
    ]
    if robust is not None:
        facts.append(f"stable in {robust.agree} of {robust.cells} variants")
    return facts


def missing_data(diagnosis: Diagnosis) -> Iterator[str]:
    """What the lack of reference trials or EMG costs."""
    if diagnosis.mode != "reference":
        yield COSTS["reference"]
    # What two records of one movement differ by, motion tells.
    if not diagnosis.inputs.channels.emg and ONE_MOVEMENT not in diagnosis.warnings:
        yield COSTS["emg"]


def number(value: float | None) -> str:
    """Three significant digits, or a dash."""
    return "–" if value is None else f"{value:.3g}"


def yes_or_no(value: bool | None) -> str:
    """A truth value in words, or that it is not known."""
    return "not known" if value is None else "yes" if value else "no"


def interval(ends: Interval | Sequence[Any]) -> str:
    """A 95 % interval in brackets, or the remark that there is none."""
    return f"[{number(ends[0])}, {number(ends[1])}]" if ends else "[no interval]"


def phase(ends: tuple[float, float]) -> str:
    """A phase interval in words."""
    return f"{ends[0]:.0f} to {ends[1]:.0f} % of the movement"
