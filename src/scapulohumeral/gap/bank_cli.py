"""The commands ``gap bank``: build the null bank, check whether it fits code and settings."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_bank_commands(commands: argparse._SubParsersAction, config: Path, cache: Path) -> None:
    """Add ``bank`` to the commands of ``gap``, with the default configuration and cache."""
    bank = commands.add_parser("bank", help="thresholds from cases without any effect")
    steps = bank.add_subparsers(required=True, metavar="STEP")
    build = steps.add_parser("build", help="test every effect-free case of one or more folders")
    build.add_argument(
        "--cases", type=Path, nargs="+", required=True, metavar="DIR", help="folders of cases"
    )
    build.add_argument("--out", type=Path, required=True, help="bank, JSON")
    build.add_argument("--cache", type=Path, default=cache, metavar="DIR")
    build.set_defaults(run=_build)
    check = steps.add_parser("check", help="say whether the bank fits; exit code 2 if not")
    check.set_defaults(run=_check)
    for step in (build, check):
        step.add_argument("--config", type=Path, default=config, metavar="FILE")


def _build(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.bank_build import BankRequest, build_bank
    from scapulohumeral.gap.run import read_config

    request = BankRequest(tuple(options.cases), options.config, options.cache, options.out)
    print(f"{build_bank(request, read_config(options.config))} rows in {options.out}")
    return 0


def _check(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.bank import read_bank
    from scapulohumeral.gap.run import REFUSED, read_config
    from scapulohumeral.gap.settings import read_settings

    settings = read_settings(read_config(options.config))
    bank, reason = read_bank(options.config.parent / settings.null_bank, settings)
    print(reason or f"the bank fits: {len(bank.cases) if bank else 0} rows")
    return 0 if bank else REFUSED
