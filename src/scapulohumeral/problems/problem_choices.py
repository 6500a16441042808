"""What a prediction leaves open beside its model: the study's own problem or that of the authors.

The authors' public program (zoufaond/Quaternion-Predictive-SHR, MIT) solves another problem than
the paper prints. Each difference is a choice here, so that one code solves both problems and
everything between them (:mod:`scapulohumeral.problems.chosen_problem`).
"""

from __future__ import annotations

from dataclasses import dataclass

from scapulohumeral.errors import ConfigError


@dataclass(frozen=True)
class ProblemChoices:
    """One optimal control problem among those between the study's own and the authors'.

    Attributes
    ----------
    arm : "own" (humerus and elbow as tracked) or "published" (those of the published composite)
    springs : "own" springs of the model, or "exponential" ones of all joints but the elbow, with
        their rest pose and damping
    forearm : how radius and hand lie as masses: "turned" by the locked pronation, or "unturned" in
        the axes of the ulna
    humerus_centre_m : distance of the humerus' mass centre from its head along the bone [m]; None:
        as scaled
    capsule_Nm : torque of the exponential spring of the model's glenohumeral joint at 0.6 rad;
        None: that of the model
    conoid : "stiff" at the recorded length, or "soft"
    contact : "fitted" thorax ellipsoid, the "published" one, or "none"
    stops : whether clavicle and scapula have stops at the ends of their ranges
    strength_exponent : power of strength in squared activations [1]; None: as configured
    reaction_rate : weight of squared rates of the joint reaction [s/N^2]; None: as configured
    largest_compression_N : bound of the lateral reaction, which then may not pull; None: neither
    clavicle_anchor : weight of the sum of the clavicle's quaternion components, less that of its
        recorded orientation at the start, at the first and the last node [1/s]
    ends_at_rest : whether all speeds are zero at the first and the last node
    coordinate_margin : how far quaternion components may leave the range of the reference [1]
    lost_force : what limited muscles lose, "active" force or "whole"
    elbow_in_pauses : whether the elbow is tracked between the elevations, too
    """

    arm: str = "own"
    springs: str = "own"
    forearm: str = "turned"
    humerus_centre_m: float | None = None
    capsule_Nm: float | None = None
    conoid: str = "stiff"
    contact: str = "fitted"
    stops: bool = True
    strength_exponent: float | None = None
    reaction_rate: float | None = None
    largest_compression_N: float | None = None
    clavicle_anchor: float = 0.0
    ends_at_rest: bool = False
    coordinate_margin: float | None = None
    lost_force: str = "active"
    elbow_in_pauses: bool = False

    def __post_init__(self) -> None:
        """Refuse words that name no choice, and numbers that are none."""
        words = {
            "arm": ("own", "published"),
            "springs": ("own", "exponential"),
            "forearm": ("turned", "unturned"),
            "conoid": ("stiff", "soft"),
            "contact": ("fitted", "published", "none"),
            "lost_force": ("active", "whole"),
        }
        for key, allowed in words.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(
                    f"choice {key}: {getattr(self, key)!r}; choose {' or '.join(allowed)}"
                )
        for key in (
            "humerus_centre_m",
            "capsule_Nm",
            "reaction_rate",
            "largest_compression_N",
            "coordinate_margin",
        ):
            value = getattr(self, key)
            if value is not None and not value > 0:
                raise ConfigError(f"choice {key}: {value}; expected a positive number")
        if self.capsule_Nm is not None and self.springs == "exponential":
            raise ConfigError(
                f"choice capsule_Nm: {self.capsule_Nm} beside exponential springs, which have a "
                "torque of their own; leave one of both out"
            )
        if not self.clavicle_anchor >= 0:
            raise ConfigError(
                f"choice clavicle_anchor: {self.clavicle_anchor}; expected no negative number"
            )
