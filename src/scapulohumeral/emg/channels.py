"""EMG channels: which muscle elements each one sees, and which scalers it informs.

Letters: C channels, G virtual muscle groups, M muscle elements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.errors import ConfigError, DataError, ModelError
from scapulohumeral.model.csv_table import Row, read_rows
from scapulohumeral.model.rotations import Array

COLUMNS = ("channel", "group", "scaled_muscle", "elements", "neighbours")


def neighbours_of(name: Mapping[str, Any]) -> dict[str, Any]:
    """JSON Schema of pairs of channels with cross-talk; `name` is that of the name of a channel.

    One for maps of a laboratory and participant files of a diagnosis: the former become the latter.
    """
    return {
        "type": "array",
        "items": {
            "type": "array",
            "items": name,
            "minItems": 2,
            "maxItems": 2,
            "uniqueItems": True,
            "description": "two different channels",
        },
        "description": "pairs of channels between which cross-talk is possible",
    }


@dataclass(frozen=True)
class Channels:
    """The EMG channels of the study.

    Attributes
    ----------
    names : (C,)
    channel_groups : (C,) virtual muscle group of each channel
    elements : (C,) muscle elements whose mean excitation is compared with each channel
    neighbours : (C,) channels that cross-talk can come from; mutual
    groups : (G,) virtual muscle groups in the order of the table
    scaled_muscles : (G,) muscle of the model that the scalers of each group act on
    """

    names: tuple[str, ...]
    channel_groups: tuple[str, ...]
    elements: tuple[tuple[str, ...], ...]
    neighbours: tuple[tuple[str, ...], ...]
    groups: tuple[str, ...]
    scaled_muscles: tuple[str, ...]

    def matrix(self, muscle_names: Sequence[str]) -> Array:
        """Averages over the elements of each channel (paper, supplement).

        Parameters
        ----------
        muscle_names : (M,) names of the muscle elements, in the order of the excitations

        Returns
        -------
        array, shape (C, M)              rows sum to one

        Raises
        ------
        ModelError                       if the model lacks an element
        """
        columns = {name: i for i, name in enumerate(muscle_names)}
        seen = np.zeros((len(self.names), len(muscle_names)), dtype=bool)
        for row, (channel, elements) in enumerate(zip(self.names, self.elements, strict=True)):
            unknown = [name for name in elements if name not in columns]
            if unknown:
                raise ModelError(
                    f"EMG channel {channel}: element {', '.join(unknown)} is not in the model; "
                    "expected names of its muscle elements. Correct the table of channels."
                )
            seen[row, [columns[name] for name in elements]] = True
        return channel_means(seen)

    def members(self, model_groups: Sequence[str]) -> np.ndarray:
        """Muscle elements that the scalers of each virtual group act on.

        Parameters
        ----------
        model_groups : (M,) muscle that each element belongs to: `group` in the model record

        Returns
        -------
        array of bool, shape (G, M)

        Raises
        ------
        ModelError                       if the model has no element of a scaled muscle
        """
        members = np.array(self.scaled_muscles)[:, None] == np.array(model_groups)[None, :]
        for group, muscle, row in zip(self.groups, self.scaled_muscles, members, strict=True):
            if not row.any():
                raise ModelError(
                    f"virtual muscle group {group}: the model has no element of '{muscle}'; "
                    f"it has {', '.join(sorted(set(model_groups)))}. Correct the table of channels."
                )
        return members

    def adjacency(self) -> np.ndarray:
        """Whether cross-talk can pass between two channels: (C, C) bool, symmetric."""
        return np.array([[name in others for name in self.names] for others in self.neighbours])


def channel_means(members: np.ndarray) -> np.ndarray:
    """Channels (C, M) that average the elements in ``members`` (C, M) bool, as the paper does.

    Raises
    ------
    ConfigError
        If a channel has no elements.
    """
    count = members.sum(axis=1)
    if not count.all():
        raise ConfigError(f"EMG channel {int(np.argmin(count))} has no muscle elements; name one")
    return members / count[:, None]


def read_channels(path: Path) -> Channels:
    """Read and check the table of channels.

    Parameters
    ----------
    path : Path                      columns channel, group, scaled_muscle, elements, neighbours;
                                     lists in a cell are separated by spaces

    Raises
    ------
    DataError                        a channel twice or without elements, a group with two muscles,
                                     neighbours that are unknown or not mutual; names row and column
    """
    rows = read_rows(path, COLUMNS)
    names = tuple(row["channel"] for row in rows)
    neighbours = {row["channel"]: tuple(row["neighbours"].split()) for row in rows}
    muscles: dict[str, str] = {}
    for number, row in enumerate(rows, start=2):
        fault = _fault(row, names, neighbours, muscles)
        if fault:
            raise DataError(f"{path}, row {number}, {fault}")
        muscles[row["group"]] = row["scaled_muscle"]
    return Channels(
        names=names,
        channel_groups=tuple(row["group"] for row in rows),
        elements=tuple(tuple(row["elements"].split()) for row in rows),
        neighbours=tuple(neighbours.values()),
        groups=tuple(muscles),
        scaled_muscles=tuple(muscles.values()),
    )


def _fault(
    row: Row,
    names: Sequence[str],
    neighbours: dict[str, tuple[str, ...]],
    muscles: dict[str, str],
) -> str | None:
    """What is wrong with a row, or None; `muscles` are those of the groups in earlier rows."""
    channel, muscle = row["channel"], row["scaled_muscle"]
    if names.count(channel) > 1:
        return f"column channel: '{channel}' stands there twice. Give each channel one row."
    if not row["elements"]:
        return f"column elements: none for '{channel}'; expected muscle elements of the model."
    if muscles.get(row["group"], muscle) != muscle:
        return (
            f"column scaled_muscle: '{muscle}' for group {row['group']}, which an earlier row "
            f"gives '{muscles[row['group']]}'. A group scales one muscle."
        )
    for other in neighbours[channel]:
        if other == channel or channel not in neighbours.get(other, ()):
            return (
                f"column neighbours: '{other}'; expected other channels that name '{channel}' as "
                "a neighbour too. Cross-talk goes both ways: correct both rows."
            )
    return None
