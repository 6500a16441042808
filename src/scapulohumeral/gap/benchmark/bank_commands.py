"""The commands ``gap bank``: build the null bank, check whether it fits code and settings."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path


def add_bank_commands(
    commands: argparse._SubParsersAction, config: Path, settings: Path, cache: Path
) -> None:
    """Add ``bank`` to the commands of ``gap``, with the default configuration and cache."""
    bank = commands.add_parser("bank", help="thresholds from cases without any effect")
    steps = bank.add_subparsers(required=True, metavar="STEP")
    build = steps.add_parser("build", help="test every effect-free case of one or more folders")
    build.add_argument(
        "--cases", type=Path, nargs="+", required=True, metavar="DIR", help="folders of cases"
    )
    build.add_argument(
        "--probes", type=Path, required=True, metavar="DIR",
        help="folder of further cases that `check --recompute` can test again",
    )  # fmt: skip
    build.add_argument("--out", type=Path, required=True, help="bank, JSON")
    build.set_defaults(run=_build)
    probe = steps.add_parser(
        "probe", help="add cases to a bank that fits, to be tested again later"
    )
    probe.add_argument("--cases", type=Path, required=True, metavar="DIR", help="folder of cases")
    probe.set_defaults(run=_probe)
    check = steps.add_parser("check", help="say whether the bank fits; exit code 2 if not")
    check.add_argument(
        "--recompute", type=int, metavar="N",
        help="test N probes again and compare: whether a change of code changes the bank",
    )  # fmt: skip
    check.add_argument("--cases", type=Path, metavar="DIR", help="folder of the cases of probes")
    check.add_argument("--seed", type=int, default=1, metavar="N", help="which probes (default 1)")
    check.add_argument(
        "--stamp", action="store_true", help="if all rows agree, renew the hash of the bank"
    )
    check.set_defaults(run=_check)
    for step in (build, probe, check):
        step.add_argument("--config", type=Path, default=config, metavar="FILE")
        step.add_argument("--settings", type=Path, default=settings, metavar="FILE")
        step.add_argument("--cache", type=Path, default=cache, metavar="DIR")


def _build(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.benchmark.null_bank_build import BankRequest, build_bank
    from scapulohumeral.gap.settings import read_diagnosis_config

    request = BankRequest(
        tuple(options.cases), options.probes, options.config, options.cache, options.out
    )
    config = read_diagnosis_config(options.config, options.settings)
    print(f"{build_bank(request, config)} rows in {options.out}")
    return 0


def _probe(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.errors import ConfigError
    from scapulohumeral.gap.benchmark.null_bank_build import probes
    from scapulohumeral.gap.detection.null_bank import bank_file, read_bank, write_bank
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings

    config = read_diagnosis_config(options.config, options.settings)
    settings = read_settings(config)
    file = bank_file(settings)
    bank, reason = read_bank(file, settings)
    if bank is None:
        raise ConfigError(f"{file}: {reason}. Probes of other code would vouch for nothing.")
    found = {one.case: one for one in bank.probes}
    for one in probes(options.cases, options.config, options.cache, config):
        found[one.case] = one
        # After every one: each takes minutes.
        write_bank(file, bank.cases, settings, tuple(found.values()))
        print(f"{one.case}: {len(one.rows)} rows", flush=True)
    return 0


def _check(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.errors import REFUSED, ConfigError
    from scapulohumeral.gap.detection.null_bank import bank_file, read_bank
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings

    if (options.recompute is None) != (options.cases is None):
        raise ConfigError("--recompute N and --cases DIR: expected both or none of them.")
    if options.stamp and options.recompute is None:
        raise ConfigError("--stamp: a hash is renewed after rows agree; add --recompute N.")
    if options.recompute is not None and not _agrees(options):
        return REFUSED
    settings = read_settings(read_diagnosis_config(options.config, options.settings))
    bank, reason = read_bank(bank_file(settings), settings)
    print(reason or f"the bank fits: {len(bank.cases) if bank else 0} rows")
    return 0 if bank else REFUSED


def _agrees(options: argparse.Namespace) -> bool:
    """Whether probes agree with the present code; renews the hash if that is asked for."""
    from scapulohumeral.gap.benchmark.null_bank_build import probe
    from scapulohumeral.gap.benchmark.null_bank_probe import recomputed
    from scapulohumeral.gap.detection.null_bank import bank_file, load_bank, write_bank
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings

    config = read_diagnosis_config(options.config, options.settings)
    settings = read_settings(config)
    file = bank_file(settings)
    bank = load_bank(file)
    again = partial(probe, file=options.config, cache=options.cache, config=config)
    rows = recomputed(bank, options.recompute, options.cases, again, options.seed)
    print(*rows, sep="\n")
    agrees = all(row.agrees for row in rows)
    if agrees and options.stamp:
        write_bank(file, bank.cases, settings, bank.probes)
        print(f"{file}: hash renewed")
    return agrees
