"""Kill the quick study at random moments, run it again, and compare its numbers.

    python tests/kill_study.py --kills 20 --seed 1 --out reports/kills.json

Each round solves the tracking problems of the quick study anew, kills every process of the study
with SIGKILL after a random share of the time that an uninterrupted run took, and runs the study
again to its end. What it needs to know is whether numbers change, and how much work was done twice.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import time
from pathlib import Path

STUDY = (
    *("snakemake", "--workflow-profile", "workflow/profiles/quick"),
    *("--configfile", "config/quick.yaml", "--nolock", "--rerun-incomplete"),
)
TARGET = "results/tracking/summary.csv"
SUMMARIES = "tracking/*/*.summary.json"
# Relative difference of two objectives that are the same to solver tolerance.
SAME = 1e-6


def run(cores: int, anew: bool, kill_after_s: float | None = None) -> float:
    """Seconds of a run of the study, which is killed after a time if one is given."""
    command = [*STUDY, "--cores", str(cores), TARGET]
    if anew:
        command += ["--forcerun", "solve_tracking"]
    begin = time.perf_counter()
    # A group of its own, so that the kill reaches the solves as well.
    process = subprocess.Popen(command, start_new_session=True)
    try:
        code = process.wait(timeout=kill_after_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    else:
        if code != 0:
            raise SystemExit(f"the study ended with {code}; its messages are above")
    return time.perf_counter() - begin


def numbers() -> dict[str, dict]:
    """Objective, status and iterations of each tracking solve, by file."""
    found = {}
    for path in sorted(Path("results").glob(SUMMARIES)):
        summary = json.loads(path.read_text(encoding="utf-8"))
        found[str(path)] = {key: summary[key] for key in ("objective", "status", "iterations")}
    return found


def resumed() -> int:
    """Number of solver logs that say they went on from a checkpoint."""
    logs = Path("results/logs/solve_tracking").glob("*.solver.log")
    return sum("interrupted solve" in path.read_text(encoding="utf-8") for path in logs)


def compare(before: dict[str, dict], after: dict[str, dict]) -> dict[str, float]:
    """Relative change of each objective; a solve that is missing or failed counts as infinite."""
    changes = {}
    for path, old in before.items():
        new = after.get(path)
        failed = new is None or new["status"] != "optimal"
        changes[path] = float("inf") if failed else abs(new["objective"] / old["objective"] - 1.0)
    return changes


def main() -> None:
    """Kill, run again, compare, and write a table of all rounds."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("reports/kills.json"))
    options = parser.parse_args()
    rng = random.Random(options.seed)
    whole, rounds = run(options.cores, anew=True), []
    reference = numbers()
    for _ in range(options.kills):
        moment = rng.uniform(0.02, 0.98) * whole
        run(options.cores, anew=True, kill_after_s=moment)
        again = run(options.cores, anew=False)
        change = max(compare(reference, numbers()).values())
        row = {"killed_after_s": moment, "rerun_s": again, "resumed": resumed(), "change": change}
        rounds.append(row)
        print(row, flush=True)
        document = {"uninterrupted_s": whole, "seed": options.seed, "rounds": rounds}
        options.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    lost = sum(row["change"] > SAME for row in rounds)
    raise SystemExit(f"{lost} of {len(rounds)} runs ended with other numbers" if lost else 0)


if __name__ == "__main__":
    main()
