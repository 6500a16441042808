"""Envelopes of EMG that were recorded with real trials, and stand in a table of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array

TRIAL, TIME = "trial", "time_s"


def read_emg(table: Path, trial: str, time_s: Array) -> pd.DataFrame:
    """EMG of one trial as a companion of its motion has it.

    Parameters
    ----------
    table : CSV file with columns `trial`, `time_s` [s] and one per channel, in rows by time
    trial : name of the trial
    time_s : (T,) times of the motion; before the first row and after the last EMG stays [s]

    Returns
    -------
    columns `time` and the channels, T rows

    Raises
    ------
    DataError                        a column is missing or no number, or no row is of the trial
    """
    try:
        every = pd.read_csv(table, dtype={TRIAL: str})
        rows = every[every[TRIAL] == trial]
        known = rows[TIME].to_numpy(float)
        channels = {
            name: np.interp(time_s, known, rows[name].to_numpy(float))
            for name in every.columns
            if name not in (TRIAL, TIME)
        }
    except (KeyError, ValueError) as error:
        raise DataError(
            f"{table}, trial {trial}: {error}; expected rows of that trial, with columns {TRIAL}, "
            f"{TIME} and numbers of each channel. Correct the table."
        ) from error
    return pd.DataFrame({"time": time_s, **channels})
