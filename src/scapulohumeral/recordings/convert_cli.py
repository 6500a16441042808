"""Arguments of ``scapulohumeral convert``, and what they start."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scapulohumeral.provenance import SOURCE_ROOT

if TYPE_CHECKING:
    from scapulohumeral.model.tables import ModelTables
    from scapulohumeral.recordings.convert import Outcome

TABLES = SOURCE_ROOT.parent / "config" / "model"
PAGE = "conversion.html"
REFUSED = 2
EXAMPLES = """examples:
  scapulohumeral convert session1/*.c3d --map markers.yaml --out trials
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
    add("recordings", nargs="+", type=Path, metavar="FILE", help=".c3d, .trc or .csv of markers")
    add("--map", type=Path, metavar="FILE", help="YAML map of landmarks to markers")
    add("--out", type=Path, required=True, metavar="DIR", help="folder for tables and page")
    add("--keep-faulty", action="store_true", help="also write tables of recordings with a fault")
    add("--tables", type=Path, default=TABLES, metavar="DIR", help="model tables")


def run(options: argparse.Namespace, command: str) -> int:
    """Convert, write, and say what was found; returns the exit code."""
    from scapulohumeral.model.tables import read_tables
    from scapulohumeral.recordings.convert import summary, write_outcomes
    from scapulohumeral.recordings.page import render_page

    tables = read_tables(options.tables)
    outcomes = _outcomes(options, tables)
    write_outcomes(options.out, outcomes, options.keep_faulty, command)
    page = options.out / PAGE
    page.write_text(render_page(outcomes, tables, command), encoding="utf-8")
    print(summary(outcomes))
    print(f"look at {page}")
    return 0 if all(outcome.usable for outcome in outcomes) else REFUSED


def progress(line: str) -> None:
    """Show what is being worked on."""
    print(line, file=sys.stderr, flush=True)


def _outcomes(options: argparse.Namespace, tables: ModelTables) -> list[Outcome]:
    from scapulohumeral.errors import ConfigError
    from scapulohumeral.recordings.checks import Limits
    from scapulohumeral.recordings.convert import convert_markers
    from scapulohumeral.recordings.landmarks import calibrate
    from scapulohumeral.recordings.marker_map import read_marker_map

    if options.map is None:
        raise ConfigError(
            "convert: no --map; expected a YAML file that names the marker of each landmark. "
            "'scapulohumeral convert --help' shows an example."
        )
    calibration = calibrate(read_marker_map(options.map), tables)
    return convert_markers(options.recordings, calibration, Limits(), progress)
