"""Arguments of ``scapulohumeral convert``, and what they start."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scapulohumeral.errors import REFUSED, ConfigError
from scapulohumeral.laboratory.commands.participant import add_body_arguments, body_of
from scapulohumeral.provenance import MODEL_TABLES

if TYPE_CHECKING:
    from scapulohumeral.laboratory.convert import Outcome
    from scapulohumeral.model.tables import ModelTables

PAGE = "conversion.html"
EXAMPLES = """examples:
  scapulohumeral convert session1/*.c3d --map markers.yaml --out trials
  scapulohumeral convert ik/*.mot --model subject.osim --map model.yaml --out trials
  scapulohumeral convert imu/*.csv --map orientations.yaml --out trials

  with a participant file for a diagnosis, tasks and repeats by the names of files:
  scapulohumeral convert all/*.c3d --map markers.yaml --out trials --id ann --body-mass 68
      --height 1.70 --tasks '(?P<task>.+)_(before|after)_(?P<repeat>[0-9]+)'
  scapulohumeral gap diagnose trials/*_after_*.csv --reference trials/*_before_*.csv --out answer

markers.yaml:
  schema: marker_map/1
  side: right                      # left arms are mirrored
  up: "+z"                         # where the files do not say it
  landmarks: {IJ: jugular, PX: xiphoid, C7: c7, T8: t8, SC: sternoclav, AC: acromioclav,
    AA: [acr_back], TS: spine, AI: inferior, PC: coracoid, EL: epi_lat, EM: epi_med, US: ulna}
  glenohumeral: {method: meskers}  # or model; marker (landmark GH); functional, with trial: FILE
  # landmarks shown only in a static trial, and carried by technical markers, three of them seen:
  # static: static.c3d
  # clusters: {acromion: {markers: [a1, a2, a3], landmarks: [AA, TS, AI]}}

model.yaml:
  schema: model_map/1
  side: right
  landmarks: {IJ: ij, PX: px, C7: c7, T8: t8, SC: sc, AC: ac, AA: aa, TS: ts, AI: ai,
    GH: {body: humerus, location_m: [0, 0, 0]}, EL: EpL, EM: EpM}

orientations.yaml:
  schema: orientation_map/1
  side: right
  axes: isb                        # or model: x right, y up, z back
  segments: {thorax: trunk, scapula: scap, humerus: arm, forearm: fore}  # columns trunk_q0 ...
"""
EPILOG = """
DIR receives one table and one record per recording, and conversion.html: look at it before you go
on. Recordings with a fault (thorax markers out of place, a clavicle that jumps, ...) get no table.

Exit code 0: all recordings were converted; 2: some were refused or have a fault, and the others
were converted.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command to a parser."""
    parser.description = "Convert recordings of one person to trial tables of the study."
    parser.epilog = EXAMPLES + EPILOG
    add = parser.add_argument
    add(
        "recordings", nargs="+", type=Path, metavar="FILE",
        help=".c3d, .trc or .csv of markers; .mot or .sto of another OpenSim model; .csv of "
        "segment orientations",
    )  # fmt: skip
    add("--map", type=Path, required=True, metavar="FILE", help="what means what, see below")
    add("--model", type=Path, metavar="OSIM", help="model that .mot or .sto files were made with")
    add("--smooth-hz", type=float, metavar="HZ", help="low-pass filter (default: none)")
    add("--out", type=Path, required=True, metavar="DIR", help="folder for tables and page")
    add("--keep-faulty", action="store_true", help="also write tables of recordings with a fault")
    add("--tables", type=Path, default=MODEL_TABLES, metavar="DIR", help="model tables")
    add("--id", metavar="ID", help="with --body-mass: name of the person (default participant)")
    add(
        "--tasks", metavar="REGEX",
        help="with --body-mass: groups (?P<task>...) and (?P<repeat>...) of whole names of trials",
    )  # fmt: skip
    add_body_arguments(parser, required=False)


def _write_participant(
    options: argparse.Namespace, outcomes: list[Outcome], tables: ModelTables
) -> None:
    """The participant file that a diagnosis of these trials reads."""
    from scapulohumeral.laboratory import participant
    from scapulohumeral.laboratory.body_size import scale_factors

    usable = [outcome for outcome in outcomes if outcome.usable and outcome.source]
    if not usable:
        print("no participant of a diagnosis: it needs a recording without a fault, see above")
        return
    points = [outcome.points for outcome in usable if outcome.points]
    # Those of earlier runs count as well: the file is of all trials in the folder.
    records = participant.kept_records(options.out)
    gravity = participant.gravity_of_records(records.values())
    if not points or gravity is None:
        raise ConfigError(
            "--body-mass: a participant needs landmarks and the axis that points up; expected "
            "markers or an OpenSim motion, and key up in the map. Leave out --body-mass otherwise."
        )
    names = [outcome.name for outcome in usable]
    trials = participant.task_and_repeat(options.tasks, names) if options.tasks else {}
    for task in dict.fromkeys(entry["task"] for entry in trials.values()):
        print(f"task {task}:", *(name for name, entry in trials.items() if entry["task"] == task))
    if options.tasks and len(trials) < len(names):
        print("no task by --tasks:", *(name for name in names if name not in trials))
    person = participant.Person(
        _id(options), body_of(options), scale_factors(points, tables), gravity
    )
    notes = [
        *participant.rescaled(options.out, person.scale),
        *participant.leaning(records, gravity),
    ]
    written = participant.write_diagnosis_participant(options.out, person, tables, trials)
    print(f"participant of a diagnosis: {written}")
    for note in notes:
        print(f"note      {note}")


def run(options: argparse.Namespace, command: str) -> int:
    """Convert, write, and say what was found; returns the exit code."""
    from scapulohumeral.laboratory.convert import check_written, summary, write_outcomes
    from scapulohumeral.laboratory.folders import make_folder
    from scapulohumeral.laboratory.page import render_page
    from scapulohumeral.model.tables import read_tables

    _check_person(options)
    if options.smooth_hz is not None and not options.smooth_hz > 0.0:
        raise ConfigError(f"--smooth-hz {options.smooth_hz}: expected above 0 Hz. Raise it.")
    check_written(options.out, options.recordings, options.map)
    make_folder(options.out)
    tables = read_tables(options.tables)
    outcomes = _outcomes(options, tables)
    write_outcomes(options.out, outcomes, options.keep_faulty, command)
    page = options.out / PAGE
    page.write_text(render_page(outcomes, tables, command), encoding="utf-8")
    print(summary(outcomes))
    if options.body_mass is not None:
        _write_participant(options, outcomes, tables)
    print(f"look at {page}")
    return 0 if all(outcome.usable for outcome in outcomes) else REFUSED


def _check_person(options: argparse.Namespace) -> None:
    """Refuse what no participant file can be made of, before any recording is read.

    Raises
    ------
    ConfigError                      mass without height, a name or tasks without either, the file
                                     of somebody else, or a pattern of tasks that fits no recording
    """
    from scapulohumeral.laboratory.participant import read_earlier, task_and_repeat

    given = {"--body-mass": options.body_mass, "--height": options.height}
    missing = [name for name, value in given.items() if value is None]
    asked = [name for name in given if name not in missing]
    asked += [f"--{name}" for name in ("id", "tasks", "sex") if getattr(options, name) is not None]
    if not asked:
        return
    if missing:
        raise ConfigError(
            f"{', '.join(asked)} without {' and '.join(missing)}: expected both, from which a "
            "participant file is made. Add what is missing, or leave the others out."
        )
    body_of(options)
    read_earlier(options.out, _id(options), of_study=False)
    if options.tasks:
        task_and_repeat(options.tasks, [file.stem for file in options.recordings])


def _id(options: argparse.Namespace) -> str:
    return options.id or "participant"


def progress(line: str) -> None:
    """Show what is being worked on."""
    print(line, file=sys.stderr, flush=True)


def _outcomes(options: argparse.Namespace, tables: ModelTables) -> list[Outcome]:
    """Outcomes by the kind of map."""
    from scapulohumeral.laboratory import convert
    from scapulohumeral.laboratory.checks import Limits
    from scapulohumeral.laboratory.markers.landmarks import calibrate
    from scapulohumeral.laboratory.markers.map_file import kind_of_map
    from scapulohumeral.laboratory.markers.marker_map import read_marker_map
    from scapulohumeral.laboratory.motions.opensim_motion import read_model_map
    from scapulohumeral.laboratory.motions.orientations import read_orientation_map

    files, settings = options.recordings, convert.Settings(tables, Limits(), options.smooth_hz)
    kind = kind_of_map(options.map)
    if kind == "marker_map/1":
        calibration = calibrate(read_marker_map(options.map), tables)
        return convert.convert_markers(files, calibration, settings, progress)
    if kind == "orientation_map/1":
        read = read_orientation_map(options.map)
        return convert.convert_orientations(files, read, settings, progress)
    if kind != "model_map/1":
        raise ConfigError(
            f"{options.map}, schema: '{kind}'; expected marker_map/1, model_map/1 or "
            "orientation_map/1. The help of this command shows an example of each."
        )
    if options.model is None:
        raise ConfigError("no --model; expected the .osim file that the motions were made with.")
    read_map = read_model_map(options.map)
    return convert.convert_motions(files, options.model, read_map, settings, progress)
