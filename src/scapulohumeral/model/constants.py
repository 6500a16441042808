"""Numbers of the model that belong to no table, section by section as in ``constants.yaml``.

Units are at the end of the names; what has none there is a ratio. Meaning and source of each number
stand beside it in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import ConfigDict, Field, Strict, TypeAdapter

from scapulohumeral.documents import read_mapping, typed
from scapulohumeral.errors import ModelError

# Numbers as numbers: a quoted one, or true, is a slip.
Real = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Vector3 = tuple[Real, Real, Real]


@dataclass(frozen=True)
class Closed:
    """What is read from a document. Keys that it does not name are refused."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class Gravity(Closed):
    """Standard gravity in the axes of an upright thorax."""

    vector_mps2: Vector3


@dataclass(frozen=True)
class Hill(Closed):
    """Curves that all muscles share (supplement of the paper)."""

    f_gauss: Real
    k_pe: Real
    epsilon_m0: Real
    d1: Real
    d2: Real
    d3: Real
    d4: Real
    v_max: Real


@dataclass(frozen=True)
class FibreAdjustment(Closed):
    """How far recorded motions may stretch fibres, and those that carry the girdle."""

    max_normalised_length: Real
    suspending_muscles: tuple[str, ...]
    suspending_length: Real


@dataclass(frozen=True)
class WrapClearance(Closed):
    """How far attachments stay outside flattened surfaces of the thorax."""

    min_level: Real
    width_share: Real


@dataclass(frozen=True)
class AuthorsMasses(Closed):
    """What the program of the paper's authors divides masses by."""

    divisor: Real


@dataclass(frozen=True)
class WideStops(Closed):
    """How far wide stops of the girdle lie beyond all recordings."""

    margin_deg: Real


@dataclass(frozen=True)
class ConoidLigament(Closed):
    """Where the conoid ligament is attached, and how stiff it is."""

    origin_fraction_of_ac: Real
    origin_y_m: Real
    origin_z_m: Real
    insertion_from_bic_l_m: Vector3
    stiffness_N_per_m: Real
    eps_m: Real


@dataclass(frozen=True)
class ScapulothoracicContact(Closed):
    """Contact of the scapula with the thorax, at two markers."""

    stiffness_N_per_m: Real
    eps: Real
    inside_factor: Real
    points: tuple[str, str]


@dataclass(frozen=True)
class PassiveJoint(Closed):
    """Springs, stops and damping of the joints."""

    k1_Nm_per_rad: Real
    k2_Nm_per_rad2: Real
    eps_rad: Real
    b_Nms_per_rad: Real
    capsule_Nm: Real


@dataclass(frozen=True)
class Glenoid(Closed):
    """Directions of the glenoid and shape of its rim."""

    inferior_inclination_deg: Real
    anterior_version_deg: Real
    superior_inferior_factor: Real


@dataclass(frozen=True)
class Forearm(Closed):
    """Where the forearm is locked."""

    pronation_deg: Real


@dataclass(frozen=True)
class UpperArm:
    """How the mass of an upper arm is distributed, over its length [1].

    Attributes
    ----------
    centre : distance of the mass centre from the shoulder's joint centre
    radius_across : radius of gyration about an axis across the arm, mean square of both
    radius_along : radius of gyration about the arm's own axis
    """

    centre: float
    radius_across: float
    radius_along: float


@dataclass(frozen=True)
class Anthropometry(Closed):
    """Masses of arm segments over that of the body (de Leva 1996), and a mean body mass."""

    male_upper_arm: Real
    male_forearm: Real
    male_hand: Real
    female_upper_arm: Real
    female_forearm: Real
    female_hand: Real
    male_upper_arm_centre: Real
    male_upper_arm_sagittal_radius: Real
    male_upper_arm_transverse_radius: Real
    male_upper_arm_longitudinal_radius: Real
    female_upper_arm_centre: Real
    female_upper_arm_sagittal_radius: Real
    female_upper_arm_transverse_radius: Real
    female_upper_arm_longitudinal_radius: Real
    mean_body_mass_kg: Real

    def share(self, part: str, sex: str | None) -> float:
        """Mass of "upper_arm", "forearm" or "hand" over body mass; unknown sex: mean of both."""
        by_sex = {
            "male": {
                "upper_arm": self.male_upper_arm,
                "forearm": self.male_forearm,
                "hand": self.male_hand,
            },
            "female": {
                "upper_arm": self.female_upper_arm,
                "forearm": self.female_forearm,
                "hand": self.female_hand,
            },
        }
        return fmean(by_sex[one][part] for one in _sexes(sex))

    def upper_arm(self, sex: str | None) -> UpperArm:
        """How the mass of the upper arm is distributed; unknown sex: mean of both."""
        values = {
            name: fmean(getattr(self, f"{one}_upper_arm_{name}") for one in _sexes(sex))
            for name in ("centre", "sagittal_radius", "transverse_radius", "longitudinal_radius")
        }
        across = np.hypot(values["sagittal_radius"], values["transverse_radius"]) / np.sqrt(2.0)
        return UpperArm(values["centre"], float(across), values["longitudinal_radius"])


def _sexes(sex: str | None) -> tuple[str, ...]:
    return (sex,) if sex else ("male", "female")


@dataclass(frozen=True)
class Constants(Closed):
    """All sections of ``constants.yaml``, without units and sources."""

    gravity: Gravity
    hill: Hill
    fibre_adjustment: FibreAdjustment
    wrap_clearance: WrapClearance
    authors_masses: AuthorsMasses
    girdle_stops: WideStops
    conoid_ligament: ConoidLigament
    scapulothoracic_contact: ScapulothoracicContact
    passive_joint: PassiveJoint
    glenoid: Glenoid
    forearm: Forearm
    anthropometry: Anthropometry


def read_constants(path: Path) -> tuple[Constants, dict[str, str]]:
    """Constants of the model, and the reason for each muscle element that is left out.

    Raises
    ------
    ModelError                       the file cannot be read, or a key or value is refused
    """
    document = read_mapping(path, "sections of constants", "Restore the file.", ModelError)
    excluded = document.pop("excluded_muscles", None)
    if excluded is None:
        raise ModelError(f"{path}: no excluded_muscles. Add the key; an empty {{}} excludes none.")
    values: dict[str, dict[str, Any]] = {}
    for section, entries in document.items():
        if not isinstance(entries, dict):
            raise ModelError(f"{path}, {section}: {entries!r}; expected named entries. Correct it.")
        for name, entry in entries.items():
            if not isinstance(entry, dict) or set(entry) != {"value", "unit", "source"}:
                raise ModelError(
                    f"{path}, {section}.{name}: expected the keys value, unit and source, "
                    f"found {entry}. Write {name}: {{value: ..., unit: ..., source: ...}}."
                )
        values[section] = {name: entry["value"] for name, entry in entries.items()}
    return typed(_adapter(), values, path, "Correct the entry."), excluded


@cache
def _adapter() -> TypeAdapter[Constants]:
    return TypeAdapter(Constants)
