"""The command ``gap calibrate``: weights of evidence from opened draws."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_calibrate_command(
    commands: argparse._SubParsersAction, config: Path, settings: Path
) -> None:
    """Add ``calibrate`` to the commands of ``gap``, with the default configuration."""
    calibrate = commands.add_parser(
        "calibrate",
        help="fit how evidence becomes probability to draws whose keys are open",
        epilog="Example of DRAWS: {second: {cases: DIR, published: FILE, answers: DIR, keys: DIR}}",
    )
    calibrate.add_argument(
        "draws", type=Path, metavar="DRAWS", help="YAML: name -> cases, published, answers, keys"
    )
    calibrate.add_argument(
        "--out", type=Path, metavar="FILE", help="default: the file that the settings name"
    )
    calibrate.add_argument("--config", type=Path, default=config, metavar="FILE")
    calibrate.add_argument("--settings", type=Path, default=settings, metavar="FILE")
    calibrate.set_defaults(run=_calibrate)


def _calibrate(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.documents import read_mapping
    from scapulohumeral.errors import ConfigError
    from scapulohumeral.gap.benchmark.calibrate import calibrate
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings
    from scapulohumeral.provenance import CONFIG_FOLDER

    settings = read_settings(read_diagnosis_config(options.config, options.settings))
    draws = read_mapping(options.draws, "names of draws", "Check the name, and the line named.")
    wanted = {"cases", "published", "answers", "keys"}
    for name, places in draws.items():
        given = set(places) if isinstance(places, dict) else set()
        if given != wanted:
            raise ConfigError(
                f"{options.draws}, {name}: {', '.join(sorted(given)) or 'nothing'}; expected "
                f"{', '.join(sorted(wanted))}. Correct the entry."
            )
    out = options.out or CONFIG_FOLDER / settings.calibration
    print(calibrate(draws, settings.weighing, out))
    return 0
