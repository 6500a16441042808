"""All effects that a diagnosis considers. To add one: write its module, add it here, test it."""

from __future__ import annotations

from collections.abc import Iterable

from scapulohumeral.gap.effects import (
    co_contraction,
    electrode_shift,
    emd,
    emg_crosstalk,
    emg_gain,
    external_force,
    fatigue,
    fibre_length,
    frame_misalignment,
    glenoid_orientation,
    hand_load,
    humerus_sta,
    joint_damping,
    pain_inhibition,
    passive_gh,
    passive_girdle,
    rate_weight,
    scapula_sta,
    segment_mass,
    serratus_path,
    st_contact,
    stability_weight,
    strength_loss,
    tendon_compliance,
    thorax_surface,
    thorax_tilt,
)
from scapulohumeral.gap.effects.base import Effect, Setup

FAMILIES = (
    hand_load,
    segment_mass,
    strength_loss,
    fatigue,
    fibre_length,
    tendon_compliance,
    serratus_path,
    passive_gh,
    passive_girdle,
    joint_damping,
    thorax_surface,
    st_contact,
    glenoid_orientation,
    co_contraction,
    pain_inhibition,
    stability_weight,
    rate_weight,
    thorax_tilt,
    external_force,
    frame_misalignment,
    scapula_sta,
    humerus_sta,
    emg_gain,
    electrode_shift,
    emg_crosstalk,
    emd,
)
# Labels, or families of them, that exist only with channels or segments that a case may lack.
NEEDING = (
    "input/frame_misalignment/scapula",
    "measurement/scapula_sta",
    "measurement/electrode_shift",
    "measurement/emd",
    "measurement/emg_crosstalk",
    "measurement/emg_gain",
)


# Families of the model, which is one and the same for a person's test and reference trials.
OF_THE_MODEL = (passive_girdle, rate_weight, serratus_path, stability_weight, thorax_surface)


def library(setup: Setup) -> tuple[Effect, ...]:
    """All effects that the recorded observables can show, in a fixed order.

    What the model itself may have wrong is the same on both sides of a comparison of one person,
    not of two simulations. These have no errors of measurement. Two records of one movement differ
    by nothing else.
    """
    families = [f for f in FAMILIES if not (setup.of_one_person and f in OF_THE_MODEL)]
    every = (effect for family in families for effect in family.members(setup))
    shown = [effect for effect in every if effect.needs <= setup.observables]
    if setup.of_one_movement:
        return tuple(effect for effect in shown if not effect.changes_body)
    return tuple(effect for effect in shown if effect.changes_body or not setup.simulated)


def untestable(effects: Iterable[Effect]) -> tuple[str, ...]:
    """Labels and families of measurement that the recorded observables cannot show."""
    known = tuple(effects)
    present = {f"{e.side}/{e.family}" for e in known} | {e.label for e in known}
    return tuple(label for label in NEEDING if label not in present)
