"""What is known of the weights of the cost, before any data."""

from __future__ import annotations

from scapulohumeral.gap.effects.base import Param

WEIGHT = Param(
    "weight_factor",
    "1",
    1.0,
    0.05,
    20.0,
    3.0,
    1.0,
    "ASSUME: weights of a cost are tuned, not measured: known to an order of magnitude",
    "log",
)
