"""The command line ``scapulohumeral``: one command per thing that a laboratory wants done.

Modules that compute are imported only when their command runs: help is quick, and the number of
threads of the linear algebra, which changes results in the last digits, is set before.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module

from scapulohumeral.exit_codes import exit_code
from scapulohumeral.linear_algebra import take_one_thread

# Command -> what it does, and the module with `add_arguments` and `run`; "gap" parses for itself.
COMMANDS = {
    "convert": (
        "recordings (markers, motions of other models, orientations) to trial tables",
        "scapulohumeral.laboratory.commands.convert",
    ),
    "emg": (
        "raw EMG and maximal contractions to the envelopes that a diagnosis reads",
        "scapulohumeral.laboratory.commands.emg",
    ),
    "participant": (
        "a participant of the study from a static trial and body size",
        "scapulohumeral.laboratory.commands.participant",
    ),
    "study": (
        "the study, of own participants too, by Snakemake",
        "scapulohumeral.laboratory.commands.study",
    ),
}
GAP = "gap"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code.

    Parameters
    ----------
    argv : arguments without the name of the program; None: those of the process
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] == [GAP]:
        from scapulohumeral.gap.cli import main as gap_main

        return gap_main(arguments)
    options = _parser(arguments[:1]).parse_args(arguments)
    take_one_thread()
    module = import_module(COMMANDS[options.command][1])
    return exit_code(lambda: module.run(options, shlex.join(["scapulohumeral", *arguments])))


def _parser(wanted: Sequence[str]) -> argparse.ArgumentParser:
    """The parser, with the arguments of the wanted command only."""
    parser = argparse.ArgumentParser(
        prog="scapulohumeral",
        description="Simulated and recorded coordination of the shoulder.",
        epilog="Exit code 0: done; 2: something was refused, and said why. "
        "'scapulohumeral COMMAND --help' shows an example of each.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command")
    for name, (text, module) in COMMANDS.items():
        command = commands.add_parser(
            name, help=text, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if name in wanted:
            import_module(module).add_arguments(command)
    commands.add_parser(GAP, help="the gap between recorded trials and the model")
    return parser


if __name__ == "__main__":
    sys.exit(main())
