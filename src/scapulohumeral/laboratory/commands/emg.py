"""Arguments of ``scapulohumeral emg``, and what they start."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scapulohumeral.errors import REFUSED, DataError
from scapulohumeral.provenance import CONFIG_FOLDER, MODEL_TABLES

if TYPE_CHECKING:
    from scapulohumeral.laboratory.emg_files import EmgMap

CONFIG = CONFIG_FOLDER / "config.yaml"
EXAMPLES = """example:
  scapulohumeral emg session1/*.c3d --mvc mvc/*.c3d --map emg.yaml --out trials

emg.yaml:
  schema: emg_map/1
  channels:
    infra: {label: "EMG 3", muscles: [infra]}        # label of the analog channel; in .csv the
    delt_lat: {label: "EMG 5", muscles: [delt_scap]} # column is the label and _V
  neighbours: [[infra, delt_lat]]                    # cross-talk is possible
  delay_s: 0.0                                       # EMG clock when the motion's shows zero; that
                                                     # of a .c3d is zero in its first frame

writes trials/TRIAL_emg.csv beside the converted trials, and the set-up into trials/participant.yaml
if convert made one.

Exit code 0: done; 2: a recording was refused, or a channel was left out.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command to a parser."""
    parser.description = "Raw EMG to envelopes, as fractions of maximal voluntary contractions."
    parser.epilog = EXAMPLES
    add = parser.add_argument
    add("recordings", nargs="+", type=Path, metavar="FILE", help=".c3d or .csv of trials")
    add("--mvc", nargs="+", type=Path, required=True, metavar="FILE", help="maximal contractions")
    add("--map", type=Path, required=True, metavar="FILE", help="channels, see below")
    add("--out", type=Path, required=True, metavar="DIR", help="folder of the trial tables")
    add("--keep-faulty", action="store_true", help="also write clipped, dead or humming channels")
    add("--config", type=Path, default=CONFIG, metavar="FILE", help="filters and limits")


def run(options: argparse.Namespace, command: str) -> int:
    """Process all recordings and say what was found; returns the exit code."""
    from scapulohumeral.laboratory import emg_files
    from scapulohumeral.laboratory.folders import make_folder
    from scapulohumeral.model.tables import read_tables

    emg_files.check_participant(options.out)
    tables = _tables(options)
    make_folder(options.out)
    emg_map = emg_files.read_emg_map(options.map)
    emg_files.check_muscles(emg_map, read_tables(MODEL_TABLES).active_groups)
    pipeline = emg_files.read_pipeline(options.config)
    contractions = emg_files.read_contractions(options.mvc, emg_map, pipeline)
    written: list[set[str]] = []
    for file, table in tables.items():
        print(file.name, file=sys.stderr, flush=True)
        # Envelopes of an earlier run must not pass for those of this.
        table.unlink(missing_ok=True)
        emg_files.quality_path(table).unlink(missing_ok=True)
        try:
            trial = emg_files.process_trial(file, contractions, emg_map, pipeline)
            names = emg_files.write_emg(table, trial, options.keep_faulty)
        except DataError as error:
            print(f"refused   {file.stem}: {error}")
            continue
        written.append(set(names))
        if not any((options.out / f"{file.stem}{suffix}").is_file() for suffix in (".csv", ".mot")):
            print(f"note      {file.stem}: {options.out} holds no trial of this name to belong to")
        motion = options.out / f"{file.stem}.csv"
        if note := emg_files.clocks_apart(trial.envelopes, motion, emg_map.delay_s):
            print(f"note      {file.stem}: {note}")
        for check in trial.checks:
            if not check.passed:
                left = "" if check.channel in names else " (left out)"
                print(f"warning   {file.stem}: {emg_files.describe(check)}{left}")
    _set_up(options, emg_map, written)
    complete = all(names == set(emg_map.labels) for names in written)
    return 0 if complete and len(written) == len(options.recordings) else REFUSED


def _tables(options: argparse.Namespace) -> dict[Path, Path]:
    """Recording -> table of its envelopes, none of which replaces a recording or a foreign file.

    Raises
    ------
    DataError                        two recordings have the same name
    ConfigError                      a file would be lost
    """
    from scapulohumeral.laboratory.emg_files import quality_path
    from scapulohumeral.laboratory.folders import check_kept, check_names, check_own

    check_names("recordings", [file.stem for file in options.recordings])
    tables = {file: options.out / f"{file.stem}_emg.csv" for file in options.recordings}
    written = (*tables.values(), *map(quality_path, tables.values()))
    check_kept((*options.recordings, *options.mvc, options.map), written)
    check_own(tables.values(), quality_path)
    return tables


def _set_up(options: argparse.Namespace, emg_map: EmgMap, written: list[set[str]]) -> None:
    """Say how many were written, and put the channels that all trials have into the participant."""
    from scapulohumeral.laboratory.emg_files import add_to_participant

    print(f"envelopes of {len(written)} of {len(options.recordings)} recordings in {options.out}")
    if not written:
        return
    common = [name for name in emg_map.labels if all(name in names for names in written)]
    path = add_to_participant(options.out, emg_map, common) if common else None
    if path is not None:
        print(f"{path}: EMG channels {', '.join(common)}")
