"""All explanations of a difference: effects, the strongest solved again, and pairs of two."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, of_person
from scapulohumeral.gap.isolation.hypothesis import Fit, strongest
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.misfit import misfit
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.refit import refit
from scapulohumeral.gap.isolation.suppositions import Supposition, integrated, supposed
from scapulohumeral.gap.labels import family
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.parallel import side_by_side
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.signatures.resolve import Resolving

log = logging.getLogger(__name__)

# Units of log evidence below the most probable supposition within which pairs are looked for.
CLOSE = 3.0
# A predicted change below this length, in units of the noise, is nothing that solving again would
# make larger.
INVISIBLE = 0.5
# Share of what an effect's derivative explains, in log evidence, that a new solution may add. In
# two golden cases and one of the benchmark 14 new solutions added up to 0.16 of it; of three large
# effects of opened draws, 0.75 to 0.98.
ADDED = 1.0
# A solution whose parameters end further than so many prior spreads from where the movements were
# solved is an extrapolation: the movements are solved once more.
SETTLED = 0.25
# Effects between simulations that are solved again at most, the strongest first: they take most of
# the time of an answer.
MOST_OF_SIMULATIONS = 24
# Units of log probability that effects may stay behind the strongest even so: what is left of
# their probability is below a hundredth of its.
BEHIND = 5.0
# The same between simulations, where a new solution counts whatever the derivative promised: as far
# as it was while evidence and predictive density had a fifth each and 25 units of both were asked.
BEHIND_OF_SIMULATIONS = 10.0


@dataclass(frozen=True, eq=False)
class Explanations:
    """All effects and pairs, fitted.

    Attributes
    ----------
    every : under any supposition
    integrated : of each label the fit under its most probable supposition, with evidence over all
    """

    every: tuple[Fit, ...]
    integrated: tuple[Fit, ...]


def screened_only(evidence: Evidence) -> Explanations:
    """Effects at the nominal solutions, where there is no gap to explain."""
    every = tuple(f for fits in evidence.fits.values() for f in fits)
    return Explanations(every, tuple(integrated(every, evidence.suppositions)))


def by_derivatives(evidence: Evidence) -> Explanations:
    """Effects at the nominal solutions and pairs of them: nothing is solved again."""
    return _with_pairs(evidence, evidence.fits)


def fit_all(
    evidence: Evidence, model: ParticipantModel, threads: int, warnings: list[str]
) -> Explanations:
    """All effects; the strongest fitted by solving again; pairs with the strongest.

    Both a derivative and a new solution are approximations of what a person would do: of an effect
    that is solved again the fit with more evidence counts. Of effects on the body these are the
    strongest of different families. Those that would stay far behind the strongest effect of all
    even so are not solved again.

    Each is solved with every stiffness. Amplitude and interval in the answer are those of one of
    them, and which is probable, derivatives hardly tell: solutions for a yielding person add more
    to them, and one cause must not lose to another because it was solved for another person.

    Effects on the record come first, and take no place among those: they need no solution.

    A simulation does what its model solves: there a new solution counts whatever the derivative
    promised, and of those that do not stay far behind the strongest are solved again, of whatever
    family.
    """
    by_person = dict(evidence.fits)
    # Without reference trials the prediction follows errors of the record: small, so linear.
    able = [f for f in evidence.screened if _may_change(f, evidence)]
    resolving = Resolving(model, evidence.signatures, evidence.sensors, evidence.settings)
    for on_body in (False, True):
        those = [f for f in able if f.hypothesis.effects[0].changes_body == on_body]
        again = _near(those, by_person, evidence)
        again = _strongest_on_body(again, evidence) if on_body else again
        log.info("solved again: %s", ", ".join(f"{f.label} {tuple(supposed(f))}" for f in again))
        jobs = [(_alternatives(f, evidence), evidence, resolving) for f in again]
        for first, solved in zip(again, side_by_side(_refit_each, jobs, threads), strict=True):
            if not solved:
                warnings.append(
                    f"{first.label}: not solved again; its amplitude is a linear estimate"
                )
            for one in solved:
                by_person = _with(by_person, one, evidence.settings.of_simulations)
    return _with_pairs(evidence, by_person)


def _strongest_on_body(able: Sequence[Fit], evidence: Evidence) -> list[Fit]:
    """Those of some effects on the body that are solved again, see :func:`fit_all`."""
    ranked = strongest(able, evidence.prior, len(able))
    if evidence.settings.of_simulations:
        return ranked[:MOST_OF_SIMULATIONS]
    of_family = {family(f.label): f for f in reversed(ranked)}
    best = [f for f in ranked if of_family[family(f.label)] is f]
    return best[: evidence.settings.short_list]


def _near(
    able: Sequence[Fit], by_person: Mapping[Supposition, tuple[Fit, ...]], evidence: Evidence
) -> list[Fit]:
    """Effects that a new solution may bring near the strongest so far.

    What another movement explains beside a derivative, the solution may explain by itself.
    """
    far = BEHIND
    if evidence.settings.of_simulations:
        # By as much evidence will be divided.
        error = evidence.settings.signature_error
        far = BEHIND_OF_SIMULATIONS * misfit(evidence.screened, evidence.residuals, error)
    far *= evidence.settings.weighing.temperature

    def weight(one: Fit) -> float:
        return one.log_evidence + float(np.log(evidence.prior[one.label]))

    singles = (f for fits in by_person.values() for f in fits)
    least = max(map(weight, integrated(singles, evidence.suppositions))) - far
    nothing = no_gap_evidence(evidence.residual)
    return [f for f in able if weight(f) + ADDED * max(f.log_evidence - nothing, 0.0) > least]


def _with_pairs(
    evidence: Evidence, by_person: Mapping[Supposition, tuple[Fit, ...]]
) -> Explanations:
    """All effects as they are fitted, and pairs of the strongest."""
    singles = tuple(f for fits in by_person.values() for f in fits)
    pairs = tuple(f for one in _probable(evidence) for f in _pairs(evidence, by_person, one))
    every = (*singles, *pairs)
    return Explanations(every, tuple(integrated(every, evidence.suppositions)))


def _with(
    by_person: Mapping[Supposition, tuple[Fit, ...]], solved: Fit, simulated: bool
) -> dict[Supposition, tuple[Fit, ...]]:
    """All fits, with one that was solved again where it counts, see :func:`fit_all`."""
    one = supposed(solved)
    better = tuple(_better(f, solved, simulated) for f in by_person[one])
    return {**by_person, one: better}


def _may_change(first: Fit, evidence: Evidence) -> bool:
    """Whether solving again may say more than the derivative."""
    [effect] = first.hypothesis.effects
    residual = evidence.residuals[first.moved_deg]
    visible = float(sum(residual.whiten(first.predicted) ** 2)) > INVISIBLE**2
    return visible and (evidence.referenced or effect.changes_body)


def _alternatives(first: Fit, evidence: Evidence) -> list[Fit]:
    """Of each stiffness the most probable fit of a label, the most probable of them first."""
    same = [f for fits in evidence.fits.values() for f in fits if f.label == first.label]
    ranked = sorted(same, key=lambda f: -f.log_evidence)
    found: dict[float, Fit] = {}
    for one in ranked:
        found.setdefault(one.hypothesis.stiffness, one)
    return list(found.values())


def _better(first: Fit, solved: Fit, simulated: bool) -> Fit:
    """The fit that counts of two of one label, see :func:`fit_all`; the first of another label."""
    if first.label != solved.label:
        return first
    return solved if simulated or solved.log_evidence > first.log_evidence else first


def _probable(evidence: Evidence) -> list[Supposition]:
    """Suppositions under which some effect is nearly as probable as under any."""
    best = {
        one: max(f.log_evidence for f in of_person(evidence.fits, one)) for one in evidence.fits
    }
    return [one for one, value in best.items() if value > max(best.values()) - CLOSE]


def _pairs(
    evidence: Evidence, by_person: Mapping[Supposition, tuple[Fit, ...]], one: Supposition
) -> list[Fit]:
    fits = of_person(by_person, one)
    residual = evidence.residuals[one.moved_deg]
    found = paired(fits, evidence.prior, residual, evidence.settings.signature_error)
    # Pairs on the record alone are the same however firmly the movement is kept.
    first = next(iter(evidence.known))
    return [
        f
        for f in found
        if one.stiffness == first or any(e.changes_body for e in f.hypothesis.effects)
    ]


def _refit_each(fits: Sequence[Fit], evidence: Evidence, resolving: Resolving) -> list[Fit]:
    """Those of some fits that can be solved again, as they are solved, with every other movement.

    What a cause does when it is solved may need no other movement beside it, where its derivative
    did to mend its shape.
    """
    found: list[Fit] = []
    for one in fits:
        solved = _refit_or_keep(one, evidence.residuals[one.moved_deg], resolving)
        if solved is None:
            continue
        each = _with_other_movements(solved, evidence)
        best = max(each, key=lambda f: f.log_evidence)
        if _far(best):
            solved = _refit_or_keep(best, evidence.residuals[best.moved_deg], resolving)
            each = each if solved is None else _with_other_movements(solved, evidence)
        found += each
    return found


def _with_other_movements(solved: Fit, evidence: Evidence) -> list[Fit]:
    """A solved hypothesis with each size of another movement, first the one it was solved for."""
    error = evidence.settings.signature_error
    others = (c for size, c in evidence.residuals.items() if size != solved.moved_deg)
    return [solved, *(fit(solved.hypothesis, residual, error) for residual in others)]


def _far(one: Fit) -> bool:
    """Whether parameters are far from where movements were solved."""
    way = abs(one.x - one.hypothesis.at) / one.hypothesis.prior_sd
    return bool(np.any(way > SETTLED))


def _refit_or_keep(first: Fit, residual: Residual, resolving: Resolving) -> Fit | None:
    """A refit, or None where a movement with the effect has no solution."""
    try:
        return refit(first, residual, resolving)
    except SolveError as error:
        log.info("%s: %s", first.label, error)
        return None
