"""Print wall time and peak memory of every measured job below a folder, slowest first.

Usage: print_benchmarks.py FOLDER
"""

import json
import sys
from pathlib import Path


def main() -> None:
    """Read Snakemake's `.jsonl` benchmark files and print a table."""
    folder = Path(sys.argv[1])
    rows = [
        (path.relative_to(folder).with_suffix(""), json.loads(line))
        for path in folder.rglob("*.jsonl")
        for line in path.read_text(encoding="utf-8").splitlines()
    ]
    print(f"{'time [s]':>10} {'memory [MB]':>12}  job")
    for job, row in sorted(rows, key=lambda pair: -pair[1]["s"]):
        # Jobs shorter than Snakemake's first sample have no memory: it writes the text "NA".
        memory = row["max_rss"] if isinstance(row["max_rss"], str) else f"{row['max_rss']:.0f}"
        print(f"{row['s']:10.1f} {memory:>12}  {job}")


if __name__ == "__main__":
    main()
