"""Verdicts by config/targets.yaml: a wrong scapula and a missing solve fail, a right one holds."""

from dataclasses import fields, replace

import pandas as pd
import pytest
import yaml
from places import REPOSITORY

from scapulohumeral.errors import ConfigError
from scapulohumeral.quantities import paper, population
from scapulohumeral.quantities.recordings_apart import Apart
from scapulohumeral.report.prediction.audit import audit_rows
from scapulohumeral.report.prediction.girdle_errors import girdle_table
from scapulohumeral.report.prediction.judged import Judged
from scapulohumeral.report.prediction.rhythm_targets import rhythm_verdicts
from scapulohumeral.report.prediction.targets import (
    PLANES,
    TASKS,
    cuff_effects,
    fall_level,
    force_verdicts,
    participants_table,
    prediction_verdicts,
    published_verdicts,
    recording_verdicts,
    task_table,
    task_verdicts,
    uncertified_solves,
)
from scapulohumeral.report.targets import changed_afterwards
from scapulohumeral.stages.distances.against import with_audit
from scapulohumeral.stages.distances.daily_tasks import ANGLES

pytestmark = pytest.mark.unit

TARGETS = yaml.safe_load((REPOSITORY / "config/targets.yaml").read_text(encoding="utf-8"))
GOOD = {
    "ur_rmse_deg": 3.0,
    "ur_bias_rest_deg": -2.0,
    "in_band_share": 0.7,
    "outside_fit_share": 0.0,
    "stop_moment_median_Nm": 0.1,
}


def recording(**changes: float) -> pd.DataFrame:
    """Healthy predictions of all participants, `changes` in the sagittal plane of par2."""
    rows = []
    for participant in ("par1", "par2", "par3"):
        for plane in PLANES:
            row = {
                "participant": participant, "plane": plane, "condition": "healthy",
                "variant": "study", "arm": "own", "status": "optimal", "certified": True, **GOOD,
            }  # fmt: skip
            changed = (participant, plane) == ("par2", "sagittal")
            rows.append(row | (changes if changed else {}))
    return pd.DataFrame(rows)


def failed(verdicts) -> list[str]:
    return [verdict.name for verdict in verdicts if not verdict.holds]


def test_predictions_within_all_limits_hold():
    assert not failed(recording_verdicts(TARGETS["against_recording"], recording()))


@pytest.mark.parametrize(
    "change",
    [
        {"ur_rmse_deg": 6.1},
        {"ur_bias_rest_deg": -4.1},
        {"ur_bias_rest_deg": 4.1},
        {"in_band_share": 0.59},
        {"outside_fit_share": 0.01},
        {"stop_moment_median_Nm": 0.51},
    ],
)
def test_one_plane_off_fails_its_limit_alone(change):
    (name,) = failed(recording_verdicts(TARGETS["against_recording"], recording(**change)))
    assert name.startswith("par2")


def test_participant_without_solution_fails_and_is_named():
    table = recording()
    table.loc[table.participant == "par3", ["status", *GOOD]] = ["failed", *[float("nan")] * 5]
    missed = failed(recording_verdicts(TARGETS["against_recording"], table))
    assert missed
    assert all(name.startswith("par3") for name in missed)
    judged = Judged(TARGETS, table, pd.DataFrame(), ("par1", "par2", "par3"))
    rows = {row[0]: row[1:] for row in participants_table(judged).rows}
    assert rows["par3"] == ("yes", "no", "no", "no solution")
    assert rows["par2"] == ("yes", "yes", "yes", "")
    doubted = replace(judged, recording=table.assign(certified=table.participant != "par2"))
    rows = {row[0]: row[1:] for row in participants_table(doubted).rows}
    assert rows["par2"] == ("yes", "no", "no", "no certificate")


def test_a_solved_participant_that_is_not_usable_has_its_missed_limits_named():
    table = recording(ur_bias_rest_deg=-4.1, in_band_share=0.5)
    judged = Judged(TARGETS, table, pd.DataFrame(), ("par1", "par2", "par3"))
    rows = {row[0]: row[1:] for row in participants_table(judged).rows}
    missed = "limits missed: upward rotation at rest, healthy band"
    assert rows["par2"] == ("yes", "yes", "no", missed)
    assert rows["par1"] == ("yes", "yes", "yes", "")


def test_limits_are_not_met_by_asking_for_less():
    """A plane or task that was not predicted is a miss in all that "every" one is judged by."""
    limits = TARGETS["against_recording"]
    table = recording()
    fewer = table[table.plane != "sagittal"]
    assert len(failed(recording_verdicts(limits, fewer))) == len(
        list(recording_verdicts(limits, table))
    )
    limits, table = TARGETS["against_tasks"], tasks()
    verdicts = list(task_verdicts(limits, table[table.task != "lifting"]))
    assert [v.name for v in verdicts if v.holds] == ["daily tasks: predictions with a certificate"]


def test_study_without_predictions_meets_nothing():
    assert all(
        not v.holds for v in recording_verdicts(TARGETS["against_recording"], pd.DataFrame())
    )
    assert all(
        not v.holds for v in published_verdicts(TARGETS["against_published"], pd.DataFrame())
    )


def published(cells_off: int) -> pd.DataFrame:
    """Tables as published, but for some cells of the rhythm by 30 %."""
    limits, rows = TARGETS["against_published"], []

    def add(condition, plane, phase, quantity, value, known=0.0):
        rows.append(
            {
                "variant": "published", "participant": "par2", "plane": plane, "phase": phase,
                "condition": condition, "quantity": quantity, "published": known,
                "reproduced": value, "status": "optimal",
            }
        )  # fmt: skip

    count = 0
    for plane in PLANES:
        for condition in ("healthy", "cuff_w10"):
            add(condition, plane, "elevation", "upward_rotation_rmse_deg", 3.9)
            add(condition, plane, "elevation", "clavicle_elevation_rmse_deg", 3.9)
            for phase in ("start-30", "30-60", "60-90", "start-90"):
                add(condition, plane, phase, "rhythm_range", 2.6 if count < cells_off else 2.1, 2.0)
                count += 1
        fall = limits["peak_fall_deg"][plane]
        add("cuff_w10", plane, "peak", "upward_rotation_fall_deg", fall + 3.9)
        for condition, falls in limits["graded_fall_deg"].items():
            add(condition, plane, "at 70 deg", "upward_rotation_fall_deg", falls[plane] - 2.9)
        add("healthy_generic", plane, "rest", "clavicle_elevation_deg", -1.0)
    return pd.DataFrame(rows)


def test_published_problem_is_judged_cell_by_cell():
    limits = TARGETS["against_published"]
    assert not failed(published_verdicts(limits, published(6)))
    (name,) = failed(published_verdicts(limits, published(7)))
    assert "rhythm" in name


def test_falls_have_a_sign_and_two_sides():
    limits, table = TARGETS["against_published"], published(0)
    fall = (table.quantity == "upward_rotation_fall_deg") & (table.phase == "peak")
    table.loc[fall & (table.plane == "frontal"), "reproduced"] = 14.1
    table.loc[fall & (table.plane == "sagittal"), "reproduced"] = -12.0
    missed = failed(published_verdicts(limits, table))
    assert len(missed) == 2
    assert all("fall of peak" in name for name in missed)


def test_an_arm_that_never_hangs_is_named_and_does_not_hide_the_others():
    limits = {**TARGETS["joint_force"], "rest_percent_bw": 10.0}
    table = recording().assign(gh_force_rest_bw=9.0, gh_force_peak_bw=60.0)
    table.loc[1, "gh_force_rest_bw"] = float("nan")
    first = next(force_verdicts(limits, table))
    assert first.holds
    assert "par1 scapular" in first.value
    table.loc[0, "gh_force_rest_bw"] = 12.0
    assert not next(force_verdicts(limits, table)).holds
    table.loc[1, "status"] = "failed"
    assert next(force_verdicts(limits, table)).value == "no prediction"


def with_forces(**changes: float) -> pd.DataFrame:
    """Recorded arms of all participants and the published arm of par2, all within their limits."""
    table = recording().assign(gh_force_rest_bw=9.0, gh_force_peak_bw=60.0, arm_peak_deg=95.0)
    table = table.assign(gh_force_90_bw=table.plane.map({"frontal": 80.0, "sagittal": 70.0}))
    high = table[table.participant == "par2"].assign(variant="study_arm", arm="published")
    # What the arm above 90 deg does is judged nowhere.
    return pd.concat([table, high.assign(gh_force_peak_bw=200.0)], ignore_index=True).assign(
        **changes
    )


def test_joint_force_is_judged_at_rest_and_against_implants():
    limits, table = TARGETS["joint_force"], with_forces()
    assert not failed(force_verdicts(limits, table))
    own = (table.variant == "study") & (table.plane == "frontal")
    table.loc[own & (table.participant == "par3"), "gh_force_90_bw"] = 85.3 + 27.0
    (missed,) = (one for one in force_verdicts(limits, table) if not one.holds)
    assert missed.name == (
        "glenohumeral force at 90 deg (assumed) against implants, recorded arms, frontal plane"
    )
    assert missed.worse == ("par3 112.3 %BW",)
    (name,) = failed(force_verdicts(limits, with_forces(gh_force_rest_bw=10.1)))
    assert "at rest" in name
    assert len(failed(force_verdicts(limits, pd.DataFrame()))) == 5


def test_arms_that_end_below_the_implants_are_named_and_judged_nowhere():
    limits, table = TARGETS["joint_force"], with_forces()
    low = (table.variant == "study") & (table.participant == "par2") & (table.plane == "frontal")
    table.loc[low, ["gh_force_90_bw", "arm_peak_deg"]] = [float("nan"), 70.6]
    held = [one for one in force_verdicts(limits, table) if "recorded arms, frontal" in one.name]
    assert [one.holds for one in held] == [True]
    assert "par2 ends at 71 deg: arm too low" in held[0].value
    none = force_verdicts(limits, with_forces(gh_force_90_bw=float("nan")))
    assert [one.holds for one in none] == [True, False, False, False, False]


def test_effect_of_the_cuff_is_stated_at_equal_weight_and_is_no_target():
    rows = [
        {
            "variant": variant, "condition": condition, "quantity": quantity, "plane": "frontal",
            "phase": "at 70 deg", "reproduced": -1.5,
        }
        for variant in ("study_arm", "published")
        for condition, quantity in (
            ("cuff_w2", "upward_rotation_fall_deg"),
            ("cuff_w10", "upward_rotation_fall_equal_weight_deg"),
        )
    ]  # fmt: skip

    def stated(rows: list[dict], targets: dict = TARGETS):
        return cuff_effects(Judged(targets, recording(), pd.DataFrame(rows), ("par2",)))

    table = stated(rows)
    assert [row[2] for row in table.rows] == ["-1.5"] * 4
    assert not table.flagged
    assert stated(rows[:3]).flagged == {3}
    assert stated(rows[:3]).rows[3][2:] == ("no prediction",) * 3
    one = {**TARGETS, "cuff_effect": {**TARGETS["cuff_effect"], "variants": ["published"]}}
    assert len(stated(rows, one).rows) == 2


def test_an_elevation_that_no_table_has_is_refused():
    limits = TARGETS["against_published"]
    assert fall_level(limits) == "at 70 deg"
    other = limits | {"graded_elevation_deg": 60}
    with pytest.raises(ConfigError, match="graded_elevation_deg is 60"):
        list(published_verdicts(other, published(0)))
    judged = Judged({**TARGETS, "against_published": other}, *[pd.DataFrame()] * 2, ("par2",))
    with pytest.raises(ConfigError, match="tabulated at 70 deg"):
        cuff_effects(judged)


def test_rows_that_are_said_to_be_changed_afterwards_exist():
    nothing = pd.DataFrame()
    rows = prediction_verdicts(Judged(TARGETS, nothing, nothing, ("par1", "par2", "par3")))
    said = [changed_afterwards(verdict.name, TARGETS) for verdict in rows]
    assert (said.count("added"), said.count("tightened")) == (8, 5)
    names = [verdict.name for verdict in rows]
    for listed in TARGETS["afterwards"].values():
        assert not [start for start in listed if not any(name.startswith(start) for name in names)]
    assert changed_afterwards("par2, healthy prediction: upward rotation at rest", TARGETS) == ""


def own_rhythm(**changes: float) -> pd.DataFrame:
    """Rhythm as printed and, over the rise, as of people; `changes` in one plane of par3."""
    rows = []
    for participant in ("par1", "par2", "par3"):
        for condition, printed in (("healthy", "healthy"), ("cuff_w10", "rc_limited")):
            for plane, phases in paper.RHYTHM[printed].items():
                for phase, value in phases.items():
                    mean, sd, _ = population.RHYTHM[plane][phase]
                    row = {"participant": participant, "condition": condition, "plane": plane}
                    row |= {"phase": phase, "shr": mean + 0.9 * sd, "shr_range": 1.19 * value}
                    changed = (participant, plane) == ("par3", "frontal")
                    rows.append(row | (changes if changed else {}))
    return pd.DataFrame(rows)


def test_own_rhythm_is_judged_by_the_printed_table_and_by_people():
    limits = TARGETS["own_rhythm"]
    assert not failed(rhythm_verdicts(limits, own_rhythm()))
    printed, people = rhythm_verdicts(limits, own_rhythm(shr=float("nan")))
    assert printed.holds
    assert people.value == "8 of 9"
    assert people.worse == ("par3 frontal: no rhythm for 2.10 ± 0.42",)
    table = own_rhythm()
    table.loc[table.index[table.participant == "par2"][:7], "shr_range"] *= 1.1
    printed, people = rhythm_verdicts(limits, table)
    assert (printed.value, printed.holds, people.holds) == ("17 of 24", False, True)


def test_rhythm_of_planes_that_were_not_asked_for_is_missed():
    limits, table = TARGETS["own_rhythm"], own_rhythm()
    fewer = list(rhythm_verdicts(limits, table[table.plane != "frontal"]))
    assert [one.value for one in fewer] == ["16 of 24", "6 of 9"]
    assert len(failed(fewer)) == len(failed(rhythm_verdicts(limits, pd.DataFrame()))) == 2


def test_solves_of_every_variant_need_a_certificate():
    limits, table = TARGETS["solves"], recording()
    both = pd.concat([table, table.assign(variant="published", arm="published")])
    assert uncertified_solves(limits, both).value == "0 of 6"
    theirs = (both.variant == "published") & (both.participant == "par2")
    verdict = uncertified_solves(limits, both.assign(certified=~theirs))
    assert not verdict.holds
    assert verdict.worse == ("authors' problem (solved here) par2 healthy",)
    # Without a solution there is nothing to certify, and its own limits are missed.
    gone = both.assign(certified=~theirs, status=theirs.map({True: "failed", False: "optimal"}))
    assert uncertified_solves(limits, gone).holds
    assert not uncertified_solves(limits, pd.DataFrame()).holds


@pytest.mark.parametrize(
    ("share", "error_mm", "missed"),
    [(0.0, 2.9, 0), (0.0, 3.1, 1), (0.4, 2.9, 1), (0.0, float("nan"), 0), (0.4, float("nan"), 1)],
)
def test_muscle_paths_need_fitted_poses_and_lengths_as_opensim_has_them(share, error_mm, missed):
    """An error of length counts inside the fitted poses, too, where it was audited."""
    limits, table = TARGETS["against_recording"], recording(outside_fit_share=share)
    audit = pd.DataFrame({"participant": "par2", "condition": "healthy", "length_max_mm": [2.9]})
    audited = with_audit(table, audit.assign(length_max_mm=error_mm))
    assert len(failed(recording_verdicts(limits, audited))) == missed


def test_every_audited_prediction_is_shown_with_its_worst_muscles():
    row = {"participant": "par3", "condition": "healthy", "poses": 65, "jumps": 2}
    row |= {"length_muscle": "lat_dorsi_5", "length_max_mm": 9.36, "length_rmse_mm": 1.93}
    row |= {"arm_muscle": "lat_dorsi_2", "arm_max_mm": 40.0, "arm_rmse_mm": 9.7}
    good = row | {"condition": "cuff_w2", "length_max_mm": 2.0}
    gone = {**row, "condition": "cuff_w10", "length_max_mm": None, "arm_max_mm": None}
    table = audit_rows(pd.DataFrame([row, good, gone]), 3.0)
    assert table.rows[0][4:] == ("9.4 lat_dorsi_5 (1.9)", "40.0 lat_dorsi_2 (9.7)")
    assert table.rows[2][4:] == ("no solution", "no solution")
    assert table.flagged == {0}


GOOD_TASK = {
    "ur_rmse_deg": 3.0,
    "tilt_rmse_deg": 5.9,
    "internal_rotation_rmse_deg": 4.0,
    "clavicle_elevation_rmse_deg": 2.0,
    "ur_bias_deg": -1.0,
    "ur_recorded_sd_deg": 6.0,
    "arm_rmse_deg": 1.0,
    "outside_fit_share": 0.0,
    "stop_moment_median_Nm": 0.0,
}


GOOD_TASK |= {f"tracked_{angle}": 1.0 for angle in ANGLES}
GOOD_TASK |= {f"apart_{field.name}": 1.0 for field in fields(Apart)}


def tasks(**changes: object) -> pd.DataFrame:
    """Predicted daily tasks of two participants, `changes` in the drinking of par2."""
    rows = []
    for participant in ("par1", "par2"):
        for task in TASKS:
            row = {
                "participant": participant, "task": task, "condition": "healthy",
                "variant": "study", "hand_load_kg": 0.0, "status": "optimal", "certified": True,
                **GOOD_TASK,
            }  # fmt: skip
            changed = (participant, task) == ("par2", "drinking")
            rows.append(row | (changes if changed else {}))
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ur_rmse_deg": 6.1}, "par2, daily tasks: upward rotation"),
        ({"tilt_rmse_deg": 6.1}, "par2, daily tasks: tilt"),
        ({"internal_rotation_rmse_deg": 6.1}, "par2, daily tasks: internal rotation"),
        ({"clavicle_elevation_rmse_deg": 6.1}, "par2, daily tasks: clavicle elevation"),
        ({"outside_fit_share": 0.01}, "par2, daily tasks: share outside"),
        ({"stop_moment_median_Nm": 0.6}, "par2, daily tasks: median moment"),
        ({"certified": False}, "daily tasks: predictions with a certificate"),
    ],
)
def test_one_daily_task_off_fails_its_limit_alone(change, said):
    limits = TARGETS["against_tasks"]
    assert not failed(task_verdicts(limits, tasks()))
    (name,) = failed(task_verdicts(limits, tasks(**change)))
    assert name.startswith(said)


def test_daily_task_without_solution_fails_all_limits_of_its_participant():
    nothing = dict.fromkeys((*GOOD_TASK, "certified"))
    table = tasks(status="failed", **nothing)
    missed = failed(task_verdicts(TARGETS["against_tasks"], table))
    assert len(missed) == 7
    judged = Judged(TARGETS, pd.DataFrame(), pd.DataFrame(), ("par1", "par2"), table)
    assert task_table(judged).flagged == {len(TASKS)}


def test_daily_tasks_that_nobody_predicted_are_missed():
    verdicts = list(task_verdicts(TARGETS["against_tasks"], pd.DataFrame()))
    assert len(verdicts) == len(failed(verdicts)) == 13


def test_other_participants_have_no_limits():
    of_ours = Judged(TARGETS, recording(), pd.DataFrame(), ("ann", "par2"))
    assert of_ours.has_limits
    assert not Judged(TARGETS, recording(), pd.DataFrame(), ("ann",)).has_limits


def test_errors_of_the_girdle_stand_by_elevation_and_an_older_table_leaves_gaps():
    row = {"participant": "par2", "condition": "cuff_w10", "phase": "elevation"}
    rows = [
        row | {"variant": variant, "plane": plane, "quantity": quantity, "reproduced": value}
        for variant in ("published", "study_arm")
        for plane in PLANES
        for quantity, value in (("upward_rotation_rmse_deg", 1.04), ("posterior_tilt_rmse_deg", 8))
    ]
    table = girdle_table(pd.DataFrame(rows))
    assert len(table.rows) == 6
    first = ("authors' problem (solved here)", "cuff_w10", "frontal", "1.0", "", "8.0")
    assert table.rows[0][:6] == first
    older = [one for one in rows if "tilt" not in one["quantity"]]
    assert girdle_table(pd.DataFrame(older)).rows[0][5] == ""
    assert not girdle_table(pd.DataFrame(rows).assign(condition="cuff_25")).rows
