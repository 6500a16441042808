"""What a calibration says of its scalers, how it is scored, and who uses it."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from emg_study import CHANNELS, CONFIG, ENVELOPE
from muscle_record import muscle_record
from small_arm import NAMES
from small_posed import small_model, small_settings, small_tracked
from synthetic_study import PARTICIPANTS

from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.emg.envelope import Envelopes, write_envelopes, write_failed_envelopes
from scapulohumeral.errors import ConfigError, DataError, SolveError, StoppedError
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solution import read_solution, write_solution
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.problems.calibrated_groups import muscle_groups
from scapulohumeral.problems.composite import composite_target
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.stages import calibration
from scapulohumeral.stages.calibration import (
    CalibrationFiles,
    CalibrationSettings,
    calibrate,
    calibrated_muscles,
    describe,
    read_scalers,
)
from scapulohumeral.stages.calibration_score import recovery_table, score
from scapulohumeral.stages.refinement import Refined, RefinementSettings

pytestmark = pytest.mark.unit

SECTION = yaml.safe_load((CONFIG / "config.yaml").read_text(encoding="utf-8"))["calibration"]
TABLE = CONFIG / "emg" / "channels.csv"
GROUPS = Scalers(("upper", "lower"), np.eye(2, dtype=bool))
SETTINGS = CalibrationSettings(
    solve=small_settings(emg=2.0, parameters=4.0),
    pause_s=1.0,
    force_bounds=(0.5, 1.5),
    fibre_bounds=(0.7, 1.3),
    envelope=ENVELOPE,
    refinement=RefinementSettings(**SECTION["refinement"]),
    identifiable={"force": 0.15, "fibre": 0.08},
)


def test_window_whose_gain_is_not_known_is_refused_before_the_solve():
    with pytest.raises(ConfigError, match=r"mvc_window_s: 0.5; .* measured for 0, 1, 3 s"):
        replace(SETTINGS, envelope=replace(ENVELOPE, mvc_window_s=0.5))


def refined(values, sd) -> Refined:
    """A refined result with independent scalers."""
    covariance = np.diag(np.ravel(sd) ** 2)
    return Refined(np.array(values), covariance, np.ones(2), 1.0, True, Start(np.zeros(1)), [])


def test_interval_and_identifiability_of_each_scaler():
    # A half width of 90 % is 1.645 standard deviations: force 0.082, 0.164; fibre 0.082, 0.016.
    found = refined([[1.2, 0.9], [1.05, 0.95]], np.array([[0.05, 0.10], [0.05, 0.01]]))
    paper = np.array([[1.3, 1.0], [1.1, 0.9]])
    groups = describe(GROUPS, found, paper, SETTINGS)
    assert list(groups) == ["upper", "lower"]
    assert groups["upper"]["force"] == {
        "value": 1.2,
        "ci90": pytest.approx([1.2 - 0.08224, 1.2 + 0.08224], abs=1e-5),
        "identifiable": True,
        "at_bound": False,
        "paper_problem": 1.3,
    }
    assert not groups["lower"]["force"]["identifiable"]
    assert not groups["upper"]["fibre"]["identifiable"]
    assert groups["lower"]["fibre"]["identifiable"]
    assert groups["lower"]["fibre"]["paper_problem"] == 0.9


@pytest.mark.parametrize(("force", "fibre"), [(1.5, 0.7), (0.5, 1.3)])
def test_scaler_at_its_bound_is_not_identified(force, fibre):
    found = refined([[force, 1.0], [fibre, 1.0]], np.full((2, 2), 0.001))
    groups = describe(GROUPS, found, np.ones((2, 2)), SETTINGS)
    for kind in ("force", "fibre"):
        assert groups["upper"][kind]["at_bound"]
        assert not groups["upper"][kind]["identifiable"]
        assert groups["lower"][kind]["identifiable"]


def entry(value, half, identifiable=True, paper=1.0) -> dict:
    """One scaler of a calibration."""
    return {
        "value": value,
        "ci90": [value - half, value + half],
        "identifiable": identifiable,
        "at_bound": False,
        "paper_problem": paper,
    }


def scored(folder, groups: dict, simulated: bool = True) -> dict:
    """Score a calibration against a plant whose force is 1.25 and whose fibres are 0.8 times."""
    plant = {
        "schema": "plant/1",
        "force": dict.fromkeys(CHANNELS.groups, 1.25),
        "fibre": dict.fromkeys(CHANNELS.groups, 0.8),
        "activation_time": 1.0,
        "deactivation_time": 1.0,
    }
    paths = [folder / name for name in ("scalers.json", "plant.yaml", "scored.json")]
    document = {"schema": "calibration/1", "emg_simulated": simulated, "groups": groups}
    paths[0].write_text(json.dumps(document), encoding="utf-8")
    if simulated:
        paths[1].write_text(yaml.safe_dump(plant), encoding="utf-8")
    score(paths[0], paths[1] if simulated else None, TABLE, paths[2])
    return json.loads(paths[2].read_text(encoding="utf-8"))


def test_score_compares_with_the_plant(tmp_path):
    groups = {
        name: {"force": entry(1.25, 0.1, paper=1.5), "fibre": entry(0.8, 0.05, False)}
        for name in CHANNELS.groups
    }
    # One force interval misses, one fibre is known; both errors are 20 %.
    groups[CHANNELS.groups[0]]["force"] = entry(1.0, 0.2, paper=1.25)
    groups[CHANNELS.groups[1]]["fibre"] = entry(0.64, 0.2)
    document = scored(tmp_path, groups)
    missed = document["groups"][CHANNELS.groups[0]]["force"]
    assert missed["plant"] == 1.25
    assert missed["error"] == pytest.approx(-0.2)
    assert missed["paper_problem_error"] == pytest.approx(0.0)
    assert not missed["covered"]
    count = len(CHANNELS.groups)
    scores = document["scores"]
    assert scores["force"] == {
        "identifiable": count,
        "groups": count,
        "median_error": pytest.approx(0.0),
        "median_error_all": pytest.approx(0.0),
        "median_error_paper_problem": pytest.approx(0.2),
    }
    assert scores["fibre"]["identifiable"] == 1
    assert scores["fibre"]["median_error"] == pytest.approx(0.2)
    assert scores["fibre"]["median_error_all"] == pytest.approx(0.0)
    assert scores["coverage90"] == pytest.approx(count / (count + 1))


def test_nothing_identifiable_has_no_median(tmp_path):
    kinds = {"force": entry(1.0, 0.9, False), "fibre": entry(1.0, 0.9, False)}
    scores = scored(tmp_path, dict.fromkeys(CHANNELS.groups, kinds))["scores"]
    assert scores["force"]["median_error"] is None
    assert scores["force"]["median_error_all"] == pytest.approx(0.2)
    assert scores["coverage90"] is None


def test_measured_emg_has_no_score(tmp_path):
    kinds = {"force": entry(1.0, 0.1), "fibre": entry(1.0, 0.1)}
    document = scored(tmp_path, dict.fromkeys(CHANNELS.groups, kinds), simulated=False)
    assert document["scores"] is None
    assert "plant" not in document["groups"][CHANNELS.groups[0]]["force"]


def test_simulated_emg_needs_its_plant(tmp_path):
    path = tmp_path / "scalers.json"
    path.write_text(json.dumps({"emg_simulated": True, "groups": {}}), encoding="utf-8")
    with pytest.raises(ConfigError, match="scalers.json: its EMG was simulated"):
        score(path, None, TABLE, tmp_path / "scored.json")


def test_calibrated_muscles_are_scaled_by_group(tmp_path):
    record = muscle_record()
    scalers = muscle_groups(record, CHANNELS)
    count = len(scalers.names)
    values = np.array([1.0 + 0.01 * np.arange(count), 0.9 - 0.01 * np.arange(count)])
    found = refined(values, np.full((2, count), 0.01))
    groups = describe(scalers, found, np.ones((2, count)), SETTINGS)
    # The order of groups in the file does not matter.
    path = tmp_path / "scalers.json"
    path.write_text(json.dumps({"groups": dict(reversed(groups.items()))}), encoding="utf-8")
    np.testing.assert_array_equal(read_scalers(path, scalers), values)

    generic = calibrated_muscles(record, TABLE, None)
    np.testing.assert_array_equal(
        generic.max_isometric_force, muscle_parameters(record).max_isometric_force
    )
    muscles = calibrated_muscles(record, TABLE, path)
    for column, members in enumerate(scalers.members):
        force = muscles.max_isometric_force[members] / generic.max_isometric_force[members]
        fibre = muscles.optimal_fibre_length[members] / generic.optimal_fibre_length[members]
        np.testing.assert_allclose(force, values[0, column])
        np.testing.assert_allclose(fibre, values[1, column])
    outside = ~scalers.members.any(axis=0)
    assert outside.any()
    np.testing.assert_array_equal(
        muscles.max_isometric_force[outside], generic.max_isometric_force[outside]
    )


@pytest.fixture
def elevation(quaternion_equations, tmp_path, monkeypatch):
    """Function that writes a tracked elevation of the small arm, and returns what follows it."""
    person = Path(shutil.copytree(PARTICIPANTS / "par2", tmp_path / "par2")) / "participant.yaml"
    monkeypatch.setattr(calibration, "load_model", lambda _: small_model(quaternion_equations))
    monkeypatch.setattr(calibration, "hashes", lambda *_: {})
    # One channel for each muscle of the small arm.
    channels = tmp_path / "channels.csv"
    rows = "".join(f"{name},{name},{name},{name},\n" for name in NAMES)
    channels.write_text(f"channel,group,scaled_muscle,elements,neighbours\n{rows}", "utf-8")

    def elevation(status: str = "optimal") -> CalibrationFiles:
        solved = small_tracked("frontal", status)
        write_solution(solved, tmp_path / "frontal.npz")
        time, flat = solved.time_s[[0, -1]], np.full((2, len(NAMES)), 0.3)
        write_envelopes(tmp_path / "emg.csv", Envelopes(NAMES, time, flat, simulated=True))
        return CalibrationFiles(
            model=ModelFiles(person, *[Path("unread")] * 4),
            channels=channels,
            tracked=[tmp_path / "frontal.npz"],
            envelopes=[tmp_path / "emg.csv"],
        )

    return elevation


def test_hand_holds_what_it_held_when_the_elevations_were_recorded(elevation):
    files = elevation()
    person = files.model.participant
    text = person.read_text(encoding="utf-8")
    person.write_text(text.replace("hand_load_kg: 0.0", "hand_load_kg: 1.5"), encoding="utf-8")
    study = calibration._read(files, SETTINGS)
    posed = study.posed(composite_target(study.composite), SETTINGS.solve)
    assert unpack(posed.parameters)["mass_load"] == 1.5


def test_calibration_to_a_motion_without_a_solution_is_written_as_failed(elevation, tmp_path):
    files = elevation("failed")
    written = tmp_path / "paper.npz", tmp_path / "paper.summary.json"
    scalers, log = tmp_path / "scalers.json", tmp_path / "solver.log"
    calibrate(files, SETTINGS, written, scalers, log)
    with pytest.raises(SolveError, match="tracking of frontal failed"):
        read_solution(written[0])
    assert "tracking of frontal failed" in log.read_text(encoding="utf-8")
    with pytest.raises(SolveError, match=r"scalers.json: calibration failed: tracking of frontal"):
        calibrated_muscles(muscle_record(), TABLE, scalers)
    # EMG of a plant, but no plant: nothing is compared with it.
    score(scalers, None, TABLE, tmp_path / "scored.json")
    document = json.loads((tmp_path / "scored.json").read_text(encoding="utf-8"))
    assert (document["status"], document["scores"], document["groups"]) == ("failed", None, {})
    with pytest.raises(SolveError, match=r"scored.json: calibration failed"):
        recovery_table({"same": tmp_path / "scored.json"})


def test_calibration_to_emg_that_could_not_be_simulated_is_written_as_failed(elevation, tmp_path):
    files = elevation()
    write_failed_envelopes(files.envelopes[0], NAMES, "simulated EMG of composite: no way")
    written = tmp_path / "paper.npz", tmp_path / "paper.summary.json"
    calibrate(files, SETTINGS, written, tmp_path / "scalers.json", tmp_path / "solver.log")
    document = json.loads((tmp_path / "scalers.json").read_text(encoding="utf-8"))
    assert (document["status"], document["emg_simulated"]) == ("failed", True)
    assert "simulated EMG of composite: no way" in document["message"]


def test_calibration_that_was_asked_to_end_writes_nothing(elevation, tmp_path, monkeypatch):
    def stop(*_):
        raise StoppedError("stopped by SIGTERM")

    monkeypatch.setattr(calibration, "solve_posed", stop)
    scalers = tmp_path / "scalers.json"
    written = tmp_path / "paper.npz", tmp_path / "paper.summary.json"
    with pytest.raises(StoppedError):
        calibrate(elevation(), SETTINGS, written, scalers, tmp_path / "solver.log")
    assert not scalers.exists()


def test_calibration_that_did_not_converge_is_no_result(tmp_path):
    record = muscle_record()
    kinds = {kind: entry(1.1, 0.1) for kind in ("force", "fibre")}
    document = {"groups": dict.fromkeys(CHANNELS.groups, kinds), "iterations": 8}
    path = tmp_path / "par2_scalers.json"
    path.write_text(json.dumps(document | {"status": "not converged"}), encoding="utf-8")
    with pytest.raises(SolveError, match=r"par2_scalers.json: .* not converge in 8 iterations"):
        calibrated_muscles(record, TABLE, path)
    path.write_text(json.dumps(document | {"status": "converged"}), encoding="utf-8")
    assert (read_scalers(path, muscle_groups(record, CHANNELS)) == 1.1).all()


def test_scalers_that_cannot_be_read_name_their_file(tmp_path):
    record = muscle_record()
    path = tmp_path / "par2_scalers.json"
    path.write_text('{"groups": {"serratus"', encoding="utf-8")
    with pytest.raises(DataError, match="par2_scalers.json: cannot be read as JSON"):
        calibrated_muscles(record, TABLE, path)
    groups = {name: {"force": entry(1.1, 0.1)} for name in CHANNELS.groups}
    path.write_text(json.dumps({"groups": groups}), encoding="utf-8")
    missing = f"par2_scalers.json, groups: no {CHANNELS.groups[0]} fibre"
    with pytest.raises(DataError, match=missing):
        calibrated_muscles(record, TABLE, path)
