"""Cases of known cause: what is listed, where trials are, what the table says of an answer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gap_files import GAIN, HASHES, STRENGTH, finished_diagnosis
from synthetic_study import solution

from scapulohumeral.configuration.check import REAL_CASES, read_real_cases, read_simulator
from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.gap.benchmark.real_cases import COLUMNS, case_table, held_out, judged
from scapulohumeral.gap.benchmark.real_emg import read_emg
from scapulohumeral.gap.benchmark.real_trials import RealTrials
from scapulohumeral.gap.benchmark.simulated_motions import write_elevations
from scapulohumeral.gap.curve_files import LeftOutRow, table_of, write_curves
from scapulohumeral.gap.effects.base import Setup
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.labels import NO_GAP, matches
from scapulohumeral.gap.nominal.simulator import simulating_model
from scapulohumeral.gap.recording.participant_file import read_participant_file
from scapulohumeral.gap.recording.trials import read_trials
from scapulohumeral.gap.result import to_json
from scapulohumeral.laboratory.participant import task_and_repeat
from scapulohumeral.ocp.solution import write_solution

pytestmark = pytest.mark.unit

CASES = read_real_cases()


def answer(**changes) -> dict:
    return json.loads(to_json(finished_diagnosis(hashes=HASHES, **changes)))


def trials(recordings: Path, made: Path) -> RealTrials:
    return RealTrials(CASES, REAL_CASES, str(recordings), made)


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    """Empty files with the names of the recordings."""
    names = [f"{t}{load}{r}.csv" for t in ("ABD", "FLX", "SHRUG") for load in "02" for r in "123"]
    for folder, files in (
        ("hand_load", names),
        ("arm_support", ["kinova_martin_boire_f3_1.c3d", "kinova_martin_statique.c3d"]),
    ):
        (tmp_path / "given" / folder).mkdir(parents=True)
        for name in files:
            (tmp_path / "given" / folder / name).touch()
    return tmp_path / "given"


def test_right_answer() -> None:
    row = judged(answer(), [STRENGTH])
    assert (row["first"], row["first_p"], row["right"]) == (STRENGTH, 0.71, True)
    assert row["in_set90"]
    assert row["set_size"] == 2
    assert row["truth_p"] == pytest.approx(0.71)
    assert row["unexplained"] == 0.08
    assert "weak or other gain" in row["said"]
    assert "mvc_torque" in row["said"]


def test_any_of_several_causes_is_right_and_their_probabilities_add_up() -> None:
    row = judged(answer(), ["body/strength_loss/supra", GAIN, STRENGTH])
    assert row["right"]
    assert row["truth_p"] == pytest.approx(0.95)


def test_wrong_answer_and_truth_outside_the_library() -> None:
    row = judged(answer(), ["no_gap"])
    assert not row["right"]
    assert not row["in_set90"]
    assert row["truth_p"] == 0.0
    row = judged(answer(), [])
    assert row["truth"] == "none"
    assert row["truth_p"] == pytest.approx(0.05)


def test_half_of_a_pair_is_not_the_answer_but_said() -> None:
    pair = f"{STRENGTH} + {GAIN}"
    said = {**answer(), "set90": [pair, "none"]}
    row = judged(said, [STRENGTH])
    assert (row["in_set90"], row["in_pair90"]) == (False, True)
    assert not judged(said, ["body/hand_load"])["in_pair90"]


def test_what_made_simulations_is_an_input_of_their_diagnosis(tmp_path: Path) -> None:
    made_of = RealTrials(CASES, REAL_CASES, "none", tmp_path).inputs
    assert "simulator" not in made_of("published_healthy")
    file, *made = made_of("cuff_quarter")["simulator"]
    simulator = read_simulator(Path(file))
    assert made == [str(path) for path in simulator.files]
    assert simulator.variant == "published"
    with pytest.raises(ConfigError, match=r"nowhere.json is no file here"):
        simulating_model(replace(simulator, model="nowhere.json"))


def test_what_left_out_tasks_show_counts_before_what_held_out_trials_do(tmp_path: Path) -> None:
    def tabled(*rows: LeftOutRow) -> Path:
        write_curves({"left_out": table_of(LeftOutRow, rows)}, tmp_path)
        return tmp_path

    # Root mean squares over both tasks: sqrt(5) before and sqrt(4) after.
    both = tabled(LeftOutRow("lift", 1.0, 2.0), LeftOutRow("reach", 3.0, 2.0))
    assert held_out(answer(), both) == pytest.approx((5**0.5 - 2.0) / (5**0.5 - 1.0), abs=1e-5)
    assert held_out(answer(), tabled()) == answer()["shrinkage"]["held_out_trial"]["value"]
    assert held_out(answer(shrinkage=None), tmp_path / "nowhere") is None
    with pytest.raises(DataError, match="Diagnose the case again"):
        held_out(answer(), tmp_path / "nowhere")


def test_failed_solve_has_a_row_without_verdict(tmp_path: Path) -> None:
    failed = {
        "status": "failed", "status_reason": "SolveError: x", "gap": None, "candidates": (),
        "none_p": None, "no_gap_p": None, "set90": (), "classes": (), "shrinkage": None,
    }  # fmt: skip
    paths = [tmp_path / f"{name}.json" for name in ("right", "failed", "time")]
    paths[0].write_text(json.dumps(answer()), encoding="utf-8")
    write_curves({"left_out": table_of(LeftOutRow, [LeftOutRow("lift", 3.0, 1.5)])}, tmp_path)
    paths[1].write_text(json.dumps(answer(**failed)), encoding="utf-8")
    paths[2].write_text('{"s": 12.5, "cpu_time": 20.0}\n', encoding="utf-8")
    table = case_table(CASES, ["load", "support"], paths[:2], [paths[2]] * 2)
    assert tuple(table.columns) == COLUMNS
    assert list(table.present.isna()) == [False, True]
    assert list(table.status_reason) == ["", "SolveError: x"]
    assert list(table.seconds) == [12.5, 12.5]
    assert list(table.core_seconds) == [20.0, 20.0]
    assert list(table.code) == [HASHES["code"][:8]] * 2
    assert table.held_out[0] == 0.75
    assert table.truth[0] == "body/hand_load"
    with pytest.raises(DataError, match="Run the diagnosis again"):
        case_table(CASES, ["load"], paths[:1], [tmp_path / "nowhere"])


def test_committed_cases() -> None:
    nulls = [CASES.cases[name] for name in CASES.of_kind("no_effect")]
    assert len(nulls) >= 24
    assert {case.person for case in nulls} == {"hand_load", "hand_load_emg", "arm_support"}
    assert all(case.truth == ["no_gap"] for case in nulls)
    contents = [(c.person, c.test, c.reference, c.view, c.spoilt) for c in CASES.cases.values()]
    assert len(set(map(repr, contents))) == len(contents)


def test_truths_are_answers_that_the_library_can_give() -> None:
    """A truth that no answer can match would count as missed for ever."""
    setup = Setup(("supra", "infra"), (), (), False)
    setups = (setup, replace(setup, of_one_movement=True))
    labels = {NO_GAP, *(effect.label for one in setups for effect in library(one))}
    for name, case in CASES.cases.items():
        for truth in case.truth:
            assert any(matches(label, truth) for label in labels), name


def test_sides_of_measured_cases_are_whole_and_apart(recordings: Path, tmp_path: Path) -> None:
    """Every pattern means files, no file is on both sides, and a null has three repeats a task."""
    for name, case in CASES.cases.items():
        if case.person not in CASES.measured:
            continue
        person = CASES.measured[case.person]
        folder = recordings / person.folder
        test, reference = (
            {path for pattern in side for path in folder.glob(pattern)}
            for side in (case.test, case.reference)
        )
        assert test, name
        assert reference, name
        # Spoilt trials are others than those that they are made from.
        assert case.spoilt or not test & reference, name
        ratio = 2 if case.kind == "no_effect" or not test & reference and case.spoilt else 1
        assert len(reference) == ratio * len(test), name
        if person.emg is None:
            found = trials(recordings, tmp_path).inputs(name)["trials"]
            assert {Path(path) for path in found} == test | reference
    assert trials(recordings, tmp_path).patterns("load_shrug")["test"] == [
        str(recordings / "hand_load" / "SHRUG2[123].csv")
    ]


def test_trials_of_a_person_with_emg_are_made_of_the_recordings_and_its_table(
    recordings: Path, tmp_path: Path
) -> None:
    files, made = trials(recordings, tmp_path), tmp_path / "hand_load_emg/with_emg"
    assert files.inputs("load_emg")["trials"] == str(made)
    assert files.patterns("load_emg_flexion") == {
        "test": [str(made / "FLX2[123].csv")],
        "reference": [str(made / "FLX0[123].csv")],
    }
    given = files.with_emg("hand_load_emg")
    assert given["emg"] == CASES.measured["hand_load_emg"].emg
    names = {Path(path).stem for path in given["trials"]}
    assert names == {f"{task}{load}{k}" for task in ("ABD", "FLX") for load in "02" for k in "123"}


def test_spoilt_trials_are_tested_and_the_recorded_ones_are_the_reference(
    recordings: Path, tmp_path: Path
) -> None:
    files = trials(recordings, tmp_path)
    given = recordings / "hand_load"
    assert files.unspoilt("skin_one") == [str(given / "*03.csv")]
    assert files.patterns("skin_one") == {
        "test": [str(tmp_path / "spoilt/skin_one/*03.csv")],
        "reference": [str(given / "*0[12].csv")],
    }
    assert files.inputs("skin_one")["spoilt"] == str(tmp_path / "spoilt/skin_one")
    assert "spoilt" not in files.sources("skin_one")


def test_an_artefact_needs_its_error(tmp_path: Path) -> None:
    path = tmp_path / "cases.yaml"
    text = REAL_CASES.read_text(encoding="utf-8")
    path.write_text(text.replace("kind: artefact", "kind: effect", 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"cases\.skin_one\.spoilt': expected for kind artefact"):
        read_real_cases(path)


def test_markers_are_converted_and_motions_cut(recordings: Path, tmp_path: Path) -> None:
    made = tmp_path / "made"
    files = trials(recordings, made)
    assert files.markers("arm_support") == {
        "recordings": [str(recordings / "arm_support" / "kinova_martin_boire_f3_1.c3d")],
        "map": "config/recordings/arm_support.yaml",
    }
    assert files.inputs("support") == {"participant": str(made / "arm_support/participant.yaml")}
    cut = files.inputs("cuff_limited")["trials"]
    assert cut == [str(made / "published/rc_limited"), str(made / "published/healthy")]


@pytest.mark.parametrize("folder", ["none", "nowhere"])
def test_missing_recordings_are_refused_with_the_remedy(folder: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="make real RECORDINGS=FOLDER"):
        trials(Path(folder), tmp_path).inputs("load")


def test_folder_without_the_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "hand_load").mkdir()
    with pytest.raises(ConfigError, match=r"no file \*2\[123\]\.csv"):
        trials(tmp_path, tmp_path).inputs("load")


def test_case_of_an_unknown_person_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cases.yaml"
    text = REAL_CASES.read_text(encoding="utf-8")
    path.write_text(text.replace("person: hand_load", "person: hand_laod", 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"cases\.load\.person': 'hand_laod'"):
        read_real_cases(path)


def test_participants_of_the_cases_can_be_read(repository: Path) -> None:
    file = read_participant_file(repository / CASES.measured["hand_load"].participant, "published")
    assert file.trials["SHRUG23"].task == "SHRUG"
    assert file.trials["SHRUG23"].repeat == 3
    assert file.participant.model.total_mass_kg == pytest.approx(24.69)


def test_every_trial_with_emg_has_it_over_its_movement(repository: Path) -> None:
    about = CASES.measured["hand_load_emg"]
    file = read_participant_file(repository / about.participant, "published")
    for trial in file.trials:
        emg = read_emg(repository / about.emg, trial, np.linspace(0.0, 11.0, 56))
        assert list(emg)[1:] == list(file.participant.emg_channels), trial
        assert emg.iloc[:, 1:].to_numpy().max() <= 1.0, trial
        assert np.ptp(emg.iloc[:, 1:].to_numpy(), axis=0).min() > 0.15, trial


def test_emg_is_interpolated_in_time_and_stays_beyond_its_ends(tmp_path: Path) -> None:
    table = tmp_path / "emg.csv"
    table.write_text(
        "trial,time_s,EMG_a\none,1.0,0.2\none,2.0,0.4\nother,0.0,0.9\n", encoding="utf-8"
    )
    found = read_emg(table, "one", np.array([0.0, 1.5, 3.0]))
    assert found["EMG_a"].tolist() == pytest.approx([0.2, 0.3, 0.4])
    assert found["time"].tolist() == [0.0, 1.5, 3.0]
    with pytest.raises(DataError, match=r"emg\.csv, trial none: .*expected rows of that trial"):
        read_emg(table, "none", np.array([0.0]))
    table.write_text("trial,time,EMG_a\none,1.0,0.2\n", encoding="utf-8")
    with pytest.raises(DataError, match="time_s"):
        read_emg(table, "one", np.array([0.0]))


def test_published_elevations_raise_and_lower_the_arm(repository: Path, tmp_path: Path) -> None:
    motions = CASES.simulated["published"].motions
    write_elevations(repository / motions["healthy"], tmp_path)
    paths = sorted(tmp_path.glob("*.csv"))
    found, _ = read_trials(paths, {})
    assert [trial.task for trial in found] == ["frontal", "sagittal", "scapular"]
    for trial in found:
        opening = trial.angles_rad[:, 7]
        assert np.rad2deg(opening.max() - opening[[0, -1]].max()) > 30.0
        assert 2.5 < np.ptp(trial.time_s) < 3.0


def test_elevations_of_a_stored_solution(tmp_path: Path) -> None:
    solved = solution("par2", "frontal", "quaternion")
    planes = {"frontal": [0, 10], "sagittal": [12, 21]}
    solved = replace(solved, header={**solved.header, "planes": planes})
    write_solution(solved, tmp_path / "a.npz")
    write_elevations(tmp_path / "a.npz", tmp_path / "cut")
    lengths = {
        path.stem: len(path.read_text().splitlines()) - 1 for path in (tmp_path / "cut").iterdir()
    }
    assert lengths == {"frontal": 10, "sagittal": 9}


def test_names_of_recordings_say_task_and_repeat(recordings: Path) -> None:
    for person, about in CASES.converted.items():
        stems = [file.stem for file in (recordings / person).glob("*_[0-9].c3d")]
        found = task_and_repeat(about.tasks, stems)
        assert set(found) == set(stems)
        assert {entry["task"] for entry in found.values()} == {"boire"}
