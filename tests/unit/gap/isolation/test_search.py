"""Of a person whose stiffness cannot be told, each effect is solved again with every likely one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_hypotheses import DAMPING, MASS, hypothesis, noise, residual

from scapulohumeral.gap.isolation import empirical_bayes as evidence_module
from scapulohumeral.gap.isolation import search
from scapulohumeral.gap.isolation.empirical_bayes import CLOSE, Evidence, _Tried, most_probable
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.search import fit_all

pytestmark = pytest.mark.unit

ERROR = 0.05
LOOSE = [hypothesis(DAMPING, 1), hypothesis(MASS, 2)]
FIRM = [replace(h, stiffness=10.0) for h in LOOSE]
THERE = residual(LOOSE[0].slope @ [2.0] + noise(1))
SETTINGS = SimpleNamespace(short_list=1, signature_error=ERROR)


def bare(**known):
    """What fits are made of, and nothing of the movements."""
    nothing = {
        "noise": None,
        "effects": (),
        "sensors": None,
        "signatures": (),
        "unknown_inputs": None,
    }
    start = {
        "prior": {},
        "fits_by_stiffness": (),
        "trials": (),
        "session_share": 1.0,
        "referenced": True,
    }
    return Evidence(residual=THERE, settings=SETTINGS, **{**nothing, **start, **known})


@pytest.fixture
def evidence():
    fits_by_stiffness = tuple(tuple(fit(h, THERE, ERROR) for h in known) for known in (LOOSE, FIRM))
    singles = [f.label for f in fits_by_stiffness[0]]
    prior = {**dict.fromkeys(singles, 0.1), " + ".join(sorted(singles)): 0.01}
    return bare(fits_by_stiffness=fits_by_stiffness, prior=prior)


def solving(monkeypatch, better):
    """Solves again with so much more evidence by stiffness; None where it fails."""

    def refit_or_keep(first, *_):
        gain = better[first.hypothesis.stiffness]
        return None if gain is None else replace(first, log_evidence=first.log_evidence + gain)

    monkeypatch.setattr(search, "_refit_or_keep", refit_or_keep)


@pytest.mark.parametrize(("better", "stiffness"), [((5.0, 9.0), 10.0), ((9.0, 5.0), 1.0)])
def test_the_stiffness_that_explains_more_once_solved_again_counts(
    evidence, monkeypatch, better, stiffness
):
    solving(monkeypatch, dict(zip((1.0, 10.0), better, strict=True)))
    found = {f.label: f for f in fit_all(evidence, None, 1, [])}
    winner = found["body/joint_damping/GH"]
    assert winner.hypothesis.stiffness == stiffness
    assert winner.log_evidence == evidence.screened[0].log_evidence + 9.0


def test_effects_that_are_paired_act_on_one_person(evidence, monkeypatch):
    seen = []

    def both(singles, *rest):
        seen.append({f.hypothesis.stiffness for f in singles})
        return paired(singles, *rest)

    monkeypatch.setattr(search, "paired", both)
    solving(monkeypatch, {1.0: 5.0, 10.0: 9.0})
    fit_all(evidence, None, 1, [])
    assert seen == [{1.0}, {10.0}]


@pytest.mark.parametrize(("better", "count"), [((None, 9.0), 0), ((None, None), 1)])
def test_an_effect_that_is_solved_for_one_person_is_no_linear_estimate(
    evidence, monkeypatch, better, count
):
    solving(monkeypatch, dict(zip((1.0, 10.0), better, strict=True)))
    warnings = []
    fit_all(evidence, None, 1, warnings)
    assert len(warnings) == count


@pytest.mark.parametrize(("behind", "kept"), [(0.9 * CLOSE, [1.0, 10.0]), (1.1 * CLOSE, [1.0])])
def test_a_stiffness_that_is_nearly_as_probable_is_kept(monkeypatch, behind, kept):
    def tried(found, hypotheses, session, error):
        density = 0.0 if hypotheses[0].stiffness == 1.0 else -behind
        fits_by_stiffness = (tuple(fit(h, THERE, ERROR) for h in hypotheses),)
        return _Tried(
            density, replace(found, session_share=session, fits_by_stiffness=fits_by_stiffness)
        )

    monkeypatch.setattr(evidence_module, "_tried", tried)
    found = most_probable(bare(), {1.0: tuple(LOOSE), 10.0: tuple(FIRM)})
    assert [fits[0].hypothesis.stiffness for fits in found.fits_by_stiffness] == kept
    assert np.isfinite([f.log_evidence for fits in found.fits_by_stiffness for f in fits]).all()
