"""The arm behind simulated EMG: its parameters, and that nobody else knows them."""

import ast
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from emg_study import CHANNELS, CONFIG, SIMULATION
from muscle_record import muscle_record
from small_arm import NAMES
from small_posed import small_model, small_settings, small_tracked
from synthetic_study import PARTICIPANTS, solution

from scapulohumeral import provenance
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.emg.channels import read_channels
from scapulohumeral.emg.recording import read_recording
from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.ocp.solution import read_solution, write_solution
from scapulohumeral.problems.calibrated_groups import muscle_groups
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.stages import reference_plant
from scapulohumeral.stages.reference_plant import (
    PlantFiles,
    PlantOutputs,
    plant_muscles,
    read_plant,
    scaler_values,
    simulate_contractions,
    simulate_elevations,
    simulate_task,
)

pytestmark = pytest.mark.unit

PLANTS = sorted((CONFIG / "plant").glob("*.yaml"))
FIRST = CHANNELS.groups[0]


def changed_plant(folder: Path, change) -> Path:
    """The plant of par2 with a change applied to its document."""
    document = yaml.safe_load((CONFIG / "plant" / "par2.yaml").read_text(encoding="utf-8"))
    change(document)
    path = folder / "plant.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


@pytest.mark.parametrize("path", PLANTS, ids=lambda path: path.stem)
def test_plants_of_the_study_lie_within_the_bounds_of_a_calibration(path):
    bounds = yaml.safe_load((CONFIG / "config.yaml").read_text(encoding="utf-8"))["calibration"]
    plant = read_plant(path, CHANNELS.groups)
    for kind in ("force", "fibre"):
        low, high = bounds[f"{kind}_bounds"]
        assert all(low < value < high for value in getattr(plant, kind).values())
    changed = any(value != 1.0 for value in plant.force.values())
    assert changed == (path.stem != "unchanged")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda d: d.update(schema="plant/2"), "plant/1"),
        (lambda d: d.pop("schema"), "plant/1"),
        (lambda d: d["force"].pop(FIRST), f"force.*{FIRST}"),
        (lambda d: d["fibre"].update(biceps=1.0), "fibre"),
        (lambda d: d["fibre"].update({FIRST: 0.0}), "fibre"),
        (lambda d: d.update(activation_time=-1.0), "activation_time"),
        (lambda d: d.pop("deactivation_time"), "deactivation_time"),
        (lambda d: d.update(tendon=1.0), "tendon"),
    ],
)
def test_wrong_plants_are_refused(tmp_path, change, named):
    with pytest.raises(ConfigError, match=named) as refusal:
        read_plant(changed_plant(tmp_path, change), CHANNELS.groups)
    assert "plant.yaml" in str(refusal.value)


def test_muscles_of_the_plant_are_those_of_the_participant_times_its_factors():
    plant, record = read_plant(PLANTS[1], CHANNELS.groups), muscle_record()
    own, participant = plant_muscles(record, CHANNELS, plant), muscle_parameters(record)
    group_of = dict(zip(CHANNELS.scaled_muscles, CHANNELS.groups, strict=True))
    groups = [group_of.get(group) for group in record.muscle_groups]
    assert None in groups
    for name, kind in (("max_isometric_force", "force"), ("optimal_fibre_length", "fibre")):
        factors = [getattr(plant, kind).get(group, 1.0) for group in groups]
        np.testing.assert_allclose(getattr(own, name), getattr(participant, name) * factors)
    for kind in ("activation_time", "deactivation_time"):
        factor = getattr(plant, kind)
        np.testing.assert_allclose(getattr(own, kind), factor * getattr(participant, kind))
    np.testing.assert_array_equal(own.tendon_slack_length, participant.tendon_slack_length)


def test_scaler_values_are_in_the_order_of_the_groups():
    plant, scalers = (
        read_plant(PLANTS[0], CHANNELS.groups),
        muscle_groups(muscle_record(), CHANNELS),
    )
    values = scaler_values(plant, scalers)
    assert values.shape == (2, len(CHANNELS.groups))
    assert values[0, 2] == plant.force[CHANNELS.groups[2]]
    assert values[1, -1] == plant.fibre[CHANNELS.groups[-1]]


def test_the_plant_holds_what_the_participant_held(tmp_path, monkeypatch):
    person = Path(shutil.copytree(PARTICIPANTS / "par2", tmp_path / "par2")) / "participant.yaml"
    text = person.read_text(encoding="utf-8")
    person.write_text(text.replace("hand_load_kg: 0.0", "hand_load_kg: 1.5"), encoding="utf-8")
    tracked = [tmp_path / "frontal.npz"]
    write_solution(solution("par2", "frontal", "quaternion"), *tracked)

    class PosedError(Exception):
        """What the motion is posed with."""

    def pose(*given):
        raise PosedError(given[-1])

    monkeypatch.setattr(reference_plant, "_pose", pose)
    files = PlantFiles(Path("unread"), Path("unread"), ModelFiles(person, *[Path("unread")] * 4))
    with pytest.raises(PosedError) as posed:
        simulate_elevations(files, tracked, small_settings(), 1.0, SIMULATION, None)
    (motion,) = posed.value.args
    assert motion.hand_load_kg == 1.5
    assert motion.sources == tracked
    with pytest.raises(PosedError) as posed:
        simulate_task("drinking", files, small_settings(), SIMULATION, None)
    assert posed.value.args[0].sources == [person.parent / "drinking.csv"]


@pytest.fixture
def small_plant(quaternion_equations, tmp_path, monkeypatch) -> tuple[PlantFiles, PlantOutputs]:
    """The small arm as its own plant, one channel for each muscle, and what to write."""
    monkeypatch.setattr(reference_plant, "load_model", lambda _: small_model(quaternion_equations))
    monkeypatch.setattr(reference_plant, "hashes", lambda *_: {})
    channels = tmp_path / "channels.csv"
    rows = "".join(f"{name},{name},{name},{name},\n" for name in NAMES)
    channels.write_text(f"channel,group,scaled_muscle,elements,neighbours\n{rows}", "utf-8")
    factors = dict.fromkeys(read_channels(channels).groups, 1.0)
    plant = changed_plant(tmp_path, lambda d: d.update(force=factors, fibre=factors))
    person = PARTICIPANTS / "par2" / "participant.yaml"
    files = PlantFiles(plant, channels, ModelFiles(person, *[Path("unread")] * 4))
    outputs = PlantOutputs(
        raw={"frontal": tmp_path / "frontal_raw.csv"},
        solution=tmp_path / "plant.npz",
        summary=tmp_path / "plant.summary.json",
        solver_log=tmp_path / "solver.log",
    )
    return files, outputs


def is_sealed(outputs: PlantOutputs, reason: str) -> None:
    """Neither solution nor EMG can be taken for a result, and both say why."""
    with pytest.raises(SolveError, match=reason):
        read_solution(outputs.solution)
    for raw in outputs.raw.values():
        with pytest.raises(SolveError, match=f"{raw.name}: simulated EMG of .*{reason}"):
            read_recording(raw, NAMES)


def test_emg_of_motions_that_were_not_tracked_is_sealed(small_plant, tmp_path):
    files, outputs = small_plant
    tracked = [tmp_path / "frontal.npz"]
    write_solution(small_tracked("frontal", "failed"), *tracked)
    simulate_elevations(files, tracked, small_settings(), 1.0, SIMULATION, outputs)
    is_sealed(outputs, "tracking of frontal failed")


def test_emg_of_a_plant_that_found_no_motion_is_sealed(small_plant):
    files, outputs = small_plant
    settings = replace(small_settings(), max_iterations=1)
    simulate_task("frontal", files, settings, SIMULATION, outputs)
    is_sealed(outputs, "Maximum number of iterations exceeded")


def test_contractions_say_that_they_are_simulated(tmp_path):
    path = tmp_path / "mvc.csv"
    simulate_contractions("par2", CONFIG / "emg" / "channels.csv", SIMULATION, path)
    recording = read_recording(path, CHANNELS.names)
    assert recording.simulated
    assert recording.volts.shape[1] == len(CHANNELS.names)


def readers_of_plants() -> set[tuple[str, str]]:
    """Module and function of every call of read_plant in the package."""
    found = set()
    for path in (provenance.SOURCE_ROOT / "scapulohumeral").rglob("*.py"):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                names = {node.id for node in ast.walk(function) if isinstance(node, ast.Name)}
                attributes = {n.attr for n in ast.walk(function) if isinstance(n, ast.Attribute)}
                if "read_plant" in names | attributes:
                    found.add((path.stem, function.name))
    return found


def test_only_simulation_and_score_read_a_plant():
    assert readers_of_plants() == {("reference_plant", "_pose"), ("calibration_score", "score")}


@pytest.mark.parametrize("stage", ["calibration", "validation", "prediction"])
def test_stages_after_the_plant_do_not_load_its_module(stage):
    loaded = {path.stem for path in provenance.code_of(f"scapulohumeral.stages.{stage}")}
    assert "refinement" in loaded
    assert not loaded & {"reference_plant", "calibration_score"}


def rules_that_name_plants(repository: Path) -> set[str]:
    """Rules of the workflow whose text names the folder of plants."""
    text = "\n".join(
        path.read_text(encoding="utf-8")
        for path in [
            repository / "Snakefile",
            *sorted((repository / "workflow/rules").glob("*.smk")),
        ]
    )
    text = re.sub(r"^use rule \w+ as (\w+) with:$", r"rule \1:", text, flags=re.MULTILINE)
    parts = re.split(r"^rule (\w+):$", text, flags=re.MULTILINE)
    rules = dict(zip(parts[1::2], parts[2::2], strict=True))
    assert "config/plant" not in parts[0]
    assert "calibrate" in rules
    return {name for name, body in rules.items() if "config/plant" in body}


def test_only_rules_of_simulation_and_score_have_a_plant_as_input(repository):
    study = {"simulate_elevations", "simulate_task", "score_calibration"}
    recovery = {"simulate_recovery_elevations", "score_recovery"}
    assert rules_that_name_plants(repository) == study | recovery
