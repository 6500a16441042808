"""How fast and how safe: records of runs beside the study, where they are committed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scapulohumeral.report.tables import Table

Record = Mapping[str, Any]

PEERS = {
    "casadi": ("CasADi, IPOPT, exact Hessian", "the same problem"),
    "moco_inverse": ("OpenSim MocoInverse", "motion prescribed, no contact, reserve torques"),
    "moco_track": ("OpenSim MocoTrack", "no contact, reserve torques"),
}
SAME_OBJECTIVE = 1e-6


def speed_content(records: Mapping[str, Record]) -> dict[str, Any]:
    """Tables of the records that are there; None for those that are not.

    Parameters
    ----------
    records : by name: ``side_by_side``, ``peers``, ``kills``
    """
    side, peers, kills = (records.get(name) for name in ("side_by_side", "peers", "kills"))
    return {
        "side_by_side": side and side_by_side(side),
        "commit": side and side["commit"],
        "calibrations": side and side["calibrations"],
        "difference": side and _largest_difference(side),
        "diagnoses": side and "diagnoses" in side and diagnosis_table(side),
        "peers": peers and peer_table(peers),
        "opty": peers and opty_table(peers),
        "kills": kills and kill_table(kills),
        "killed_study": kills,
    }


def side_by_side(record: Record) -> Table:
    """Solves by the former and the present code; marked: not optimal, or a higher objective.

    The last rows are sums over the solves of a kind.
    """
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for k, row in enumerate(record["rows"]):
        former, present = row["former"], row["present"]
        change = present["objective"] / former["objective"] - 1.0
        failed = {former["status"], present["status"]} != {"optimal"}
        if failed or change > SAME_OBJECTIVE:
            flagged.add(k)
        rows.append(
            (
                row["case"].replace("/", " ").replace("_", " "),
                *_pair(former["processor_seconds"], present["processor_seconds"]),
                f"{former['iterations']}, {present['iterations']}",
                f"{former['peak_MB']:.0f}, {present['peak_MB']:.0f}",
                f"{change:+.1e}",
                present["status"] if not failed else f"{former['status']}; {present['status']}",
            )
        )
    for kind in ("tracking", "prediction"):
        chosen = [row for row in record["rows"] if row["case"].startswith(kind)]
        if chosen:
            sums = [sum(r[s]["processor_seconds"] for r in chosen) for s in ("former", "present")]
            rows.append((f"{kind}, sum of {len(chosen)}", *_pair(*sums), "", "", "", ""))
    columns = ("problem", "former [s]", "present [s]", "ratio [1]", "iterations", "peak [MB]")
    return Table((*columns, "change of objective [1]", "status"), rows, frozenset(flagged))


def diagnosis_table(record: Record) -> Table:
    """Diagnoses by the former and the present command, from nothing and once more."""
    turns = ("first", "again")
    rows = []
    for row in record["diagnoses"]:
        times = [
            [row[name][turn]["processor_seconds"] for name in ("former", "present")]
            for turn in turns
        ]
        name = row["case"].replace("_", " ")
        rows.append((name, *(text for pair in times for text in _pair(*pair))))
    columns = [f"{side}, {t} [s]" for t in turns for side in ("former", "present")]
    columns = [*columns[:2], "ratio [1]", *columns[2:], "ratio, again [1]"]
    return Table(("trials", *columns), rows, frozenset())


def _pair(former: float, present: float) -> tuple[str, str, str]:
    """Two times and their ratio as text."""
    return f"{former:.1f}", f"{present:.1f}", f"{former / present:.1f}"


def _largest_difference(record: Record) -> float:
    """Largest relative difference of objective or constraints of the two codes at one point."""
    return max(max(row["difference"].values()) for row in record["rows"])


def peer_table(record: Record) -> Table:
    """This solver and others on one tracking problem; marked: did not solve it."""
    seconds = record["own"]["tracking_processor_seconds"]
    rows, flagged = _own_rows(record["own"])
    for name, (peer, problem) in PEERS.items():
        found = record["peers"].get(name)
        if found is None:
            continue
        solved_it = found["finished"] and found["optimal"]
        if not solved_it:
            flagged.add(len(rows))
        built, solved = found.get("build_seconds"), found.get("solve_seconds")
        taken = solved or found["processor_seconds"] - (built or 0.0)
        rows.append(
            (
                peer,
                problem,
                "" if built is None else f"{built:.1f}",
                f"{taken:.1f}",
                str(found.get("iterations", "")),
                found["message"],
                f"{'' if solved_it else '> '}{taken / seconds:.1f}",
            )
        )
    columns = (
        "solver",
        "problem",
        "built [s]",
        "solved [s]",
        "iterations",
        "outcome",
        "times ours",
    )
    return Table(columns, rows, frozenset(flagged))


def _own_rows(own: Record) -> tuple[list[tuple[str, ...]], set[int]]:
    """This solver with its own and with a limited-memory Hessian; which of them to mark."""
    seconds, whole = (own[f"{n}_processor_seconds"] for n in ("tracking", "limited_memory"))
    first, second = (str(own[f"{n}_iterations"]) for n in ("tracking", "limited_memory"))
    reached = own["limited_memory_seconds"] is not None
    limited = (f"{whole:.1f}", second, "objective not reached", f"> {whole / seconds:.1f}")
    if reached:
        # Only the clock was read on the way.
        clock = f"{own['limited_memory_seconds']:.1f} (clock)"
        outcome = f"same objective within 1e-4 after this time, of {whole:.1f} s in all"
        limited = (clock, second, outcome, f"{own['ratio_limited_memory']:.1f} (clock)")
    outcome = "optimal" if own["tracking_optimal"] else "not optimal"
    rows: list[tuple[str, ...]] = [
        ("this solver", "", "", f"{seconds:.1f}", first, outcome, "1"),
        ("this solver, limited memory", "the same problem", "", *limited),
    ]
    return rows, {k for k, held in enumerate((own["tracking_optimal"], reached)) if not held}


def opty_table(record: Record) -> Table:
    """Building and evaluating by opty alone, by number of muscles; marked: did not finish."""
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    found = {int(n.removeprefix("opty_")): r for n, r in record["peers"].items() if "opty" in n}
    for muscles, row in sorted(found.items()):
        if not row["finished"]:
            flagged.add(len(rows))
        own = row.get("own_evaluation_seconds"), row.get("evaluation_seconds")
        rows.append(
            (
                str(muscles),
                _seconds(row.get("own_build_seconds")),
                _seconds(row.get("build_seconds")),
                *(f"{1000 * s:.2f}" if s else "" for s in own),
                f"{own[1] / own[0]:.2f}" if all(own) else "",
                row["message"] or "built",
            )
        )
    columns = ("muscles", "built by us [s]", "by opty [s]", "evaluated by us [ms]", "by opty [ms]")
    return Table((*columns, "ratio [1]", "outcome"), rows, frozenset(flagged))


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def kill_table(record: Record) -> Table:
    """Runs of the quick study that were killed; marked: a finished job was done again."""
    names = ("finished", "lost", "repeated", "resumed")
    rows = [
        (f"{row['killed_after_s']:.1f}", *(str(row[name]) for name in names))
        for row in record["rounds"]
    ]
    flagged = {k for k, row in enumerate(record["rounds"]) if row["repeated"]}
    columns = (
        *("killed after [s]", "jobs finished", "jobs under way", "finished jobs begun again"),
        "solves that went on",
    )
    return Table(columns, rows, frozenset(flagged))
