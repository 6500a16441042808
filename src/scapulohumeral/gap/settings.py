"""How a diagnosis is made: section `gap` of the configuration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from scapulohumeral.errors import ConfigError

# What the nominal model does: track all segments, or predict scapula and clavicle from the humerus.
View = Literal["tracking", "prediction"]
VIEWS: tuple[View, ...] = ("tracking", "prediction")


@dataclass(frozen=True)
class SessionSpread:
    """Standard deviations of what changes between two recordings of one person without a cause.

    Attributes
    ----------
    emg_gain : of the logarithm of each channel's gain; emg_offset : of each channel
    frame_deg : of each segment frame about each axis
    clavicle_axial_deg : of the axial rotation of the clavicle, which skin markers hardly see
    posture_deg : of the intended angle of each joint, smooth over the movement
    timing_ms : of EMG against kinematics
    """

    emg_gain: float
    emg_offset: float
    frame_deg: float
    clavicle_axial_deg: float
    posture_deg: float
    timing_ms: float


@dataclass(frozen=True)
class NoisePrior:
    """Standard deviations between repeats, as far as the repeats of a case cannot tell.

    Attributes
    ----------
    kinematics_deg : of each joint angle; emg : of each channel; contact_N : of each component
    repeats : number of repeats that this knowledge is worth
    """

    kinematics_deg: float
    emg: float
    contact_N: float
    repeats: float


@dataclass(frozen=True)
class ModelSpread:
    """Standard deviations of the model's own error, for cases without reference.

    Attributes
    ----------
    kinematics_deg, emg, contact_N : as in :class:`NoisePrior`
    emg_gain : of the logarithm of each channel's gain
    """

    kinematics_deg: float
    emg: float
    contact_N: float
    emg_gain: float


@dataclass(frozen=True)
class GapSettings:
    """How a diagnosis is made; the keys of section `gap`, except the nominal weights and folder.

    Attributes
    ----------
    nodes : mesh nodes of every movement; phase_functions : smooth functions kept of each curve
    iterations : after which a solve counts as failed
    alpha : false alarms allowed for the claim of a gap
    short_list : effects that are solved again; refits : Gauss-Newton steps of each
    signature_error : relative error of predicted changes, by channel
    temperature : divides log evidence before it becomes probability
    prior_no_gap, prior_none : prior probabilities; the rest is shared by the families
    session, noise, model : see there
    weights : of the nominal objective, keys of ``weights.tracking`` and `stability`
    null_bank : file of thresholds from effect-free cases, relative to the configuration
    geometry : keys of section `geometry` that differ for the models of cases
    view : what the nominal model does
    """

    nodes: int
    phase_functions: int
    iterations: int
    alpha: float
    short_list: int
    refits: int
    signature_error: float
    temperature: float
    prior_no_gap: float
    prior_none: float
    null_bank: str
    geometry: Mapping[str, Any]
    session: SessionSpread
    noise: NoisePrior
    model: ModelSpread
    weights: Mapping[str, float]
    view: View = "tracking"

    def __post_init__(self) -> None:
        """Refuse contradictions."""
        if not 2 <= self.phase_functions <= self.nodes // 2:
            raise ConfigError(
                f"gap.phase_functions: {self.phase_functions} of {self.nodes} nodes; expected 2 to "
                f"{self.nodes // 2}, or the curves hold noise. Lower it or raise gap.nodes."
            )
        if self.prior_no_gap + self.prior_none >= 1.0:
            raise ConfigError(
                f"gap.prior_no_gap and prior_none: {self.prior_no_gap} and {self.prior_none} leave "
                "nothing for the effects; expected a sum below 1. Lower them."
            )


def read_settings(config: Mapping[str, Any], view: View = "tracking") -> GapSettings:
    """Settings of a configuration; predictions have the weights of the study's healthy ones.

    Raises
    ------
    ConfigError                      section or key missing or unknown, or a contradiction
    """
    if "gap" not in config:
        raise ConfigError("no section 'gap' in the configuration; expected it as in config.yaml.")
    section = dict(config["gap"])
    parts = {"session": SessionSpread, "noise": NoisePrior, "model": ModelSpread}
    stability = section.pop("stability", 0.0)
    if view == "prediction":
        stability = config["prediction"]["conditions"]["healthy"]["w_gh"]
    section["weights"] = {**config["weights"][view], "stability": stability}
    section["view"] = view
    known = {field.name for field in fields(GapSettings)}
    for name, kind in parts.items():
        expected = {field.name for field in fields(kind)}
        found = set(section.get(name, ()))
        if expected != found:
            raise ConfigError(
                f"gap.{name}: keys {', '.join(sorted(found))}; "
                f"expected {', '.join(sorted(expected))}."
            )
        section[name] = kind(**section[name])
    if set(section) != known:
        wrong = ", ".join(sorted(set(section) ^ known))
        raise ConfigError(
            f"gap: missing or unknown key {wrong}; expected {', '.join(sorted(known))}."
        )
    return GapSettings(**section)


def sections_read(config: Mapping[str, Any], *views: View) -> dict[str, Any]:
    """The part of a configuration that a diagnosis depends on.

    Parameters
    ----------
    config : the whole
    views : what the nominal model does
    """
    own = config["gap"]["geometry"]
    part: dict[str, Any] = {
        "masses": config["masses"],
        "geometry": {k: v for k, v in config["geometry"].items() if k not in own},
        "weights": {view: config["weights"][view] for view in views},
        "gap": config["gap"],
    }
    if "prediction" in views:
        healthy = {"w_gh": config["prediction"]["conditions"]["healthy"]["w_gh"]}
        part["prediction"] = {"conditions": {"healthy": healthy}}
    return part
