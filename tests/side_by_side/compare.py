"""Time the solver of this tree against that of a former commit, on the former problems, in one run.

    python tests/side_by_side/compare.py --only tracking prediction/par2 --out record.json

The former commit is checked out beside. Its own code makes the models of its study, poses the
problems (18 tracking solves, 22 predictions), writes them down in numbers and solves them; then
this tree solves the same numbers, by turns on one core. Only the first way to a prediction is
taken: from tracking at once, or from the solution of its neighbour, each code from its own.
Models differ between the commits, so this tree's own problems would be others. Bounds of the
unknowns are each code's own: they differ in the reaction, 2 kN there and 5 kN here, and solutions
that were compared stay below 1.1 kN.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

COMMIT = "3898186"
HERE = Path(__file__).resolve().parent
TREE = HERE.parents[1]
SNAKEMAKE = (
    *("snakemake", "--workflow-profile", "workflow/profiles/default", "--cores", "1"),
    *("--rerun-triggers", "mtime", "--nolock", "--quiet", "all", "--"),
)


@contextlib.contextmanager
def checked_out(commit: str, folder: Path | None) -> Iterator[Path]:
    """A checkout of the commit: in a folder that stays, or in one that is removed."""
    place = folder or Path(tempfile.mkdtemp()) / "former"
    if not place.exists():
        command = ["git", "-C", str(TREE), "worktree", "add", "--detach", str(place), commit]
        subprocess.run(command, check=True)
    try:
        yield place.resolve()
    finally:
        if folder is None:
            command = ["git", "-C", str(TREE), "worktree", "remove", "--force", str(place)]
            subprocess.run(command, check=True)
            shutil.rmtree(place.parent)


def all_cases(config: dict[str, Any]) -> list[str]:
    """Names of all solves of the former study, neighbours first."""
    chosen = config["prediction"]
    tracked = [
        f"tracking/{participant}/{plane}_{formulation}"
        for participant in config["participants"]
        for plane in config["planes"]
        for formulation in config["formulations"]
    ]
    predicted: list[str] = []
    for participant in config["participants"]:
        names = [*chosen["predict"], *chosen["predict_also"].get(participant, [])]
        waiting = [f"prediction/{participant}/{name}" for name in dict.fromkeys(names)]
        while waiting:
            ready = [c for c in waiting if neighbour_of(c, config) in (None, *predicted)]
            if not ready:
                raise SystemExit(f"these start from what is not predicted: {', '.join(waiting)}")
            predicted += ready
            waiting = [c for c in waiting if c not in ready]
    return [*tracked, *predicted]


def neighbour_of(case: str, config: dict[str, Any]) -> str | None:
    """The case whose solution a case starts from; None for a start from motion."""
    kind, participant, name = case.split("/")
    if kind == "tracking":
        return None
    start = config["prediction"]["conditions"][name]["start"]
    return None if start == "direct" else f"prediction/{participant}/{start}"


def with_neighbours(chosen: list[str], config: dict[str, Any]) -> list[str]:
    """The chosen cases with those that they start from, in the order of all cases."""
    needed, waiting = set(chosen), list(chosen)
    while waiting:
        before = neighbour_of(waiting.pop(), config)
        if before and before not in needed:
            needed.add(before)
            waiting.append(before)
    return [case for case in all_cases(config) if case in needed]


def needed_files(case: str, config: dict[str, Any], calibrate: bool) -> list[str]:
    """Results of the former study that a case is posed from."""
    kind, participant, name = case.split("/")
    formulation = name.rsplit("_", 1)[1] if kind == "tracking" else "quaternion"
    files = [
        f"results/models/{participant}.json",
        f"results/models/{participant}_thorax.json",
        f"results/muscle_geometry/{participant}/{formulation}.npz",
        f"results/equations/{formulation}",
    ]
    if kind == "prediction":
        files += [f"results/tracking/{participant}/{p}_quaternion.npz" for p in config["planes"]]
        if calibrate and config["prediction"]["conditions"][name]["parameters"] == "calibrated":
            files.append(f"results/calibration/{participant}.json")
    return files


def run(tree: Path, folder: Path, *command: str) -> None:
    """Run a command in a folder with the sources of a tree; stop with its words if it fails."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(tree / "src"),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")


def solve_both(
    case: str, neighbour: str | None, checkout: Path, calibrations: Path, scratch: Path
) -> dict[str, Any]:
    """Solve a case with the former and with the present code; one row of the record."""
    folder = scratch / case
    folder.mkdir(parents=True, exist_ok=True)
    before = str(scratch / neighbour) if neighbour else ""
    load = os.getloadavg()[0]
    former = [str(HERE / "former.py"), case, str(folder), before, str(calibrations)]
    run(checkout, checkout, sys.executable, *former)
    equations = str(TREE / "results/equations")
    run(TREE, TREE, sys.executable, str(HERE / "present.py"), str(folder), equations, before)
    rows = {
        name: json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        for name in ("former", "present", "difference")
    }
    return {"case": case, **rows, "load": load}


def say(row: dict[str, Any]) -> None:
    """One line about a case."""
    sides = [row["former"], row["present"]]
    times = [
        f"{s['processor_seconds']:6.1f} s {s['iterations']:3d} it {s['status']}" for s in sides
    ]
    ratio = sides[0]["processor_seconds"] / sides[1]["processor_seconds"]
    change = sides[1]["objective"] / sides[0]["objective"] - 1
    print(f"{row['case']:42} {times[0]} | {times[1]} | {ratio:4.1f} | {change:+.1e}", flush=True)


def main() -> None:
    """Compare the chosen cases and add their rows to the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--commit", default=COMMIT)
    parser.add_argument("--checkout", type=Path, help="folder of the former commit, which stays")
    parser.add_argument("--calibrations", type=Path, help="calibrations of another study for both")
    parser.add_argument("--only", nargs="+", default=[""], help="first letters of cases")
    parser.add_argument("--out", type=Path, default=Path("reports/side_by_side.json"))
    options = parser.parse_args()
    # The processes that are started inherit the one core.
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    document: dict[str, Any] = {"rows": []}
    if options.out.exists():
        document = json.loads(options.out.read_text(encoding="utf-8"))
    rows = {row["case"]: row for row in document["rows"]}
    with checked_out(options.commit, options.checkout) as checkout:
        text = (checkout / "config/config.yaml").read_text(encoding="utf-8")
        config = yaml.safe_load(text)
        chosen = [c for c in all_cases(config) if c.startswith(tuple(options.only))]
        chosen = with_neighbours(chosen, config)
        own = options.calibrations is None
        files = dict.fromkeys(f for c in chosen for f in needed_files(c, config, own))
        run(checkout, checkout, *SNAKEMAKE, *files)
        run(TREE, TREE, *SNAKEMAKE, *(f for f in files if f.startswith("results/equations")))
        calibrations = (options.calibrations or checkout / "results/calibration").resolve()
        scratch = checkout / "results/side_by_side"
        for case in chosen:
            before = neighbour_of(case, config)
            rows[case] = solve_both(case, before, checkout, calibrations, scratch)
            say(rows[case])
            about = {"commit": options.commit, "calibrations": "former" if own else "present"}
            document |= {**about, "rows": list(rows.values())}
            options.out.parent.mkdir(parents=True, exist_ok=True)
            options.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
