"""A wrong configuration is refused with key, reason, meaning, and a line that would do."""

import copy
from pathlib import Path

import pytest
import yaml

from scapulohumeral.configuration.check import (
    BENCH,
    BLIND,
    STUDY,
    check_config,
    checked,
    read_bench,
    read_blind,
    read_config,
)
from scapulohumeral.configuration.sections import StudyConfig
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.settings import (
    SETTINGS,
    VIEWS,
    GapSection,
    read_diagnosis_config,
    read_settings,
    sections_read,
    with_problem_of,
)

pytestmark = pytest.mark.unit

CONFIG = read_config()


def changed(place: str, value: object) -> dict:
    """The configuration with one value replaced, or removed if it is None."""
    config = copy.deepcopy(CONFIG)
    *sections, last = place.split(".")
    here = config
    for name in sections:
        here = here[name]
    here.pop(last, None)
    if value is not None:
        here[last] = value
    return config


def refusal(place: str, value: object) -> str:
    with pytest.raises(ConfigError) as error:
        check_config(changed(place, value), "x.yaml, ")
    return str(error.value)


def test_committed_files_are_allowed() -> None:
    check_config(CONFIG)
    assert read_blind(BLIND).cases.blind > read_blind(BLIND).cases.blind_small
    assert min(read_bench(BENCH).opty_muscles) > 0
    read_settings(read_diagnosis_config(STUDY))


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("geometry.posees", 1500, "Did you mean 'poses'? Keys there are: poses, held_out_poses,"),
        ("plane", ["frontal"], "Did you mean 'planes'?"),
        ("geometry.poses", -1, "key 'geometry.poses': -1; expected greater than or equal to 100."),
        ("solve.tolerance", "1e-6", "'1e-6'; expected a valid number."),
        ("solve.tolerance", True, "True; expected a valid number."),
        ("solve.max_iterations", 10.5, "10.5; expected a valid integer"),
        ("solve.hessian", "exactly", "expected 'automatic', 'exact', 'gauss-newton' or"),
        ("planes", ["frontal", "frontal"], "expected every name once, not frontal again"),
        ("planes", [], "expected at least 1 item"),
        ("geometry.scapula_turn_deg", [10, -30], "expected the lower one first"),
        ("geometry.scapula_turn_deg", [10], "expected at least 2 items"),
        ("geometry.girdle_turn_deg", -1, "-1; expected greater than or equal to 0"),
        ("calibration.force_bounds", [0.5, 99], "key 'calibration.force_bounds.1': 99; expected"),
        ("model", None, "key 'model': is missing; it is required."),
        ("model.masses", None, "key 'model.masses': is missing; it is required."),
        ("solve.tolerance", None, "key 'solve.tolerance': is missing; it is required."),
        ("weights.tracking.activation", None, "key 'weights.tracking.activation': is missing"),
        ("weights.tracking.activation", float("nan"), "expected a finite number"),
        ("prediction.conditions.healthy.capacity", 1.2, "healthy.capacity': 1.2; expected less"),
        ("prediction.conditions.Healthy", {}, "'Healthy'; expected"),
        ("participants", "par1", "expected a valid list"),
        ("solve", 3, "expected a dictionary"),
    ],
)
def test_reason_and_place_are_said(place: str, value: object, said: str) -> None:
    message = refusal(place, value)
    assert said in message
    assert message.startswith("Configuration, x.yaml, key '")


def test_meaning_and_a_line_that_would_do_are_said() -> None:
    message = refusal("solve.max_iterations", 0)
    assert "Meaning: Iterations of the last phase of a solve, after which it" in message
    assert message.endswith("Write for example: max_iterations: 1000")
    assert refusal("model.masses", "weighed").endswith("Write for example: masses: anthropometric")
    assert refusal("geometry.posees", 3).endswith("Write for example: poses: 2700")
    assert refusal("planes", ["Coronal"]).endswith("planes: [frontal, scapular, sagittal]")


def test_what_was_refused_is_no_example(tmp_path: Path) -> None:
    """Who edits the committed file, from which examples are read."""
    wrong = changed("solve.max_iterations", 0)
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(wrong), encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        checked(StudyConfig, wrong, "", tmp_path / "config.yaml")
    assert "Meaning: Iterations" in str(error.value)
    assert "Write for example" not in str(error.value)


def test_key_that_may_be_absent() -> None:
    check_config(changed("prediction.conditions.healthy_stiff.girdle_stiffness_Nm_per_rad", None))
    assert "-1" in refusal("prediction.conditions.healthy_stiff.girdle_stiffness_Nm_per_rad", -1)


@pytest.mark.parametrize("text", ["a: [1", "\tx: 1", "[]", "3", ""])
def test_file_that_holds_no_configuration(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match="x.yaml"):
        read_config(path)


def test_file_of_another_encoding(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes("report: \u00e4".encode("utf-16"))
    with pytest.raises(ConfigError, match="x.yaml"):
        read_config(path)


def test_settings_of_diagnoses_are_checked_alike(tmp_path: Path) -> None:
    section = yaml.safe_load(SETTINGS.read_text())
    for name, value in (("nodes", 3), ("session", {"emg_gain": 0.1}), ("tempreature", 2)):
        with pytest.raises(ConfigError, match=name):
            checked(GapSection, {**section, name: value}, "", SETTINGS)
    contradiction = {**section, "phase_functions": 20}
    with pytest.raises(ConfigError, match=r"^phase_functions: 20 of 21 nodes"):
        read_settings({**read_diagnosis_config(STUDY), "gap": contradiction})


def test_predictions_of_a_variant_solve_its_problem() -> None:
    config = read_diagnosis_config(STUDY)
    own = read_settings(config, "prediction")
    named = config["variants"]["named"]["published"]["problem"]
    found = read_settings(sections_read(with_problem_of(config, "published"), *VIEWS), "prediction")
    assert {key: getattr(found.choices, key) for key in named} == named
    assert found.weights == {**own.weights, "strength_exponent": named["strength_exponent"]}
    assert read_settings(with_problem_of(config, "study"), "prediction") == own
    with pytest.raises(ConfigError, match="variant other; expected one of: study, published"):
        with_problem_of(config, "other")


def test_settings_of_a_view() -> None:
    config = read_diagnosis_config(STUDY)
    tracked, predicted = (read_settings(config, view) for view in ("tracking", "prediction"))
    assert tracked.weights["stability"] == config["gap"]["stability"]
    healthy = config["prediction"]["conditions"]["healthy"]
    assert predicted.weights["stability"] == healthy["w_gh"]
    assert predicted.weights.keys() - {"stability"} == config["weights"]["prediction"].keys()
    part = sections_read(config, "tracking")
    assert read_settings(part) == tracked
    simulated = read_settings(part, of_simulations=True)
    share = part["gap"]["simulated"]
    assert share * tracked.noise.kinematics_deg.GH == simulated.noise.kinematics_deg.GH
    assert simulated.noise.phase_shift[0] == share * tracked.noise.phase_shift[0]
    assert simulated.noise.repeats == tracked.noise.repeats
    assert simulated.session.frame_deg == share * tracked.session.frame_deg
    with pytest.raises(KeyError):
        read_settings(part, "prediction")
