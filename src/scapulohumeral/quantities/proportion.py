"""Shares in words, and those of cases with their uncertainty."""

from __future__ import annotations

import math

Z95 = 1.959964


def percent(share: float | None) -> str:
    """A share as whole percent, or the remark that it is not known."""
    return "unknown" if share is None else f"{100.0 * share:.0f} %"


def wilson95(hits: int, cases: int) -> tuple[float, float]:
    """Wilson 95 % interval of a share, which holds for few cases and for shares near 0 and 1.

    Parameters
    ----------
    hits : cases that count; cases : all of them, at least one

    Source
    ------
    Wilson 1927, J Am Stat Assoc 22: 209-212.
    """
    centre = (hits + Z95**2 / 2) / (cases + Z95**2)
    half = Z95 * math.sqrt(hits * (cases - hits) / cases + Z95**2 / 4) / (cases + Z95**2)
    return max(centre - half, 0.0), min(centre + half, 1.0)
