"""A movement that was done differently: another posture or strategy, whatever the reason.

It has no shape of its own, so it is not among the effects that are differentiated:
`residual.other_movement` says how such movements vary, `isolation.movement` estimates the one that
was done.
"""

from __future__ import annotations

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param
from scapulohumeral.gap.labels import MOVED

CHANGE = Param(
    "change_deg",
    "deg",
    0.0,
    0.0,
    180.0,
    5.0,
    10.0,
    "root mean square over joints, tasks and phases; a joint cannot turn further",
)
_SIDE, _FAMILY = MOVED.split("/")
MOVEMENT_STRATEGY = Effect(
    side=_SIDE,
    family=_FAMILY,
    member=None,
    params=(CHANGE,),
    needs=KINEMATICS,
    mimics=("hand_load", "strength_loss", "frame_misalignment"),
    splitting="EMG or joint force beside the motion; the same movement guided or paced",
)
