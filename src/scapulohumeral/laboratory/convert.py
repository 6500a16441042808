"""Recordings to trial tables, records and one page: the work behind ``scapulohumeral convert``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.laboratory.checks import (
    FAULT,
    Finding,
    Limits,
    check_clusters,
    check_coordinates,
    check_motion,
    check_points,
    check_session,
    segment_lengths,
    thorax_shape,
)
from scapulohumeral.laboratory.folders import check_kept, check_names, check_own, make_folder
from scapulohumeral.laboratory.markers.landmarks import Calibration, Landmarks, read_landmarks
from scapulohumeral.laboratory.motions.opensim_motion import ModelMap, read_motions
from scapulohumeral.laboratory.motions.orientations import OrientationMap, read_orientations
from scapulohumeral.laboratory.participant import mean_gravity
from scapulohumeral.laboratory.record import Source, record_path, write_record, write_trial
from scapulohumeral.laboratory.trial import (
    Converted,
    convert_segments,
    segments_of_landmarks,
    smoothed,
)
from scapulohumeral.model.rotations import Array
from scapulohumeral.model.tables import ModelTables

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """How recordings are converted: model tables, limits of the checks, low-pass filter or None."""

    tables: ModelTables
    limits: Limits
    cutoff_hz: float | None = None

    def finished(self, converted: Converted) -> Converted:
        """A trial as it is written: smoothed, if that is asked for."""
        return converted if self.cutoff_hz is None else smoothed(converted, self.cutoff_hz)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one recording.

    Attributes
    ----------
    file : recording
    name : of the trial
    converted : None if the recording was refused
    source : None if the recording was refused
    findings : of all checks
    points : landmark -> (T, 3) [m] in thorax axes from IJ, for the picture; empty without landmarks
    refusal : why it was refused, else empty
    """

    file: Path
    name: str
    converted: Converted | None
    source: Source | None
    findings: tuple[Finding, ...]
    points: dict[str, Array]
    refusal: str = ""

    @property
    def usable(self) -> bool:
        """Whether the trial was converted without a fault."""
        return self.converted is not None and not any(f.severity == FAULT for f in self.findings)


def refused(file: Path, error: Exception) -> Outcome:
    """Outcome of a recording that cannot be converted."""
    return Outcome(file, file.stem, None, None, (), {}, str(error))


def convert_markers(
    files: Sequence[Path], calibration: Calibration, settings: Settings, progress: Progress
) -> list[Outcome]:
    """Convert recordings of markers of one person.

    Parameters
    ----------
    files : recordings
    calibration : map and static trials
    settings : Settings
    progress : called with a line per recording

    Returns
    -------
    list of Outcome                  in the order of `files`; a recording that cannot be used is
                                     among them with its refusal
    """
    known: dict[Path, Landmarks] = {}

    def convert(file: Path) -> Outcome:
        known[file] = read_landmarks(file, calibration)
        return _of_landmarks(known[file], settings, _marker_source(known[file], calibration))

    return _against_each_other(_outcomes(files, convert, progress), known, settings.limits)


def convert_motions(
    files: Sequence[Path], model: Path, model_map: ModelMap, settings: Settings, progress: Progress
) -> list[Outcome]:
    """Convert motions of another OpenSim model; parameters and result as `convert_markers`."""
    progress(f"{len(files)} motions of {model.name}, posed by OpenSim")
    posed = dict(zip(files, read_motions(files, model, model_map), strict=True))
    known = {file: found for file, found in posed.items() if isinstance(found, Landmarks)}

    def convert(file: Path) -> Outcome:
        landmarks = posed[file]
        if isinstance(landmarks, DataError):
            raise landmarks
        source = Source(
            file=file,
            kind="opensim motion",
            files=(model, model_map.path),
            settings={"side": model_map.side, "landmarks": dict(model_map.landmarks)},
        )
        return _of_landmarks(landmarks, settings, source)

    return _against_each_other(_outcomes(files, convert), known, settings.limits)


def convert_orientations(
    files: Sequence[Path], orientation_map: OrientationMap, settings: Settings, progress: Progress
) -> list[Outcome]:
    """Convert tables of orientations; parameters and result as `convert_markers`."""

    def convert(file: Path) -> Outcome:
        raw = convert_segments(read_orientations(file, orientation_map), settings.tables)
        converted = settings.finished(raw)
        source = Source(
            file=file,
            kind="orientations",
            files=(orientation_map.path,),
            settings={"side": orientation_map.side, "segments": dict(orientation_map.segments)},
        )
        # A filter hides jumps.
        findings = check_motion(raw.motion, settings.tables)
        return Outcome(file, file.stem, converted, source, tuple(findings), {})

    return _outcomes(files, convert, progress)


def _outcomes(
    files: Sequence[Path], convert: Callable[[Path], Outcome], progress: Progress | None = None
) -> list[Outcome]:
    """What becomes of each recording; one that cannot be used is among them with its refusal."""
    outcomes = []
    for i, file in enumerate(files, start=1):
        if progress is not None:
            progress(f"{i}/{len(files)} {file.name}")
        try:
            outcomes.append(convert(file))
        except (ConfigError, DataError) as error:
            # A cut-off may be too high for one recording and suit the others.
            outcomes.append(refused(file, error))
    return outcomes


def _against_each_other(
    outcomes: list[Outcome], known: Mapping[Path, Landmarks], limits: Limits
) -> list[Outcome]:
    """Outcomes with what the trials of one person show only together."""
    read = [i for i, outcome in enumerate(outcomes) if outcome.converted is not None]
    points = [known[outcomes[i].file].points for i in read]
    shapes = [thorax_shape(one) for one in points]
    lengths = [
        {name: float(np.median(v)) for name, v in segment_lengths(one).items()} for one in points
    ]
    for i, found in zip(read, check_session(shapes, lengths, limits), strict=True):
        outcomes[i] = replace(outcomes[i], findings=(*outcomes[i].findings, *found))
    return outcomes


def check_static(static: Landmarks, tables: ModelTables) -> list[str]:
    """What is worth a look in a static posture that body size is taken from, a text each.

    Raises
    ------
    DataError                        no person holds it: body size would be that of misplaced
                                     markers; names the file and what is wrong
    """
    raw = convert_segments(segments_of_landmarks(static, tables), tables)
    findings = check_points(static, raw, Limits()) + check_clusters(static.clusters, Limits())
    wrong = "; ".join(one.text for one in findings if one.severity == FAULT)
    if wrong:
        raise DataError(f"{static.source}: {wrong}. Correct the markers, or name another file.")
    return [one.text for one in findings]


def _of_landmarks(landmarks: Landmarks, settings: Settings, source: Source) -> Outcome:
    segments = segments_of_landmarks(landmarks, settings.tables)
    raw = convert_segments(segments, settings.tables)
    findings = [
        *check_points(landmarks, raw, settings.limits),
        *check_motion(raw.motion, settings.tables, landmarks.first_frame),
        *check_clusters(landmarks.clusters, settings.limits),
        *check_coordinates(landmarks.missing),
    ]
    lengths = segment_lengths(landmarks.points)
    inside = {
        name: np.einsum("tji,tj->ti", segments.thorax, point - landmarks.points["IJ"])
        for name, point in landmarks.points.items()
    }
    spread = {name: (float(np.median(v)), float(v.std())) for name, v in lengths.items()}
    return Outcome(
        file=landmarks.source,
        name=landmarks.source.stem,
        converted=settings.finished(raw),
        source=replace(
            source,
            lengths_m=spread,
            gravity_mps2=None
            if landmarks.up is None
            else mean_gravity([(segments.thorax, landmarks.up)]),
        ),
        findings=tuple(findings),
        points=inside,
    )


def _marker_source(landmarks: Landmarks, calibration: Calibration) -> Source:
    marker_map = calibration.marker_map
    further = (marker_map.path, marker_map.static, marker_map.functional_trial)
    return Source(
        file=landmarks.source,
        kind="markers",
        files=tuple(file for file in further if file is not None),
        settings={
            "side": marker_map.side,
            "mirrored": marker_map.side == "left",
            "unit": landmarks.unit,
            "first_frame": landmarks.first_frame,
            "up": None if landmarks.up is None else landmarks.up.tolist(),
            "glenohumeral_centre": landmarks.centre,
            "landmarks": {name: list(m) for name, m in marker_map.landmarks.items()},
        },
        gaps=landmarks.gaps,
    )


def check_written(folder: Path, recordings: Sequence[Path], map_file: Path) -> None:
    """Refuse a folder in which a conversion would replace what it reads, or files of others.

    Raises
    ------
    ConfigError                      names the file that would be lost
    """
    tables = [folder / f"{recording.stem}.csv" for recording in recordings]
    check_kept((*recordings, map_file), (*tables, *map(record_path, tables)))
    check_own(tables, record_path)


def write_outcomes(
    folder: Path, outcomes: Sequence[Outcome], keep_faulty: bool, command: str
) -> None:
    """Write tables of usable trials and records of all that could be read.

    Parameters
    ----------
    folder : Path                    made if it is not there
    outcomes : of one conversion
    keep_faulty : also write tables of trials with faults
    command : that made them

    Raises
    ------
    DataError                        two recordings have the same name
    """
    check_names("recordings", [outcome.name for outcome in outcomes])
    make_folder(folder)
    for outcome in outcomes:
        table = folder / f"{outcome.name}.csv"
        # A table of an earlier run must not pass for one of this.
        table.unlink(missing_ok=True)
        record_path(table).unlink(missing_ok=True)
        if outcome.converted is None or outcome.source is None:
            continue
        write_record(
            record_path(table), outcome.converted, outcome.source, outcome.findings, command
        )
        if outcome.usable or keep_faulty:
            write_trial(table, outcome.converted)


def summary(outcomes: Sequence[Outcome]) -> str:
    """One line per recording that needs a look, and how many were converted."""
    lines = []
    for outcome in outcomes:
        if outcome.refusal:
            lines.append(f"refused   {outcome.name}: {outcome.refusal}")
        for finding in outcome.findings:
            lines.append(f"{finding.severity:9} {outcome.name}: {finding.name}: {finding.text}")
    usable = sum(outcome.usable for outcome in outcomes)
    return "\n".join([*lines, f"{usable} of {len(outcomes)} recordings converted without a fault"])
