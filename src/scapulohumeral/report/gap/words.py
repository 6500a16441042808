"""Words of the chapter on the gap: what a diagnosis and its score card call things.

The README of the diagnosis has the same words for whoever works on it.
"""

from __future__ import annotations

from collections.abc import Mapping

# Tests that a finding may rest on, by their names in answers.
TESTS: Mapping[str, str] = {
    "max_t": "largest difference of any channel at any phase",
    "glr": "shapes of all effects",
    "on_record": "shapes of effects that spoil the record of motion",
    "permutation": "other arrangements of the trials",
    "without_one_trial": "without any one trial",
    "one_trial_alone": "a trial that cannot be left out",
}
WORDS: Mapping[str, str] = {
    "effect": "something that the model lacks, with parameters that are off without it",
    "side, family, member": (
        "parts of the name of an effect: what it acts on (body, control, input, measurement), its "
        "kind, and the muscle, joint, segment or channel"
    ),
    "class": "effects that these trials cannot tell apart",
    "none": "a cause that is not in the library of effects",
    "no_gap": "no difference beyond what repeats, sessions and errors of prediction make",
    "abstained": "there is a gap, and the answer says why no cause of it is named",
    "90 % set": (
        "the answers that hold the truth in nine of ten cases. This is over all cases: sets hold "
        "single effects less often, and no effect or one that hardly shows more often"
    ),
    "channels and phases where the gap shows": (
        "those that an answer names, against those that the cause changes by two standard errors. "
        "Cards of draws until 2026-11-29 told the latter by phases of the whole recording, rest "
        "included, and the former by those of the movement, so that right ones missed each other"
    ),
    "size [sigma]": (
        "how far the gap goes beyond noise and sessions, over what they scatter; above none it may "
        "be in few channels and still be a gap"
    ),
    "floor": "what two recordings differ by without any cause: the scatter of repeats and sessions",
    "gap above the noise, reducible gap": "what is left of the gap once the floor is taken off",
    "fold": "trials of one task that are left out of a fit and then predicted",
    "null bank": "persons without effect, whose tests say how high thresholds have to be",
    "who yields, keeps, changes": (
        "columns of a score card: how a simulated person meets an effect. It gives way as least "
        "effort says, keeps the movement and pays with its muscles, or makes another movement"
    ),
    "black box": "smooth forces and errors of channels without a cause, which follow any gap",
    "placebo": "a random smooth force, fitted like an effect, which should follow no gap",
    "oracle": "the effect that was put in, with the parameters that the diagnosis fits to it",
    "screening": "all effects by their derivatives alone, before any movement is solved again",
    "cosine": "baseline: the angle between the difference and what an effect would make",
    "BIC of single samples": "baseline: the information criterion as if samples were independent",
    "rules of thumb": "baseline: what an experienced person would try first",
    "near, far unknown cause": (
        "one that is no effect of the library, but like one (a tear of part of a muscle), or "
        "unlike all (friction, a splint)"
    ),
    "twice the smallest detectable": (
        "effects at least twice as large as the amplitude that a test would find in 0.8 of persons"
    ),
}
FAMILIES: Mapping[str, str] = {
    "hand_load": "a mass in the hand that the model does not know of",
    "segment_mass": "segments heavier or lighter than scaling says",
    "strength_loss": "muscles that are weaker than the model's: tear, palsy, atrophy",
    "fatigue": "muscles that tire while they move",
    "fibre_length": "fibres or tendons of other length than the model's",
    "tendon_compliance": "tendons that stretch, where the model's are rigid",
    "serratus_path": "a serratus anterior with longer or shorter arms than the model's",
    "passive_gh": "a stiff glenohumeral capsule",
    "passive_girdle": "ligaments and fasciae that carry the girdle more, or less, than the model's",
    "joint_damping": "a joint with more viscous friction than the model's",
    "thorax_surface": "a thorax under the scapula of another size or place",
    "st_contact": "ribs under the scapula that are harder or softer than the model's",
    "glenoid_orientation": "a glenoid that faces another way than the model's",
    "co_contraction": "muscles across a joint, or of the whole arm, that never rest",
    "pain_inhibition": "muscles that are spared although they could pull",
    "stability_weight": "a person to whom the place of the humeral head matters more, or less",
    "rate_weight": "a person who moves and drives muscles more, or less, smoothly than the model",
    "movement_strategy": "a movement that was done differently, whatever the reason",
    "thorax_tilt": "a trunk that leans while the model's stands upright",
    "external_force": "a force on the arm from outside: arm support, exoskeleton, cable, contact",
    "frame_misalignment": "segment frames that were digitised askew",
    "scapula_sta": "skin that slides over the scapula when the arm is lifted",
    "humerus_sta": "skin of the upper arm that does not follow its axial rotation",
    "emg_gain": "EMG normalised by a maximum that was too small or too large",
    "electrode_shift": "skin that slides over the muscle with its electrode",
    "emg_crosstalk": "electrodes that also hear the muscle beside them",
    "emd": "electromechanical delay: envelopes that lead the force by longer than the model's",
}
