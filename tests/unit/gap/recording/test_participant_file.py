"""Participants of a diagnosis can be read in every form, and wrong files are refused by key."""

import re

import numpy as np
import pytest
import yaml
from gap_files import elevation, participant_document, write_csv, write_participant
from places import REPOSITORY

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.gap.recording.case import make_case
from scapulohumeral.gap.recording.participant_file import (
    BASE_HEIGHT_M,
    check_groups,
    find_participant,
    read_participant_file,
    read_scaled_model,
)
from scapulohumeral.gap.recording.trials import TrialEntry, read_trials
from scapulohumeral.gap.run import Request, read_case
from scapulohumeral.model.participant_schema import SCALED_SEGMENTS

pytestmark = pytest.mark.unit

CONFIG = REPOSITORY / "config"


def scaled_document(**changes) -> dict:
    """A table of scaled segments: each twice as deep as wide, 1 kg more from hand to thorax."""
    return {
        "bodies": [{"name": name, "mass_kg": 7 - i} for i, name in enumerate(SCALED_SEGMENTS)],
        "segment_scale": [
            {"segment": name.removesuffix("_r"), "scale_xyz": [1.0, 1.1, 1.2]}
            for name in SCALED_SEGMENTS
        ],
        **changes,
    }


def test_short_file(tmp_path):
    emg = {
        "channels": {"EMG_infra": ["infra"], "EMG_mid": ["delt_scap"]},
        "unit": "fraction_of_max",
        "neighbours": [["EMG_infra", "EMG_mid"]],
    }
    trials = {"lift_r1": {"task": "raise", "window_s": [0.4, 2.9]}}
    file = read_participant_file(write_participant(tmp_path, emg=emg, trials=trials), "published")
    assert file.participant.emg_channels == {"EMG_infra": ("infra",), "EMG_mid": ("delt_scap",)}
    assert file.participant.emg_unit == "fraction_of_max"
    assert file.participant.neighbours == (("EMG_infra", "EMG_mid"),)
    assert file.trials == {"lift_r1": TrialEntry("raise", None, (0.4, 2.9))}


def test_the_example_of_the_readme_can_be_read(tmp_path):
    text = (CONFIG.parent / "README.md").read_text(encoding="utf-8")
    [example] = re.findall(r"```yaml\n(.*?)```", text, flags=re.DOTALL)
    (tmp_path / "participant.yaml").write_text(example, encoding="utf-8")
    file = read_participant_file(tmp_path / "participant.yaml", "published")
    assert file.participant.emg_channels
    assert file.participant.neighbours
    assert file.trials["lifting_r1"].window_s == (0.4, 2.9)


def test_generic_model_grows_with_height_and_weighs_by_anthropometry(tmp_path):
    model = read_participant_file(write_participant(tmp_path), "published").participant.model
    assert model.scale == dict.fromkeys(SCALED_SEGMENTS, (1.8 / BASE_HEIGHT_M,) * 3)
    assert model.masses == "anthropometric"
    assert model.body_mass_kg == 80.0


def test_base_height_fits_the_humerus_of_the_base_model():
    from scapulohumeral.model.tables import read_tables

    elbow = read_tables(CONFIG / "model").joints["hu"].location_m
    upper_arm = 0.5 * (281.7 / 1741.0 + 275.1 / 1735.0) * BASE_HEIGHT_M
    assert np.linalg.norm(elbow) == pytest.approx(upper_arm, rel=0.002)


def test_scaled_model_by_file(tmp_path):
    (tmp_path / "scaled.yaml").write_text(yaml.safe_dump(scaled_document()))
    path = write_participant(tmp_path, model={"file": "scaled.yaml"})
    model = read_participant_file(path, "anthropometric").participant.model
    assert model.scale["hand_r"] == (1.0, 1.1, 1.2)
    assert model.segment_mass_kg["thorax"] == 7.0
    assert model.total_mass_kg == 28.0
    assert model.masses == "published"


@pytest.mark.parametrize("masses", ["published", "anthropometric"])
def test_participants_of_the_study_can_be_diagnosed(masses):
    path = CONFIG / "participants" / "par2" / "participant.yaml"
    participant = read_participant_file(path, masses).participant
    assert participant.model.total_mass_kg == pytest.approx(36.5311)
    assert participant.model.masses == masses
    assert participant.emg_channels == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"side": "left"}, r"participant\.yaml, side: .*mirror left ones"),
        ({"model": None}, r"'model' is a required property"),
        ({"model": {"generic": True}}, r"model: .*generic: true, body_mass_kg, height_m"),
        ({"height": 1.8}, r"height: there is no such key"),
        ({"gravity_in_thorax_mps2": [0, -9.8]}, r"gravity_in_thorax_mps2"),
        ({"trials": {"a": {"window_s": [2.0, 1.0]}}}, r"trials\.a\.window_s.*start before end"),
        ({"emg": {"channels": {"infra": ["infra"]}, "unit": "fraction_of_mvc"}}, r"EMG_"),
        (
            {
                "emg": {
                    "channels": {"EMG_a": ["infra"]},
                    "unit": "fraction_of_mvc",
                    "neighbours": [["EMG_a", "EMG_b"]],
                }
            },
            r"emg\.neighbours: 'EMG_b'; expected one of EMG_a",
        ),
        ({"model": {"file": "none.yaml"}}, r"none\.yaml"),
    ],
)
def test_wrong_files_are_refused_by_key(tmp_path, changes, message):
    with pytest.raises(ConfigError, match=message):
        read_participant_file(write_participant(tmp_path, **changes), "published")


def test_a_scaled_model_needs_all_segments(tmp_path):
    path = tmp_path / "scaled.yaml"
    path.write_text(yaml.safe_dump(scaled_document(bodies=scaled_document()["bodies"][:-1])))
    with pytest.raises(ConfigError, match="bodies: no hand_r"):
        read_scaled_model(path)


def test_the_file_is_found_beside_the_trials_or_above(tmp_path):
    path = write_participant(tmp_path)
    inner = tmp_path / "trials"
    inner.mkdir()
    assert find_participant([inner / "a.csv", tmp_path / "b.csv"]) == path
    own = write_participant(inner)
    assert find_participant([inner / "a.csv"]) == own
    with pytest.raises(ConfigError, match="different participants"):
        find_participant([inner / "a.csv", tmp_path / "b.csv"])


def sides(folder, **reference):
    """The same trial in folders ``test`` and ``reference``, the participant file above both."""
    write_participant(folder, trials={"lift_r1": {"task": "raise"}})
    paths = []
    for name, peak_deg in (("test", 60.0), ("reference", 50.0)):
        (folder / name).mkdir()
        paths.append(write_csv(elevation(peak_deg=peak_deg), folder / name / "lift_r1.csv"))
    if reference:
        write_participant(folder / "reference", **reference)
    return paths


def read_sides(*paths, participant=None):
    """Test and reference trial of a case, as the command reads them."""
    test, reference = paths
    request = Request(
        tests=(test,), references=(reference,), out=test.parent, participant=participant,
        config=CONFIG, cache=test.parent, seed=1, threads=1, command="", simulated=True,
    )  # fmt: skip
    case = read_case(request, {"model": {"masses": "published"}})
    return case.test[0], case.reference[0]


def test_each_side_is_described_by_its_own_file(tmp_path):
    trials = {"lift_r1": {"task": "raise", "repeat": 3, "window_s": [0.4, 2.4]}}
    paths = sides(tmp_path, trials=trials)
    test, reference = read_sides(*paths)
    assert (reference.repeat, reference.window_s) == (3, (0.4, 2.4))
    assert (test.repeat, test.task) == (1, "raise")
    assert test.window_s != reference.window_s


def test_a_named_participant_file_describes_both_sides(tmp_path):
    paths = sides(tmp_path, trials={"lift_r1": {"task": "other", "repeat": 3}}, id="another")
    test, reference = read_sides(*paths, participant=tmp_path / "participant.yaml")
    assert (test.task, reference.task, reference.repeat) == ("raise", "raise", 1)


def test_one_file_above_describes_both_sides(tmp_path):
    test, reference = read_sides(*sides(tmp_path))
    assert (test.task, reference.task) == ("raise", "raise")


def test_electrodes_may_be_described_on_one_side_only(tmp_path):
    paths = sides(tmp_path, emg=None, trials={"lift_r1": {"task": "raise"}})
    assert read_sides(*paths)[1].task == "raise"


def test_missing_file_is_told(tmp_path):
    trial = tmp_path / "deep" / "deeper" / "a.csv"
    with pytest.raises(DataError, match=r"a\.csv: no such file"):
        find_participant([trial])
    trial.parent.mkdir(parents=True)
    trial.touch()
    with pytest.raises(ConfigError, match="--participant"):
        find_participant([trial])


def test_unknown_muscle_groups_are_refused(tmp_path):
    emg = {"channels": {"EMG_a": ["infraspinatus"]}, "unit": "fraction_of_mvc"}
    participant = read_participant_file(write_participant(tmp_path, emg=emg), "").participant
    with pytest.raises(ConfigError, match=r"EMG_a: no muscle group 'infraspinatus'.*infra, "):
        check_groups(participant, CONFIG / "model")


def test_channels_count_only_if_all_trials_have_them(tmp_path):
    assert participant_document()["emg"]["channels"] == {"EMG_infra": ["infra"]}
    file = read_participant_file(write_participant(tmp_path), "published")
    rising = np.linspace(0.1, 0.2, len(elevation()))
    with_emg = elevation().assign(EMG_infra=rising, EMG_other=rising)
    paths = [
        write_csv(with_emg, tmp_path / "a.csv"),
        write_csv(elevation(peak_deg=50.0), tmp_path / "b.csv"),
    ]
    trials, _ = read_trials(paths, {})
    assert make_case(file.participant, trials[:1], []).channels == ("EMG_infra",)
    assert make_case(file.participant, trials, []).channels == ()
