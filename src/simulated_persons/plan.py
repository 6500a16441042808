"""What blind cases are drawn: how many of which kind, on whom, with which effects.

The draw decides everything from one seed, which stays with the keys.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulated_persons.effects import (
    LIBRARY_LIKE,
    UNKNOWN,
    Injection,
    distant_crosstalk,
    frame_misalignment,
    friction,
    heart,
    movement_strategy,
    scapula_sta,
    speed_gain,
    thorax_surface,
)

Draw = Callable[[np.random.Generator], Injection]
# Shares of the kinds among the cases of the design, 144: the actual numbers vary with the seed.
SHARES = {
    "null": 0.17,
    "single": 0.43,
    "pair": 0.10,
    "unknown": 0.12,
    "salted": 0.10,
    "strategy": 0.08,
}
# How persons meet an effect. ASSUME: most people keep the movement that they are asked for, or do
# it a little otherwise; few give way as far as effort would have it.
YIELDS, KEEPS, CHANGES = "yields", "keeps", "changes"
PERSONS = {YIELDS: 0.3, KEEPS: 0.4, CHANGES: 0.3}
# Kinds of cases whose persons do not change their movement beside: nothing else is wrong in them.
UNCHANGED = ("null", "strategy")
# Share of persons who are recorded with skin markers, which hardly see axial rotation.
MARKERS_SHARE = 0.5
SALTS: tuple[Draw | None, ...] = (None, frame_misalignment, scapula_sta)
# The plants: this package's own, OpenSim (`opensim_plant`), and recorded motion with salt.
OWN, OPENSIM, SALTED = "P1", "P2", "S"
PLANTS = (OWN, OPENSIM)
# What each plant can be given. In OpenSim's the thorax is no surface to be pushed by.
LIBRARY: dict[str, tuple[Draw, ...]] = {
    OWN: LIBRARY_LIKE,
    OPENSIM: tuple(draw for draw in LIBRARY_LIKE if draw is not thorax_surface),
}
OUTSIDE: dict[str, tuple[Draw, ...]] = {
    OWN: UNKNOWN,
    OPENSIM: (friction, heart, distant_crosstalk, speed_gain),
}
TASKS = ("frontal", "scapular", "sagittal")
# Measurement: with EMG and reference trials, without one of them, without both.
MODES = ((True, True, 0.6), (False, True, 0.15), (True, False, 0.15), (False, False, 0.1))
ON_EMG = (
    "measurement/em",
    "measurement/electrode_shift",
    "unknown/near/distant_crosstalk",
    "unknown/near/speed_gain",
    "unknown/far/heart",
)
# No body has another thorax from one recording to the next: it is the model that has it wrong. And
# without reference trials there is no movement that the test could differ from.
OF_THE_MODEL: tuple[str, ...] = ("body/thorax_surface",)
OF_TWO_SIDES: tuple[str, ...] = ("control/movement_strategy",)
FEWEST_REPEATS, MOST_REPEATS = 3, 5
# Share of simulated cases whose glenoid is instrumented.
CONTACT_SHARE = 0.2
# Share of cases whose effect may hardly show: what a diagnosis must not make anything of.
FAINT_SHARE = 0.15


@dataclass(frozen=True)
class Plan:
    """One case before anything is simulated.

    Attributes
    ----------
    id : random name, so that no order of drawing shows; `generate` gives blind cases another one
    seed : of everything random in it
    plant : of `PLANTS`, or `SALTED`
    kind : of `SHARES`
    participant : whose anatomy; tasks : recorded in the case; hidden : kept for scoring
    injections : effects
    emg, contact, reference : what the case contains; repeats : trials per task and side
    faint : the effect may hardly show; otherwise it is drawn again
    person : of `PERSONS`; markers : on the skin, so that axial rotation is hardly seen
    """

    id: str
    seed: int
    plant: str
    kind: str
    participant: str
    tasks: tuple[str, ...]
    hidden: str
    injections: tuple[Injection, ...]
    emg: bool
    contact: bool
    reference: bool
    repeats: int
    faint: bool
    person: str
    markers: bool

    @property
    def otherwise(self) -> bool:
        """Whether the test movement is done otherwise than the reference."""
        return self.person == CHANGES or self.kind == "strategy"

    @property
    def may_show(self) -> bool:
        """Whether the effect can show: motion does not of a person who keeps it."""
        recorded = ("input/frame", "measurement", "control/movement")
        on_record = any(i.label.startswith(recorded) for i in self.injections)
        return self.person == YIELDS or self.emg or self.contact or on_record


def draw_plans(
    seed: int,
    count: int,
    participants: Sequence[str],
    kind: str | None = None,
    plant: str = OWN,
) -> list[Plan]:
    """A number of cases; families of effects come in turn, so that each is represented.

    With a `kind` all cases are of that kind: open ones, for thresholds and calibration. Recorded
    motion with salt comes with the package's own plant only.
    """
    rng = np.random.default_rng(seed)
    shares = {k: v for k, v in SHARES.items() if plant == OWN or k != "salted"}
    kinds = _kinds(rng, count, shares) if kind is None else [kind] * count
    library = LIBRARY[plant]
    supply = {
        "single": _in_turn(rng, [(f,) for f in library]),
        "unknown": _in_turn(rng, [(f,) for f in OUTSIDE[plant]]),
        "salted": _in_turn(rng, [() if f is None else (f,) for f in SALTS]),
    }
    plans = []
    for name in kinds:
        if name == "pair":
            chosen = rng.choice(len(library), size=2, replace=False)
            families: tuple[Draw, ...] = tuple(library[i] for i in chosen)
        elif name == "strategy":
            families = (movement_strategy,)
        else:
            families = next(supply[name]) if name in supply else ()
        plan = _plan(rng, name, families, str(rng.choice(participants)))
        plans.append(replace(plan, plant=SALTED if name == "salted" else plant))
    return plans


def redrawn(plan: Plan, attempt: int) -> Plan:
    """The same case with other amplitudes and another person."""
    seed = plan.seed + attempt
    rng = np.random.default_rng(seed)
    families = {f.__name__: f for f in (*LIBRARY_LIKE, *UNKNOWN, movement_strategy)}
    again = tuple(families[i.family](rng) for i in plan.injections)
    return replace(plan, seed=seed, injections=again)


def _kinds(rng: np.random.Generator, count: int, of: Mapping[str, float]) -> list[str]:
    shares = np.array(list(of.values())) * np.exp(rng.normal(0, 0.1, len(of)))
    names = list(of)
    if count < len(names):  # not one of each
        return [str(kind) for kind in rng.choice(names, count, False, shares / shares.sum())]
    numbers = np.maximum(np.round(count * shares / shares.sum()).astype(int), 1)
    numbers[names.index("single")] += count - numbers.sum()
    kinds = np.repeat(names, numbers)
    return [str(kind) for kind in rng.permutation(kinds)]


def _in_turn(rng: np.random.Generator, items: list):
    while True:
        for index in rng.permutation(len(items)):
            yield items[index]


def _modes(kind: str, labels: Sequence[str]) -> list[tuple[bool, bool, float]]:
    """Of `MODES` those in which effects can be what differs."""
    found = []
    for emg, reference, weight in MODES:
        unfit = OF_THE_MODEL if reference else OF_TWO_SIDES
        unfit += () if emg else ON_EMG
        if not (kind == "salted" and emg or any(label.startswith(unfit) for label in labels)):
            found.append((emg, reference, weight))
    return found


def _plan(
    rng: np.random.Generator, kind: str, families: tuple[Draw, ...], participant: str
) -> Plan:
    injections = tuple(sorted((draw(rng) for draw in families), key=lambda i: i.label))
    modes = _modes(kind, [injection.label for injection in injections])
    weights = np.array([mode[2] for mode in modes])
    emg, reference, _ = modes[rng.choice(len(modes), p=weights / weights.sum())]
    persons = {k: v for k, v in PERSONS.items() if kind not in UNCHANGED or k != CHANGES}
    person = rng.choice(list(persons), p=np.array(list(persons.values())) / sum(persons.values()))
    order = [str(task) for task in rng.permutation(TASKS)]
    return Plan(
        # Probes of the null bank, whose seed is known, are found by this name.
        id=rng.bytes(4).hex(),
        seed=int(rng.integers(2**31)),
        plant=SALTED if kind == "salted" else OWN,
        kind=kind,
        participant=participant,
        tasks=tuple(order[:2]),
        hidden=order[2],
        injections=injections,
        emg=emg,
        contact=kind != "salted" and bool(rng.random() < CONTACT_SHARE),
        reference=reference,
        repeats=int(rng.integers(FEWEST_REPEATS, MOST_REPEATS + 1)),
        faint=bool(rng.random() < FAINT_SHARE),
        person=YIELDS if kind == "salted" else str(person),
        markers=kind != "salted" and bool(rng.random() < MARKERS_SHARE),
    )
