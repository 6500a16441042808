"""Elevations cut from simulated composite motions, as trials of a diagnosis."""

from __future__ import annotations

from pathlib import Path

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.record import write_trial
from scapulohumeral.model.motion import Motion, read_motion
from scapulohumeral.model.published_arm import NODE_S, PUBLISHED_PLANES
from scapulohumeral.ocp.solution import read_solution

# Rounding of the times of a published table [s].
ROUNDING_S = 1e-6


def write_elevations(composite: Path, folder: Path) -> None:
    """Write each elevation of a composite motion as a trial, ``<plane>.csv``.

    Parameters
    ----------
    composite : published table of joint angles, or a stored solution of this study (``.npz``)
    folder : made if missing

    Raises
    ------
    DataError                        the motion cannot be read, or ends too early
    """
    folder.mkdir(parents=True, exist_ok=True)
    for plane, motion in elevations(composite).items():
        write_trial(folder / f"{plane}.csv", motion)


def elevations(composite: Path) -> dict[str, Motion]:
    """The elevations of a composite motion by plane, without its pauses.

    Raises
    ------
    DataError                        see `write_elevations`
    """
    if composite.suffix == ".npz":
        solution = read_solution(composite)
        planes = {name: slice(*nodes) for name, nodes in solution.header["planes"].items()}
        return {
            name: Motion(solution.time_s[nodes], solution.angles_rad[nodes])
            for name, nodes in planes.items()
        }
    motion = read_motion(composite)
    found = {}
    for name, (first, stop) in PUBLISHED_PLANES.items():
        start, end = NODE_S * first, NODE_S * (stop - 1)
        if motion.time_s[-1] < end - ROUNDING_S:
            raise DataError(
                f"{composite}: ends at {motion.time_s[-1]:g} s; expected the {name} elevation "
                f"until {end:g} s. Name a composite motion of the publication."
            )
        inside = (motion.time_s >= start - ROUNDING_S) & (motion.time_s <= end + ROUNDING_S)
        found[name] = Motion(motion.time_s[inside], motion.angles_rad[inside])
    return found
