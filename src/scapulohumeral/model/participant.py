"""Participants: scale factors, masses and recorded motions, read from ``config/participants``.

Letters: T frames. The ten joint angles of a frame are in the order of ``rotations.ANGLE_NAMES``:
clavicle (SC) and scapula (AC) in the sequence Y-Z-X, humerus (GH) in Y-Z-Y, elbow about its axis.
Files hold degrees and seconds; everything returned is in radians and seconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.motion import Motion, MotionPlaces, read_motion
from scapulohumeral.model.participant_file import read_participant_file
from scapulohumeral.model.plausibility import check_ranges, check_rate, check_speed
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.model.smoothing import smooth_recording


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid with its axes along those of the thorax."""

    centre_m: tuple[float, ...]
    radii_m: tuple[float, ...]


@dataclass(frozen=True)
class MeasuredEmg:
    """Raw EMG of one trial and what it takes to read it.

    `file` is the recording of the trial, `mvc_file` that of the maximal voluntary contractions.
    `delay_s` is what the EMG clock shows when the kinematic clock shows zero. `labels` are those of
    channels in C3D files, where they differ from the names of the channels.
    """

    file: Path
    mvc_file: Path
    delay_s: float
    labels: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Trial:
    """One recorded motion of a participant, and what it held in its hand.

    A raw recording is smoothed on reading, if participant.yaml gives a cut-off for it. A
    `daily_task` validates the model: no muscle is adapted to it.
    `published_file` is the published simulation of the same trial, or None; `emg` the EMG measured
    in it, or None.
    """

    name: str
    file: Path
    motion: Motion
    hand_load_kg: float
    published_file: Path | None
    emg: MeasuredEmg | None
    daily_task: bool


@dataclass(frozen=True, eq=False)
class Participant:
    """Everything that tells one participant from another.

    `scale` is segment size over base model along the axes of the segment. `published_total_mass_kg`
    is that of all segments together: thorax and one arm. `thorax_ellipsoid` is the thoracic wall of
    the published model, or None. `predictions` are files of published predictions by condition.
    """

    name: str
    side: str
    sex: str | None
    height_m: float | None
    body_mass_kg: float | None
    gravity_mps2: tuple[float, ...]
    scale: Mapping[str, tuple[float, ...]]
    published_total_mass_kg: float
    preserve_mass_distribution: bool
    thorax_ellipsoid: Ellipsoid | None
    trials: Mapping[str, Trial]
    predictions: Mapping[str, Path]

    @property
    def recordings(self) -> list[Motion]:
        """What was recorded: a file counts once, whatever the hand is taken to have held in it."""
        return _once(self.trials.values())

    @property
    def elevations(self) -> list[Motion]:
        """What may shape muscles and surfaces of the model: recordings but of daily tasks, once."""
        return _once(trial for trial in self.trials.values() if not trial.daily_task)

    def trial(self, name: str) -> Trial:
        """The trial of that name.

        Raises
        ------
        ConfigError                  if this participant has no such trial
        """
        if name not in self.trials:
            raise ConfigError(
                f"trial '{name}' of {self.name}: unknown. Choose from {', '.join(self.trials)}, "
                f"or add it to participant.yaml of {self.name}."
            )
        return self.trials[name]


def participant_of(file: Path) -> Participant:
    """The participant of a participant.yaml, see :func:`read_participant`."""
    return read_participant(file.parents[1], file.parent.name)


def read_participant(directory: Path, name: str) -> Participant:
    """Read and validate a participant with all recorded motions.

    Parameters
    ----------
    directory : Path                 folder of all participants, e.g. config/participants
    name : str                       the participant's own folder in it

    Raises
    ------
    ConfigError                      unknown participant, or participant.yaml is wrong
    DataError                        a recorded motion cannot be used
    """
    document = read_participant_file(directory, name)
    folder = directory / name
    ellipsoid = document.get("published_thorax_ellipsoid")
    emg = _measured_emg(folder, document)
    return Participant(
        name=name,
        side=document["side"],
        sex=document["sex"],
        height_m=document["height_m"],
        body_mass_kg=document["body_mass_kg"],
        gravity_mps2=tuple(document["gravity_in_thorax_mps2"]),
        scale={segment: tuple(factors) for segment, factors in document["scale"].items()},
        published_total_mass_kg=document["mass"]["published_total_kg"],
        preserve_mass_distribution=document["mass"]["preserve_mass_distribution"],
        thorax_ellipsoid=ellipsoid and Ellipsoid(**{k: tuple(v) for k, v in ellipsoid.items()}),
        trials={
            key: _trial(folder, key, entry, emg.get(key))
            for key, entry in document["trials"].items()
        },
        predictions={
            condition: folder / file
            for condition, file in document.get("published_predictions", {}).items()
        },
    )


def _measured_emg(folder: Path, document: Mapping[str, Any]) -> dict[str, MeasuredEmg]:
    """Measured EMG by name of the trial."""
    emg = document.get("emg", {"trials": {}})
    return {
        trial: MeasuredEmg(
            file=folder / file,
            mvc_file=folder / emg["mvc"],
            delay_s=float(emg["delay_s"]),
            labels=emg.get("labels", {}),
        )
        for trial, file in emg["trials"].items()
    }


def _trial(folder: Path, name: str, entry: Mapping[str, Any], emg: MeasuredEmg | None) -> Trial:
    published = entry["published"]
    file = folder / entry["file"]
    motion = _recorded(file)
    if "smooth_cutoff_hz" in entry:
        motion = smooth_recording(motion, float(entry["smooth_cutoff_hz"]), file)
    return Trial(
        name=name,
        file=file,
        motion=motion,
        hand_load_kg=float(entry["hand_load_kg"]),
        published_file=folder / published if published else None,
        emg=emg,
        daily_task=entry.get("daily_task", False),
    )


def _once(trials: Iterable[Trial]) -> list[Motion]:
    """Motions of trials, each file once."""
    return list({trial.file: trial.motion for trial in trials}.values())


def _recorded(file: Path) -> Motion:
    """A recorded motion that a shoulder can have made."""
    motion, places = read_motion(file), MotionPlaces(file)
    pose = trial_to_pose(motion.angles_rad)
    check_rate(places, motion.time_s)
    check_speed(places, motion.time_s, pose)
    check_ranges(places, pose)
    return motion
