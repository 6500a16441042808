"""Answered cases of two rival effects, whose truth is known."""

import numpy as np

from scapulohumeral.gap.benchmark.open_draws.open_cases import OpenCase
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.gap.verdict.posterior import Circumstances, Score
from scapulohumeral.gap.weighing import Weighing

TEAR, GAIN = "body/strength_loss/infra", "measurement/emg_gain/EMG_infra"
START = Weighing(0.2, 0.2, 0.33, 0.1, 0.1, 0.1, 0.1, 0.1, 0.87, 0.6, 0.67, 0.5, 0.02)


def open_case(
    evidence: float,
    right: tuple[str, ...] = (TEAR,),
    present: bool = True,
    draw: str = "one",
    p_value: float = 1.0,
) -> OpenCase:
    """A case in which a tear has so much more log evidence than a gain."""
    scores = {
        TEAR: Score(np.log(0.3), evidence, evidence),
        GAIN: Score(np.log(0.3), 0.0, 0.0),
        MOVED: Score(np.log(0.2), -40.0, -40.0),
        NONE: Score(np.log(0.1), -40.0, -40.0),
        NO_GAP: Score(np.log(0.1), -40.0, -40.0),
    }
    about = Circumstances(
        present, referenced=True, told=True, able=True, p_value=p_value, misfit=1.0
    )
    return OpenCase(draw, "a1", right, right, about, scores)
