"""What muscles with compliant tendons must be excited with to pull as muscles with rigid ones do.

The study's tendons are rigid. A tendon that stretches leaves less length to the fibres, the less
the harder they pull, and fibres move while the muscle does not:

    l = (L - slack (1 + s)) / l_opt    v = (V - slack ds/dt) / (v_max l_opt)

with L and V length and lengthening velocity of the muscle-tendon unit. The strain s grows with the
force F over the maximum isometric force Fmax like the toe region of Thelen 2003 (J Biomech Eng 125:
70-77), here up to its value s_max at the maximum:

    F / Fmax = (exp(3 s / s_max) - 1) / (exp(3) - 1)

Letters: N nodes, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters, excitation_change, force_derivatives
from scapulohumeral.errors import ModelError

TOE_SHAPE = 3.0


@dataclass(frozen=True, eq=False)
class Pull:
    """How muscles with rigid tendons pull, at nodes a step apart [s]; arrays (N, M).

    Attributes
    ----------
    length, velocity : of muscle and tendon [m], [m/s]
    activation, excitation : with which they pull so [1]
    """

    length: np.ndarray
    velocity: np.ndarray
    activation: np.ndarray
    excitation: np.ndarray
    step: float


def tendon_strain(share: np.ndarray, strain_at_max: float) -> np.ndarray:
    """Strain [1] of tendons at forces over their maximum [1]; what pushes leaves them slack."""
    return strain_at_max / TOE_SHAPE * np.log1p(np.expm1(TOE_SHAPE) * np.maximum(share, 0.0))


def compliant_activation(pull: Pull, muscles: MuscleParameters, strain_at_max: float) -> np.ndarray:
    """Activations (N, M) that give the same forces through tendons that stretch.

    Below zero where even inactive fibres would pull harder.

    Raises
    ------
    ModelError                       a force that is no number or that no activation gives, with
                                     muscle and node
    """
    rigid = force_derivatives(pull.length, pull.velocity, muscles)
    force = rigid.active * pull.activation + rigid.passive
    _check_numbers(force, muscles)
    strain = tendon_strain(force / muscles.max_isometric_force, strain_at_max)
    stretch = muscles.tendon_slack_length * strain
    velocity = pull.velocity - np.gradient(stretch, pull.step, axis=0)
    own = force_derivatives(pull.length - stretch, velocity, muscles)
    activation = (force - own.passive) / own.active
    # Fibres without active force would need an infinite one, of either sign, or one that is none.
    needed = np.where(np.isfinite(activation), activation, np.inf)
    if needed.max() > 1.0:
        node, muscle = np.unravel_index(np.argmax(needed), needed.shape)
        raise ModelError(
            f"tendon of {muscles.names[muscle]}, node {node}: an activation of "
            f"{activation[node, muscle]:.2f} is needed if it stretches by {strain_at_max:g}; "
            "expected 1 at most. Choose a smaller tendon_strain"
        )
    return activation


def _check_numbers(force: np.ndarray, muscles: MuscleParameters) -> None:
    """Refuse forces (N, M) that are no numbers: all that follows from them would be none."""
    missing = np.argwhere(~np.isfinite(force))
    if len(missing):
        node, muscle = missing[0]
        raise ModelError(
            f"{muscles.names[muscle]}, node {node}: a force of {force[node, muscle]} N with a "
            "rigid tendon; expected a number. Correct its length, velocity or activation there"
        )


def compliant_excitation(pull: Pull, muscles: MuscleParameters, strain_at_max: float) -> np.ndarray:
    """Excitations (N, M) that give the same forces through tendons that stretch, in 0 to 1.

    What the stretch asks for is added to the excitations of the rigid muscles: so without any they
    are the same whatever scheme the motion was computed with.
    """
    activations = pull.activation, compliant_activation(pull, muscles, strain_at_max)
    rigid, own = (
        a + excitation_change(np.gradient(a, pull.step, axis=0), a, muscles) for a in activations
    )
    return np.clip(pull.excitation + own - rigid, 0.0, 1.0)
