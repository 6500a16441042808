"""How far a calibration is from the reference plant whose simulated EMG it was given.

Apart from the calibration, which must not know the plant.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.emg.channels import read_channels
from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.stages.calibration import FAILED, KINDS, failure_of
from scapulohumeral.stages.reference_plant import read_plant


def score(calibration: Path, plant: Path | None, channels: Path, scored: Path) -> None:
    """Add to a calibration how far it is from the plant whose EMG it was given.

    Errors are relative to the plant's value; medians are over the identifiable scalers, those of
    all and of the paper's problem beside them. Measured EMG has no plant to compare with, and a
    calibration that failed has no scalers; one that did not converge is compared as it ended.

    Raises
    ------
    ConfigError
        If the EMG was simulated and no plant is named.
    """
    document = json.loads(calibration.read_text(encoding="utf-8"))
    if document.get("status") == FAILED:
        document["scores"] = None
    elif document["emg_simulated"]:
        if plant is None:
            raise ConfigError(f"{calibration}: its EMG was simulated; name the plant behind it")
        groups = read_channels(channels).groups
        truth = read_plant(plant, groups)
        for name, entry in document["groups"].items():
            for kind in KINDS:
                true = getattr(truth, kind)[name]
                low, high = entry[kind]["ci90"]
                entry[kind] |= {
                    "plant": true,
                    "error": entry[kind]["value"] / true - 1.0,
                    "paper_problem_error": entry[kind]["paper_problem"] / true - 1.0,
                    "covered": bool(low <= true <= high),
                }
        document["scores"] = _scores(document["groups"])
    else:
        document["scores"] = None
    scored.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def recovery_table(scored: Mapping[str, Path]) -> pd.DataFrame:
    """Calibrated scalers beside those of the simulated arms whose EMG they were calibrated to.

    Parameters
    ----------
    scored : what :func:`score` wrote, by name of the arm

    Returns
    -------
    table, one row per arm, muscle group and kind of scaler [1]
        arm, group, kind, plant, value, low, high (90 % interval), covered, identifiable,
        paper_problem (the paper's estimate), misfit (of EMG, 1 if noise explains it), status

    Raises
    ------
    SolveError                       a calibration failed
    """
    rows = []
    for arm, path in scored.items():
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["status"] == FAILED:
            raise SolveError(f"{path}: {failure_of(document)}")
        for group, entry in document["groups"].items():
            for kind in KINDS:
                found = entry[kind]
                low, high = found["ci90"]
                kept = ("plant", "value", "covered", "identifiable", "paper_problem")
                row = {"arm": arm, "group": group, "kind": kind, "low": low, "high": high}
                row |= {name: found[name] for name in kept}
                rows.append(row | {"misfit": document["misfit"], "status": document["status"]})
    return pd.DataFrame(rows)


def _scores(groups: Mapping[str, Any]) -> dict[str, Any]:
    scores: dict[str, Any] = {}
    for kind in KINDS:
        entries = [group[kind] for group in groups.values()]
        chosen = [entry for entry in entries if entry["identifiable"]]
        scores[kind] = {
            "identifiable": len(chosen),
            "groups": len(entries),
            "median_error": _median(chosen, "error"),
            "median_error_all": _median(entries, "error"),
            "median_error_paper_problem": _median(chosen, "paper_problem_error"),
        }
    chosen = [
        group[kind] for group in groups.values() for kind in KINDS if group[kind]["identifiable"]
    ]
    covered = [entry["covered"] for entry in chosen]
    scores["coverage90"] = float(np.mean(covered)) if covered else None
    return scores


def _median(entries: Sequence[Mapping[str, Any]], key: str) -> float | None:
    return float(np.median([abs(entry[key]) for entry in entries])) if entries else None
