"""Words for the names that result files and the configuration use."""

from __future__ import annotations

from collections.abc import Mapping

# Endings that are units, as they are printed.
UNITS = {
    "deg": "deg",
    "bw": "% body weight",
    "N": "N",
    "Nm": "N m",
    "mm": "mm",
    "m": "m",
    "s": "s",
    "percent": "%",
}
PARTS = {"ur": "upward rotation", "gh": "glenohumeral", "rmse": "RMSE", "rms": "RMS"}
# Names whose parts say too little.
WHOLE = {
    "ur_bias_rest_deg": "upward rotation at rest, mean error [deg]",
    "in_band_share": "share in the healthy band [1]",
    "recorded_in_band_share": "share of the recording in the healthy band [1]",
    "rhythm_range": "rhythm, paper's estimator [1]",
    "rhythm_signed": "rhythm, signed ends [1]",
    "upward_rotation_fall_deg": "fall of upward rotation from healthy [deg]",
    "upward_rotation_fall_equal_weight_deg": (
        "fall of upward rotation from the whole cuff at the same w_GH [deg]"
    ),
    "reached_from": "start that led there",
    "weight clavicle_point_m": "tracked point of the clavicle, from the sternum [m]",
}
# Steps of the ladder: what of the authors' problem is taken back.
STEPS = {
    "effort": "what an activation costs",
    "reactions": "sign of the joint reaction",
    "ends": "clavicle and speeds at both ends",
    "box": "fence around recorded coordinates",
    "springs": "passive joints",
    "contact": "thorax surface and points that touch it",
    "conoid": "conoid ligament",
    "serratus_path": "path of serratus, paths by hand",
    "fibres": "fibres set by hand",
    "stops": "stops of clavicle and scapula",
    "masses": "masses of arm and girdle",
    "cuff_and_elbow": "loss of the cuff, elbow in pauses",
    "arm": "motion of the arm",
}
# What is to be said of times.
BESIDE_OTHERS = "may have been measured beside other jobs: compare iterations, not times"
# Variants whose name in files means something else in a text.
VARIANTS = {"published": "authors' problem (solved here)"}
GLOSSARY: Mapping[str, str] = {
    "healthy": "shoulder of the participant, weight of joint stability w_GH 2",
    "healthy_w10": "the same at w_GH 10",
    "healthy_generic, healthy_stiff": "with generic muscles; with stiffer joints of the girdle",
    "cuff_w2 to cuff_w10": "supraspinatus and infraspinatus without active force, at this w_GH",
    "cuff_75, cuff_50, cuff_25": "their active force at this percentage, w_GH 2",
    "supraspinatus": "supraspinatus alone without active force, w_GH 2",
    "…_from_…": "the shoulder named first, solved from the solution of the one named last",
    "study": "the study's own model and problem, on recorded arms",
    "study_arm": "the same on the arm of the published predictions",
    VARIANTS["published"]: (
        "the problem of the authors' program on that arm, as this study solves it; files call it "
        "published. Elsewhere in the report, published is what the authors have printed or shared"
    ),
    "spring, exponential, capsule_25, capsule_65": (
        "the study's model without a glenohumeral capsule; with the authors' springs in all "
        "joints; with a capsule of 0.25 and 0.65 N m"
    ),
    "alone_…, upto_…": (
        "rungs of the ladder: the authors' problem with this choice taken back alone, or with all "
        "up to it"
    ),
    "rest, start, peak": (
        "rising arm below 20 deg of elevation; first node of the rise; largest of an elevation, "
        "of retraction the most retracted"
    ),
    "motion_…, emg_…, …_reference": (
        "columns of a score card: what a case comes with (motion alone, EMG, joint force), and "
        "whether trials of the same person without the effect belong to it"
    ),
    "SC_rx to GH_rz, EL_rx": (
        "channels of a diagnosis: how far a joint is turned about x, y and z of the segment before "
        "it [deg]; SC is clavicle, AC scapula, GH humerus, EL elbow"
    ),
}


def in_words(name: str) -> str:
    """A name of a column, quantity or setting in words, with its unit in brackets.

    A number in it is an elevation of the arm [deg].
    """
    if name in WHOLE:
        return WHOLE[name]
    parts = name.split("_")
    unit = UNITS.get(parts[-1]) if len(parts) > 1 else None
    if unit is not None:
        parts.pop()
    said = [f"with the arm at {p} deg" if p.isdigit() else PARTS.get(p, p) for p in parts]
    return " ".join(said) + (f" [{unit}]" if unit else "")


def variant_in_words(variant: str) -> str:
    """A variant as the report calls it, or a rung, which may be the variant it starts from."""
    return VARIANTS.get(variant, variant)


def step_in_words(step: str) -> str:
    """What a step of the ladder takes back, or the variant it starts from; others stay."""
    return STEPS.get(step, variant_in_words(step).replace("_", " "))
