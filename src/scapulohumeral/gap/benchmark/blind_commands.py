"""The commands on draws of cases: ``gap blind``, ``gap calibrate``, ``gap ablation``.

What computes is imported when a step runs.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

OPTIONS = {
    "--cases": "folder of case folders",
    "--published": "file of hashes",
    "--answers": "folder of answers",
    "--keys": "folder of keys, outside the checkout",
    "--out": "file to write: a score card, or a table; rates of `assumed` stand beside it",
}

DRAWS_HELP = "YAML: name -> cases, published, answers, keys"
DRAWS_EPILOG = "DRAWS holds {second: {cases: DIR, published: FILE, answers: DIR, keys: DIR}}"


def add_blind_commands(commands: argparse._SubParsersAction, config: Path, cache: Path) -> None:
    """Add ``blind`` to the commands of ``gap``, with the default configuration and cache."""
    blind = commands.add_parser("blind", help="benchmark on cases whose cause is sealed")
    steps = blind.add_subparsers(required=True, metavar="STEP")
    seal = _step(steps, "seal", "publish hashes of keys", "--cases", "--keys", "--published")
    seal.add_argument("--open", action="store_true", help="the seed is known: no blind draw")
    seal.set_defaults(run=_seal)
    answer = _step(steps, "answer", "diagnose every case", "--cases", "--published", "--answers")
    answer.set_defaults(run=_answer)
    score = _step(
        steps, "score", "open the keys and score", "--cases", "--published", "--answers", "--keys",
        "--out",
    )  # fmt: skip
    score.set_defaults(run=_score)
    bound = _step(
        steps, "limits", "what limits answers to opened cases", "--cases", "--keys", "--out"
    )
    bound.set_defaults(run=_limits)
    most = _step(
        steps,
        "assumed",
        "what cases tell at most: answers to persons who are just as assumed",
        "--cases",
        "--out",
    )
    most.add_argument(
        "--designs", type=int, default=8, metavar="N", help="cases whose trials count"
    )
    most.add_argument("--persons", type=int, default=60, metavar="N", help="persons for each")
    most.add_argument("--seed", type=int, default=1, metavar="N", help="of all persons")
    most.set_defaults(run=_assumed)
    for step in (score, bound, most):
        step.add_argument("--config", type=Path, default=config, metavar="FILE")
        step.add_argument("--cache", type=Path, default=cache, metavar="DIR")
    for step in (answer, score):
        step.add_argument("--jobs", type=int, default=2, metavar="N", help="cases at a time")


def _step(
    steps: argparse._SubParsersAction, name: str, text: str, *options: str
) -> argparse.ArgumentParser:
    step = steps.add_parser(name, help=text)
    for option in options:
        step.add_argument(option, type=Path, required=True, help=OPTIONS[option])
    return step


def _seal(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.benchmark.protocol import seal

    seal(options.cases, options.keys, options.published, options.open)
    return 0


def _answer(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.benchmark.protocol import BlindFiles, answer

    answer(BlindFiles(options.cases, options.published, options.answers), options.jobs)
    return 0


def _score(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.benchmark.noise_free.hidden_task import hidden_shrinkage
    from scapulohumeral.gap.benchmark.protocol import BlindFiles, score

    files = BlindFiles(options.cases, options.published, options.answers)
    shrinks = partial(hidden_shrinkage, config_file=options.config, cache=options.cache)
    score(files, options.keys, options.out, shrinks, options.jobs)
    return 0


def _limits(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.benchmark.by_derivatives.limits import limits

    limits(options.cases, options.keys, options.config, options.cache).to_csv(
        options.out, index=False
    )
    return 0


def _assumed(options: argparse.Namespace, command: str) -> int:
    import json

    from scapulohumeral.gap.benchmark.by_derivatives.assumed_answers import (
        assumed_answers,
        designs,
    )
    from scapulohumeral.gap.benchmark.by_derivatives.assumed_rates import rates
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings

    settings = read_settings(read_diagnosis_config(options.config))
    cases = designs(options.cases, options.designs)
    table = assumed_answers(cases, options.persons, options.seed, options.config, options.cache)
    table.to_csv(options.out, index=False)
    found = json.dumps(rates(table, settings), indent=1)
    options.out.with_suffix(".json").write_text(found + "\n", encoding="utf-8")
    return 0


def add_calibrate_command(
    commands: argparse._SubParsersAction, config: Path, settings: Path
) -> None:
    """Add ``calibrate`` and ``ablation`` to the commands of ``gap``, with default configuration."""
    calibrate = commands.add_parser(
        "calibrate",
        help="fit how evidence becomes probability to draws whose keys are open",
        epilog=DRAWS_EPILOG,
    )
    add = calibrate.add_argument
    add("draws", type=Path, nargs="?", metavar="DRAWS", help=f"{DRAWS_HELP}; beside --opened")
    add(
        "--opened",
        type=Path,
        default=config.parent / "gap/opened",
        metavar="DIR",
        help="tables of draws that were opened earlier, which are fitted to as well",
    )
    add("--keep", action="store_true", help="add DRAWS to the tables of --opened")
    add("--out", type=Path, metavar="FILE", help="default: the file that the settings name")
    ablation = commands.add_parser(
        "ablation",
        help="what each stage of the diagnosis adds, on draws whose keys are open",
        epilog=DRAWS_EPILOG,
    )
    ablation.add_argument("draws", type=Path, metavar="DRAWS", help=DRAWS_HELP)
    ablation.add_argument("--out", type=Path, metavar="FILE", required=True)
    for command, run in ((calibrate, _calibrate), (ablation, _ablation)):
        command.add_argument("--config", type=Path, default=config, metavar="FILE")
        command.add_argument("--settings", type=Path, default=settings, metavar="FILE")
        command.set_defaults(run=run)


def _calibrate(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.errors import DataError
    from scapulohumeral.gap.benchmark.open_draws.calibrate import calibrate, weights_before
    from scapulohumeral.gap.benchmark.open_draws.open_cases import (
        read_open_cases,
        read_opened,
        write_opened,
    )
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings
    from scapulohumeral.provenance import CONFIG_FOLDER

    settings = read_settings(read_diagnosis_config(options.config, options.settings))
    fresh = read_open_cases(_draws(options.draws)) if options.draws else []
    names = {case.draw for case in fresh}
    earlier = read_opened(options.opened) if options.opened.is_dir() else []
    cases = [*(case for case in earlier if case.draw not in names), *fresh]
    if not cases:
        raise DataError(f"{options.opened}: no such folder, and no DRAWS; name one of them.")
    if options.keep:
        write_opened(cases, options.opened, settings.weighing)
    in_use = CONFIG_FOLDER / settings.calibration
    start = weights_before(in_use, cases, settings.weighing)
    print(calibrate(cases, start, options.out or in_use))
    return 0


def _ablation(options: argparse.Namespace, command: str) -> int:
    from scapulohumeral.gap.benchmark.open_draws.ablation import write_ablation
    from scapulohumeral.gap.settings import read_diagnosis_config, read_settings

    settings = read_settings(read_diagnosis_config(options.config, options.settings))
    write_ablation(_draws(options.draws), settings.weighing, options.out)
    return 0


def _draws(path: Path) -> dict[str, dict[str, str]]:
    """Places of draws by name, from a YAML file."""
    from scapulohumeral.documents import read_mapping
    from scapulohumeral.errors import ConfigError

    draws = read_mapping(path, "names of draws", "Check the name, and the line named.")
    wanted = {"cases", "published", "answers", "keys"}
    for name, places in draws.items():
        given = set(places) if isinstance(places, dict) else set()
        if given != wanted:
            raise ConfigError(
                f"{path}, {name}: {', '.join(sorted(given)) or 'nothing'}; expected "
                f"{', '.join(sorted(wanted))}. Correct the entry."
            )
    return draws
