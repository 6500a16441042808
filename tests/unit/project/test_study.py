"""What a configuration asks for, and refusals before anything is planned."""

import copy
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from scapulohumeral.configuration.check import read_config
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.published_arm import PUBLISHED_PLANES
from scapulohumeral.provenance import CONFIG_FOLDER
from scapulohumeral.study import Study, planned

pytestmark = pytest.mark.unit

PARTICIPANTS = CONFIG_FOLDER / "participants"
SIMULATED = Path("made")
Edit = Callable[[dict], object]


def study(change: Edit = lambda config: None, folder: Path = PARTICIPANTS) -> Study:
    """The committed study with a change of its configuration."""
    config = copy.deepcopy(read_config())
    config.update(participants=["par2", "par3"], planes=["sagittal", "frontal"])
    config["validation"].update(tasks=["driving", "drinking"])
    config["prediction"].update(predict=["healthy"], predict_also={"par3": ["cuff_w2"]})
    # The published arm needs all planes.
    config["variants"]["predict"] = {}
    change(config)
    return planned(config, folder)


@pytest.fixture
def people(tmp_path: Path) -> Callable[[Edit], Path]:
    """Function that copies the participants, with a change of the file of par3."""

    def copied(change: Edit) -> Path:
        folder = tmp_path / "participants"
        shutil.copytree(PARTICIPANTS, folder)
        path = folder / "par3" / "participant.yaml"
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
        change(document)
        path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
        return folder

    return copied


def test_trials_and_tasks_are_those_of_the_participant() -> None:
    one = study()
    assert list(one.trials("par2"))[:3] == ["frontal", "scapular", "sagittal"]
    assert one.recording("par2", "driving") == PARTICIPANTS / "par2" / "driving.csv"
    assert one.tasks("par2") == ["driving", "drinking"], "in the order of the configuration"
    assert one.tasks("par3") == []
    assert one.validated() == [("par2", "driving"), ("par2", "drinking")]


def test_elevations_come_in_one_order_and_all() -> None:
    names = [path.stem for path in study().elevations("par2")]
    assert names == ["frontal", "scapular", "sagittal"]


def test_a_participant_with_daily_tasks_alone_is_refused(people: Callable[[Edit], Path]) -> None:
    """Thorax and stops of joints are fitted to elevations."""

    def all_tasks(document: dict) -> None:
        for trial in document["trials"].values():
            trial["daily_task"] = True

    with pytest.raises(ConfigError, match="are all daily tasks; expected one at least"):
        study(folder=people(all_tasks))


def test_different_loads_in_one_motion_are_refused_before_anything_runs(
    people: Callable[[Edit], Path],
) -> None:
    folder = people(lambda d: d["trials"]["frontal"].update(hand_load_kg=2.0))
    with pytest.raises(ConfigError, match="par3.*hand_load_kg: sagittal 0, frontal 2; expected"):
        study(folder=folder)

    def tracked_only(config: dict) -> None:
        config["prediction"].update(predict=[], predict_also={}, scaler_spread=[])
        config["validation"].update(tasks=[])

    assert study(tracked_only, folder).calibrated() == []


def test_calibration_without_any_emg_is_refused(tmp_path: Path) -> None:
    """par3 by another name has no arm that simulates EMG."""
    folder = tmp_path / "participants"
    shutil.copytree(PARTICIPANTS / "par3", folder / "ann")
    file = folder / "ann" / "participant.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("id: par3", "id: ann"), "utf-8")

    def ann(config: dict) -> None:
        config.update(participants=["ann"], diagnose=[])
        config["validation"].update(tasks=[])
        config["prediction"].update(predict_also={}, generic_muscles=[], scaler_spread=[])
        config["prediction"].update(tasks=[])
        config["variants"].update(predict={})

    with pytest.raises(ConfigError, match=r"'ann' is calibrated, .* no EMG of 'sagittal'"):
        study(ann, folder)

    def generic(config: dict) -> None:
        ann(config)
        config["prediction"].update(generic_muscles=["ann"])

    assert study(generic, folder).calibrated() == []


def test_names_that_the_files_of_others_have_are_refused(people: Callable[[Edit], Path]) -> None:
    def fast(document: dict) -> None:
        document["trials"]["frontal_fast"] = {**document["trials"]["frontal"], "daily_task": True}

    folder = people(fast)
    with pytest.raises(ConfigError, match="Task 'frontal_fast' of participant 'par3'"):
        study(lambda config: config["validation"].update(tasks=["frontal_fast"]), folder)

    def audited(config: dict) -> None:
        conditions = config["prediction"]["conditions"]
        conditions["cuff_audited"] = dict(conditions["healthy"])

    with pytest.raises(ConfigError, match=r"conditions\.cuff_audited': names that end with"):
        study(audited)


def test_the_published_arm_needs_all_planes() -> None:
    def published(config: dict) -> None:
        config["variants"]["predict"] = {"published": {"par2": ["healthy"]}}

    with pytest.raises(ConfigError, match=r"'planes' has no scapular, but 'variants.predict.publ"):
        study(published)
    study(lambda config: published(config) or config.update(planes=list(PUBLISHED_PLANES)))


@pytest.mark.parametrize(("step", "allowed"), [(0.04, True), (0.02, True), (0.03, False)])
def test_daily_tasks_are_predicted_on_parts_of_tracked_steps(step: float, allowed: bool) -> None:
    def change(config: dict) -> None:
        config["prediction"].update(task_time_step_s=step)

    if allowed:
        study(change)
        return
    with pytest.raises(ConfigError, match=r"divided by a whole number.*task_time_step_s: 0.04"):
        study(change)


def test_the_published_arm_needs_its_own_mesh() -> None:
    def published(config: dict) -> None:
        config["variants"]["predict"] = {"published": {"par2": ["healthy"]}}
        config.update(planes=list(PUBLISHED_PLANES))
        config["solve"].update(time_step_s=0.02)

    with pytest.raises(ConfigError, match=r"'solve.time_step_s' is 0.02 s, but .* every 0.04 s"):
        study(published)


@pytest.mark.parametrize(
    ("section", "changes", "words"),
    [
        ("emg.simulation", {"mvc_hold_s": 2.0}, r"mvc_hold_s' is 2 s; .*mvc_window_s \(3 s\)"),
        ("emg.envelope", {"mvc_window_s": 2.0}, r"mvc_window_s: 2.0; a calibration has to know"),
        ("emg.envelope", {"band_high_hz": 1000.0}, r"band_high_hz' is 1000 Hz; expected less"),
        ("emg.envelope", {"cutoff_hz": 8.0, "rate_hz": 25.0}, r"rate_hz: 25.0; expected at least"),
        ("geometry", {"scapula_turn_deg": [10, 30]}, r"scapula_turn_deg.*expected 0 between"),
        ("calibration", {"force_bounds": [1.3, 1.5]}, r"force_bounds.*expected 1 between"),
    ],
)
def test_settings_that_contradict_each_other_are_refused(
    section: str, changes: dict, words: str
) -> None:
    def change(config: dict) -> None:
        for name in section.split("."):
            config = config[name]
        config.update(changes)

    with pytest.raises(ConfigError, match=words):
        study(change)


def test_a_pause_has_two_intervals_of_the_mesh() -> None:
    def change(config: dict) -> None:
        config["solve"].update(time_step_s=0.2)
        config["composite"].update(pause_s=0.2)

    with pytest.raises(ConfigError, match=r"pause_s' is 0.2 s; expected two mesh intervals"):
        study(change)


def test_what_shapes_a_model_cannot_judge_it(people: Callable[[Edit], Path]) -> None:
    with pytest.raises(ConfigError, match=r"'validation.tasks' names 'sagittal', which shapes"):
        study(lambda config: config["validation"].update(tasks=["sagittal"]))
    with pytest.raises(ConfigError, match=r"'prediction.tasks' names 'frontal', which shapes"):
        study(lambda config: config["prediction"].update(tasks=["frontal"]))
    folder = people(lambda d: d["trials"]["frontal"].update(daily_task=True))
    with pytest.raises(ConfigError, match=r"'planes' names 'frontal', which is a daily task"):
        study(lambda config: None, folder)


def test_published_paths_need_a_published_arm() -> None:
    with pytest.raises(ConfigError, match=r"par3.*lists no published_predictions\.healthy"):
        study(lambda config: config["model"].update(paths="published"))


def test_predictions_are_those_of_all_and_those_of_one() -> None:
    one = study()
    assert one.predicted() == [("par2", "healthy"), ("par3", "healthy"), ("par3", "cuff_w2")]
    assert one.condition("cuff_w2", "par2")["muscles"] == ["supra", "infra"]


def test_a_condition_that_is_asked_for_twice_is_predicted_once() -> None:
    twice = study(lambda c: c["prediction"].update(predict_also={"par3": ["healthy", "cuff_w2"]}))
    assert twice.conditions("par3") == ["healthy", "cuff_w2"]


def test_healthy_shoulder_follows_the_tasks_that_a_participant_has() -> None:
    def asked(*names: str) -> Edit:
        return lambda config: config["prediction"].update(tasks=list(names))

    assert study(asked("lifting", "driving")).predicted_tasks() == [
        ("par2", "lifting"),
        ("par2", "driving"),
    ]
    with pytest.raises(ConfigError, match=r"'prediction\.tasks' names 'drivin'"):
        study(asked("drivin"))


def test_daily_tasks_are_predicted_beside_elevations_only() -> None:
    def tasks_alone(config: dict) -> None:
        config["prediction"].update(predict=[], predict_also={}, tasks=["driving"])

    assert study(tasks_alone).predicted_tasks() == []


def test_only_calibrated_predictions_get_a_spread_of_their_scalers() -> None:
    def asked(*names: str) -> Edit:
        return lambda config: config["prediction"].update(scaler_spread=list(names))

    assert study(asked("healthy", "cuff_w2")).spread() == [("par2", "healthy")]
    with pytest.raises(ConfigError, match=r"prediction\.scaler_spread' names 'healthi'"):
        study(asked("healthi"))


def test_muscles_calibrated_to_a_random_plant_are_not_predicted_with() -> None:
    one = study()
    assert one.condition("cuff_w2", "par2")["parameters"] == "calibrated"
    assert one.condition("cuff_w2", "par3")["parameters"] == "generic"
    plain = study(lambda config: config["prediction"].update(generic_muscles=[]))
    assert plain.condition("cuff_w2", "par3")["parameters"] == "calibrated"


def test_muscles_are_calibrated_if_anything_needs_them() -> None:
    def nothing(config: dict) -> None:
        config["validation"].update(tasks=[])
        config["prediction"].update(predict=[], predict_also={})

    assert study(nothing).calibrated() == []
    assert study(nothing).with_emg() == []
    assert study().calibrated() == ["par2", "par3"]
    assert study().with_emg() == [
        ("par2", "sagittal"),
        ("par2", "frontal"),
        ("par2", "driving"),
        ("par2", "drinking"),
        ("par3", "sagittal"),
        ("par3", "frontal"),
    ]


def test_muscles_are_calibrated_if_a_daily_task_alone_needs_them() -> None:
    def task(config: dict) -> None:
        config["validation"].update(tasks=[])
        config["prediction"].update(
            predict=["healthy_generic"], predict_also={}, tasks=["drinking"], generic_muscles=[]
        )

    assert study(task).calibrated() == ["par2"], "par3 has no recording of it"


def test_measured_emg_takes_the_place_of_simulated_emg(people: Callable[[Edit], Path]) -> None:
    emg = {"mvc": "emg/mvc.csv", "trials": {"frontal": "emg/frontal.c3d"}, "delay_s": 0.0}
    folder = people(lambda document: document.update(emg=emg))
    one = study(folder=folder)
    measured = one.raw_emg("par3", "frontal", SIMULATED)
    assert measured["raw"] == folder / "par3" / "emg/frontal.c3d"
    assert measured["mvc"] == folder / "par3" / "emg/mvc.csv"
    assert one.raw_emg("par3", "sagittal", SIMULATED)["raw"] == Path("made/par3/sagittal_raw.csv")
    assert one.simulates_emg("par3"), "of the sagittal plane"
    assert not study(lambda c: c.update(planes=["frontal"]), folder).simulates_emg("par3")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c: c.update(participants=["par9"]), "participants: [par1, par2, par3]"),
        (lambda c: c.update(diagnose=["par7"]), "'diagnose' names 'par7'"),
        (
            lambda c: c["prediction"].update(predict_also={"par8": ["healthy"]}),
            "'prediction.predict_also' names 'par8'",
        ),
        (lambda c: c["validation"].update(tasks=["drinkin"]), "'drinkin', which no participant"),
        (lambda c: c["prediction"].update(predict=["helthy"]), "Choose from: healthy_generic,"),
        (
            lambda c: c["prediction"].update(predict_also={"par3": ["cuff"]}),
            "'prediction.predict_also.par3' names 'cuff'",
        ),
        (
            lambda c: c["prediction"]["conditions"]["healthy"].update(start="somewhere"),
            "'prediction.conditions.healthy.start' is 'somewhere'",
        ),
        (
            lambda c: c["prediction"]["conditions"]["healthy"].update(start="cuff_w2"),
            "never comes to a solution",
        ),
        (lambda c: c["model"].update(masses="weighed"), "key 'model.masses'"),
        (
            lambda c: c["prediction"]["conditions"]["cuff_w2"].update(muscles=["suprra", "infra"]),
            "'prediction.conditions.cuff_w2.muscles' names suprra; the model simulates no such",
        ),
        (
            lambda c: c["variants"]["predict"].update(published={"par8": ["healthy"]}),
            "'variants.predict' names 'par8'",
        ),
        (
            lambda c: c["variants"]["tried"].update(variants=["upto_springs"]),
            "'variants.tried.variants' names 'upto_springs', which follows the published arm, or",
        ),
        (
            lambda c: c["variants"]["named"]["published"]["problem"].update(stpos=False),
            "'variants.named.published.problem' has stpos, which is no choice of a problem. Choose",
        ),
    ],
)
def test_names_of_nothing_are_refused(change: Edit, said: str) -> None:
    with pytest.raises(ConfigError) as error:
        study(change)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.pop("trials"), "'trials' is a required property"),
        (lambda d: d.update(trials=[]), "par3/participant.yaml, trials"),
        (lambda d: d["trials"].update(frontal={}), "trials.frontal"),
        (lambda d: d["trials"].pop("sagittal"), "no recording of"),
        (lambda d: d.update(id="par1"), "id: 'par1'; expected 'par3'"),
        (
            lambda d: d.update(emg={"mvc": "a", "trials": {"frontl": "b"}, "delay_s": 0}),
            "emg.trials: frontl",
        ),
    ],
)
def test_malformed_participant_is_refused_with_file_and_key(
    people: Callable[[Edit], Path], change: Edit, said: str
) -> None:
    folder = people(change)
    with pytest.raises(ConfigError) as error:
        study(folder=folder)
    assert said in str(error.value)


def test_trial_that_is_not_there() -> None:
    with pytest.raises(ConfigError, match="has no trial 'driving'"):
        study().recording("par3", "driving")


def test_participants_of_no_study_do_not_matter(people: Callable[[Edit], Path]) -> None:
    folder = people(lambda document: document.pop("trials"))
    only = study(lambda c: c.update(participants=["par2"], diagnose=[]), folder)
    assert only.participants == ["par2"]


def test_an_entry_without_conditions_asks_for_nobody() -> None:
    """Own participants take back those of the paper, whom their folder does not have."""
    asked = study(lambda c: c["prediction"].update(predict_also={"par8": []}))
    assert "par8" not in asked.files
