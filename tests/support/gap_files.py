"""Files of a made-up diagnosis case, and a made-up finished diagnosis."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from scapulohumeral.gap.result import (
    Amplitude,
    Candidate,
    Channels,
    Detectable,
    Diagnosis,
    EffectClass,
    Entered,
    Feasibility,
    Gap,
    GroupShrinkage,
    Inputs,
    NextTrial,
    Regions,
    Robustness,
    Share,
    Shown,
    Shrinkage,
    Size,
)
from scapulohumeral.model.rotations import ANGLE_NAMES

# Of an answer whose case was never run.
HASHES = {"code": "c", "config": "d", "model": "m", "inputs": "i", "null_bank": None}
REST_DEG = (-25.0, 8.0, 5.0, 45.0, 5.0, -3.0, 40.0, 20.0, -30.0, 20.0)
STRENGTH, GAIN = "body/strength_loss/infra", "measurement/emg_gain/EMG_infra"


def elevation(rate_hz: float = 50.0, peak_deg: float = 60.0, still_s: float = 0.5) -> pd.DataFrame:
    """Raising the arm in 2 s by a smooth step, with rest before and after; columns of a trial."""
    time = np.arange(0.0, 2.0 + 2.0 * still_s + 0.5 / rate_hz, 1.0 / rate_hz)
    x = np.clip((time - still_s) / 2.0, 0.0, 1.0)
    table = pd.DataFrame(np.tile(REST_DEG, (len(time), 1)), columns=list(ANGLE_NAMES))
    table["GH_z"] += peak_deg * (10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5)
    table.insert(0, "time", time)
    return table


def write_csv(table: pd.DataFrame, path: Path) -> Path:
    """The table as CSV."""
    table.to_csv(path, index=False)
    return path


def write_mot(table: pd.DataFrame, path: Path, in_degrees: str) -> Path:
    """The table as OpenSim motion file."""
    header = f"motion\nversion=1\ninDegrees={in_degrees}\nendheader\n"
    path.write_text(header + table.to_csv(index=False, sep="\t"))
    return path


def participant_document(**changes) -> dict:
    """A generic participant with one EMG channel; a change of None removes the key."""
    document = {
        "schema": "participant/1",
        "id": "anna",
        "side": "right",
        "model": {"generic": True, "body_mass_kg": 80, "height_m": 1.8},
        "gravity_in_thorax_mps2": [0.0, -9.80665, 0.0],
        "emg": {"channels": {"EMG_infra": ["infra"]}, "unit": "fraction_of_mvc"},
        **changes,
    }
    return {key: value for key, value in document.items() if value is not None}


def write_participant(folder: Path, **changes) -> Path:
    """``participant.yaml`` in a folder."""
    path = folder / "participant.yaml"
    path.write_text(yaml.safe_dump(participant_document(**changes)))
    return path


def finished_diagnosis(**changes) -> Diagnosis:
    """A complete answer in which infraspinatus is weak, or its channel has another gain."""
    share = Share(0.86, (0.75, 0.92), 6)
    fields = {
        "status": "ok",
        "status_reason": "",
        "mode": "reference",
        "inputs": Inputs("anna", ("a_r2",), ("a_r1",), ("a",), Channels(True, True, False)),
        "gap": Gap(
            True, 0.002, "max_t", 7.2, 4.1, "repeats", Size(5.3, (4.4, 6.3)),
            Feasibility(True, 12.0),
            (Detectable(STRENGTH, "f0_factor", 0.81, "1", 0.8),),
        ),
        "regions": Regions(
            (Shown("EMG_infra", (40.0, 90.0), 62.0, 1, 7.2, 0.11, "1", 0.001, 1.0, True),),
            (Entered("dof", "GH_rz", (35.0, 88.0), 4.8, "N m", 0.002, 1.0, True),),
        ),
        "candidates": (
            Candidate(
                STRENGTH, "member", 0.71, 1, 0.08, 0.4,
                (Amplitude("f0_factor", 0.55, (0.45, 0.66), "1", False),),
            ),
            Candidate(
                GAIN, "member", 0.24, 1, 0.12, None,
                (Amplitude("gain_factor", 1.8, (1.5, 2.2), "1", False),),
            ),
        ),
        "none_p": 0.05,
        "no_gap_p": 0.0,
        "set90": (STRENGTH, GAIN),
        "classes": (EffectClass(1, (STRENGTH, GAIN), 0.95, 0.62, "weak or other gain"),),
        "shrinkage": Shrinkage(
            share, share, None, (GroupShrinkage("emg", "in_sample", 0.09, 0.03, 0.018, "1"),)
        ),
        "next_trial": NextTrial("mvc_torque", (STRENGTH, GAIN), 0.97),
        "robustness": Robustness(18, 17),
        "curves": {
            "shows": pd.DataFrame(
                {
                    "channel": np.repeat(["EMG_infra", "GH_rz"], 101),
                    "phase_percent": np.tile(np.arange(101.0), 2),
                    "effect_sigma": np.linspace(-3.0, 7.2, 202),
                    "threshold_sigma": 4.1,
                    "repeated": True,
                }
            )
        },
        **changes,
    }  # fmt: skip
    return Diagnosis(**fields)
