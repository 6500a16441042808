"""Cases whose cause is known from elsewhere, ``config/gap/real_cases.yaml``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from scapulohumeral.configuration.fields import Real, Section, key

Name = Annotated[str, key("Name of a person or case.", pattern=r"^[a-z0-9_]+$")]
# A space would be two words of a command.
Pattern = Annotated[str, key("File, or pattern of files.", pattern=r"^[A-Za-z0-9_.*?/\[\]-]+$")]
Patterns = Annotated[list[Pattern], key("Files below the folder of the person.", min_length=1)]
Kind = Literal["effect", "no_effect", "artefact", "simulation"]


@dataclass(frozen=True)
class Converted(Section):
    """Recordings of markers that `scapulohumeral convert` turns into joint angles."""

    folder: Annotated[Pattern, key("Below the folder of recordings [no unit].")]
    files: Annotated[Pattern, key("Recordings in it [no unit].")]
    map: Annotated[Pattern, key("Marker map [no unit].")]
    tasks: Annotated[str, key("Task and repeat in the names of files, a pattern [no unit].")]
    body_mass_kg: Annotated[Real, key("Body mass [kg].", ge=20, le=300)]
    height_m: Annotated[Real, key("Height [m].", ge=1, le=2.5)]
    source: Annotated[str, key("Where the recordings are from [no unit].", min_length=1)]


@dataclass(frozen=True)
class Measured(Section):
    """Recorded joint angles as they stand."""

    folder: Annotated[Pattern, key("Below the folder of recordings [no unit].")]
    participant: Annotated[Pattern, key("Participant file [no unit].")]
    source: Annotated[str, key("Where the recordings are from [no unit].", min_length=1)]
    emg: Annotated[Pattern | None, key("Table of their EMG, by trial and time [no unit].")] = None


@dataclass(frozen=True)
class Simulated(Section):
    """Simulated composite motions, of which each elevation becomes a trial."""

    participant: Annotated[Pattern, key("Participant file [no unit].")]
    source: Annotated[str, key("Where the motions are from [no unit].", min_length=1)]
    motions: Annotated[
        dict[Name, Pattern],
        key("Published tables or stored solutions by name [no unit].", min_length=1),
    ]


@dataclass(frozen=True)
class Spoilt(Section):
    """An error of measurement that recorded test trials are given."""

    segment: Annotated[
        Literal["thorax", "scapula", "humerus"], key("Whose frame is turned [no unit].")
    ]
    axis: Annotated[Literal["x", "y", "z"], key("Of that frame [no unit].")]
    deg: Annotated[Real, key("Turn [deg].", ge=-45, le=45)]
    growing: Annotated[
        bool,
        key(
            "Skin. Of the scapula: from 60 deg of elevation on, whole at 120; of the humerus, axis "
            "y: against its axial rotation, whole at 60 deg [no unit]."
        ),
    ] = False


@dataclass(frozen=True)
class RealCase(Section):
    """One diagnosis: which trials, and what is known of their difference."""

    kind: Annotated[
        Kind,
        key(
            "Recorded with or without a cause: effect, no_effect; with an error put in: artefact; "
            "or simulation [no unit]."
        ),
    ]
    person: Annotated[Name, key("Of converted, measured or simulated [no unit].")]
    view: Annotated[
        Literal["tracking", "prediction"], key("What the nominal model does [no unit].")
    ]
    test: Annotated[Patterns, key("Trials to explain [no unit].")]
    reference: Annotated[Patterns, key("Trials without the cause [no unit].")]
    truth: Annotated[list[str], key("Labels of which one is right [no unit].")]
    known: Annotated[str, key("What is known of the difference [no unit].", min_length=1)]
    spoilt: Annotated[
        Spoilt | None, key("Error that test trials are given, of kind artefact [no unit].")
    ] = None
    simulator: Annotated[
        Pattern | None, key("What made both sides, of kind simulation [no unit].")
    ] = None


@dataclass(frozen=True)
class RealCases(Section):
    """All of them."""

    converted: Annotated[dict[Name, Converted], key("Persons whose markers were recorded.")]
    measured: Annotated[dict[Name, Measured], key("Persons whose joint angles were recorded.")]
    simulated: Annotated[dict[Name, Simulated], key("Simulated persons.")]
    cases: Annotated[dict[Name, RealCase], key("Diagnoses by name.", min_length=1)]

    def of_kind(self, kind: str) -> list[str]:
        """Names of the cases of a kind."""
        return [name for name, case in self.cases.items() if case.kind == kind]

    @property
    def people(self) -> dict[str, Converted | Measured | Simulated]:
        """Who moves, by name."""
        return {**self.converted, **self.measured, **self.simulated}
