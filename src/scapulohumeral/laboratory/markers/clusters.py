"""Landmarks that a rigid cluster of markers carries along, placed in it by a static trial.

Letters: T frames, K markers of a cluster.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.markers.files import Markers
from scapulohumeral.laboratory.markers.marker_map import Cluster
from scapulohumeral.model.rotations import Array

# Markers of a cluster that spread by less than this in the second direction are a line [m].
LEAST_SPREAD_M = 0.005


@dataclass(frozen=True, eq=False)
class Template:
    """A cluster as a static trial shows it.

    Attributes
    ----------
    name : of the cluster
    markers : (K,) labels
    places : (K, 3) [m] of the markers, in axes of the cluster
    landmarks : landmark -> (3,) [m] in axes of the cluster
    """

    name: str
    markers: tuple[str, ...]
    places: Array
    landmarks: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Carried:
    """What a cluster tells in one recording.

    Attributes
    ----------
    landmarks : landmark -> (T, 3) [m], laboratory axes, of a left arm as it is
    misfits : marker -> (T,) [m] from where the rigid cluster that fits best has it
    """

    landmarks: Mapping[str, Array]
    misfits: Mapping[str, Array]


def read_template(
    cluster: Cluster, landmarks: Mapping[str, tuple[str, ...]], static: Markers
) -> Template:
    """Mean places of a cluster and its landmarks in the static trial, in axes of the cluster.

    Means in laboratory axes would bend the cluster when a marker is hidden while the person sways.

    Parameters
    ----------
    cluster : which markers, and which landmarks they carry
    landmarks : landmark -> markers whose mean it is
    static : recording that shows them together

    Raises
    ------
    DataError                        a marker that is not there, or not together with the others, or
                                     markers on a line; names file, cluster and marker
    """
    labels = {name: landmarks[name] for name in cluster.landmarks}
    further = [label for many in labels.values() for label in many]
    tracks = {label: static.track(label) for label in [*cluster.markers, *further]}
    whole = np.isfinite([tracks[label] for label in cluster.markers]).all(axis=(0, 2))
    for label, track in tracks.items():
        if not np.isfinite(track[whole]).all(axis=1).any():
            raise DataError(
                f"{static.source}, cluster {cluster.name}: no frame shows {label} and all of "
                f"{', '.join(cluster.markers)}. Record the static trial again, or map others."
            )
    cloud = np.stack([tracks[label][whole] for label in cluster.markers], axis=1)
    spread = np.linalg.svd(cloud[0] - cloud[0].mean(axis=0), compute_uv=False)
    if spread[1] < LEAST_SPREAD_M:
        raise DataError(
            f"{static.source}, cluster {cluster.name}: markers {', '.join(cluster.markers)} lie "
            f"within {1e3 * spread[1]:.1f} mm of a line; expected a triangle. Add a marker."
        )
    turns, centre = _turns(cloud[0], cloud), cloud.mean(axis=1)

    def place(label: str) -> Array:
        return np.nanmean(np.einsum("tji,tj->ti", turns, tracks[label][whole] - centre), axis=0)

    return Template(
        name=cluster.name,
        markers=cluster.markers,
        places=np.array([place(label) for label in cluster.markers]),
        landmarks={n: np.mean([place(one) for one in many], axis=0) for n, many in labels.items()},
    )


def _turns(reference: Array, cloud: Array) -> Array:
    """Rotations (T, 3, 3) of a cluster (K, 3) that fit it best to its markers (T, K, 3)."""
    centred = reference - reference.mean(axis=0)
    return np.array(
        [
            Rotation.align_vectors(frame - frame.mean(axis=0), centred)[0].as_matrix()
            for frame in cloud
        ]
    )


def carry(template: Template, track: Callable[[str], Array]) -> Carried:
    """Landmarks that a cluster carries along: the rigid motion closest to its markers.

    Parameters
    ----------
    template : of the static trial
    track : marker -> (T, 3) [m] in the recording, finite
    """
    cloud = np.stack([track(label) for label in template.markers], axis=1)
    centre, moved = template.places.mean(axis=0), cloud.mean(axis=1)
    turns = _turns(template.places, cloud)
    rigid = moved[:, None] + (template.places - centre) @ turns.swapaxes(1, 2)
    misfit = np.linalg.norm(cloud - rigid, axis=2)
    return Carried(
        landmarks={name: moved + turns @ (p - centre) for name, p in template.landmarks.items()},
        misfits=dict(zip(template.markers, misfit.T, strict=True)),
    )
