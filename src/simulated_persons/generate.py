"""Generate blind cases: trials and participant files for the diagnosis, keys for whoever scores.

Usage: ``python -m simulated_persons.generate --cases N --results DIR --participants DIR
--names NAME ... --out DIR --keys DIR [--plant P2]``. Keys must lie outside the checkout; the
seed, drawn unless ``--seed`` gives it, is kept with them in ``draw.json``: it tells every cause.
``draw.json`` also counts the draws that were dropped, and names the cases that were given up.

A key is ``KEYS/CASE.json``: labels, amplitudes, plant, seed, what would be seen without noise, the
noise-free tasks, the hidden one among them, and why earlier draws of the case were dropped.
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from scapulohumeral.errors import ConfigError, SolveError
from simulated_persons.drawing.attempts import Drawn, GivenUp, drawn_cases
from simulated_persons.drawing.case_files import write_case
from simulated_persons.drawing.keys import case_key
from simulated_persons.drawing.study import Study, load_study
from simulated_persons.plan import OWN, PLANTS, SHARES, Plan, draw_plans

DRAW = "draw.json"
SEED_BITS = 128
NAME_BYTES = 4


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, help="for open cases: whoever knows it knows all")
    parser.add_argument("--cases", type=int, required=True)
    parser.add_argument("--names", nargs="+", required=True, help="folders of participants")
    parser.add_argument("--plant", choices=PLANTS, default=OWN, help="P2: simulated by OpenSim")
    parser.add_argument("--kind", choices=sorted(SHARES), help="open cases of one kind only")
    for name in ("results", "participants", "out", "keys"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    options = parser.parse_args(arguments)
    _check_keys_folder(options.keys)
    study = load_study(options.results, options.participants, options.names)
    names = tuple(study.anatomies)
    # More seeds than anybody could try.
    seed = secrets.randbits(SEED_BITS) if options.seed is None else options.seed
    plans = draw_plans(seed, options.cases, names, options.kind, options.plant)
    if options.seed is None:
        plans = renamed(plans)
    for folder in (options.out, options.keys):
        folder.mkdir(parents=True, exist_ok=True)
    draw = {"seed": seed, **{name: getattr(options, name) for name in ("cases", "kind", "plant")}}
    _write(options.keys / DRAW, draw)  # before anything can be interrupted
    _write(options.keys / DRAW, draw | write_cases(study, plans, options.out, options.keys))


def renamed(plans: Sequence[Plan]) -> list[Plan]:
    """The same cases, with names that tell nothing of how they were drawn.

    Names are public. By those from the generator that draws causes, seeds could be tried.
    """
    return [replace(plan, id=secrets.token_hex(NAME_BYTES)) for plan in plans]


def write_cases(study: Study, plans: Sequence[Plan], out: Path, keys: Path) -> dict[str, Any]:
    """Draw cases, write their files and keys, and count what was dropped on the way.

    Raises
    ------
    SolveError                       no case could be drawn at all
    """
    dropped, given_up, written = Counter[str](), [], 0
    for case in drawn_cases(study, plans):
        dropped.update(case.attempt.failures)
        if isinstance(case, GivenUp):
            given_up.append(_given_up(case))
            continue
        write_case(study, case.plan, case.recordings, out / case.plan.id)
        _write(keys / f"{case.plan.id}.json", _key(case))
        written += 1
        print(f"{case.plan.id} written", flush=True)
    if not written:
        reasons = ", ".join(f"{reason} ({n})" for reason, n in dropped.items())
        raise SolveError(
            f"none of {len(plans)} cases could be drawn: {reasons}; expected arms that do their "
            "tasks. Look at the models in --results, or narrow simulated_persons.effects."
        )
    return {"written": written, "dropped_draws": dict(dropped), "given_up": given_up}


def _key(case: Drawn) -> dict[str, Any]:
    """Key of a case, with what drawing it took."""
    drawing = {"asked_person": case.attempt.asked, "dropped_draws": list(case.attempt.failures)}
    return case_key(case.plan, case.recordings) | drawing


def _given_up(case: GivenUp) -> dict[str, Any]:
    plan = case.attempt.plan
    return {
        "case": plan.id,
        "kind": plan.kind,
        "participant": plan.participant,
        "asked_person": case.attempt.asked,
        "effects": [injection.label for injection in plan.injections],
        "dropped_draws": list(case.attempt.failures),
        "replaced_by": case.by,
    }


def _write(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(document) + "\n", encoding="utf-8")


def _check_keys_folder(keys: Path) -> None:
    """Refuse a folder that the diagnosis could read, or that holds keys already."""
    checkout = Path(__file__).resolve().parents[2]
    if keys.resolve().is_relative_to(checkout):
        raise ConfigError(
            f"--keys {keys}: lies in {checkout}, where the diagnosis could read it. "
            "Name a folder outside."
        )
    if keys.is_dir() and any(keys.iterdir()):
        raise ConfigError(f"--keys {keys}: holds files already. Name a new folder for new keys.")


if __name__ == "__main__":
    main()
