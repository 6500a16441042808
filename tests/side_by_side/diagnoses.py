"""Time diagnoses by this tree against those by a former commit, on the same trials, in one run.

    python tests/side_by_side/diagnoses.py --out record.json

Both commands answer the trials of golden cases as a user calls them, with the settings of their
own commit, by turns on one core: once with nothing but the equations prepared, and once more.
Answers differ, because the diagnosis does: what is compared is the time until there is one.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from compare import COMMIT, SNAKEMAKE, TREE, checked_out, run

CASES = TREE / "tests/golden/cases"


def taken(tree: Path, case: Path, folder: Path) -> dict[str, Any]:
    """Time of one diagnosis of a case by the sources of a tree, and what it answered."""
    command = [sys.executable, "-m", "scapulohumeral.gap.cli", "gap", "diagnose"]
    command += [str(path) for path in sorted((case / "test").glob("*.csv"))]
    if (case / "reference").is_dir():
        command += ["--reference", *map(str, sorted((case / "reference").glob("*.csv")))]
    command += ["--participant", str(case / "participant.yaml"), "--threads", "1"]
    command += ["--cache", str(folder / "cache"), "--out", str(folder / "out")]
    clock, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    run(tree, tree, *command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = json.loads((folder / "out/result.json").read_text(encoding="utf-8"))
    return {
        "seconds": time.perf_counter() - clock,
        "processor_seconds": sum(after[:2]) - sum(before[:2]),
        "status": answer["status"],
    }


def diagnosed_by_both(case: Path, trees: dict[str, Path], scratch: Path) -> dict[str, Any]:
    """One row of the record: a case by both trees, from nothing and once more."""
    row: dict[str, Any] = {"case": case.name, "load": os.getloadavg()[0]}
    for turn in ("first", "again"):
        for name, tree in trees.items():
            folder = scratch / case.name / name
            row.setdefault(name, {})[turn] = taken(tree, case, folder)
            shutil.rmtree(folder / "out")
    return row


def say(row: dict[str, Any]) -> None:
    """One line about a case."""
    for turn in ("first", "again"):
        times = [row[name][turn]["processor_seconds"] for name in ("former", "present")]
        print(f"{row['case']:20} {turn}: {times[0]:6.1f} s | {times[1]:6.1f} s", flush=True)


def main() -> None:
    """Diagnose the golden cases by both and add their rows to the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--commit", default=COMMIT)
    parser.add_argument("--checkout", type=Path, help="folder of the former commit, which stays")
    parser.add_argument("--out", type=Path, default=Path("reports/side_by_side.json"))
    options = parser.parse_args()
    # The processes that are started inherit the one core.
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    document = json.loads(options.out.read_text(encoding="utf-8"))
    if document["commit"] != options.commit:
        raise SystemExit(f"{options.out}: of {document['commit']}; name another file with --out")
    with checked_out(options.commit, options.checkout) as checkout:
        trees = {"former": checkout, "present": TREE}
        for tree in trees.values():
            run(tree, tree, *SNAKEMAKE, "results/equations/quaternion")
        document["diagnoses"] = []
        with tempfile.TemporaryDirectory() as scratch:
            for case in sorted(CASES.iterdir()):
                document["diagnoses"].append(diagnosed_by_both(case, trees, Path(scratch)))
                say(document["diagnoses"][-1])
                options.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
