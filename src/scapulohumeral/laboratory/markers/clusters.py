"""Landmarks that a rigid cluster of markers carries along, placed in it by a static trial.

Letters: T frames, K markers of a cluster.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.markers.files import Markers
from scapulohumeral.laboratory.markers.marker_map import Cluster
from scapulohumeral.model.rotations import Array

# Fewer markers leave the turn of a cluster open.
FEWEST_MARKERS = 3
# Markers of a cluster that spread by less than this in the second direction are a line [m].
LEAST_SPREAD_M = 0.005
# Of a marker, or a DataError that says why it has none.
Track = Callable[[str], Array]


@dataclass(frozen=True, eq=False)
class Template:
    """A cluster as a static trial shows it.

    Attributes
    ----------
    name : of the cluster
    markers : (K,) labels
    places : (K, 3) [m] of the markers, in axes of the cluster
    landmarks : landmark -> (3,) [m] in axes of the cluster
    left_out : why further markers of the map are not used, a text each
    """

    name: str
    markers: tuple[str, ...]
    places: Array
    landmarks: Mapping[str, Array]
    left_out: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Carried:
    """What a cluster tells in one recording.

    Attributes
    ----------
    landmarks : landmark -> (T, 3) [m], laboratory axes, of a left arm as it is
    misfits : marker -> (T,) [m] from where the rigid cluster that fits best has it
    left_out : why further markers of the map are not used, a text each
    """

    landmarks: Mapping[str, Array]
    misfits: Mapping[str, Array]
    left_out: tuple[str, ...]


def read_template(
    cluster: Cluster, landmarks: Mapping[str, tuple[str, ...]], static: Markers
) -> Template:
    """Mean places of a cluster and its landmarks in the static trial, in axes of the cluster.

    Means in laboratory axes would bend the cluster when a marker is hidden while the person sways.
    Markers of the cluster that the trial does not show are left out.

    Parameters
    ----------
    cluster : which markers, and which landmarks they carry
    landmarks : landmark -> markers whose mean it is
    static : recording that shows them together

    Raises
    ------
    DataError                        fewer than three markers, one that is never seen together with
                                     the others, markers on a line, or no marker of a landmark;
                                     names file, cluster and marker
    """
    seen, left_out = _seen(cluster.name, cluster.markers, static.track)
    labels = {name: landmarks[name] for name in cluster.landmarks}
    further = [label for many in labels.values() for label in many]
    tracks = {label: static.track(label) for label in [*seen, *further]}
    whole = np.isfinite([tracks[label] for label in seen]).all(axis=(0, 2))
    for label, track in tracks.items():
        if not np.isfinite(track[whole]).all(axis=1).any():
            raise DataError(
                f"{static.source}, cluster {cluster.name}: no frame shows {label} and all of "
                f"{', '.join(seen)}. Record the static trial again, or map others."
            )
    cloud = np.stack([tracks[label][whole] for label in seen], axis=1)
    _refuse_line(static, cluster.name, (seen, left_out), cloud[0])
    turns, centre = _turns(cloud[0], cloud), cloud.mean(axis=1)

    def place(label: str) -> Array:
        return np.nanmean(np.einsum("tji,tj->ti", turns, tracks[label][whole] - centre), axis=0)

    return Template(
        name=cluster.name,
        markers=seen,
        places=np.array([place(label) for label in seen]),
        landmarks={n: np.mean([place(one) for one in many], axis=0) for n, many in labels.items()},
        left_out=left_out,
    )


def _seen(
    cluster: str, labels: Sequence[str], track: Track
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Those of the markers of a cluster that have a track in a recording, and why not the others.

    Some software leaves the label of a marker out that it saw in no frame.
    """
    seen, hidden = [], []
    for label in labels:
        try:
            track(label)
        except DataError as error:
            hidden.append(str(error))
        else:
            seen.append(label)
    if len(seen) < FEWEST_MARKERS:
        raise DataError(
            f"{hidden[0]} Cluster {cluster} needs {FEWEST_MARKERS} markers; found "
            f"{', '.join(seen) or 'none'}."
        )
    return tuple(seen), tuple(hidden)


def _refuse_line(
    markers: Markers, cluster: str, found: tuple[Sequence[str], Sequence[str]], places: Array
) -> None:
    """Refuse a cluster whose markers, found by `_seen` and at places (K, 3), leave a turn open."""
    seen, hidden = found
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if spread[1] < LEAST_SPREAD_M:
        raise DataError(
            f"{markers.source}, cluster {cluster}: markers {', '.join(seen)} lie within "
            f"{1e3 * spread[1]:.1f} mm of a line; expected a triangle. "
            f"{' '.join(hidden) or 'Add a marker.'}"
        )


def _as_seen(template: Template, markers: Markers, track: Track) -> Template:
    """A cluster without the markers that have no track in a recording."""
    seen, hidden = _seen(template.name, template.markers, track)
    if not hidden:
        return template
    places = template.places[[template.markers.index(label) for label in seen]]
    _refuse_line(markers, template.name, (seen, hidden), places)
    left_out = (*template.left_out, *hidden)
    return replace(template, markers=seen, places=places, left_out=left_out)


def _turns(reference: Array, cloud: Array) -> Array:
    """Rotations (T, 3, 3) of a cluster (K, 3) that fit it best to its markers (T, K, 3)."""
    centred = reference - reference.mean(axis=0)
    return np.array(
        [
            Rotation.align_vectors(frame - frame.mean(axis=0), centred)[0].as_matrix()
            for frame in cloud
        ]
    )


def carry(template: Template, markers: Markers, track: Track) -> Carried:
    """Landmarks that a cluster carries along: the rigid motion closest to its markers.

    Those that the recording does not show, or not for too long, are left out: of the whole
    recording, as landmarks would jump where a marker comes and goes.

    Parameters
    ----------
    template : of the static trial
    markers : recording
    track : marker -> (T, 3) [m] in the recording, gaps filled; DataError if they cannot be

    Raises
    ------
    DataError                        fewer than three markers, or some on a line; names file,
                                     cluster and marker
    """
    seen = _as_seen(template, markers, track)
    cloud = np.stack([track(label) for label in seen.markers], axis=1)
    centre, moved = seen.places.mean(axis=0), cloud.mean(axis=1)
    turns = _turns(seen.places, cloud)
    rigid = moved[:, None] + (seen.places - centre) @ turns.swapaxes(1, 2)
    misfit = np.linalg.norm(cloud - rigid, axis=2)
    return Carried(
        landmarks={name: moved + turns @ (p - centre) for name, p in seen.landmarks.items()},
        misfits=dict(zip(seen.markers, misfit.T, strict=True)),
        left_out=seen.left_out,
    )
