"""The command ``scapulohumeral gap``.

Modules that compute are imported only after the arguments are read: help is quick, and the number
of threads of the linear algebra, which changes results in the last digits, is set before.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from scapulohumeral.exit_codes import exit_code
from scapulohumeral.gap.benchmark.bank_commands import add_bank_commands
from scapulohumeral.gap.benchmark.blind_commands import add_blind_commands, add_calibrate_command
from scapulohumeral.linear_algebra import take_one_thread
from scapulohumeral.provenance import CONFIG_FOLDER, SOURCE_ROOT

CONFIG = CONFIG_FOLDER / "config.yaml"
SETTINGS = CONFIG_FOLDER / "gap" / "settings.yaml"
CACHE = SOURCE_ROOT.parent / "results" / "gap" / "models"
DIAGNOSE = "where recorded trials and the model part, which effect explains it, and how far"
EXAMPLES = """examples:
  scapulohumeral gap diagnose trials/*_after_*.csv --reference trials/*_before_*.csv --out answer
  scapulohumeral gap diagnose reach_r*.mot --participant ann.yaml --out answer  # no reference: less
"""
EXIT_CODES = """\
'scapulohumeral convert' makes trials and participant.yaml from recordings. DIR/report.html is the
answer in words and pictures.

Exit code 0: DIR/result.json holds an answer, which may be that there is no gap, or that none can be
given; 2: the input is refused; 3: a solve failed, and result.json says so.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code.

    Parameters
    ----------
    argv : arguments without the name of the program; None: those of the process
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    options = _parser().parse_args(arguments)
    take_one_thread()
    return exit_code(lambda: options.run(options, shlex.join(["scapulohumeral", *arguments])))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="scapulohumeral", description="Simulated and recorded coordination of the shoulder."
    )
    areas = parser.add_subparsers(required=True, metavar="AREA")
    gap = areas.add_parser(
        "gap",
        help="the gap between recorded trials and the model",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = gap.add_subparsers(required=True, metavar="COMMAND")
    _add_diagnose(commands)
    add_bank_commands(commands, CONFIG, SETTINGS, CACHE)
    add_blind_commands(commands, CONFIG, CACHE)
    add_calibrate_command(commands, CONFIG, SETTINGS)
    return parser


def _add_diagnose(commands: argparse._SubParsersAction) -> None:
    diagnose = commands.add_parser(
        "diagnose",
        help=DIAGNOSE,
        description=f"Say {DIAGNOSE}.",
        epilog=f"{EXAMPLES}\n{EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = diagnose.add_argument
    add("test", nargs="+", type=Path, metavar="TEST", help="trials to explain: .csv or .mot")
    add("--reference", nargs="+", type=Path, default=[], metavar="REF", help="trials without it")
    add("--out", type=Path, required=True, metavar="DIR", help="folder for the answer")
    add("--participant", type=Path, metavar="FILE", help="default: beside TESTs, or above")
    add(
        "--view", choices=("tracking", "prediction"), default="tracking",
        help="compare with the tracked motion, or with scapula and clavicle predicted from the "
        "humerus (default tracking)",
    )  # fmt: skip
    add(
        "--simulated", action="store_true",
        help="trials are simulations: no scatter between repeats, no errors of measurement",
    )  # fmt: skip
    add(
        "--simulator", type=Path, metavar="FILE",
        help="what made the simulations, as config/gap/simulators/study.yaml: their own model and "
        "problem, in place of a model that is scaled and fitted for the trials",
    )  # fmt: skip
    add(
        "--one-movement", action="store_true",
        help="both sides recorded the same movements, with two systems at once; found out where "
        "tasks were repeated",
    )  # fmt: skip
    add("--seed", type=int, default=1, metavar="N", help="of random numbers (default 1)")
    add("--threads", type=int, default=2, metavar="N", help="solves side by side (default 2)")
    add("--config", type=Path, default=CONFIG, metavar="FILE", help="of the study: model, solver")
    add("--settings", type=Path, default=SETTINGS, metavar="FILE", help="errors, noise, priors")
    add("--cache", type=Path, default=CACHE, metavar="DIR", help="of models that were built")
    diagnose.set_defaults(run=_diagnose)


def _diagnose(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.run import Request, run

    request = Request(
        tests=tuple(options.test),
        references=tuple(options.reference),
        out=options.out,
        participant=options.participant,
        config=options.config,
        cache=options.cache,
        seed=options.seed,
        threads=options.threads,
        command=command,
        view=options.view,
        settings=options.settings,
        simulated=options.simulated,
        simulator=options.simulator,
        one_movement=options.one_movement,
    )
    return run(request)


if __name__ == "__main__":
    sys.exit(main())
