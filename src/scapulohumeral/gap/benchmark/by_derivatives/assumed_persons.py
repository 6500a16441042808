"""Persons who are just as the diagnosis assumes: differences drawn from its own model of a case.

Cause, amplitude, how a person answers to it, another movement, sessions and scatter are drawn from
what is believed of them before any data. Answers to such persons cannot fail by an assumption that
is wrong, only by what the trials do not tell, or by a fault of the inference (simulation-based
calibration: Talts et al. 2018, arXiv 1804.06788).

Letters: D coefficients, P parameters, N nodes, K channels, T tasks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.isolation.empirical_bayes import (
    ERROR_SHARES,
    SESSION_SHARES,
    ErrorShares,
    Evidence,
    as_assumed,
    assumed,
)
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.model_error import change_error, own_error
from scapulohumeral.gap.isolation.suppositions import log_weight_of_size
from scapulohumeral.gap.labels import JOIN, family
from scapulohumeral.gap.residual.noise import draws, normal_draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import UNKNOWN_INPUT_SIZES

NOTHING, MOVEMENT, UNKNOWN, SINGLE, PAIR = "nothing", "movement", "unknown", "single", "pair"
# A change shows if its root mean square over the movement is so many standard errors in some
# channel of some task: the rule of keys.
SHOWN = 2.0
# Attempts after which no parameters inside all bounds are expected any more.
ATTEMPTS = 10_000


@dataclass(frozen=True, eq=False)
class AssumedPerson:
    """A difference with all that made it.

    Attributes
    ----------
    kind : nothing, movement (another one alone), unknown (smooth inputs), single or pair
    causes : hypotheses of the effects, as they are for this person; x : (P,) parameters of each
    moved_deg : size of another movement that was supposed [deg]
    errors : shares of what sessions change and of the error of predictions
    delta : (D,) the difference
    cause_shows : how large each cause is by itself [standard errors], see :data:`SHOWN`; of smooth
        inputs that of their sum
    movement_shows : the same of the other movement
    """

    kind: str
    causes: tuple[Hypothesis, ...]
    x: tuple[np.ndarray, ...]
    moved_deg: float
    errors: ErrorShares
    delta: np.ndarray
    cause_shows: tuple[float, ...]
    movement_shows: float

    @property
    def shown(self) -> bool:
        """Whether every cause shows by itself, or the movement if that is all."""
        sizes = self.cause_shows if self.cause_shows else (self.movement_shows,)
        return min(sizes) >= SHOWN

    @property
    def truth(self) -> str:
        """Label of the injected effects; empty without any."""
        return JOIN.join(sorted(one.label for one in self.causes))


def draw_person(evidence: Evidence, kind: str, seed: int | Sequence[int]) -> AssumedPerson:
    """A person of a kind.

    Parameters
    ----------
    evidence : of a case, with the settings of diagnoses
    kind : :data:`NOTHING`, :data:`MOVEMENT`, :data:`UNKNOWN`, :data:`SINGLE` or :data:`PAIR`
    seed : of all that is drawn
    """
    rng = np.random.default_rng(seed)
    errors = _errors(evidence, rng)
    person = assumed(evidence, errors)
    stiffness = rng.choice(list(evidence.known))
    causes = _causes(person, kind, float(stiffness), rng)
    body = any(one.effects[0].changes_body for one in causes) or kind == UNKNOWN
    moved_deg = _moved(person, kind, body, rng)
    same, other = person.residuals[0.0], person.residuals[moved_deg]
    x = tuple(_parameters(one, rng) for one in causes)
    error = person.settings.signature_error
    changes = [_change(other, one, at, error, rng) for one, at in zip(causes, x, strict=True)]
    if kind == UNKNOWN:
        changes.append(_smooth_inputs(evidence.unknown_inputs.columns, rng))
    movement = normal_draws(other.covariance - same.covariance, 1, rng)[0]
    scatter = draws(same, 1, int(rng.integers(2**31)))[:, 0]
    return AssumedPerson(
        kind=kind,
        causes=causes,
        x=x,
        moved_deg=moved_deg,
        errors=errors,
        delta=scatter + movement + np.sum(changes, axis=0),
        cause_shows=tuple(_size(same, change) for change in changes),
        movement_shows=_size(same, movement),
    )


def _errors(evidence: Evidence, rng: np.random.Generator) -> ErrorShares:
    """Shares of errors, each as probable as the others that are tried."""
    sessions = SESSION_SHARES if evidence.referenced else SESSION_SHARES[:1]
    markers, electrodes = (float(rng.choice(sessions)) for _ in range(2))
    # How much a task scatters is drawn with the scatter itself.
    signature = float(rng.choice(ERROR_SHARES))
    return replace(
        as_assumed(evidence), markers=markers, electrodes=electrodes, signature=signature
    )


def _causes(
    evidence: Evidence, kind: str, stiffness: float, rng: np.random.Generator
) -> tuple[Hypothesis, ...]:
    """Effects by their priors: of a pair, two of different families."""
    count = {SINGLE: 1, PAIR: 2}.get(kind, 0)
    found: list[Hypothesis] = []
    for _ in range(count):
        taken = {family(one.label) for one in found}
        left = [h for h in evidence.known[stiffness] if family(h.label) not in taken]
        prior = np.array([evidence.prior[h.label] for h in left])
        found.append(left[rng.choice(len(left), p=prior / prior.sum())])
    return tuple(found)


def _moved(evidence: Evidence, kind: str, body: bool, rng: np.random.Generator) -> float:
    """Size of another movement [deg]: that of :data:`MOVEMENT` is above zero."""
    sizes = [size for size in evidence.residuals if kind != MOVEMENT or size > 0.0]
    if kind == NOTHING:
        return 0.0
    weights = np.exp([log_weight_of_size(size, evidence.residuals, body) for size in sizes])
    return float(rng.choice(sizes, p=weights / weights.sum()))


def _parameters(one: Hypothesis, rng: np.random.Generator) -> np.ndarray:
    """Internal parameters (P,) by their prior, inside bounds and in order."""
    low, high = one.bounds
    for _ in range(ATTEMPTS):
        x = one.prior_sd * rng.normal(size=len(low))
        if np.all((low <= x) & (x <= high)) and all(x[i] <= x[j] for i, j in one.order):
            return x
    raise RuntimeError(f"{one.label}: no parameters inside its bounds in {ATTEMPTS} attempts")


def _change(
    residual: Residual, one: Hypothesis, x: np.ndarray, relative: float, rng: np.random.Generator
) -> np.ndarray:
    """Change (D,) that a person shows, who answers otherwise than predicted."""
    [effect] = one.effects
    predicted = one.predict(x)
    error = change_error(
        residual, predicted, own_error(effect, relative), controlled=effect.changes_body
    )
    return predicted + np.linalg.solve(residual.axes.matrix, error.draw(rng, 1)[:, 0])


def _smooth_inputs(columns: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Change (D,) by smooth unknown inputs (D, S) of a size as probable as others."""
    size = float(rng.choice(UNKNOWN_INPUT_SIZES))
    return size * columns @ rng.normal(size=columns.shape[1])


def _size(residual: Residual, change: np.ndarray) -> float:
    """Largest root mean square over phase of a change (D,) in any channel of any task.

    In standard errors of the mean difference between repeats.
    """
    error = replace(residual, covariance=residual.noise).spread
    return float(np.sqrt(np.mean((residual.curves(change) / error) ** 2, axis=1)).max())
