"""Kill the quick study again and again at random moments, and compare its numbers in the end.

    python tests/kill_study.py --kills 20 --seed 1 --out reports/kills.json

A copy of this tree runs the quick study from nothing, without a disturbance. Another copy does so
while every process of it is killed with SIGKILL, a random time after each start, until that has
happened as often as asked; then the study runs to its end. What it needs to know is whether a
number changes, whether a finished job is done twice, and how many solves went on from where they
were.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

TREE = Path(__file__).resolve().parents[1]
STUDY = (
    *("snakemake", "--workflow-profile", "workflow/profiles/quick"),
    *("--configfile", "config/quick.yaml", "--nolock"),
)
STARTED = re.compile(r"^Job (\d+): (.*)$", re.MULTILINE)
FINISHED = re.compile(r"^Finished jobid: (\d+) ", re.MULTILINE)
GOES_ON = "interrupted solve"
# Relative difference of two objectives that are the same to solver tolerance.
SAME = 1e-6


@dataclass(frozen=True)
class Run:
    """One start of the study.

    Attributes
    ----------
    seconds : until its end, or until it was killed
    killed : whether it was
    started, finished : messages of its jobs
    """

    seconds: float
    killed: bool
    started: tuple[str, ...]
    finished: tuple[str, ...]


@dataclass(frozen=True)
class Round:
    """What is recorded of a run that was killed.

    Attributes
    ----------
    killed_after_s : after its start
    finished : jobs that it finished; lost : jobs that it had started and not finished
    repeated : jobs that it started although an earlier run had finished them
    resumed : solves that went on from a checkpoint
    """

    killed_after_s: float
    finished: int
    lost: int
    repeated: int
    resumed: int


def copied(folder: Path) -> Path:
    """The committed files of this tree in a folder: a study that has computed nothing."""
    folder.mkdir(parents=True)
    archive = folder / "tree.tar"
    subprocess.run(["git", "-C", str(TREE), "archive", "-o", str(archive), "HEAD"], check=True)
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="data")
    archive.unlink()
    return folder


def run(tree: Path, cores: int, kill_after_s: float | None = None) -> Run:
    """Run the study in a copy of the tree; kill it after a time if one is given."""
    environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
    begin, killed = time.perf_counter(), False
    with tempfile.TemporaryFile("w+", encoding="utf-8") as said:
        # A group of its own, so that the kill reaches the solves as well.
        process = subprocess.Popen(
            [*STUDY, "--cores", str(cores)],
            cwd=tree, env=environment, stdout=said, stderr=said, start_new_session=True,
        )  # fmt: skip
        try:
            code = process.wait(timeout=kill_after_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            code, killed = 0, True
        seconds = time.perf_counter() - begin
        said.seek(0)
        text = said.read()
    if code != 0:
        raise SystemExit(f"{text[-5000:]}\nthe study ended with {code}; its messages are above")
    names = dict(STARTED.findall(text))
    finished = tuple(names[job] for job in FINISHED.findall(text) if job in names)
    return Run(seconds, killed, tuple(names.values()), finished)


def resumed(tree: Path) -> set[tuple[str, float]]:
    """Solver logs, and their age, that say the solve went on from a checkpoint."""
    logs = tree.glob("results/logs/**/*.solver.log")
    return {
        (path.name, path.stat().st_mtime)
        for path in logs
        if GOES_ON in path.read_text(encoding="utf-8")
    }


def objectives(tree: Path) -> dict[str, float]:
    """Objective of each solve by file; infinite where it failed."""
    found = {}
    for path in sorted(tree.glob("results/**/*.summary.json")):
        summary = json.loads(path.read_text(encoding="utf-8"))
        solved = summary["status"] == "optimal"
        found[str(path.relative_to(tree))] = summary["objective"] if solved else float("inf")
    return found


def largest_change(before: dict[str, float], after: dict[str, float]) -> float:
    """Largest relative change of an objective; infinite where a solve is missing or failed."""
    if before.keys() != after.keys() or not before:
        return float("inf")
    pairs = [(before[name], after[name]) for name in before]
    if any(float("inf") in pair for pair in pairs):
        return float("inf")
    return max(abs(new / old - 1.0) for old, new in pairs)


def kill_again_and_again(
    scratch: Path, kills: int, cores: int, whole_s: float, rng: random.Random
) -> tuple[list[Round], list[dict[str, float]]]:
    """Kill a study so often; rounds, and objectives of every study that came to its end.

    Moments are drawn so that the study gets on between kills: it ends about when the last one has
    struck. If it ends before, another one is begun.
    """
    rounds: list[Round] = []
    ends: list[dict[str, float]] = []
    while len(rounds) < kills:
        tree = copied(scratch / f"killed_{len(ends)}")
        done: Counter[str] = Counter()
        ended = False
        while not ended:
            before = resumed(tree)
            moment = rng.uniform(0.0, 4.0 * whole_s / kills) if len(rounds) < kills else None
            got = run(tree, cores, moment)
            repeated = (done & Counter(got.started)).total()
            done.update(got.finished)
            ended = not got.killed
            if ended:
                continue
            left = len(got.started) - len(got.finished)
            again = len(resumed(tree) - before)
            rounds.append(Round(got.seconds, len(got.finished), left, repeated, again))
            print(rounds[-1], flush=True)
        ends.append(objectives(tree))
    return rounds, ends


def main() -> None:
    """Run undisturbed, run killed, compare, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("reports/kills.json"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        undisturbed = copied(scratch / "undisturbed")
        whole = run(undisturbed, options.cores)
        print(f"undisturbed: {len(whole.finished)} jobs in {whole.seconds:.0f} s", flush=True)
        rounds, ends = kill_again_and_again(
            scratch, options.kills, options.cores, whole.seconds, random.Random(options.seed)
        )
        reference = objectives(undisturbed)
        change = max(largest_change(reference, end) for end in ends)
    document = {
        "undisturbed_s": whole.seconds,
        "jobs": len(whole.finished),
        "solves": len(reference),
        "seed": options.seed,
        "studies": len(ends),
        "change": change,
        "rounds": [asdict(row) for row in rounds],
    }
    options.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    twice = sum(row.repeated for row in rounds)
    if change > SAME or twice:
        sys.exit(f"largest change of an objective {change:.1e}; jobs done twice: {twice}")


if __name__ == "__main__":
    main()
