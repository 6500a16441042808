"""Evidence of three effects with made-up signatures, under suppositions of a person."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from gap_movement import SETTINGS as USUAL
from made_up_hypotheses import DAMPING, EFFECTS, MASS, SIZE, hypothesis, noise, residual

from scapulohumeral.gap.isolation import empirical_bayes
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.residual.noise import SessionShares, scatterings

ERROR = 0.05
GAIN = EFFECTS["measurement/emg_gain/EMG_a"]
LOOSE = (hypothesis(DAMPING, 1), hypothesis(MASS, 2), hypothesis(GAIN, 3))
FIRM = tuple(replace(h, stiffness=10.0) if h.effects[0].changes_body else h for h in LOOSE)
SAME = residual(LOOSE[0].slope @ [2.0] + noise(1))
LABELS = [h.label for h in LOOSE]
SETTINGS = replace(USUAL, short_list=1, signature_error=ERROR)
COLUMNS = np.random.default_rng(6).normal(size=(SIZE, 4))


def supposed_residuals(same=SAME):
    moved = same.covariance + np.diag(np.linspace(0.0, 0.5, len(same.delta)))
    return {0.0: same, 6.0: replace(same, covariance=moved, moved_deg=6.0)}


def records(*, referenced=True):
    """What is asked of records: there are trials of one person."""
    reference = {"lift": ()} if referenced else {}
    return SimpleNamespace(sensors=None, reference=reference, of_one_person=True)


def bare(same=SAME, **known):
    """What fits are made of, and nothing of the movements."""
    labels = [h.label for h in LOOSE]
    pairs = [" + ".join(sorted((a, b))) for i, a in enumerate(labels) for b in labels[:i]]
    start = {
        "residuals": supposed_residuals(same),
        "cautious": same,
        "folds": (),
        "halves": (),
        "noise": None,
        "effects": tuple(h.effects[0] for h in LOOSE),
        "prior": {**dict.fromkeys(labels, 0.1), **dict.fromkeys(pairs, 0.01)},
        "records": records(),
        "signatures": (),
        "unknown_inputs": SimpleNamespace(columns=COLUMNS),
        "session_shares": SessionShares(1.0, 1.0),
        "scatter": dict.fromkeys(scatterings(same), 1.0),
        "settings": SETTINGS,
        "known": {1.0: LOOSE, 10.0: FIRM},
        "fits": {},
    }
    found = Evidence(**{**start, **known})
    return empirical_bayes._with_fits(found, found.suppositions)
