"""Variants and the ladder between two of them; choices of the problem and what they put on."""

from dataclasses import replace

import numpy as np
import pytest
from arm import parameters
from places import REPOSITORY
from skeleton import skeleton_record
from small_arm import small_muscles

from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.dynamics.participant_parameters import forearm
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.motion import read_motion
from scapulohumeral.model.muscle_paths.authors_thorax import (
    CONTACT_POINTS_M,
    THORAX_CENTRE_M,
    THORAX_RADII_M,
)
from scapulohumeral.model.muscle_paths.thorax_clearance import chain_frames, level_set
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.published_arm import published_pose
from scapulohumeral.model.tables import read_tables
from scapulohumeral.ocp.problem import Bounds
from scapulohumeral.problems.chosen_problem import chosen_bounds, chosen_parameters, without_force
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.problems.variants import (
    Variant,
    choices_of,
    geometry_name,
    ladder,
    model_name,
    named_variants,
    predicted,
)

pytestmark = pytest.mark.unit

PUBLISHED = {"model": {"masses": "divided"}, "problem": {"stops": False, "conoid": "soft"}}
LADDER = {
    "start": "published",
    "alone": ["masses"],
    "steps": {"ligament": ["conoid"], "masses": ["masses"], "stops": ["stops"]},
}


RECORD = skeleton_record()


def section(**changes):
    return {"named": {"published": PUBLISHED}, "ladder": {**LADDER, **changes}}


def test_rungs_take_differences_back_alone_and_together():
    found = named_variants(section())
    problem = PUBLISHED["problem"]
    assert found["alone_masses"] == Variant("alone_masses", {}, problem, "published")
    assert found["upto_masses"] == Variant("upto_masses", {}, {"stops": False}, "upto_ligament")
    assert "alone_stops" not in found
    last = found["upto_stops"]
    assert (last.model, last.problem) == (found["study"].model, found["study"].problem)


def test_rungs_start_from_the_one_below_on_the_same_arm():
    published = {"model": {}, "problem": {"arm": "published", "stops": False, "conoid": "soft"}}
    steps = {"ligament": ["conoid"], "arm": ["arm"], "stops": ["stops"]}
    settings = {"start": "published", "alone": ["arm", "stops"], "steps": steps}
    found = named_variants({"named": {"published": published}, "ladder": settings})
    assert {name: variant.neighbour for name, variant in found.items()} == {
        "study": None,
        "published": None,
        "upto_ligament": "published",
        "alone_arm": None,
        "upto_arm": None,
        "alone_stops": "published",
        "upto_stops": "upto_arm",
    }


def test_ladder_names_what_it_cannot_take_back():
    with pytest.raises(ConfigError, match=r"steps.ligament.*springs.*differs in: masses, stops"):
        named_variants(section(steps={"ligament": ["springs"]}, alone=[]))
    with pytest.raises(ConfigError, match="Write one of: published"):
        ladder({"published": Variant("published", {}, {})}, {"start": "publisher", "steps": {}})
    with pytest.raises(ConfigError, match=r"ladder.alone' names mass\. .* ligament, masses, stops"):
        named_variants(section(alone=["mass"]))


def test_models_are_named_by_their_choices():
    configured = {"masses": "published", "fibres": "recorded_range"}
    assert model_name(configured, {}) is None
    assert model_name(configured, {"masses": "published"}) is None
    assert model_name(configured, {"masses": "divided"}) == "divided-recorded_range"


def test_name_of_a_model_says_its_choices_again():
    configured = {"masses": "published", "fibres": "recorded_range"}
    chosen = {"masses": "divided", "fibres": "suspended"}
    assert choices_of(configured, model_name(configured, chosen)) == chosen


def test_variant_has_paths_of_its_own_for_another_surface_or_the_published_arm():
    configured = {"masses": "published", "serratus_path": "flattened"}
    heavy = Variant("heavy", {"masses": "divided"}, {"arm": "own"})
    assert geometry_name(configured, heavy) is None
    assert geometry_name(configured, replace(heavy, problem={"arm": "published"})) == (
        "published-flattened"
    )
    scaled = replace(heavy, model={"serratus_path": "as_scaled", "masses": "divided"})
    assert geometry_name(configured, scaled) == "published-as_scaled"
    configured["paths"] = "das3"
    edited = replace(heavy, model={"paths": "published", "masses": "divided"})
    assert geometry_name(configured, edited) == "published-flattened-published"


def test_only_participants_of_the_study_are_predicted():
    asked = {"predict": {"box": {"par1": ["healthy"], "par2": ["healthy", "cuff"]}}}
    found = predicted(asked, ["par2", "par3"])
    assert found == [("box", "par2", "healthy"), ("box", "par2", "cuff")]


def test_the_studys_own_choices_change_no_parameter():
    own = pack(parameters())
    np.testing.assert_array_equal(chosen_parameters(own, RECORD, ProblemChoices()), own)


@pytest.mark.parametrize(
    ("choices", "blocks"),
    [
        ({"conoid": "soft"}, {"conoid_stiffness", "conoid_eps", "conoid_insertion"}),
        ({"stops": False}, {"stop_stiffness"}),
        ({"contact": "none"}, {"contact_stiffness"}),
        (
            {"contact": "published"},
            {"thorax_centre", "thorax_radii", "contact_TS", "contact_AI"},
        ),
        ({"humerus_centre_m": 0.2}, {"com_humerus"}),
        ({"capsule_Nm": 0.5}, {"spring_torque"}),
    ],
)
def test_a_choice_changes_its_own_parameters_only(choices, blocks):
    before = unpack(pack(parameters(conoid_stiffness=8e4, stop_stiffness=5e3)))
    after = unpack(chosen_parameters(pack(before), RECORD, ProblemChoices(**choices)))
    changed = {name for name in before if not np.array_equal(before[name], after[name])}
    assert changed == blocks


@pytest.mark.parametrize("condition", ["healthy", "rc_limited"])
def test_published_scapulae_glide_on_the_published_thorax(condition):
    """Of the joints of par2 nothing is fitted: points, surface and motion belong together."""
    par2 = read_participant(REPOSITORY / "config/participants", "par2")
    joints = read_tables(REPOSITORY / "config/model").joints
    of_parent = {"sc1": "thorax", "ac1": "clavicle_r", "gh1": "scapula_r"}
    locations = {
        joint: np.multiply(joints[joint].location_m, par2.scale[segment])
        for joint, segment in of_parent.items()
    }
    pose = published_pose(read_motion(par2.predictions[condition]))
    origin, axes = chain_frames(locations, pose)["scapula_r"]

    def level(point: str) -> np.ndarray:
        position = origin + axes @ np.array(CONTACT_POINTS_M[point])
        return level_set(position, np.array(THORAX_CENTRE_M), np.array(THORAX_RADII_M))

    # A level of 0.02 is one millimetre.
    assert np.abs(level("contact_AI")).max() < 0.02
    assert level("contact_TS").min() > 0.0


def test_exponential_springs_replace_linear_ones():
    choices = ProblemChoices(springs="exponential")
    after = unpack(chosen_parameters(pack(parameters()), RECORD, choices))
    np.testing.assert_array_equal(after["joint_stiffness"], 0.0)
    np.testing.assert_array_equal(after["spring_torque"], [1.0, 1.0, 0.25, 0.0])
    np.testing.assert_allclose(after["rest_GH"].reshape(3, 3), np.eye(3), atol=1e-15)


def test_unturned_forearm_is_that_of_no_pronation():
    hand = replace(RECORD.segments["hand_r"], com_m=(0.03, -0.08, 0.0))
    turned = replace(RECORD, pronation_rad=2.0, segments={**RECORD.segments, "hand_r": hand})
    choices = ProblemChoices(forearm="unturned")
    after = unpack(chosen_parameters(pack(parameters()), turned, choices))
    mass, com, inertia, hand = forearm(replace(turned, pronation_rad=0.0))
    np.testing.assert_allclose(after["mass_forearm"], mass)
    np.testing.assert_allclose(after["com_forearm"], com)
    np.testing.assert_allclose(after["inertia_forearm"], inertia)
    np.testing.assert_allclose(after["com_load"], hand)
    assert not np.allclose(com, forearm(turned)[1])


def test_bounds_are_those_of_the_reference():
    reference = np.linspace(-0.3, 0.7, 13) + np.linspace(0.0, 0.2, 5)[:, None]
    bounds = chosen_bounds(
        ProblemChoices(coordinate_margin=0.2, largest_compression_N=1600.0, ends_at_rest=True),
        reference,
        Bounds(),
    )
    low, high = bounds.coordinates
    np.testing.assert_allclose(low, reference[0] - 0.2)
    free = np.setdiff1d(np.arange(13), [0, 4, 8])
    np.testing.assert_allclose(high[free], reference[-1, free] + 0.2)
    assert (high[[0, 4, 8]] <= 1.0).all()
    assert bounds.compression == (0.0, 1600.0)
    assert bounds.ends_at_rest
    own = chosen_bounds(ProblemChoices(), reference, Bounds())
    assert (own.compression, own.coordinates, own.ends_at_rest) == (None, None, False)


def test_lost_muscles_lose_active_or_whole_force():
    muscles = replace(small_muscles(), capacity=np.full(3, 0.5))
    lost = np.array([True, False, False])
    active = without_force(muscles, lost, 0.2, "active")
    np.testing.assert_allclose(active.capacity, [0.1, 0.5, 0.5])
    np.testing.assert_array_equal(active.max_isometric_force, muscles.max_isometric_force)
    whole = without_force(muscles, lost, 0.0, "whole")
    assert 0.0 < whole.max_isometric_force[0] < 1e-3
    np.testing.assert_array_equal(whole.capacity, muscles.capacity)


def test_unknown_choices_are_refused():
    with pytest.raises(ConfigError, match="choice springs: 'cubic'; choose own or exponential"):
        ProblemChoices(springs="cubic")
    with pytest.raises(ConfigError, match="coordinate_margin"):
        ProblemChoices(coordinate_margin=0.0)
    with pytest.raises(ConfigError, match=r"capsule_Nm: 0.5 beside exponential springs"):
        ProblemChoices(capsule_Nm=0.5, springs="exponential")
