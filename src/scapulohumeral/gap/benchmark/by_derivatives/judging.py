"""Judge differences that were not recorded as if they were, by derivatives alone.

Nothing is solved again, so one difference takes seconds once a case is put together.

Letters: D coefficients.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scapulohumeral.gap.assembly import assemble
from scapulohumeral.gap.benchmark.protocol import folder_request
from scapulohumeral.gap.detection import null_bank
from scapulohumeral.gap.detection.presence import Presence, surest, tested
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, most_probable
from scapulohumeral.gap.isolation.search import by_derivatives
from scapulohumeral.gap.judgement import Judged, judge
from scapulohumeral.gap.labels import family
from scapulohumeral.gap.nominal.participant_model import ModelSettings, participant_model
from scapulohumeral.gap.recording.case import Case
from scapulohumeral.gap.residual.differences import read_records
from scapulohumeral.gap.run import read_case
from scapulohumeral.gap.settings import read_diagnosis_config, read_settings
from scapulohumeral.gap.verdict.posterior import Posterior


def evidence_of(folder: Path, config_file: Path, cache: Path) -> tuple[Evidence, Case]:
    """A case folder as the diagnosis puts it together.

    Parameters
    ----------
    folder : of a case; config_file, cache : as for the diagnosis

    Raises
    ------
    SolveError                       a nominal movement cannot be solved
    """
    config = read_diagnosis_config(config_file)
    settings = read_settings(config)
    case = read_case(folder_request(folder, config_file, cache), config)
    model = participant_model(case, ModelSettings.of(config), cache)
    records = read_records(case, model, settings, [])
    evidence = assemble(case, records, model, settings, [])
    # The signature error is the most probable one of the recorded difference: here it is sought
    # for each difference anew.
    return replace(evidence, settings=settings), case


def with_difference(evidence: Evidence, delta: np.ndarray) -> Evidence:
    """The same for another difference (D,), with the most probable shares of errors for it."""
    # What was found most probable for another difference does not count here.
    whole = replace(evidence.cautious, delta=delta, covariance=evidence.cautious.noise)
    return most_probable(replace(evidence, residuals={0.0: whole}, cautious=whole, fits={}))


class Inflation(NamedTuple):
    """What tests for a gap need of a case beside its difference: widening of thresholds, seed."""

    factor: float
    seed: int


def inflation_of(evidence: Evidence, case: Case) -> Inflation:
    """How far the null bank widens the thresholds of a case."""
    settings = evidence.settings
    bank, _ = null_bank.read_bank(null_bank.bank_file(settings), settings)
    mode = "reference" if evidence.referenced else "no_reference"
    factor, _ = null_bank.inflation(
        bank, mode, bool(case.channels), case.has_contact, settings.alpha
    )
    return Inflation(factor, case.seed)


def judged(evidence: Evidence, inflation: Inflation) -> tuple[Presence, Judged]:
    """Whether a difference is a gap by the first tests, and all hypotheses judged."""
    settings = evidence.settings
    tests = tested(
        evidence.cautious, evidence.shapes(), settings.alpha, inflation.factor, inflation.seed
    )[1]
    there = surest(tests)
    found = by_derivatives(evidence)
    # Trials that show few causes are not asked for here: most would have shown.
    return there, judge(
        evidence, found, there, settings.weighing, inflation.factor, inflation.seed, able=True
    )


def probability_of(p: Posterior, families: Collection[str]) -> float:
    """Probability of all answers of some families."""
    return sum(q for label, q in p.every.items() if family(label) in families)


def leaves_something(found: Judged) -> bool:
    """Whether the first cause is said to leave something."""
    return found.left is not None and found.left.presence.present


def length(evidence: Evidence) -> float:
    """Length of a difference, in units of what differs without a cause."""
    c = evidence.cautious
    return float(np.linalg.norm(c.whiten(c.delta)))
