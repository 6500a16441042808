"""Arguments of ``scapulohumeral participant``, and what they start."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from scapulohumeral.provenance import MODEL_TABLES

if TYPE_CHECKING:
    from scapulohumeral.laboratory.body_size import Body

EXAMPLES = """example:
  scapulohumeral participant --static session1/static.c3d --map markers.yaml --id ann
      --body-mass 68 --height 1.70 --trials trials/frontal.csv trials/reach.csv --out participants

makes participants/ann/participant.yaml with copies of the trials and their records: a participant
of the study.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command to a parser."""
    parser.description = "Make a participant of the study from a static trial and body size."
    parser.epilog = EXAMPLES
    add = parser.add_argument
    add("--static", nargs="+", type=Path, required=True, metavar="FILE", help="with all landmarks")
    add("--map", type=Path, required=True, metavar="FILE", help="marker map, as for convert")
    add("--trials", nargs="+", type=Path, required=True, metavar="CSV", help="converted trials")
    add("--out", type=Path, required=True, metavar="DIR", help="folder of all participants")
    add("--id", required=True, help="name of the participant: small letters and digits")
    add_body_arguments(parser, required=True)
    add("--tables", type=Path, default=MODEL_TABLES, metavar="DIR", help="model tables")


def add_body_arguments(parser: argparse.ArgumentParser, required: bool) -> None:
    """Describe body mass, height and sex to a parser."""
    parser.add_argument("--body-mass", type=float, required=required, metavar="KG")
    parser.add_argument("--height", type=float, required=required, metavar="M")
    parser.add_argument("--sex", choices=("male", "female"), help="default: mean of both")


def body_of(options: argparse.Namespace) -> Body:
    """Body size of the arguments.

    Raises
    ------
    ConfigError                      beyond human size: other units
    """
    from scapulohumeral.errors import ConfigError
    from scapulohumeral.laboratory.body_size import Body

    if not 20.0 <= options.body_mass <= 300.0:
        raise ConfigError(f"--body-mass {options.body_mass}: expected 20 to 300 kg.")
    if not 1.0 <= options.height <= 2.5:
        raise ConfigError(f"--height {options.height}: expected 1 to 2.5 m; write metres.")
    return Body(options.body_mass, options.height, options.sex)


def run(options: argparse.Namespace, command: str) -> int:
    """Write the participant and say where; returns the exit code."""
    from scapulohumeral.laboratory.body_size import scale_factors
    from scapulohumeral.laboratory.convert import check_static
    from scapulohumeral.laboratory.folders import check_names
    from scapulohumeral.laboratory.markers.frames import thorax_frame
    from scapulohumeral.laboratory.markers.landmarks import calibrate, read_landmarks
    from scapulohumeral.laboratory.markers.marker_map import read_marker_map
    from scapulohumeral.laboratory.participant import (
        Person,
        gravity_of_records,
        kept_records,
        leaning,
        mean_gravity,
        without_companions,
        write_study_participant,
    )
    from scapulohumeral.laboratory.record import read_record, record_path
    from scapulohumeral.model.tables import read_tables

    body, tables = body_of(options), read_tables(options.tables)
    calibration = calibrate(read_marker_map(options.map), tables)
    statics = [read_landmarks(file, calibration, posture=True) for file in options.static]
    for static in statics:
        for note in check_static(static, tables):
            print(f"note      {static.source.name}: {note}")
    scale = scale_factors([static.points for static in statics], tables)
    tables_of_trials = without_companions(options.trials)
    records = {table: read_record(table) for table in tables_of_trials}
    # That of the trials themselves, as far as their records hold it, earlier ones included.
    known = kept_records(options.out / options.id)
    known |= {table.stem: record for table, record in records.items()}
    gravity = gravity_of_records(known.values()) or mean_gravity(
        [(thorax_frame(static.points), static.up) for static in statics]
    )
    person = Person(options.id, body, scale, gravity)
    check_names("trials", [table.stem for table in tables_of_trials])
    trials = {table.stem: table for table in tables_of_trials}
    path = write_study_participant(options.out, person, tables, trials)
    for table, record in records.items():
        if not record.get("usable", True):
            print(f"note      {table.stem}: has a fault, see findings of {record_path(table)}")
    for note in leaning(known, gravity):
        print(f"note      {note}")
    print(f"{path}: {len(trials)} trials; scale factors", *_listed(scale))
    return 0


def _listed(scale: dict[str, float]) -> list[str]:
    return [f"{name} {factor:.3f}" for name, factor in scale.items()]
