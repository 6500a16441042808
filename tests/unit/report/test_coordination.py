"""Chapters beyond tracking: calibration, validation and prediction, from a synthetic study."""

import base64
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import synthetic_coordination
import synthetic_study
import yaml

from scapulohumeral.emg.envelope import write_failed_envelopes
from scapulohumeral.emg.quality import write_quality
from scapulohumeral.model.published_arm import published_pose
from scapulohumeral.quantities import paper
from scapulohumeral.quantities.population import ELEVATION_DEG, UPWARD_ROTATION, healthy_band
from scapulohumeral.quantities.published_distance import published_distances
from scapulohumeral.report import study as study_module
from scapulohumeral.report.calibration.figures import (
    emg_quality,
    scaler_figure,
    scaler_table,
    score_table,
)
from scapulohumeral.report.chapters import (
    calibration_chapter,
    other_objective,
    prediction_chapter,
    tracked_note,
    validation_chapter,
)
from scapulohumeral.report.coordination import (
    Cases,
    Coordination,
    CoordinationFiles,
    Prediction,
    _cases,
)
from scapulohumeral.report.coordination_targets import (
    channel_reductions,
    coordination_verdicts,
    smallest_stable_weight,
    solve_verdicts,
    stable_weight,
    validation_verdicts,
)
from scapulohumeral.report.drawing.svg import Drawing, Picture
from scapulohumeral.report.prediction.figures import (
    condition_label,
    pauses,
    prediction_kinematics,
    published_angles,
    upward_rotation_figure,
)
from scapulohumeral.report.prediction.ladder import ladder_figure, ladder_rows, ladder_table
from scapulohumeral.report.prediction.loading import _reach, sweep_figure
from scapulohumeral.report.prediction.moments import group_force_figure, largest_push
from scapulohumeral.report.prediction.tables import prediction_solves, starts
from scapulohumeral.report.prediction.targets import TASKS
from scapulohumeral.report.published.comparison import (
    comparison,
    published_plane,
    published_rhythm_table,
    recovered,
)
from scapulohumeral.report.render import render_report
from scapulohumeral.report.study import ReportFiles, Study, read_study
from scapulohumeral.report.tables import settings as settings_table
from scapulohumeral.report.validation.figures import reduction_table, task_figures
from scapulohumeral.stages.distances.against import read_predictions
from scapulohumeral.stages.distances.daily_tasks import COLUMNS
from scapulohumeral.templates import page_template

pytestmark = pytest.mark.unit

TARGETS = yaml.safe_load(study_module.TARGETS.read_text(encoding="utf-8"))
PLANES = ("frontal", "scapular", "sagittal")
# Committed tables, and words that only they bring into the report.
COMMITTED = {
    "reports/sensitivity.csv": "scapula of the start turned by -20 deg",
    "reports/ladder.csv": "Mean change of upward rotation over fixed elevations",
    "reports/static_postures.csv": "serr_ant +",
    "config/literature/moment_arms.csv": "Liu et al. 1997",
    "config/literature/joint_force.csv": "implants, mean peak",
}
# Fields that take them under another name.
FIELDS = {"static_postures": "postures", "held_girdle": "held"}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> ReportFiles:
    """Three planes of par2 with everything."""
    return written(tmp_path_factory.mktemp("study"), PLANES)


def written(folder: Path, planes: Sequence[str]) -> ReportFiles:
    """Planes of par2 with everything; the cuff-limited solve at weight 2 failed."""
    runs = [synthetic_study.solution("par2", plane, "quaternion") for plane in planes]
    coordination = synthetic_coordination.write_coordination(folder, runs, failed=("cuff_w2",))
    return replace(synthetic_study.write_study(folder, runs), coordination=coordination)


@pytest.fixture(scope="module")
def study(files: ReportFiles) -> Study:
    """The same, read."""
    return read_study(files)


@pytest.fixture(scope="module")
def coordination(study: Study) -> Coordination:
    """What goes beyond tracking."""
    return study.coordination


@pytest.fixture(scope="module")
def cases(coordination: Coordination) -> Cases:
    """Predictions of par2."""
    return coordination.cases["par2"]


@pytest.fixture(scope="module")
def html(files: ReportFiles) -> str:
    """The whole report."""
    return render_report(files)


@pytest.fixture(scope="module")
def html_of_tables(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The whole report with committed tables, and a daily task against its recording.

    They are about no plane, and one is drawn sooner than three.
    """
    files = written(tmp_path_factory.mktemp("one_plane"), PLANES[:1])
    row = dict.fromkeys(COLUMNS, 0.0) | {"participant": "par2"}
    row |= {"status": "optimal", "certified": True, "variant": "study", "condition": "healthy"}
    table = pd.DataFrame([{**row, "task": task} for task in TASKS])
    angles = ["tilt_rmse_deg", "tracked_tilt_rmse_deg", "apart_tilt_rmse_deg"]
    table.loc[table.task == "shelf_reaching", angles] = [13.91, 8.4, 11.0]
    path = tmp_path_factory.mktemp("tasks") / "against_tasks.csv"
    table.to_csv(path, index=False)
    tables = {FIELDS.get(Path(name).stem, Path(name).stem): [Path(name)] for name in COMMITTED}
    coordination = replace(files.coordination, against_tasks=[path], **tables)
    return render_report(replace(files, coordination=coordination))


def test_report_has_all_chapters(html: str) -> None:
    assert "This study predicts no motion" not in html
    assert "1 of 7 predictions did not converge: par2 cuff_w2" in html
    for name in ("scalers", "prediction_par2", "glenohumeral_force_par2", "capacity_par2"):
        assert f'download="{name}.csv"' in html


def test_simulated_emg_is_called_so_wherever_emg_is_shown(html: str, study: Study) -> None:
    assert "The EMG of this study is simulated" in html
    chapter = calibration_chapter(study)
    assert "simulated EMG" in chapter["figure"].caption
    assert "simulated EMG" in chapter["figure"].svg
    assert all("simulated EMG" in f.caption for f in task_figures(study.coordination))
    for part in html.split("<h3>")[1:] + html.split("<h2 ")[1:]:
        heading = part.split("</h")[0]
        assert "EMG" not in heading or "imulated EMG" in heading


def test_study_without_predictions_says_so(tmp_path: Path) -> None:
    runs = [synthetic_study.solution("par1", "sagittal", "quaternion")]
    study = read_study(synthetic_study.write_study(tmp_path, runs))
    assert prediction_chapter(study) is None
    assert calibration_chapter(study) is None
    assert coordination_verdicts(study.coordination) == []
    assert {row[0] for row in comparison(study, study.coordination).rows} == {"tracking"}


def test_cases_are_found_by_what_was_predicted(cases: Cases) -> None:
    assert cases.healthy.condition.name == "healthy"
    assert cases.generic.condition.name == "healthy_generic"
    assert cases.cuff.condition.name == "cuff_w10"
    assert [p.condition.name for p in cases.graded] == ["healthy", "cuff_50"]
    assert [p.condition.name for p in cases.isolated] == ["supraspinatus"]


def test_failed_prediction_is_in_no_figure_and_no_number(
    coordination: Coordination, cases: Cases
) -> None:
    assert [p.condition.name for p in cases.sweep] == ["cuff_w10"]
    assert sweep_figure(cases) is None, "one weight is no sweep"
    table = prediction_solves(coordination)
    failed = [row for i, row in enumerate(table.rows) if i in table.flagged]
    assert [(row[1], row[7]) for row in failed] == [("cuff_w2", "NOT CONVERGED")]
    conditions = {*synthetic_coordination.CONDITIONS, "recorded"} - {"cuff_w2"}
    assert set(coordination.rhythm.condition) == conditions
    rows = coordination.judged.recording.set_index("condition")
    assert rows.loc["cuff_w2"].ur_rmse_deg.isna().all()
    assert (rows.loc["healthy"].ur_rmse_deg > 1.0).all()
    assert not rows.loc["cuff_w2"].certified.any()
    assert rows.drop("cuff_w2").certified.all()


def test_recording_whose_tracking_failed_is_compared_with(tmp_path: Path) -> None:
    runs = [synthetic_study.solution("par2", "frontal", "quaternion", "failed")]
    files = synthetic_coordination.write_coordination(tmp_path, runs, tasks=False)
    assert "recorded" in set(pd.read_csv(files.rhythm[0]).condition)
    assert pd.read_csv(files.against_recording[0]).ur_rmse_deg.notna().all()


def test_figure_shows_predictions_and_published_motions(cases: Cases) -> None:
    figure = prediction_kinematics(cases)
    for label in ("predicted, healthy", "predicted, cuff-limited", "published, healthy"):
        assert f">{label}</text>" in figure.svg
    assert "doi:10.5281" in figure.caption


def downloaded(figure: Picture) -> pd.DataFrame:
    """Numbers that a figure offers."""
    coded = figure.data_uri.split(",", 1)[1]
    return pd.read_csv(io.BytesIO(base64.b64decode(coded)))


def test_scalers_are_offered_with_the_intervals_that_are_drawn(coordination: Coordination) -> None:
    numbers = downloaded(scaler_figure(coordination)).set_index("muscle group")
    panel = "par2: scaler of maximum isometric force, simulated EMG"
    of_force = {
        column.removeprefix(f"{panel} | ").removesuffix(", factor on the generic value [1]"): value
        for column, value in numbers.loc["scapular_deltoid"].items()
        if column.startswith(panel)
    }
    assert of_force == {
        "90 % interval, lower end": 1.1,
        "90 % interval, upper end": 1.2,
        "calibrated": 1.15,
        "paper's problem": 1.02,
        "plant": 1.16,
    }


def test_numbers_over_elevation_say_what_they_are(cases: Cases) -> None:
    numbers = downloaded(upward_rotation_figure(cases))
    assert numbers.columns[0] == "thoracohumeral elevation [deg]"
    assert all(name.endswith("scapular upward rotation [deg]") for name in numbers.columns[1:])


def test_humeral_angles_that_mean_nothing_in_pauses_are_not_drawn(cases: Cases) -> None:
    """Near the hanging arm they turn by half a circle, which would flatten all else."""
    figure = prediction_kinematics(cases)
    drawn = downloaded(figure).set_index("time [s]")
    start, end = pauses(cases.healthy)[0]
    times = cases.healthy.solution.time_s
    inside = drawn.loc[times[start] + 0.02 : times[end] - 0.02]
    assert inside["humerus z: elevation (+) | predicted, healthy, angle [deg]"].notna().any()
    for column in drawn:
        if column.startswith(("humerus y:", "humerus y':")):
            assert inside[column].isna().all(), column
            assert drawn[column].notna().any()
    assert "another motion of the arm" in figure.caption
    assert (
        "another motion of the arm"
        not in prediction_kinematics(replace(cases, published={})).caption
    )


def test_panels_hold_the_whole_path_of_the_force(cases: Cases) -> None:
    """The point of the sweep is how far outside the rim the force comes."""
    limit = 0.32
    shear = replace(cases.healthy.load, path=np.full_like(cases.healthy.load.path, 0.9))
    far = SimpleNamespace(record=cases.healthy.record, load=shear, planes=cases.healthy.planes)
    assert 0.9 < _reach([far]) < 1.0
    assert _reach([cases.healthy]) >= limit
    shear.path[0] = 50.0
    assert _reach([far]) < 2.0


def test_shoulders_of_another_weight_have_another_label(cases: Cases) -> None:
    healthy = cases.healthy
    header = healthy.solution.header
    heavy = {**header, "condition": {**header["condition"], "w_gh": 10.0}}
    other = replace(healthy, solution=replace(healthy.solution, header=heavy))
    assert condition_label(healthy) == "healthy, calibrated muscles, w_GH 2"
    assert condition_label(other) == "healthy, calibrated muscles, w_GH 10"


def without(coordination: Coordination, *names: str) -> list[Prediction]:
    return [p for p in coordination.predictions if p.condition.name not in names]


def test_the_only_shoulder_of_a_study_without_calibration_is_shown(
    coordination: Coordination, cases: Cases
) -> None:
    """Generic muscles stand for the whole shoulder only where no calibrated one was asked for."""
    generic = [p for p in coordination.predictions if p.condition.name == "healthy_generic"]
    alone = _cases("par2", generic, {})
    assert alone.healthy.condition.name == "healthy_generic"
    assert alone.generic is None
    assert prediction_kinematics(alone) is not None
    header = {**cases.healthy.solution.header, "status": "failed"}
    failed = replace(cases.healthy, solution=replace(cases.healthy.solution, header=header))
    both = _cases("par2", [failed, *generic], {})
    assert both.healthy is None
    assert both.generic.condition.name == "healthy_generic"


def test_a_study_without_loss_of_the_cuff_is_not_judged_by_it(coordination: Coordination) -> None:
    cuff = [n for n in synthetic_coordination.CONDITIONS if n.startswith("cuff")]
    without_cuff = replace(coordination, predictions=without(coordination, *cuff))
    assert "loss of the cuff" in " ".join(v.name for v in coordination_verdicts(coordination))
    found = coordination_verdicts(without_cuff)
    assert not [v for v in found if v.name.startswith("loss of the cuff")]


def test_healthy_without_solution_has_no_figures(cases: Cases) -> None:
    nothing = Cases("par2", (), {})
    assert prediction_kinematics(nothing) is None
    assert nothing.graded == ()


def test_force_leaves_the_glenoid_at_the_low_weight(
    tmp_path: Path, coordination: Coordination
) -> None:
    assert stable_weight(coordination, "par2") == 10.0
    runs = [synthetic_study.solution("par2", plane, "quaternion") for plane in PLANES]
    extra = synthetic_coordination.write_coordination(tmp_path, runs, tasks=False)
    files = replace(synthetic_study.write_study(tmp_path, runs), coordination=extra)
    solved = read_study(files).coordination
    assert [p.condition.w_gh for p in solved.cases["par2"].sweep] == [2.0, 10.0]
    low = solved.cases["par2"].sweep[0]
    assert low.load.eccentricity.max() > 1.0
    assert stable_weight(solved, "par2") == 10.0
    assert solved.validation.empty


def test_a_failed_weight_ends_the_range_of_stable_ones(coordination: Coordination) -> None:
    cases = coordination.cases["par2"]
    (high,) = [p for p in cases.sweep if p.condition.w_gh == 10.0]

    def at(weight: float) -> Prediction:
        header = high.solution.header
        condition = {**header["condition"], "w_gh": weight, "name": f"cuff_{weight:g}"}
        return replace(
            high, solution=replace(high.solution, header={**header, "condition": condition})
        )

    def swept(solved: Sequence[float], asked: Sequence[float]) -> Coordination:
        shown = Cases("par2", tuple(map(at, solved)), {})
        return replace(coordination, predictions=list(map(at, asked)), cases={"par2": shown})

    assert stable_weight(swept((6.0, 8.0, 10.0), (6.0, 8.0, 10.0)), "par2") == 6.0
    assert stable_weight(swept((6.0, 10.0), (6.0, 8.0, 10.0)), "par2") == 10.0
    nothing = smallest_stable_weight(swept((), (6.0, 8.0)))
    assert (nothing.holds, nothing.worse) == (False, ("par2",))
    # One weight is no sweep to be judged.
    one = coordination_verdicts(swept((6.0,), (6.0,)))
    assert not [v for v in one if v.name.startswith("loss of the cuff")]


def test_forces_are_compared_with_the_printed_ones_in_newtons(
    study: Study, coordination: Coordination
) -> None:
    """The paper divides by 650 N, this study by the weight of its own mean mass."""
    rows = [row for row in comparison(study, coordination).rows if "peak glenohumeral" in row[1]]
    assert [row[2] for row in rows] == ["699", "556"]
    healthy = coordination.cases["par2"].healthy
    for row, plane in zip(rows, ("frontal", "sagittal"), strict=True):
        force = healthy.solution.reaction_N[healthy.planes[plane]]
        assert row[3] == f"{np.linalg.norm(force, axis=1).max():.0f}"


def test_published_elevations_follow_ours_in_any_order(cases: Cases) -> None:
    """Each is put where ours is; planes that do not follow each other there are apart here."""
    motion = cases.published["healthy"]
    healthy = cases.healthy
    planes = dict(reversed(healthy.solution.header["planes"].items()))
    time_s, angles = published_angles(cases, motion)
    header = {**healthy.solution.header, "planes": {"sagittal": planes["sagittal"]}}
    one = replace(healthy, solution=replace(healthy.solution, header=header))
    alone, its_angles = published_angles(Cases("par2", (one,), cases.published), motion)
    inside = np.isin(time_s, alone)
    np.testing.assert_allclose(angles[inside], its_angles)
    header = {**healthy.solution.header, "planes": planes}
    turned = replace(healthy, solution=replace(healthy.solution, header=header))
    times, _ = published_angles(Cases("par2", (turned,), cases.published), motion)
    np.testing.assert_allclose(times[: len(alone)], alone)


def test_a_stiffer_girdle_is_no_part_of_the_sweep(coordination: Coordination) -> None:
    """Its cuff loss is compared with nothing, and its participant has no sweep to judge."""
    lost = coordination.cases["par2"].sweep[0]
    header = lost.solution.header
    condition = {**header["condition"], "girdle_stiffness_Nm_per_rad": 5.0}
    solution = replace(lost.solution, header={**header, "condition": condition})
    stiff = Cases("par3", (replace(lost, solution=solution),), {})
    assert stiff.sweep == ()
    both = replace(coordination, cases={**coordination.cases, "par3": stiff})
    verdict = smallest_stable_weight(both)
    assert verdict.holds
    assert verdict.value == "par2 10, par3 no sweep"
    assert not smallest_stable_weight(replace(coordination, cases={"par3": stiff})).holds


def test_verdicts_of_the_synthetic_study(coordination: Coordination) -> None:
    verdicts = {v.name: v for v in coordination_verdicts(coordination)}

    def one(text: str):  # noqa: ANN202 - a verdict
        (found,) = [v for name, v in verdicts.items() if text in name]
        return found

    assert one("maximum isometric force").holds
    assert not one("optimal fibre length").holds
    assert one("optimal fibre length").worse == ("par2 4.0 %",)
    assert not one("cover the truth").holds
    assert one("mean reduction").holds
    assert not one("predictions: solves").holds
    assert one("predictions: solves").worse == ("par2 cuff_w2",)
    assert one("predictions: solutions with a certificate").holds
    assert one("predictions of all variants").holds


def test_calibration_without_a_result_stands_first_and_enters_nothing(
    files: ReportFiles, tmp_path: Path
) -> None:
    failed = synthetic_coordination.calibration("par3")
    failed |= {"status": "failed", "message": "no way", "groups": {}, "scores": None}
    path = synthetic_coordination.write_json(tmp_path / "par3.json", failed)
    both = [*files.coordination.calibrations, path]
    study = read_study(replace(files, coordination=replace(files.coordination, calibrations=both)))
    first, *others = coordination_verdicts(study.coordination)
    assert (first.name, first.holds) == ("calibrations", False)
    assert first.value == "1 of 2 converged"
    assert first.worse == ("par3: calibration failed: no way",)
    assert all("par3" not in v.value for v in others if "calibration" in v.name)
    assert {row[0] for row in scaler_table(study.coordination).rows} == {"par2"}
    assert calibration_chapter(study)["figure"].svg.count("par3") == 0
    alone = replace(files.coordination, calibrations=[path])
    html = render_report(replace(files, coordination=alone))
    assert "1 of 1 calibrations have no result" in html
    assert "par3 (calibration failed: no way)" in html


def test_emg_that_could_not_be_simulated_is_shown_as_failed(
    files: ReportFiles, tmp_path: Path
) -> None:
    envelopes, qualities = files.coordination.envelopes, files.coordination.emg_quality
    sealed, about = tmp_path / "par2" / envelopes[0].name, tmp_path / "quality.json"
    sealed.parent.mkdir()
    write_failed_envelopes(sealed, ["anterior_deltoid"], "no way")
    write_quality(about, [], simulated=True, failure="no way")
    coordination = replace(
        files.coordination,
        envelopes=[sealed, *envelopes[1:]],
        emg_quality=[about, *qualities[1:]],
    )
    html = render_report(replace(files, coordination=coordination))
    assert html.count("NOT SIMULATED") == 1
    assert "no way" in html


def test_uncertified_and_slow_predictions_do_not_hold(coordination: Coordination) -> None:
    table = coordination.prediction_table.assign(certified=False, seconds=500.0)
    _, certificates, times = solve_verdicts(table, TARGETS["predictions"])
    assert not certificates.holds
    assert not times.holds
    assert "par2 healthy 500 s" in times.worse


def test_limit_of_the_kkt_error_judges_certificates(coordination: Coordination) -> None:
    """A stricter limit is missed by certificates that were given for a laxer one."""
    limits = TARGETS["predictions"]
    _, held, _ = solve_verdicts(coordination.prediction_table, limits)
    assert held.holds
    _, missed, _ = solve_verdicts(coordination.prediction_table, {**limits, "kkt_error": 1e-12})
    assert not missed.holds
    assert "par2 healthy" in missed.worse
    assert "1e-12" in missed.name


def test_failed_task_is_no_reduction(coordination: Coordination) -> None:
    table = coordination.validation.assign(rmse_calibrated=np.nan)
    assert channel_reductions(table).reduction.isna().all()
    mean, worse = validation_verdicts(table, TARGETS["validation"])
    assert not mean.holds
    assert mean.value == "not known: a solve has no result"
    assert not worse.holds
    assert worse.value == "0 of 0 by more than 5 %"
    assert len(worse.worse) == coordination.validation.channel.nunique()
    assert all(text.endswith("not known") for text in worse.worse)
    shown = replace(coordination, validation=table)
    assert {row[3:5] for row in reduction_table(shown).rows} == {("no result", "")}


def test_worse_channel_is_named() -> None:
    table = pd.DataFrame(
        {
            "participant": "par2",
            "task": ["driving", "lifting", "heavy"] * 2,
            # What is solved again with another load counts once.
            "recording": ["driving", "lifting", "lifting"] * 2,
            "channel": ["a"] * 3 + ["b"] * 3,
            "rmse_generic": [0.3, 0.4, 0.9, 0.1, 0.1, 0.9],
            "rmse_calibrated": [0.0, 0.0, 0.9, 0.12, 0.12, 0.1],
        }
    )
    mean, worse = validation_verdicts(table, TARGETS["validation"])
    assert mean.value == "40 %"
    assert worse.worse == ("par2 b -20 %",)
    assert channel_reductions(table).generic[0] == pytest.approx(np.sqrt(0.125))


def test_scalers_that_miss_the_plant_are_flagged(coordination: Coordination) -> None:
    table = scaler_table(coordination)
    assert [table.rows[i][1:3] for i in sorted(table.flagged)] == [
        ("scapular deltoid", "optimal fibre length")
    ]
    assert table.rows[0][-1] == "1.16", "published value beside it"
    quality = emg_quality(coordination)
    assert quality.rows[0][2:4] == ("simulated", "2 of 4")


def test_coverage_is_that_of_the_kind(coordination: Coordination) -> None:
    """One of the two identifiable fibres is missed, no strength is."""
    table = score_table(coordination)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    name = "of the identifiable, 90 % intervals that cover the plant [%]"
    assert [row[name] for row in rows] == ["100.0", "50.0"]


def test_reductions_stand_beside_the_published_ones(coordination: Coordination) -> None:
    rows = {row[1]: row for row in reduction_table(coordination).rows}
    assert rows["lateral deltoid"][3] == "0.000"
    assert rows["lateral deltoid"][5] == "0.126 → 0.122"
    assert rows["clavicular pectoralis"][5] == "not printed"


def test_same_problem_from_another_start(coordination: Coordination) -> None:
    (row,) = starts(coordination).rows
    assert row[1:3] == ("healthy", "healthy_direct")
    assert 0.0 < float(row[5]) < 0.2


def test_comparison_holds_every_published_rhythm(study: Study, coordination: Coordination) -> None:
    rows = comparison(study, coordination).rows
    rhythms = [row for row in rows if row[1].startswith("rhythm")]
    assert len(rhythms) == 24
    assert rhythms[0][3:5] == ("none", ""), "the synthetic scapula hardly turns up to 30 deg"
    whole = rhythms[3]
    assert whole[1] == "rhythm, healthy, frontal plane, start-90 deg"
    assert float(whole[2]) == paper.RHYTHM["healthy"]["frontal"]["start-90"]
    assert float(whole[4]) == pytest.approx(float(whole[3]) - float(whole[2]), abs=0.011)
    assert "deg by the paper" in whole[5]


def test_scaler_is_compared_with_the_plant_where_that_is_not_as_published(
    study: Study, coordination: Coordination
) -> None:
    """Fibres of the plant are the model's own, and some of these are no longer the authors'."""
    document = synthetic_coordination.calibration("par2")
    document["groups"]["clavicular_trapezius"]["fibre"] |= {"plant": 0.99, "error": -0.192}
    changed = replace(coordination, calibrations={"par2": document})
    why = {row[1]: row[5] for row in recovered(changed).rows if row[0] == "calibration"}
    fibre = why["scaler of optimal fibre length, clavicular trapezius"]
    assert "a plant with 0.99" in fibre
    assert "differs by -19 %" in fibre
    force = why["scaler of maximum isometric force, clavicular trapezius"]
    assert "a plant with the published scaler" in force
    for entry in document["groups"]["clavicular_trapezius"].values():
        del entry["plant"]
    measured = {row[1]: row[5] for row in recovered(changed).rows}
    assert measured["scaler of optimal fibre length, clavicular trapezius"].startswith("other EMG")


def test_what_simulated_emg_was_made_with_is_not_called_reproduced(
    study: Study, coordination: Coordination
) -> None:
    parts = {"calibration", "validation"}
    assert parts == {row[0] for row in recovered(coordination).rows}
    assert parts.isdisjoint(row[0] for row in comparison(study, coordination).rows)
    document = {**synthetic_coordination.calibration("par2"), "emg_simulated": False}
    measured = replace(coordination, emg=[], calibrations={"par2": document})
    assert not recovered(measured).rows
    assert parts <= {row[0] for row in comparison(study, measured).rows}


def test_settings_stand_by_stage(study: Study, coordination: Coordination) -> None:
    """What predictions minimise differs from what tracking does."""
    first = coordination.predictions[0]
    settings = {"time_step_s": 0.04, "weights": {"strength_exponent": 1}}
    solution = replace(first.solution, header={**first.solution.header, "settings": settings})
    changed = replace(coordination, predictions=[replace(first, solution=solution)])
    table = settings_table(replace(study, coordination=changed))
    assert table.columns == ("setting", "tracking", "calibration", "validation", "prediction")
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["time step [s]"] == ("0.04", "0.04", "0.04", "0.04")
    assert rows["tracked point of the clavicle, from the sternum [m]"] == ("0.5", "0.5", "0.5", "")
    assert rows["weight strength exponent"] == ("", "", "", "1")
    assert rows["weight emg"] == ("", "2", "", "")


def test_other_weights_of_calibration_are_said_where_there_are_any(study: Study) -> None:
    weights = {"calibration": {"emg": 2, "activation": 1, "reaction_rate": 1e-6}}
    weights["prediction"] = {"activation": 1, "reaction_rate": 1.5625e-8, "strength_exponent": 1}
    found = other_objective(replace(study, config={"weights": weights}))
    assert found == [
        "reaction rate 1.5625e-08 instead of 1e-06",
        "strength exponent 1 instead of 0",
    ]
    same = {**weights, "prediction": weights["calibration"]}
    assert not other_objective(replace(study, config={"weights": same}))
    generic = replace(study.coordination, predictions=[study.coordination.cases["par2"].generic])
    assert not other_objective(replace(study, coordination=generic))


def test_texts_name_settings_and_limits_as_they_are(files: ReportFiles, html: str) -> None:
    assert "raw\nsignals of 2,000 Hz" in html
    assert "band-pass 10 to 400 Hz, rectification, low-pass at 4 Hz" in html
    assert "marked: worse by more than 5 %, or" in html
    emg = files.config["emg"]
    envelope = {**emg["envelope"], "band_low_hz": 20, "cutoff_hz": 6}
    other = {**emg, "envelope": envelope, "simulation": {**emg["simulation"], "rate_hz": 1500}}
    study = read_study(replace(files, config={**files.config, "emg": other}))
    targets = {**study.targets, "validation": {"increase": 0.1}}
    shown = page_template("scapulohumeral.report", "calibration/chapter.html.j2").render(
        study=replace(study, targets=targets),
        emg="simulated EMG",
        calibration=calibration_chapter(study),
        validation=validation_chapter(study),
    )
    assert "signals of 1,500 Hz" in shown
    assert "band-pass 20 to 400 Hz, rectification, low-pass at 6 Hz" in shown
    assert "marked: worse by more than 10 %, or" in shown


def test_sensitivity_is_referred_to_only_where_it_changed_the_reaction_rate(
    html: str, html_of_tables: str
) -> None:
    words = "says how much hangs on it"
    assert (words in html, words in html_of_tables) == (False, True)
    assert "The ladder of variants says how much" not in html_of_tables


def test_targets_of_afterwards_are_marked_and_counted(html: str, study: Study) -> None:
    summary = html.split('id="verdicts"')[1].split("</section>")[0]
    count = len(re.findall(r"<strong>(?:holds|does not hold)</strong>", summary))
    words = f"8 of the {count} were added, and 5 made stricter, after results were seen"
    assert words in summary
    assert summary.count("<em>(added after results were seen)</em>") == 8
    assert summary.count("<em>(tightened after results were seen)</em>") == 5


def test_grey_line_is_said_to_be_no_recording(study: Study, cases: Cases, html: str) -> None:
    """The synthetic scapula is tracked with an error of three degrees, in one angle."""
    note = tracked_note(study, cases)
    assert "their upward rotations differ by up to 3.0 deg" in note
    chapter = html.split('<h2 id="prediction">')[1].split("<h2")[0]
    # In the caption and for readers of the screen, of two figures.
    assert chapter.count("differ by up to 3.0 deg") == 4
    assert tracked_note(study, replace(cases, participant="par3")) == ""


def test_captions_say_where_panels_have_their_own_scales(html: str) -> None:
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", html, re.S)
    own = [c.split('download="')[1].split('"')[0] for c in captions if "their own scales" in c]
    assert {"scalers.csv", "task_par2_shelf_reaching.csv", "prediction_emg_par2.csv"} <= set(own)
    (capacity,) = [caption for caption in captions if "partly lost" in caption]
    assert "do not start at zero" in capacity


def test_times_are_said_to_be_measured_beside_other_jobs(html: str) -> None:
    (target,) = re.findall(r"<td>(predictions: time of a solve.*?)</td>", html)
    (figure,) = re.findall(r"<figcaption>(Iterations and wall time.*?)<a", html, re.S)
    captions = re.findall(r"<caption>(Every solve; .*?|Time and memory.*?)</caption>", html)
    assert len(captions) == 2
    assert all("beside other jobs" in text for text in (target, figure, *captions))


def test_arms_that_do_not_fit_their_body_are_limits_by_name(html: str) -> None:
    limits = html.split('<h2 id="limits">')[1]
    assert "Masses of the arm do not fit the body (par2)" in limits


def test_rhythm_table_has_published_values_in_brackets(
    coordination: Coordination, cases: Cases
) -> None:
    table = published_rhythm_table(coordination.rhythm, cases)
    rows = {row[:2]: row for row in table.rows}
    assert table.columns[2:6] == ("start-30", "30-60", "60-90", "start-90")
    assert rows["frontal", "healthy"][2].endswith("(2.96)")
    assert "(" not in rows["frontal", "cuff_50"][2]
    # Whatever was predicted is compared with the recording over elevations that both pass.
    recorded, healthy = rows["frontal", "recorded"], rows["frontal", "healthy"]
    assert recorded[6].split(" (")[1] == healthy[6].split(" (")[1]
    assert recorded[6] != healthy[6]


def test_published_motion_is_measured_like_the_reproduced(cases: Cases) -> None:
    plane = published_plane(cases, "healthy", "frontal")
    assert plane is not None
    # Peaks of the published table; the synthetic elevations are shorter, and last less long.
    assert plane.peak_elevation_deg == pytest.approx(92.5, abs=1.0)
    assert plane.peak_upward_rotation_deg == pytest.approx(37.0, abs=1.0)
    scapular = published_plane(cases, "healthy", "scapular")
    assert scapular is not None
    assert scapular.peak_elevation_deg == pytest.approx(100.5, abs=1.5)
    assert published_plane(cases, "unknown", "frontal") is None
    assert published_plane(cases, "healthy", "of_another_study") is None


def test_published_motion_has_one_rhythm_wherever_it_is_told(cases: Cases) -> None:
    pose = published_pose(cases.published["healthy"])
    elsewhere = {
        (c.plane, c.phase): c.published
        for c in published_distances(pose, pose, {})
        if c.quantity == "rhythm_signed"
    }
    for (plane, phase), value in elsewhere.items():
        here = published_plane(cases, "healthy", plane).rhythm[phase].shr
        assert here == pytest.approx(value, nan_ok=True), (plane, phase)


def test_committed_tables_are_shown(html: str, html_of_tables: str) -> None:
    assert [words for words in COMMITTED.values() if words in html] == []
    assert [words for words in COMMITTED.values() if words not in html_of_tables] == []


def test_daily_tasks_are_shown_with_what_is_left_in_tracking(
    html: str, html_of_tables: str
) -> None:
    assert "13.91 (8.40; 11.00)" in html_of_tables
    assert "par2 shelf_reaching +13.9 deg" in html_of_tables, "its limit is missed by name"
    assert "daily tasks against their recordings" not in html


def test_band_ends_with_its_statistics() -> None:
    band = healthy_band("frontal", UPWARD_ROTATION, np.array([20.0, 30.0, 45.0, 130.0]))
    assert band is not None
    assert np.isnan(band.low[[0, 3]]).all()
    assert (band.high[1] - band.low[1]) / 2 == pytest.approx(3.2)
    assert band.low[1] < band.low[2]
    assert ELEVATION_DEG[0] == 30.0
    assert healthy_band("driving", UPWARD_ROTATION, np.array([45.0])) is None


def test_no_files_are_no_results() -> None:
    assert not any(vars(CoordinationFiles()).values())


def test_elements_that_push_are_drawn_and_said(
    cases: Cases, coordination: Coordination, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Passive fibres shorter than optimal push: the axis starts below zero and words say so."""
    drawn = []
    finish = Drawing.finish
    monkeypatch.setattr(Drawing, "finish", lambda d, *text: drawn.append(d) or finish(d, *text))
    force = cases.healthy.solution.muscle_force_N.copy()
    force[3, -1] = -2.5
    pushed = replace(cases.healthy, solution=replace(cases.healthy.solution, muscle_force_N=force))
    others = tuple(p for p in cases.predictions if p.condition.name != "healthy")
    figure = group_force_figure(replace(cases, predictions=(pushed, *others)))
    assert "up to 2.5 N" in figure.caption
    assert min(axes.get_ylim()[0] for axes in drawn[0].axes.flat) < -2.5
    assert largest_push([pushed, *others]) == (2.5, "par2 healthy, supra_1")
    assert largest_push(coordination.predictions) is None


def test_ladder_shows_every_rung_and_what_did_not_converge(coordination: Coordination) -> None:
    files = coordination.files
    predictions = read_predictions(files.predictions, files.prediction_summaries)
    chosen = {one.names["condition"]: one for one in predictions}
    rungs = {"published": "healthy", "alone_springs": "cuff_50", "upto_springs": "cuff_w2"}
    healthy = {"condition": chosen["healthy"].summary["condition"]}
    climbed = [
        replace(chosen[name], summary={**chosen[name].summary, **healthy, "variant": rung})
        for rung, name in rungs.items()
    ]
    table = ladder_table(climbed)
    assert table.groupby("kind").step.unique().explode().to_dict() == {
        "start": "published",
        "alone": "springs",
        "cumulative": "springs",
    }
    assert table[table.kind == "cumulative"].ur_peak_deg.isna().all()
    assert table[table.kind != "cumulative"].ur_peak_deg.notna().all()
    drawn = ladder_figure(table)
    assert "passive joints" in drawn.svg
    assert "authors' problem (solved here)" in drawn.svg
    # Not that of the table reports/ladder.csv.
    assert drawn.name != "ladder"
    numbers = downloaded(drawn)
    assert numbers.rung.tolist() == ["authors' problem (solved here)", "passive joints"]
    rows = ladder_rows(table)
    assert len(rows.rows) == 9
    assert {rows.rows[k][0] for k in rows.flagged} == {"upto_springs"}
