"""The report, rendered from a small synthetic study with one failed solve."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import synthetic_study
import yaml
from gap_files import HASHES, finished_diagnosis
from places import REPOSITORY

from scapulohumeral.errors import DataError
from scapulohumeral.gap.effects.base import Setup
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.result import Share, Shrinkage, to_json
from scapulohumeral.quantities.segment_angles import thorax_angles
from scapulohumeral.report import study as study_module
from scapulohumeral.report import targets
from scapulohumeral.report.assumptions import find_assumptions
from scapulohumeral.report.chapters import gap_chapter
from scapulohumeral.report.drawing import curves as kinematics
from scapulohumeral.report.gap import tables as gap_tables
from scapulohumeral.report.render import clavicle_point, render_report
from scapulohumeral.report.study import ReportFiles, Study, read_study
from scapulohumeral.report.tables import mass_judgement, masses, mean_errors
from scapulohumeral.report.tracking import figures
from scapulohumeral.report.tracking.gimbal import gimbal_lock, spike_sentence, spikes
from scapulohumeral.templates import page_template

pytestmark = pytest.mark.unit

TARGETS = yaml.safe_load(study_module.TARGETS.read_text(encoding="utf-8"))
DOUBT = "no reference trials: errors of the model itself lower all confidence"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> ReportFiles:
    """Two planes of one participant in both formulations; one Euler solve failed."""
    runs = [
        synthetic_study.solution("par2", trial, formulation, status)
        for trial, formulation, status in (
            ("frontal", "quaternion", "optimal"),
            ("frontal", "euler", "optimal"),
            ("scapular", "quaternion", "optimal"),
            ("scapular", "euler", "failed"),
        )
    ]
    return synthetic_study.write_study(tmp_path_factory.mktemp("study"), runs)


@pytest.fixture(scope="module")
def study(files: ReportFiles) -> Study:
    """The same, read."""
    return read_study(files)


@pytest.fixture(scope="module")
def html(files: ReportFiles) -> str:
    """The report of it."""
    return render_report(files)


@pytest.fixture(scope="module")
def html_of_one(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The report of one solve and one diagnosis.

    From the answer that the command writes, not from its Python objects.
    """
    folder = tmp_path_factory.mktemp("one")
    files = synthetic_study.write_study(
        folder, [synthetic_study.solution("par1", "sagittal", "quaternion")]
    )
    path = folder / "result.json"
    path.write_text(to_json(finished_diagnosis(warnings=(DOUBT,), hashes=HASHES)), encoding="utf-8")
    return render_report(replace(files, diagnoses=[path]))


def section(html: str, plane: str) -> str:
    """Part of the report about one plane."""
    return html.split(f'<details id="par2-{plane}"')[1].split("</details>")[0]


def test_failed_solve_is_shown_as_failed(html: str) -> None:
    assert "1 of 4 solves did not converge" in html
    assert "par2 scapular euler" in html
    failed = section(html, "scapular")
    assert failed.count(">NOT CONVERGED: Euler angles</text>") == 2, "watermark of both figures"
    assert "These curves are no result" in failed
    assert "NOT CONVERGED" not in section(html, "frontal")


def test_report_stands_alone(html: str) -> None:
    assert not re.search(r'(?:src|href)="(?!#|data:)', html)
    assert "@import" not in html
    assert "<metadata" not in html
    assert len(html) < 8_000_000


def test_same_files_give_the_same_report(files: ReportFiles, html: str) -> None:
    assert render_report(files) == html


def test_failed_solve_enters_no_mean(study: Study) -> None:
    found = {(error.formulation, error.key): error for error in mean_errors(study)}
    quaternion = found["quaternion", "rmse_clavicle_deg"]
    assert quaternion.solves == 2
    assert found["euler", "rmse_clavicle_deg"].solves == 1
    # Three degrees in one of two angles.
    assert quaternion.ours_deg == pytest.approx(3.0 / np.sqrt(2.0), abs=0.02)
    assert quaternion.why == "agrees within 1 deg"


def test_spike_of_the_euler_solve_is_found(study: Study) -> None:
    trial = study.trial("par2", "frontal")
    assert "delt_scap_6 alone has one here" in spike_sentence(trial)
    rows = {row[:3]: float(row[3]) for row in spikes(trial).rows}
    step = rows["delt_scap_6", "activation", "largest step"]
    assert step == pytest.approx(synthetic_study.SPIKE, abs=0.01)
    bend = rows["delt_scap_6", "activation", "largest second difference"]
    assert bend == pytest.approx(2 * synthetic_study.SPIKE, abs=0.01)
    assert gimbal_lock(study).figure is not None


@pytest.mark.parametrize(
    ("elements", "words"),
    [((), "none has one"), ((0,), "alone has one"), ((0, 2), "both have one")],
)
def test_it_is_said_in_how_many_of_the_elements_a_spike_is(study: Study, elements, words) -> None:
    """Half of what the paper shows is not all of it."""
    trial = study.trial("par2", "frontal")
    calm = trial.runs["quaternion"].solution.activation
    spiky = calm.copy()
    spiky[20, list(elements)] += 0.4
    solution = replace(trial.runs["euler"].solution, activation=spiky)
    euler = replace(trial.runs["euler"], solution=solution)
    assert words in spike_sentence(replace(trial, runs={**trial.runs, "euler": euler}))


def test_case_that_is_not_solved_is_said_to_be_missing(tmp_path: Path) -> None:
    runs = [synthetic_study.solution("par1", "sagittal", "quaternion")]
    finding = gimbal_lock(read_study(synthetic_study.write_study(tmp_path, runs)))
    assert "does not solve par2 frontal" in finding.finding
    assert finding.figure is None


def test_study_of_one_solve_is_rendered(html_of_one: str) -> None:
    assert "Participant par1, sagittal plane" in html_of_one
    assert "did not converge" not in html_of_one


def test_solution_and_summary_must_belong_together(files: ReportFiles) -> None:
    mixed = ReportFiles(**{**vars(files), "summaries": files.summaries[::-1]})
    with pytest.raises(DataError, match="Delete both files"):
        read_study(mixed)


def test_heavy_arm_is_flagged(study: Study) -> None:
    table = masses(study)
    assert table.flagged == {0}
    assert float(table.rows[0][6]) == pytest.approx(
        12.0 / (83.0 * 0.5 * (0.0494 + 0.0449)), abs=0.01
    )
    assert "implausible" in table.rows[0][-1]


@pytest.mark.parametrize(
    ("ratio", "judgement"), [(1.0, "plausible"), (1.4, "outside 57 to 109"), (0.4, "implausible")]
)
def test_judgement_of_masses(ratio: float, judgement: str) -> None:
    assert mass_judgement(83.0, ratio, known=False).startswith(judgement)


@pytest.mark.parametrize(
    ("mass_kg", "ratio", "judgement"),
    [(52.0, 1.0, "plausible"), (115.0, 1.4, "plausible"), (80.0, 2.5, "implausible")],
)
def test_a_participant_of_known_mass_is_judged_by_no_group(
    mass_kg: float, ratio: float, judgement: str
) -> None:
    assert mass_judgement(mass_kg, ratio, known=True).startswith(judgement)


def test_a_report_of_own_participants_claims_no_published_data(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = [synthetic_study.solution("par1", "sagittal", "quaternion")]
    files = synthetic_study.write_study(tmp_path, runs)
    published = ("zoufaond", "by number only", "Published masses", "and the paper&#39;s over")
    assert "zoufaond" in render_report(files)
    monkeypatch.setattr(study_module, "PUBLISHED", tmp_path)
    own = render_report(files)
    assert not [text for text in published if text in own]
    assert "No participant is one of the paper" in own
    assert "Body masses of single participants are not published" not in own


def test_assumption_goes_on_over_comment_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_text("# ASSUME no\n# wind.\nx = 1\n# other\ny = 2  # ASSUME flat\n", "utf-8")
    found = [(a.text, a.line) for a in find_assumptions([path])]
    assert found == [("no wind.", 1), ("flat", 5)]


def test_texts_that_bound_a_parameter_are_assumptions(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_text(
        '"""Texts with ASSUME are listed."""\n'
        'SOURCE = "measured; ASSUME: worse at worst"\n'
        'a = Param("tilt", 1.0, SOURCE), Param("turn", 2.0, source=SOURCE)\n'
        'b = Param(\n    "gain", 1.0,\n    "ASSUME at most "\n    "threefold")\n'
        'c = Param(name, 1.0, "ASSUME: unnamed")\n'
        'd = "measured"\n',
        "utf-8",
    )
    assert [(a.text, a.line) for a in find_assumptions([path])] == [
        ("tilt: measured; assumed: worse at worst", 2),
        ("turn: measured; assumed: worse at worst", 2),
        ("gain: at most threefold", 6),
        ("unnamed", 8),
    ]


def test_assumptions_of_the_effects_are_listed() -> None:
    """As many as the library marks, each with the parameter it is about, if its name is written."""
    folder = REPOSITORY / "src" / "scapulohumeral" / "gap" / "effects"
    found = {a.text for a in find_assumptions(sorted(folder.glob("*.py")))}
    setup = Setup(("infra",), ("EMG_a", "EMG_b"), (("EMG_a", "EMG_b"),), True)
    marked = {p.source for e in library(setup) for p in e.params if "ASSUME" in p.source}
    assert len(marked) >= 13
    for source in marked:
        said = re.split(r"ASSUME:?\s+", source)[-1]
        assert any(text.endswith(said) for text in found)
    assert "cost_factor: an order of magnitude; no cost is published" in found
    assert any(text.startswith("engagement_deg: capsules engage") for text in found)


def test_weight_of_the_clavicle_point(study: Study) -> None:
    point = clavicle_point(study)
    assert point["points_m"] == [0.5]
    assert point["share_at_ac"] == pytest.approx(0.14**2)


def summary_table() -> pd.DataFrame:
    """Two quaternion solves and a failed Euler one."""
    return pd.DataFrame(
        {
            "participant": "par1",
            "plane": ["frontal", "scapular", "frontal"],
            "formulation": ["quaternion", "quaternion", "euler"],
            "status": ["optimal", "optimal", "failed"],
            "constraint_violation": [1e-9, 1e-8, 1.0],
            "norm_rmse": [1e-14, 1e-12, 0.0],
            "rmse_clavicle_deg": [2.0, 4.0, 90.0],
            "rmse_thoracoscapular_deg": [4.0, 6.0, 90.0],
            "angle_humerus_deg": [1.0, 1.0, 90.0],
        }
    )


def test_verdicts_name_what_misses_the_target() -> None:
    verdicts = targets.verdicts(
        summary_table(),
        synthetic_study.quality().assign(participant="par1", formulation="euler"),
        TARGETS,
    )
    found = {v.name.split(",")[0]: v for v in verdicts}
    assert not found["solves"].holds
    assert found["solves"].worse == ("par1 frontal euler",)
    assert found["constraint violation"].holds
    assert found["clavicle without axial rotation"].holds
    assert found["clavicle without axial rotation"].worse == ("par1 scapular quaternion 4.00 deg",)
    assert not found["thoracoscapular"].holds
    assert found["deviation of quaternion norms from one"].holds
    worst = [v for v in verdicts if "worst rotation" in v.name]
    assert not worst[0].holds
    assert worst[0].worse == ("par1 euler pect_maj_c_2 6.000 mm",)


def test_limits_are_those_of_the_file() -> None:
    """A stricter file is missed by the same results."""
    geometry = synthetic_study.quality().assign(participant="par1", formulation="euler")
    strict = {
        "tracking": {
            **TARGETS["tracking"],
            "constraint_violation": 1e-9,
            "mean_error_deg": {"angle_humerus_deg": 0.9},
        },
        "geometry": {"median_mm": {"length_rmse_mm": 0.1}, "worst_mm": {}},
    }
    found = targets.verdicts(summary_table(), geometry, strict)
    assert [v.name.split(",")[0] for v in found if not v.holds] == [
        "solves",
        "constraint violation",
        "humerus",
        "muscle length",
    ]


def test_nothing_converged_does_not_hold() -> None:
    failed = summary_table().assign(status="failed")
    quality = synthetic_study.quality().assign(participant="par1", formulation="euler")
    verdicts = targets.verdicts(failed, quality, TARGETS)
    assert sum(v.value == "no converged solve" for v in verdicts) == 5
    assert not any(v.holds for v in verdicts if v.value == "no converged solve")


def test_humeral_angles_of_the_hanging_arm_are_left_out() -> None:
    pose = np.zeros((2, 13))
    pose[:, [0, 4, 8]] = 1.0
    pose[1, 8:12] = [np.cos(0.25), 0.0, 0.0, np.sin(0.25)]
    angles = thorax_angles(pose)
    assert np.isnan(angles[0, [6, 8]]).all()
    np.testing.assert_allclose(angles[1, [6, 7, 8]], [0.0, np.rad2deg(0.5), 0.0], atol=1e-9)


def test_no_peak_of_the_joint_reaction_is_cropped(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Panels share an axis, so a limit that is set by the first would hold for larger ones, too."""
    drawn = []
    monkeypatch.setattr(figures.Drawing, "finish", lambda drawing, *_: drawn.append(drawing))
    first, second = study.trials
    run = second.runs["quaternion"]
    stronger = replace(run.solution, reaction_N=5.0 * run.solution.reaction_N)
    heavy = replace(second, runs={"quaternion": replace(run, solution=stronger)})
    figures.reaction_figure([first, heavy])
    bottom, top = drawn[0].axes.flat[0].get_ylim()
    assert bottom == 0.0
    assert top > np.linalg.norm(stronger.reaction_N, axis=1).max()


def test_branch_is_the_one_of_the_reference() -> None:
    times = np.array([0.0, 1.0])
    near = kinematics.on_branch(
        np.array([[10.0], [-170.0]]), times, np.array([[5.0], [200.0]]), times
    )
    np.testing.assert_allclose(near, [[10.0], [190.0]])


def test_diagnosis_becomes_a_chapter_with_its_doubts(html_of_one: str) -> None:
    chapter = html_of_one.split('<h2 id="gap">')[1].split("<h2")[0]
    cells = ("yes", "0.002", "largest difference of any channel at any phase", "5.3 [4.4, 6.3]")
    assert "".join(f"<td>{cell}</td>" for cell in cells) in chapter
    assert "body/strength_loss/infra (probability 71 %): f0_factor 0.55 [0.45, 0.66]" in chapter
    assert "GH_rz at 35 to 88 %" in chapter
    removed = (
        "in sample: 86 % [75 %, 92 %]; expected on a new movement, not measured: none to remove"
    )
    assert removed in chapter
    assert DOUBT in chapter
    assert "No blind cases have been scored" in chapter
    assert "Cases of known cause were not run" in chapter


def test_abstention_names_no_cause() -> None:
    document = json.loads(
        to_json(
            finished_diagnosis(status="abstained", status_reason="no variant agrees", hashes=HASHES)
        )
    )
    table = gap_tables.verdict_table([document])
    assert table.flagged == {0}
    assert "not decided: no variant agrees" in table.rows[0]
    assert not any("strength_loss" in cell for cell in table.rows[0])
    assert table.rows[0][-1].endswith("by the most probable cause, which is not named")


def test_share_on_a_new_movement_is_expected_within_an_interval() -> None:
    shares = Shrinkage(Share(0.79, None, 3), None, Share(0.97, (-0.06, 1.0), 3), ())
    why = ("in_sample: of too few trials for an interval",)
    answer = finished_diagnosis(shrinkage=shares, warnings=why, hashes=HASHES)
    document = json.loads(to_json(answer))
    assert gap_tables.verdict_table([document]).rows[0][-1] == (
        "in sample: 79 %; expected on a new movement, not measured: 97 % [-6 %, 100 %]"
    )


@pytest.mark.parametrize(("code", "other"), [("c", False), ("d" * 64, True)])
def test_scores_of_other_code_say_so(code: str, other: bool) -> None:
    """The diagnosis is by code "c"."""
    document = json.loads(to_json(finished_diagnosis(hashes=HASHES)))
    rate = {"value": 0.5, "hits": 1, "n": 2, "wilson95": [0.1, 0.9]}
    names = ("false_alarms", "detection", "family_top1", "class_top1")
    scores = {**dict.fromkeys(names, rate), "set90": {"coverage": rate}, "cases": {"single": 2}}
    scores["amplitude"] = {"relative_error": {"median": 0.3, "n": 2}}
    card = {
        "file": "card.json", "sealed": {"date": "2026-01-01", "hash": "h"}, "look": "first look",
        "scored": {"cases": 2}, "answered": {"code": code}, "plants": {"P1": {"all": scores}},
    }  # fmt: skip
    study = SimpleNamespace(diagnoses=[document], blind_scores=[card], real_cases=pd.DataFrame())
    template = page_template("scapulohumeral.report", "gap/chapter.html.j2")
    text = template.render(gap=gap_chapter(study))
    assert "The diagnoses above are by code <code>c</code>." in text
    assert ("The scores below are of other code" in text) == other


def test_score_card_shows_rates_with_their_intervals_and_says_where_there_is_no_case() -> None:
    rate = {"value": 0.75, "hits": 3, "n": 4, "wilson95": [0.30, 0.95]}
    none = {"value": None, "hits": 0, "n": 0, "wilson95": None}
    modes = {"all": {"cases": {"null": 1, "single": 3}, "family_top1": rate, "detection": none}}
    [table] = gap_tables.score_tables({"plants": {"P1": modes}}).values()
    rows = {row[0]: row for row in table.rows}
    assert rows["cases"][1] == "4"
    assert rows["family right, most probable"][1] == "75 % [30 %, 95 %], 4 cases"
    assert rows["all effects that show: gap found"][1] == "no case"
    assert rows["time of a diagnosis, median [s]"][1] == "no case"
    modes["all"] |= {"seconds": {"median": 168.4, "n": 4}}
    [table] = gap_tables.score_tables({"plants": {"P1": modes}}).values()
    rows = {row[0]: row for row in table.rows}
    assert rows["time of a diagnosis, median [s]"][1] == "168 (4 cases)"


def test_rates_of_draws_with_the_same_rules_are_told_together() -> None:
    def card(rules: dict[str, str], hits: int, cases: int) -> dict[str, object]:
        rate = {"value": hits / cases, "hits": hits, "n": cases, "wilson95": [0.0, 1.0]}
        return {"rules": rules, "plants": {"P1": {"all": {"family_top1": rate}}}}

    old, new = {"large": "before"}, {"large": "now"}
    other_plant = {"rules": new, "plants": {"P2": {}}}
    table = gap_tables.together_table(
        [card(old, 9, 9), card(new, 1, 4), other_plant, card(new, 5, 6)]
    )
    assert table.columns == ("2 draws", "all", "bar")
    rows = {row[0]: row for row in table.rows}
    # Six of ten: Wilson's interval by hand.
    assert rows["family right, most probable"][1] == "60 % [31 %, 83 %], 10 cases"
    assert rows["class right"][1] == "no case"
    assert not gap_tables.together_table([card(old, 9, 9), card(new, 1, 4)]).rows
    assert not gap_tables.together_table([]).rows


def test_sets_are_told_of_single_effects_and_of_all_others_by_the_cases_of_any_card() -> None:
    def row(status: str, covered: bool | None, mode: str = "emg_reference") -> dict[str, object]:
        return {"plant": "P1", "mode": mode, "status": status, "covered": covered}

    single = [row("single", True), row("single", True), row("single", False, "motion_reference")]
    others = [row("null", True), row("unknown", True), row("pair", None), row("moved", None)]
    salted = [{**row("single", False), "plant": "S"}]
    modes = {"all": {"cases": {"single": 3}}, "emg_reference": {"cases": {"single": 2}}}
    card = {"rules": {}, "cases": [*single, *others, *salted], "plants": {"P1": modes}}
    [table] = gap_tables.score_tables(card).values()
    rows = {row[0]: row for row in table.rows}
    assert rows["90 % set holds the truth, single effects"][1].startswith("67 %")
    assert rows["90 % set holds the truth, single effects"][2].startswith("100 %")
    assert rows["90 % set holds the truth, all others"][1].endswith("2 cases")
    # What a card of an earlier draw did not score is not without a case.
    assert rows["channel with the largest change named"][1] == "not scored then"
    table = gap_tables.together_table([card, card])
    rows = {row[0]: row for row in table.rows}
    assert rows["90 % set holds the truth, single effects"][1].endswith("6 cases")
    assert rows["90 % set holds the truth, all others"][1].startswith("100 %")


def test_sets_of_committed_draws_hold_single_effects_less_often_than_others() -> None:
    """By hand, of the draws of 2026-11-29 04:12 and 07:56: 20 of 28, and 75 of 75."""
    folder = REPOSITORY / "reports" / "blind_scores"
    names = ("2026-11-29T041214Z", "2026-11-29T075648Z")
    cards = [json.loads((folder / f"{name}.json").read_text("utf-8")) for name in names]
    rows = {row[0]: row for row in gap_tables.together_table(cards).rows}
    single, others = (
        rows[f"90 % set holds the truth, {kind}"][1] for kind in ("single effects", "all others")
    )
    assert (single[:4], others[:5]) == ("71 %", "100 %")
    assert (single.split(", ")[-1], others.split(", ")[-1]) == ("28 cases", "75 cases")
    assert rows["channel with the largest change named"][1].endswith("14 cases")


def test_baselines_stand_below_what_is_counted_by_their_rule() -> None:
    names = [path for _, path, _ in gap_tables.SCORES]
    for group in ((), ("large",)):
        first = names.index((*group, "effect_top1"))
        below = [path for path in names if path[:-1] == (*group, "baselines")]
        assert names[first + 1 : first + 1 + len(below)] == below


def test_every_draw_of_blind_cases_stands_beside_the_others() -> None:
    rate = {"value": 0.5, "hits": 1, "n": 2, "wilson95": [0.1, 0.9]}
    error = {"relative_error": {"median": 0.3, "n": 2}}
    scores = dict.fromkeys(("false_alarms", "detection", "family_top1", "class_top1"), rate)
    scores |= {"set90": {"coverage": rate}, "amplitude": error}
    scores["cases"] = {"single": 2}
    cards = [
        {
            "file": f"{date}.json",
            "sealed": {"date": date},
            "look": "first look",
            "scored": {"cases": cases},
            "answered": {"code": "a" * 64},
            "plants": {"P1": {"all": scores}},
        }
        for date, cases in (("2026-01-01", 60), ("2026-02-01", 60), ("2026-03-01", 20))
    ]
    table = gap_tables.draw_table(cards)
    assert [row[0] for row in table.rows] == [f"2026-0{month}-01.json" for month in (1, 2, 3)]
    assert [row[1] for row in table.rows] == ["2026-01-01", "2026-02-01", "2026-03-01"]
    row = dict(zip(table.columns, table.rows[0], strict=True))
    assert row["family right"] == "50 % [10 %, 90 %], 2 cases"
    assert row["there: class right"] == "not scored then"
    assert row["amplitude error, median"] == "0.3 (2 cases)"
    both = gap_tables.draw_table([cards[0] | {"plants": {"P2": {"all": scores}, "S": {}}}])
    assert [row[2] for row in both.rows] == ["Persons simulated by OpenSim"]
    # The newest of the largest is shown whole.
    study = SimpleNamespace(diagnoses=[], blind_scores=cards, real_cases=pd.DataFrame())
    assert gap_chapter(study)["card"] is cards[1]


def test_history_of_draws_is_made_from_the_committed_score_cards() -> None:
    files = sorted((REPOSITORY / "reports" / "blind_scores").glob("*.json"))
    cards = [{**json.loads(file.read_text("utf-8")), "file": file.name} for file in files]
    table = gap_tables.draw_table(cards)
    assert len(files) >= 15
    simulated = [
        (card, card["plants"][plant]["all"])
        for card in cards
        for plant in ("P1", "P2")
        if plant in card["plants"]
    ]
    for (card, scores), cells in zip(simulated, table.rows, strict=True):
        row = dict(zip(table.columns, cells, strict=True))
        assert row["keys sealed"] == card["sealed"]["date"]
        # What the Makefile and the report say of the names of cards.
        own = row["card"] == f"{card['sealed']['date'].replace(':', '')}.json"
        assert own == (card["sealed"]["date"] >= "2026-11-28")
        for name, rate in (
            ("false alarms", scores["false_alarms"]),
            ("class right", scores["class_top1"]),
            ("90 % set holds the truth", scores["set90"]["coverage"]),
        ):
            low, high = (f"{100 * end:.0f} %" for end in rate["wilson95"])
            share = f"{100 * rate['hits'] / rate['n']:.0f} %"
            assert row[name] == f"{share} [{low}, {high}], {rate['n']} cases"
        assert ("large" in scores) == (row["there: class right"] != "not scored then")


def test_study_without_diagnosis_says_so(html: str) -> None:
    assert "This study diagnoses no gap." in html
