"""How a diagnosis is made: keys of ``config/gap/settings.yaml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from scapulohumeral.configuration.check import REMEDY, checked, read_config
from scapulohumeral.configuration.fields import Angles, Real, Section, Whole, key
from scapulohumeral.documents import read_yaml
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.weighing import Weighing, read_weighing
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.problems.variants import named_variants
from scapulohumeral.provenance import CONFIG_FOLDER

SETTINGS = CONFIG_FOLDER / "gap" / "settings.yaml"
# What the nominal model does: track all segments, or predict scapula and clavicle from the humerus.
View = Literal["tracking", "prediction"]
VIEWS: tuple[View, ...] = ("tracking", "prediction")


@dataclass(frozen=True)
class SessionSpread(Section):
    """Standard deviations of what changes between two recordings of one person without a cause."""

    emg_gain: Annotated[Real, key("Logarithm of the gain of an EMG channel [1].", gt=0, le=3)]
    emg_own_maximum: Annotated[
        Real, key("The same where each recording has a maximum of its own [1].", gt=0, le=3)
    ]
    emg_offset: Annotated[Real, key("Offset of an EMG channel [fraction of MVC].", gt=0, le=1)]
    frame_deg: Annotated[Real, key("Each segment frame about each axis [deg].", gt=0, le=45)]
    clavicle_axial_deg: Annotated[
        Real,
        key("Axial rotation of the clavicle, which skin markers hardly see [deg].", gt=0, le=90),
    ]
    posture_deg: Annotated[
        Real, key("Intended angle of each joint, smooth over the movement [deg].", gt=0, le=45)
    ]
    timing_ms: Annotated[Real, key("EMG clock against motion clock [ms].", gt=0, le=500)]


@dataclass(frozen=True)
class JointSpread(Section):
    """Standard deviations of joint rotations between repeats."""

    SC: Annotated[Real, key("Sternoclavicular [deg].", gt=0, le=45)]
    AC: Annotated[Real, key("Acromioclavicular [deg].", gt=0, le=45)]
    GH: Annotated[Real, key("Glenohumeral [deg].", gt=0, le=45)]
    EL: Annotated[Real, key("Elbow [deg].", gt=0, le=45)]


@dataclass(frozen=True)
class NoisePrior(Section):
    """Standard deviations between repeats, as far as the repeats of a case cannot tell."""

    kinematics_deg: Annotated[
        JointSpread, key("Joint rotations, what timing makes of them taken off.")
    ]
    phase_shift: Annotated[
        list[Annotated[Real, key("Standard deviation [share].", gt=0, le=0.5)]],
        key("Where in the movement a trial is, by cosines of phase [share of its duration]."),
    ]
    emg: Annotated[Real, key("EMG [fraction of MVC].", gt=0, le=1)]
    emg_relative: Annotated[Real, key("EMG over its own height [1].", ge=0, le=2)]
    contact_N: Annotated[Real, key("Components of the joint force [N].", gt=0, le=2000)]
    repeats: Annotated[Real, key("Repeats that this knowledge is worth [1].", gt=0, le=100)]


@dataclass(frozen=True)
class OneMovement(Section):
    """What differs without a cause where both sides recorded the same movements."""

    share: Annotated[Real, key("Of the session's posture and of noise [1].", gt=0, le=1)]
    repeats: Annotated[Real, key("Repeats that this knowledge is worth [1].", gt=0, le=1000)]


@dataclass(frozen=True)
class ModelSpread(Section):
    """Standard deviations of the model's own error, for cases without reference."""

    kinematics_deg: Annotated[Real, key("Joint angles of scapula and clavicle [deg].", gt=0, le=45)]
    emg: Annotated[Real, key("EMG [fraction of MVC].", gt=0, le=1)]
    contact_N: Annotated[Real, key("Components of the joint force [N].", gt=0, le=2000)]
    emg_gain: Annotated[Real, key("Logarithm of the gain of an EMG channel [1].", gt=0, le=3)]


@dataclass(frozen=True)
class CaseGeometry(Section):
    """Keys of section `geometry` of the study that differ for the model of a case."""

    poses: Annotated[Whole, key("Poses to fit to [1].", ge=100, le=20000)]
    scapula_turn_deg: Annotated[
        Angles, key("Lowest and highest turn of the scapula under the recorded arm [deg].")
    ]


@dataclass(frozen=True)
class _Keys(Section):
    nodes: Annotated[Whole, key("Mesh nodes of every movement [1].", ge=12, le=101)]
    phase_functions: Annotated[
        Whole, key("Smooth functions of phase kept of every curve [1].", ge=2, le=20)
    ]
    iterations: Annotated[
        Whole, key("Iterations after which a solve counts as failed [1].", ge=10, le=10000)
    ]
    # Less would be out of reach for one trial of its side alone: its p value is the root of one
    # that so many draws of the noise tell (`single_trials.as_sure_as_two`).
    alpha: Annotated[
        Real, key("False alarms allowed for the claim of a gap [1].", ge=0.045, le=0.5)
    ]
    short_list: Annotated[
        Whole,
        key(
            "Families of effects on the body, of which the strongest is solved again [1].",
            ge=1,
            le=20,
        ),
    ]
    refits: Annotated[Whole, key("Gauss-Newton steps of each of them, at most [1].", ge=1, le=10)]
    signature_error: Annotated[
        Real, key("Relative error of predicted changes, by channel [1].", ge=0, le=2)
    ]
    prior_no_gap: Annotated[Real, key("Probability of no gap before any data [1].", gt=0, le=0.9)]
    prior_none: Annotated[
        Real, key("Probability of no known cause before any data [1].", gt=0, le=0.9)
    ]
    prior_moved: Annotated[
        Real, key("Probability of another movement alone, before any data [1].", gt=0, le=0.9)
    ]
    calibration: Annotated[
        str,
        key(
            "File of fitted weights of evidence, relative to the folder config [no unit].",
            pattern=r"^[A-Za-z0-9_./-]+[.]json$",
        ),
    ]
    null_bank: Annotated[
        str,
        key(
            "File of thresholds from effect-free cases, relative to the folder config [no unit].",
            pattern=r"^[A-Za-z0-9_./-]+[.]json$",
        ),
    ]
    simulated: Annotated[
        Real, key("Share of session and noise between simulations [1].", gt=0, le=1)
    ]
    one_movement: Annotated[
        OneMovement, key("What two records of one movement differ by without a cause.")
    ]
    session: Annotated[
        SessionSpread, key("Standard deviations of what changes between two recordings.")
    ]
    noise: Annotated[
        NoisePrior, key("Standard deviations between repeats, where repeats are missing.")
    ]
    model: Annotated[ModelSpread, key("Standard deviations of the model's own error.")]


@dataclass(frozen=True)
class GapSection(_Keys):
    """All keys of the file."""

    stability: Annotated[
        Real, key("Weight of shear over compression at the glenoid, squared [1/s].", gt=0, le=1.0e4)
    ]
    geometry: Annotated[
        CaseGeometry, key("Keys of `geometry` that differ for the model of a case.")
    ]


@dataclass(frozen=True)
class GapSettings(_Keys):
    """How a diagnosis is made: the keys of the file, and what follows from the study's.

    Attributes
    ----------
    geometry : keys of section `geometry` that differ for the models of cases
    weights : of the nominal objective, keys of ``weights.tracking`` and `stability`
    view : what the nominal model does
    of_simulations : whether the trials are simulations, which have no markers and do not scatter
    of_one_movement : whether both sides recorded the same movements, with two systems at once
    choices : which problem predictions solve
    """

    geometry: Mapping[str, Any]
    weights: Mapping[str, float]
    view: View = "tracking"
    of_simulations: bool = False
    of_one_movement: bool = False
    choices: ProblemChoices = ProblemChoices()

    def __post_init__(self) -> None:
        """Refuse contradictions."""
        if not 2 <= self.phase_functions <= self.nodes // 2:
            raise ConfigError(
                f"phase_functions: {self.phase_functions} of {self.nodes} nodes; expected 2 to "
                f"{self.nodes // 2}, or the curves hold noise. Lower it or raise nodes."
            )
        if self.prior_no_gap + self.prior_none + self.prior_moved >= 1.0:
            raise ConfigError(
                f"prior_no_gap, prior_none and prior_moved: {self.prior_no_gap}, "
                f"{self.prior_none} and {self.prior_moved} leave nothing for the effects; expected "
                "a sum below 1. Lower them."
            )

    def for_one_movement(self) -> GapSettings:
        """The same for test and reference trials that recorded one movement at once."""
        left = self.one_movement
        noise = replace(_scaled(self.noise, left.share), repeats=left.repeats)
        session = replace(self.session, posture_deg=left.share * self.session.posture_deg)
        return replace(self, noise=noise, session=session, of_one_movement=True)

    @property
    def weighing(self) -> Weighing:
        """Weights of evidence, from the file that `calibration` names."""
        return read_weighing(CONFIG_FOLDER / self.calibration)


def read_diagnosis_config(path: Path, settings: Path = SETTINGS) -> dict[str, Any]:
    """The configuration of the study in a file, with the settings of diagnoses as section `gap`.

    Raises
    ------
    ConfigError                      a file cannot be read, or a value is refused
    """
    return with_settings(read_config(path), settings)


def with_settings(config: Mapping[str, Any], settings: Path) -> dict[str, Any]:
    """A configuration of the study with the settings in a file as section `gap`."""
    section = read_yaml(settings, REMEDY)
    checked(GapSection, section, f"{settings}, ", SETTINGS)
    return {**config, "gap": section, "problem": {}}


def with_problem_of(config: Mapping[str, Any], name: str) -> dict[str, Any]:
    """A configuration whose predictions solve the problem of a variant.

    Parameters
    ----------
    config : as of :func:`read_diagnosis_config`
    name : of a variant in section `variants`, or "study"

    Raises
    ------
    ConfigError                      there is no such variant
    """
    known = named_variants(config["variants"])
    if name not in known:
        raise ConfigError(f"variant {name}; expected one of: {', '.join(known)}. Correct it.")
    return {**config, "problem": dict(known[name].problem)}


def read_settings(
    config: Mapping[str, Any], view: View = "tracking", of_simulations: bool = False
) -> GapSettings:
    """Settings of a configuration; predictions have the weights of the study's healthy ones.

    Parameters
    ----------
    config : as of :func:`read_diagnosis_config`, or its :func:`sections_read`
    view : what the nominal model does
    of_simulations : whether the trials are simulations

    Raises
    ------
    ConfigError                      a value is refused, or there is a contradiction
    """
    section = checked(GapSection, config["gap"], "settings of the diagnosis, ", SETTINGS)
    stability = section.stability
    if view == "prediction":
        stability = config["prediction"]["conditions"]["healthy"]["w_gh"]
    shared = {field.name: getattr(section, field.name) for field in fields(_Keys)}
    if of_simulations:
        noise = _scaled(section.noise, section.simulated)
        shared["noise"] = replace(noise, repeats=section.noise.repeats)
        shared["session"] = _scaled(section.session, section.simulated)
    choices = ProblemChoices(**config["problem"])
    weights = {**config["weights"][view], "stability": stability}
    for name in ("strength_exponent", "reaction_rate"):
        if getattr(choices, name) is not None:
            weights[name] = getattr(choices, name)
    return GapSettings(
        **shared,
        geometry=asdict(section.geometry),
        weights=weights,
        view=view,
        of_simulations=of_simulations,
        choices=choices,
    )


def _scaled(value: Any, share: float) -> Any:
    """Standard deviations of a section, or a list of them, times a share."""
    if isinstance(value, Section):
        return replace(value, **{k: _scaled(v, share) for k, v in vars(value).items()})
    return [share * v for v in value] if isinstance(value, list) else share * value


def sections_read(config: Mapping[str, Any], *views: View) -> dict[str, Any]:
    """The part of a configuration that a diagnosis depends on.

    Parameters
    ----------
    config : the whole
    views : what the nominal model does
    """
    own = config["gap"]["geometry"]
    part: dict[str, Any] = {
        "model": dict(config["model"]),
        "geometry": {k: v for k, v in config["geometry"].items() if k not in own},
        "weights": {view: config["weights"][view] for view in views},
        "gap": config["gap"],
        "problem": config["problem"],
    }
    if "prediction" in views:
        healthy = {"w_gh": config["prediction"]["conditions"]["healthy"]["w_gh"]}
        part["prediction"] = {"conditions": {"healthy": healthy}}
    return part
