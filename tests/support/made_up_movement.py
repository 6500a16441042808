"""A person who moved in another way, with EMG that follows: made up for tests of the inference."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from gap_movement import CHANNELS, NODES

from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.other_movement import other_movement
from scapulohumeral.gap.residual.residual import Residual

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
DOF, COUNT = 10, 4
FUNCTIONS = phase_functions(NODES, COUNT)
TASKS = ("a", "b", "c")
SCALES = np.array([1.0] * DOF + [0.01] * len(CHANNELS))


def intended(seed):
    """Change (10, B, N, K) per degree: it is realised, and joints ask for EMG, each its own."""
    rng = np.random.default_rng(seed)
    shapes = (FUNCTIONS * np.sqrt(NODES)).T
    change = np.zeros((DOF, COUNT, NODES, len(NAMES)))
    for dof in range(DOF):
        change[dof, :, :, dof] = shapes
        mixed = np.tensordot(rng.normal(size=(COUNT, COUNT)), shapes, 1)
        change[dof, :, :, DOF:] = 0.01 * mixed[..., None] * rng.normal(size=len(CHANNELS))
    return change


def signatures(tasks=TASKS):
    """What other movements change in each task."""
    return [SimpleNamespace(task=task, intended=intended(i)) for i, task in enumerate(tasks)]


def same_movement(noise=0.3, tasks=TASKS, session=0.0):
    """A comparison whose movement was the same; sessions change all tasks alike."""
    size = len(NAMES) * COUNT
    scale = np.tile(np.repeat(SCALES, COUNT), len(tasks))
    noise_ = np.diag((noise * scale) ** 2)
    alike = np.tile(np.eye(size), (len(tasks), 1)) * scale[:, None]
    covariance = noise_ + session**2 * alike @ alike.T
    degrees = (8.0,) * len(tasks)
    return Residual(
        np.zeros(len(scale)), covariance, noise_, FUNCTIONS, tuple(tasks), NAMES, degrees
    )


def supposed_movements(same, delta, relative_error=0.1, sizes=(2.0, 6.0, 18.0)):
    """Comparisons by the supposed size of another movement, of a difference (D,)."""
    same = replace(same, delta=delta)
    unit = other_movement(same, signatures(same.tasks), relative_error)
    moved = {
        size: replace(same, covariance=same.covariance + size**2 * unit, moved_deg=size)
        for size in sizes
    }
    return {0.0: same, **moved}


def simulated_movements(rng, count, tasks=TASKS, relative_error=0.0):
    """Changes (D, count) by smooth random movements of which joints vary by one degree each.

    Half of the variance is alike in all tasks; EMG is off by a movement of its own in each channel.
    """
    shares = 1.0 / np.arange(1, COUNT + 1)
    shares /= np.linalg.norm(shares)

    def movement():
        alike = rng.normal(size=(count, DOF, COUNT))
        parts = []
        for of_task in signatures(tasks):
            amounts = np.sqrt(0.5) * (alike + rng.normal(size=alike.shape)) * shares
            curves = np.einsum("ldb,dbnk->lnk", amounts, of_task.intended)
            parts.append(np.einsum("nb,lnk->lkb", FUNCTIONS, curves))
        return np.stack(parts, axis=1)

    change = movement()
    for channel in range(DOF, len(NAMES)):
        change[:, :, channel] += relative_error * movement()[:, :, channel]
    return change.reshape(count, -1).T
