"""A whole diagnosis on made-up nominal solutions: verdicts, missing data, a valid answer."""

import json
import zlib
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from gap_files import HASHES
from gap_movement import CHANNELS, NODES, SETTINGS, small_body, small_record

from scapulohumeral.errors import ConfigError, DataError, SolveError
from scapulohumeral.gap import answer as answer_module
from scapulohumeral.gap import assembly, pipeline
from scapulohumeral.gap.answer import NO_EXCESS, _remarks_on_shrinkage
from scapulohumeral.gap.assembly import effects_of
from scapulohumeral.gap.benchmark.by_derivatives import assumed_answers, limits
from scapulohumeral.gap.benchmark.by_derivatives.assumed_rates import rates
from scapulohumeral.gap.benchmark.by_derivatives.judging import inflation_of, with_difference
from scapulohumeral.gap.benchmark.noise_free import hidden_task
from scapulohumeral.gap.benchmark.noise_free.trial import noise_free_trial
from scapulohumeral.gap.benchmark.null_bank_build import null_cases
from scapulohumeral.gap.benchmark.scored_case import ScoredCase
from scapulohumeral.gap.curve_files import LeftOutRow
from scapulohumeral.gap.detection.size import NO_INTERVAL
from scapulohumeral.gap.effects.base import Setup
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.effects.library import NEEDING, library
from scapulohumeral.gap.explained import Explained
from scapulohumeral.gap.isolation import empirical_bayes, pairs, search
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.left_over import SOMETHING_LEFT, left_in_words, left_over
from scapulohumeral.gap.nominal.control_bias import no_drive
from scapulohumeral.gap.pipeline import diagnose
from scapulohumeral.gap.recording.case import (
    ContactSeries,
    EmgSeries,
    GapParticipant,
    GapTrial,
    ScaledModel,
    make_case,
)
from scapulohumeral.gap.recording.movement_window import smoothed
from scapulohumeral.gap.recording.observables import (
    JOINT_QUATERNIONS,
    KINEMATIC_CHANNELS,
    channel_kind,
    channel_names,
    difference,
    phase_functions,
)
from scapulohumeral.gap.residual import differences, emg_level
from scapulohumeral.gap.residual.differences import read_records
from scapulohumeral.gap.result import Feasibility, Robustness, Share, Shrinkage, to_json
from scapulohumeral.gap.signatures.linearise import DOF, record_derivative
from scapulohumeral.gap.signatures.nuisances import SMOOTH, session_records
from scapulohumeral.gap.signatures.of_tasks import STIFFNESSES, TaskSignatures
from scapulohumeral.gap.weighing import SCHEMA
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    pose_to_trial,
    quaternion_multiply,
    rotation_vector_to_quaternion,
)

pytestmark = pytest.mark.unit

TASKS = {"high": 1.5, "low": 1.0}
EVERY = channel_names(CHANNELS, True)
RIGHT = "body/strength_loss/biceps"
AMOUNT = np.log(0.5)
MEMBERS = {"biceps", "EL", "hand", "forearm", "scapula", "EMG_a", "EMG_b", "EMG_a>EMG_b"}


def smooth_change(name, channels, nodes=NODES):
    """Smooth random change (N, K) of the elbow [deg], of EMG [fraction of MVC] and force [N]."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    shape = phase_functions(nodes, 3) * np.sqrt(nodes)
    curves = shape @ rng.normal(size=(3, len(channels)))
    sizes = {"kinematics": 4.0, "emg": 0.05, "contact_force": 50.0}
    moved = [c not in KINEMATIC_CHANNELS[:-1] for c in channels]
    return curves * moved * [sizes[channel_kind(c)] for c in channels]


def made_up_movement(channels):
    """Change (10, B, N, K) by another movement, which is realised and asks for another EMG."""
    count = SETTINGS.phase_functions
    shapes = phase_functions(NODES, count).T * np.sqrt(NODES)
    change = np.zeros((DOF, count, NODES, len(channels)))
    for dof in range(DOF):
        change[dof, :, :, dof] = shapes
        change[dof, :, :, DOF:] = 0.01 * shapes[..., None] * (1.0 + dof % 3)
    return change


def made_up_response(task, mean_record, compared_s, model, effects, sensors, settings, *_):
    """A nominal solution that predicts the record, with made-up derivatives."""
    channels = channel_names(sensors.channels, sensors.contact)
    signatures = tuple(
        tuple(
            np.stack([smooth_change(f"{e.label}{p.name}{kept}", channels) for p in e.params])
            if e.changes_body
            else record_derivative(e, np.zeros(len(e.params)), mean_record)
            for e in effects
        )
        for kept in ("", *(f" kept {f}" for f in STIFFNESSES[1:]))
    )
    slack = np.stack(
        [[smooth_change(f"slack{i}{k}", channels) for k in range(SMOOTH)] for i in range(DOF)]
    )
    none = np.zeros((1, NODES, len(channels)))
    levers = np.tile(np.eye(10, 3), (NODES - 1, 1, 1))
    session = np.stack(
        [difference(one, mean_record) for one in session_records(mean_record, settings)]
    )
    return TaskSignatures(
        task=task, mean_record=mean_record, nominal=mean_record, point=None, effects=signatures,
        intended=made_up_movement(channels), posture=none,
        session=session, tempo=0.0 * none[0], tempo_errors=none[:0],
        followed=tuple(0.0 * s for s in signatures[0]),
        followed_session=0.0 * session,
        unmeasured=none[:0], followed_unmeasured=none[:0],
        slack=slack, levers=levers,
        needed=np.zeros((NODES - 1, 10)), drive=no_drive(NODES, 3),
    )  # fmt: skip


@pytest.fixture
def whole_library():
    """For tests with all members and sizes of another movement; most have fewer, to be quick."""


def few_members(*arguments):
    """All families, with one or two members each."""
    return tuple(e for e in effects_of(*arguments) if e.member is None or e.member in MEMBERS)


@pytest.fixture(autouse=True)
def _quick(request, monkeypatch):
    monkeypatch.setattr(pairs, "LEADERS", 2)
    monkeypatch.setattr(pairs, "PARTNERS", 4)
    if "whole_library" not in request.fixturenames:
        monkeypatch.setattr(assembly, "effects_of", few_members)
        monkeypatch.setattr(empirical_bayes, "SIZES_DEG", (6.0,))


@pytest.fixture(autouse=True)
def _made_up(monkeypatch):
    monkeypatch.setattr(assembly, "task_signatures", made_up_response)
    monkeypatch.setattr(assembly, "movement", lambda *_: None)
    monkeypatch.setattr(emg_level, "_predicted_or_none", lambda mean_record, *_: mean_record.emg)
    for module in (assembly, differences):
        monkeypatch.setattr(module, "nominal_body", lambda model, nodes: small_body())
    monkeypatch.setattr(search, "_refit_or_keep", lambda first, *rest: first)


def turned(pose, by_rad):
    """Poses (N, 13) whose ball joints are turned by rotation vectors, (N, 9) of (N, K)."""
    pose = pose.copy()
    for i, part in enumerate(JOINT_QUATERNIONS):
        turn = rotation_vector_to_quaternion(by_rad[:, 3 * i : 3 * i + 3])
        pose[:, part] = quaternion_multiply(turn, pose[:, part])
    return pose


def trial(task, repeat, change, emg, contact, seed, observe=lambda record: record):
    """A recorded trial: the record of its task, as it is observed, changed, with noise."""
    rng = np.random.default_rng(seed)
    record = observe(small_record(TASKS[task]))
    # As smooth as repeats are expected to scatter.
    shapes = phase_functions(NODES, 3) / np.sqrt(np.arange(1, 4))
    noise = shapes @ np.hstack([rng.normal(size=(3, n)) for n in (12, 3)])
    curves = change + noise * np.repeat([0.6, 0.01, 10.0], [10, 2, 3])
    time = np.linspace(0.0, 0.44, NODES)
    angles = pose_to_trial(turned(record.pose, np.deg2rad(change)))
    angles[:, 9] += np.deg2rad(curves[:, 9])
    series = EmgSeries(time, CHANNELS, record.emg + curves[:, 10:12]) if emg else None
    force = ContactSeries(time, curves[:, 12:]) if contact else None
    window = (0.0, 0.44)
    smooth = smoothed(Motion(time, angles))
    return GapTrial(
        f"{task}_r{repeat}", task, repeat, time, angles, smooth, series, force, window, Path()
    )


def case(
    effect=None,
    emg=True,
    reference=True,
    repeats=3,
    tasks=tuple(TASKS),
    kept="",
    contact=False,
    shares=None,
    moved=None,
    observe=lambda record: record,
    seed=0,
):
    """A case whose tests are changed as :func:`made_up_response` predicts of its channels.

    `shares` are factors on the change by task, `moved` (10, B) amounts [deg] of the smooth changes
    of joints that were intended; tests are observed by `observe`.
    """
    measured = channel_names(CHANNELS if emg else (), contact)
    change = np.zeros((NODES, len(EVERY)))
    if effect:
        own = AMOUNT * smooth_change(f"{effect}f0_factor{kept}", measured)
        change[:, np.isin(EVERY, measured)] = own
    if moved is not None:
        own = np.tensordot(moved, made_up_movement(measured)[:, : moved.shape[1]], 2)
        change[:, np.isin(EVERY, measured)] += own
    sides = [
        [
            trial(
                task,
                i,
                (side == 0) * (shares or {}).get(task, 1.0) * change,
                emg,
                contact,
                seed + 100 * side + 10 * i + len(task),
                *([observe] if side == 0 else []),
            )
            for task in tasks
            for i in range(repeats)
        ]
        for side in (0, 1)
    ]
    participant = GapParticipant(
        id="x",
        side="right",
        model=ScaledModel({}, 80.0, {}, "published"),
        gravity_mps2=(0.0, -9.81, 0.0),
        emg_channels={"EMG_a": ("coracobrachialis",), "EMG_b": ("biceps",)} if emg else {},
        emg_unit="fraction_of_mvc",
        neighbours=(CHANNELS,) if emg else (),
    )
    return make_case(participant, sides[0], sides[1] if reference else [], threads=1)


@pytest.fixture(scope="module")
def answers():
    """Answers by name, each found by the first test that asks for it.

    For cases and settings that several tests look at, in tests that have made nothing else up.
    """
    return {}


@pytest.fixture
def found(answers):
    """The answer to a cause that is found."""
    if "found" not in answers:
        answers["found"] = diagnosed(effect=RIGHT)
    return answers["found"]


@pytest.fixture
def found_by_evidence(answers, by_evidence):
    """The same, with weights that keep nothing for what evidence does not say."""
    if "by evidence" not in answers:
        answers["by evidence"] = diagnosed(by_evidence, effect=RIGHT)
    return answers["by evidence"]


@pytest.fixture
def found_by_motion(answers):
    """The same without EMG."""
    if "by motion" not in answers:
        answers["by motion"] = diagnosed(effect=RIGHT, emg=False)
    return answers["by motion"]


@pytest.fixture
def by_evidence(tmp_path):
    """Settings whose weights keep nothing for what evidence does not say."""
    weighing = replace(SETTINGS.weighing, foreign=0.0, moved=0.0, silent_power=0.0)
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"schema": SCHEMA, "weights": asdict(weighing)}), encoding="utf-8")
    return replace(SETTINGS, calibration=str(path))


def diagnosed(settings=SETTINGS, **how):
    done = diagnose(case(**how), None, settings)
    to_json(replace(done, hashes=HASHES))
    return done


def left(first, **how):
    """What a cause leaves of a made-up case."""
    known = case(**how)
    records = read_records(known, None, SETTINGS, [])
    evidence = assembly.assemble(known, records, None, SETTINGS, [])
    return left_over({f.label: f for f in evidence.screened}[first], evidence, 1.0, 0)


def tilted(record):
    """A record whose scapula markers are turned."""
    return replace(record, pose=turn_frame(record.pose, "scapula", np.deg2rad([0.0, 12.0, 0.0])))


def test_what_the_cause_explains_is_not_left():
    assert not left(RIGHT, effect=RIGHT).presence.present


@pytest.mark.parametrize(
    ("first", "observe", "nearest"),
    [
        ("measurement/emg_gain/EMG_a", lambda record: record, RIGHT),
        (RIGHT, tilted, "input/frame_misalignment/scapula"),
    ],
)
def test_what_another_cause_did_is_left_and_has_a_place(first, observe, nearest):
    rest = left(first, effect=RIGHT, observe=observe)
    assert rest.presence.present
    assert rest.nearest == nearest
    words = left_in_words(first, rest)
    assert words.startswith(SOMETHING_LEFT)
    assert rest.regions[0].channel in words


def wavy(record):
    """A record whose EMG goes up and down as no effect makes it."""
    waves = 0.08 * np.sin(np.linspace(0.0, 2.0 * np.pi, NODES))
    return replace(record, emg=record.emg + waves[:, None] * [1.0, -1.0])


def test_an_answer_says_whether_its_first_cause_is_all(found):
    assert not [remark for remark in found.warnings if remark.startswith(SOMETHING_LEFT)]
    answer = diagnosed(effect=RIGHT, observe=wavy)
    [remark] = [remark for remark in answer.warnings if remark.startswith(SOMETHING_LEFT)]
    assert answer.candidates[0].label in remark
    assert answer.candidates[0].p <= 0.5


@pytest.mark.parametrize("stiffness", STIFFNESSES)
def test_effects_are_found_however_firmly_the_movement_is_kept(stiffness, found):
    answer = found
    if stiffness != 1.0:
        answer = diagnosed(effect=RIGHT, kept=f" kept {stiffness}")
    assert answer.candidates[0].label == RIGHT
    errors = dict(answer.curves["errors"].to_numpy().tolist())
    assert errors["stiffness"] == stiffness


@pytest.mark.parametrize(
    ("reference", "unit", "tells"),
    [
        (True, "fraction_of_mvc", True),
        (True, "fraction_of_max", False),
        (False, "fraction_of_mvc", False),
    ],
)
def test_control_bias_is_read_from_reference_trials_of_known_level(
    reference, unit, tells, monkeypatch
):
    """EMG of test trials holds the effect that is looked for; one of its own maximum no level.

    What predictions follow is asked for without reference trials only.
    """
    told = []

    def task_signatures(*job):
        told.append(job[-2:])
        return made_up_response(*job)

    monkeypatch.setattr(assembly, "task_signatures", task_signatures)
    known = case(effect=RIGHT, reference=reference)
    known = replace(known, participant=replace(known.participant, emg_unit=unit))
    assembly.assemble(known, read_records(known, None, SETTINGS, []), None, SETTINGS, [])
    assert told == [(tells, not reference)] * len(TASKS)


def smallest_gain(answer):
    """The smallest EMG gain that would be found, in units of its logarithm."""
    found = {one.label: one.value for one in answer.gap.smallest_detectable}
    return abs(np.log(found.get("measurement/emg_gain/EMG_a", np.inf)))


def test_an_own_maximum_says_less_about_emg(found):
    """If gains may differ between recordings, only larger ones are found."""
    known = case(effect=RIGHT)
    unit = replace(known.participant, emg_unit="fraction_of_max")
    lenient = diagnose(replace(known, participant=unit), None, SETTINGS)
    assert smallest_gain(lenient) > 2.0 * smallest_gain(found)
    assert any("own maximum" in text for text in lenient.warnings)
    assert not any("own maximum" in text for text in found.warnings)


def test_maxima_that_both_sides_share_say_as_much_as_a_maximal_contraction():
    """Where one side stays below maxima that the other reaches, both were divided by the same."""
    known = case(effect=RIGHT)
    shared = replace(known, participant=replace(known.participant, emg_unit="fraction_of_max"))

    def divided(trials, by):
        """Trials whose EMG was divided by one value of each channel."""
        each = [np.concatenate([t.emg.values for t in trials]).max(axis=0) for trials in by]
        whole = np.maximum.reduce(each)
        return tuple(replace(t, emg=replace(t.emg, values=t.emg.values / whole)) for t in trials)

    both = (shared.test, shared.reference)
    one = replace(
        shared, test=divided(shared.test, both), reference=divided(shared.reference, both)
    )
    own = replace(
        shared,
        test=divided(shared.test, [shared.test]),
        reference=divided(shared.reference, [shared.reference]),
    )
    assert one.emg_has_one_maximum
    assert not own.emg_has_one_maximum
    assert not replace(one, reference=()).emg_has_one_maximum
    told = replace(own.participant, emg_unit="fraction_of_shared_max")
    assert replace(own, participant=told).emg_has_one_maximum
    alone = replace(own, participant=told, reference=())
    shared_by = {
        "maxima that test and reference trials share": one,
        "maxima that all trials share": alone,
        "own maximum": own,
    }
    for words, some in shared_by.items():
        said = []
        settings = pipeline._for_emg_unit(SETTINGS, some, said)
        assert (settings is SETTINGS) == (some is not own)
        assert len(said) == 1
        assert words in said[0]


def test_emg_without_a_level_tells_the_same_whatever_it_was_divided_by(monkeypatch):
    """What a cause adds is a share of the maximal contraction, as the model predicts it."""
    monkeypatch.setattr(emg_level, "_predicted_or_none", lambda *_: np.full((NODES, 2), 0.1))
    known = case(effect=RIGHT)
    shared = replace(known.participant, emg_unit="fraction_of_shared_max")

    def times(trials, factors):
        return tuple(replace(t, emg=replace(t.emg, values=t.emg.values * factors)) for t in trials)

    answers = [
        diagnose(
            replace(
                known,
                participant=shared,
                test=times(known.test, factors),
                reference=times(known.reference, factors),
            ),
            None,
            SETTINGS,
        )
        for factors in ([1.0, 1.0], [0.2, 3.0])
    ]
    assert any("EMG has no level" in text for text in answers[0].warnings)
    first, second = ([(c.label, round(c.p, 6)) for c in a.candidates] for a in answers)
    assert first == second


def test_whether_activations_reach_a_record_is_asked_of_emg_that_has_a_level(monkeypatch):
    monkeypatch.setattr(answer_module, "no_cost", lambda *_: Feasibility(True, 12.0))
    of_mvc = case(reference=False)
    for unit, tested in (("fraction_of_mvc", True), ("fraction_of_max", False)):
        participant = replace(of_mvc.participant, emg_unit=unit)
        done = diagnose(replace(of_mvc, participant=participant), None, SETTINGS)
        assert done.gap.no_cost.tested == tested


@pytest.mark.parametrize(
    ("unit", "told"),
    [("fraction_of_mvc", "fraction_of_mvc"), ("fraction_of_max", "fraction_of_mvc_as_predicted")],
)
def test_emg_has_the_unit_in_which_it_is_compared(unit, told):
    known = case(effect=RIGHT)
    participant = replace(known.participant, emg_unit=unit)
    done = diagnose(replace(known, participant=participant), None, SETTINGS)
    assert done.gap.present
    rows = (*done.regions.shows, *done.regions.enters, *done.shrinkage.groups)
    units = {row.unit for row in rows if row.unit.startswith("fraction")}
    for table in done.curves.values():
        units |= {u for u in table.get("unit", ()) if u.startswith("fraction")}
    assert units == {told}


def test_what_a_cause_leaves_is_told_with_the_factors_of_the_person(found_by_evidence, by_evidence):
    """As the shrinkage is: the overlay shows both, and its table of causes says the share."""
    done = found_by_evidence
    table = done.curves["overlay"]
    whole, left = (
        float(np.sqrt(np.mean(values**2)))
        for values in (table["difference"], table["difference"] - table["with_effect"])
    )
    assert left < whole
    assert all(c.unexplained_share <= 1.0 for c in done.candidates)
    factors = done.curves["factors"]
    best = factors[factors["label"] == done.candidates[0].label]["factor"]
    assert not np.allclose(best, 1.0, atol=1e-3)


def test_a_class_with_another_movement_says_what_would_tell():
    moved = np.zeros((DOF, 3))
    moved[1, 0], moved[8, 1] = 12.0, 9.0
    done = diagnosed(emg=False, moved=moved)
    texts = [c.text for c in done.classes if c.labels[0] == MOVED]
    assert texts or done.candidates[0].label != MOVED
    assert not [text for text in texts if "each effect alone" in text]


def test_variants_start_from_the_movements_solved_last(monkeypatch):
    """A cause that only fits after solving again is no less stable for that."""
    cause = "body/joint_damping/EL"
    shape = AMOUNT * smooth_change("solved only f0_factor", channel_names(CHANNELS, False))

    def solved_again(first, residual, *rest):
        value = np.zeros_like(first.hypothesis.value)
        if first.label == cause:
            value = residual.compress([shape] * len(residual.tasks))[:, None]
        slope = np.tile(1e-3 * value, first.hypothesis.slope.shape[1])
        hypothesis = replace(first.hypothesis, value=value, slope=slope)
        return fit(hypothesis, residual, SETTINGS.signature_error)

    monkeypatch.setattr(search, "_refit_or_keep", solved_again)
    answer = diagnose(case(effect="solved only "), None, replace(SETTINGS, short_list=1000))
    assert answer.candidates[0].label == cause
    assert answer.robustness.agree == answer.robustness.cells


def test_the_right_cause_removes_more_than_random_forces_do(found):
    shares = dict(found.curves["controls"].itertuples(index=False))
    assert set(shares) == {"black box", "placebo 1", "placebo 2", "placebo 3"}
    kept = found.shrinkage.held_out_trial.value
    assert kept > 0.5
    # The made-up effect shows in three channels, so factors of a person let one force follow it.
    by_chance = sorted(shares[f"placebo {i}"] for i in (1, 2, 3))
    assert by_chance[1] < 0.5 * kept
    assert by_chance[2] < 0.75 * kept
    new = found.shrinkage.new_task
    assert new.ci95[0] <= new.value <= new.ci95[1]
    assert new.ci95[0] < new.ci95[1]
    left_out = found.curves["left_out"]
    assert set(left_out.task) == set(TASKS)
    assert np.all(left_out.after < left_out.before)
    assert new.n_trials == found.shrinkage.held_out_trial.n_trials == len(found.inputs.test)


def test_random_forces_remove_little_where_no_factors_of_a_person_let_them():
    exact = diagnose(case(effect=RIGHT), None, replace(SETTINGS, signature_error=0.0))
    shares = dict(exact.curves["controls"].itertuples(index=False))
    kept = exact.shrinkage.held_out_trial.value
    assert all(shares[f"placebo {i}"] < 0.5 * kept for i in (1, 2, 3))


@pytest.mark.parametrize(
    ("in_sample", "new_task", "words"),
    [
        (0.9, 0.4, ["much less went on tasks left out"]),
        (0.9, 0.8, []),
        (0.9, None, []),
        (None, None, ["nothing to remove"]),
    ],
)
def test_what_a_shrinkage_does_not_show_is_said(in_sample, new_task, words):
    shares = [None if v is None else Share(v, (0.0, 1.0), 6) for v in (in_sample, None, new_task)]
    left_out = [] if new_task is None else [LeftOutRow("lift", 2.0, 2.0 - new_task)]
    remarks = _remarks_on_shrinkage(Explained(Shrinkage(*shares, ()), left_out, []))
    assert len(remarks) == len(words)
    assert all(word in remark for word, remark in zip(words, remarks, strict=True))


def failing(*tasks):
    """A nominal model that cannot do some tasks."""

    def task_signatures(task, *rest):
        if task in tasks:
            raise SolveError(f"movement {task}: not solved")
        return made_up_response(task, *rest)

    return task_signatures


def test_a_task_that_cannot_be_solved_is_left_out_with_its_reason(monkeypatch):
    monkeypatch.setattr(assembly, "task_signatures", failing("low"))
    done = diagnosed(effect=RIGHT)
    assert any("task low is left out: movement low: not solved" in line for line in done.warnings)
    assert done.candidates[0].label == RIGHT
    monkeypatch.setattr(assembly, "task_signatures", failing(*TASKS))
    with pytest.raises(SolveError, match="not solved"):
        diagnosed(effect=RIGHT)


def test_an_effect_that_the_reference_trials_have_is_told():
    """A strength that is lost in the reference trials is no cause in the test trials."""
    known = case(effect=RIGHT)
    told = f"{RIGHT} in the reference trials would explain the difference better"
    assert not any(told in line for line in diagnose(known, None, SETTINGS).warnings)
    exchanged = replace(known, test=known.reference, reference=known.test)
    assert any(told in line for line in diagnose(exchanged, None, SETTINGS).warnings)


def test_equal_trials_show_no_gap(by_evidence):
    done = diagnosed(by_evidence)
    assert not done.gap.present
    assert done.no_gap_p >= 0.5
    assert not {"controls", "left_out"} & set(done.curves)
    assert "no_gap" in done.set90
    assert done.shrinkage is None
    assert done.regions.shows == ()


@pytest.mark.parametrize("share", [4.0, 0.0])
def test_a_gap_of_one_trial_is_none_and_the_trial_is_named(share):
    """One test trial of each task: changed are those of both, or that of one."""
    every = case(effect=RIGHT, shares={"high": 4.0, "low": share})
    first = [t for t in every.test if t.repeat == 0]
    done = diagnose(make_case(every.participant, first, every.reference, threads=1), None, SETTINGS)
    assert done.gap.present == (share > 0.0)
    rests = [text for text in done.warnings if "the gap rests on test trial high_r0" in text]
    assert len(rests) == (share == 0.0)
    assert (done.gap.p_value > SETTINGS.alpha) == (share == 0.0)


def test_a_gap_of_the_only_trial_of_a_side_comes_with_a_warning():
    every = case(effect=RIGHT, shares={"high": 4.0, "low": 4.0})
    first = [next(t for t in every.test if t.task == "high")]
    few = [t for t in every.reference if t.task == "high"]
    done = diagnose(make_case(every.participant, first, few, threads=1), None, SETTINGS)
    assert done.gap.present
    [text] = [text for text in done.warnings if "is the only one of its side" in text]
    assert text.startswith(f"test trial {first[0].name} ")


def test_no_gap_of_one_trial_against_one_comes_with_a_warning():
    done = diagnosed(repeats=1)
    assert not done.gap.present
    [text] = [text for text in done.warnings if text.startswith("no gap says little here")]
    assert "one test and one reference trial" in text
    assert not any("no gap says little" in text for text in diagnosed().warnings)


def test_the_effect_behind_a_gap_is_named(whole_library):
    done = diagnosed(effect=RIGHT)
    assert done.gap.present
    assert RIGHT in done.candidates[0].label
    assert RIGHT in " ".join(done.set90)
    assert {region.channel for region in done.regions.shows} & {"EL_rx", *CHANNELS}
    assert done.gap.floor_source == "repeats"
    assert any("null bank" in warning for warning in done.warnings)
    low, high = done.gap.size.ci95
    assert 0.0 < low < done.gap.size.value < high
    table = done.curves["shows"]
    for region in done.regions.shows:
        own = table[table["channel"] == region.channel].set_index("phase_percent")["repeated"]
        assert set(own[slice(*region.phase_percent)]) == {region.repeated}
    assert set(done.curves["overlay"]["compared_with"]) == {"reference trials"}


def named(done):
    """Probabilities by label."""
    return {c.label: c.p for c in done.candidates}


def test_another_movement_with_the_emg_it_asks_for_is_no_fault_of_the_body():
    amounts = np.random.default_rng(5).normal(size=(DOF, 3)) * [6.0, 3.0, 2.0]
    done = diagnosed(moved=amounts)
    first, second = done.candidates[:2]
    assert done.gap.present
    assert done.status == "ok", done.status_reason
    assert first.label == MOVED
    # Who moved in another way may have any weak fault as well: they share what is left.
    assert first.p > 2.0 * second.p
    assert done.set90[0] == MOVED
    [size] = first.parameters
    assert size.value == pytest.approx(np.sqrt(np.sum(amounts**2) / DOF), rel=0.1)
    assert done.shrinkage.held_out_trial.value > 0.5


def test_motion_alone_does_not_tell_a_body_from_another_movement(found_by_motion):
    done = found_by_motion
    assert done.gap.present
    assert done.status == "abstained"
    assert "motion alone cannot tell" in done.status_reason
    assert RIGHT in done.set90
    assert MOVED in named(done)


def test_where_motion_cannot_tell_no_more_of_it_is_asked_for_whatever_else_speaks_against():
    """Tasks that disagree are the reason there, and motion alone cannot tell even so."""
    done = diagnosed(effect=RIGHT, emg=False, shares={"high": 2.0, "low": 0.0})
    assert done.gap.present
    assert "motion alone cannot tell" not in done.status_reason
    assert done.next_trial is None
    assert any("motion alone cannot tell" in warning for warning in done.warnings)
    by_evidence = diagnosed(effect=RIGHT, shares={"high": 2.0, "low": 0.0})
    assert by_evidence.status == "abstained"
    assert "" not in by_evidence.warnings


def test_a_gap_of_one_task_is_told_though_the_mean_over_tasks_hides_it():
    done = diagnosed(effect=RIGHT, shares={"high": 0.09, "low": -0.09})
    assert done.gap.present
    told = [one for one in done.warnings if "stands out in task" in one]
    assert len(told) == 1, done.warnings
    assert "no channel over all tasks together" in told[0]


def test_only_people_and_not_simulations_choose_their_movement():
    """What two simulations may differ by is another model, and no other movement."""
    simulations = replace(SETTINGS, of_simulations=True)
    for reference, settings in ((True, SETTINGS), (True, simulations), (False, SETTINGS)):
        some = case(reference=reference)
        records = read_records(some, None, settings, [])
        evidence = assembly.assemble(some, records, None, settings, [])
        chosen = reference and settings is SETTINGS
        assert tuple(evidence.known) == (STIFFNESSES if chosen else STIFFNESSES[:1])
        assert (len(evidence.residuals) > 1) is chosen
        families = {effect.family for effect in effects_of(some, records, None, settings)}
        assert ("thorax_surface" in families) is not chosen


def test_motion_alone_finds_a_turned_frame_and_says_that_a_posture_looks_alike():
    label = "input/frame_misalignment/scapula"
    motion = case(emg=False)
    records = read_records(motion, None, SETTINGS, [])
    frame = next(e for e in effects_of(motion, records, None, SETTINGS) if e.label == label)
    off = np.array([12.0, -9.0, 10.0])
    done = diagnosed(emg=False, observe=lambda record: frame.observe(record, off))
    assert done.status == "ok"
    assert any("posture held differently" in warning for warning in done.warnings)
    assert done.candidates[0].label == label
    assert done.candidates[0].p <= 0.5
    [first, *_] = done.classes
    assert {label, MOVED} <= set(first.labels)
    assert first.p > 0.5
    assert done.next_trial is None
    for found, amount in zip(done.candidates[0].parameters, off, strict=True):
        assert found.value == pytest.approx(amount, abs=1.5)


def test_a_cause_that_other_assumptions_replace_is_at_most_as_probable_as_not(
    monkeypatch, by_evidence, found_by_evidence
):
    assert max(named(found_by_evidence).values()) > 0.5
    monkeypatch.setattr(answer_module, "robustness", lambda *_: (Robustness(8, 2), []))
    done = diagnosed(by_evidence, effect=RIGHT)
    assert done.status == "abstained"
    assert "2 of 8 variants" in done.status_reason
    assert max(named(done).values()) <= 0.5


@pytest.mark.parametrize(
    ("low", "first", "status", "why"),
    [
        (0.5, RIGHT, "abstained", "different amplitudes"),
        (0.0, RIGHT, "abstained", "left out of the fit"),
        # What tasks share as little as this looks like another movement in each of them.
        (-0.5, MOVED, "ok", ""),
    ],
)
def test_a_cause_that_tasks_disagree_about_is_not_named(
    by_evidence, found_by_evidence, low, first, status, why
):
    done = diagnosed(by_evidence, effect=RIGHT, shares={"high": 1.5, "low": low})
    assert found_by_evidence.candidates[0].p > 0.5
    assert max(named(done).values()) <= 0.5
    assert done.gap.present
    assert done.status == status
    assert done.candidates[0].label == first
    assert why in done.status_reason


@pytest.mark.parametrize(
    "how",
    [
        {"emg": False},
        {"emg": False, "contact": True},
        {"contact": True},
        {"reference": False},
        {"emg": False, "reference": False, "repeats": 1},
        {"repeats": 1},
        {"tasks": ("high",)},
        {"tasks": ("high",), "repeats": 1, "reference": False},
    ],
    ids=str,
)
def test_missing_data_still_give_a_valid_answer(how, found_by_motion):
    done = found_by_motion if how == {"emg": False} else diagnosed(effect=RIGHT, **how)
    if not how.get("emg", True):
        assert done.untestable == tuple(e for e in NEEDING if e.startswith("measurement/e"))
        assert not done.gap.no_cost.tested
    if how.get("repeats") == 1:
        assert done.gap.floor_source == "configuration"
        assert any("no task was repeated" in warning for warning in done.warnings)
        assert done.curves["shows"]["repeated"].isna().all()
        assert {region.repeated for region in done.regions.shows} <= {None}
    hidden = done.gap.present and not done.gap.size.value
    assert (NO_EXCESS in done.warnings) == hidden
    assert (NO_INTERVAL in done.warnings) == (how.get("repeats") == 1 and not hidden)
    assert (done.gap.size.ci95 is None) == (how.get("repeats") == 1 or hidden)
    if not how.get("reference", True):
        assert any("no reference trials" in warning for warning in done.warnings)
        assert set(done.curves["overlay"]["compared_with"]) == {"model"}
    if how.get("tasks") and done.shrinkage:
        assert done.shrinkage.new_task is None


@pytest.mark.parametrize(
    ("emg", "contact", "kinds"),
    [
        (False, False, [(False, False)]),
        (True, False, [(True, False), (False, False)]),
        (True, True, [(True, True), (True, False), (False, True), (False, False)]),
    ],
)
def test_an_effect_free_case_vouches_for_all_its_kinds(emg, contact, kinds):
    # One draw of noise: in one of seven the largest of these comes to 1.03.
    rows = null_cases(case(emg=emg, contact=contact, seed=1000), None, SETTINGS)
    assert [(row.emg, row.contact) for row in rows] == kinds
    assert all(0.0 < row.largest < 1.0 for row in rows)
    # Fewer channels, other values.
    assert len({row.max_t for row in rows}) == len(kinds)


def test_names_and_order_do_not_matter(found):
    given = case(effect=RIGHT)
    renamed = [
        [replace(t, name=f"{i}", task=t.task[::-1]) for i, t in enumerate(reversed(trials))]
        for trials in (given.test, given.reference)
    ]
    other = make_case(replace(given.participant, id="y"), *renamed, threads=1)
    same = diagnose(other, None, SETTINGS)
    assert [c.label for c in found.candidates] == [c.label for c in same.candidates]
    np.testing.assert_allclose([c.p for c in found.candidates], [c.p for c in same.candidates])
    assert found.gap == same.gap


def test_a_new_solution_counts_only_with_more_evidence(monkeypatch, found):
    """Where solving again explains less, the derivative is no worse an approximation."""

    def useless(first, residual, *rest):
        nothing = np.zeros_like(first.hypothesis.slope)
        return fit(replace(first.hypothesis, slope=nothing), residual, SETTINGS.signature_error)

    monkeypatch.setattr(search, "_refit_or_keep", useless)
    assert diagnosed(effect=RIGHT).candidates[0] == found.candidates[0]


def test_predictions_have_no_null_bank():
    answer = diagnose(case(), None, replace(SETTINGS, view="prediction"))
    assert any("predicted from the humerus" in text for text in answer.warnings)
    assert answer.hashes["null_bank"] is None


def compared_on_a_hidden_task(monkeypatch, value, reference, factor=1.0):
    """Difference of a hidden task in which one EMG channel is half as loud again, and what an
    answer with a gain of `value` removes of it, if the person shows `factor` times the effect."""
    monkeypatch.setattr(hidden_task, "task_signatures", made_up_response)
    plain = trial("high", 0, np.zeros((NODES, len(EVERY))), True, False, 5)
    louder = replace(plain.emg, values=plain.emg.values * [1.0, 1.5])
    whole = case(reference=reference)
    hidden = replace(
        whole, test=(replace(plain, emg=louder),), reference=(plain,) if reference else ()
    )
    label = "measurement/emg_gain/EMG_b"
    candidate = {"label": label, "parameters": [{"name": "gain_factor", "value": value}]}
    names = channel_names(whole.channels, False)
    factors = pd.DataFrame(factor, index=[label], columns=names)
    errors = pd.Series({"stiffness": 1.0, "marker_share": 1.0, "electrode_share": 1.0})
    there, removed = hidden_task._compared(
        whole, hidden, candidate, factors, errors, None, SETTINGS
    )
    return there.delta, removed


@pytest.mark.parametrize(
    ("value", "factor", "share"),
    [(1.5, 1.0, 1.0), (1.0, 1.0, 0.0), (1.25, 1.0, 0.5), (1.25, 2.0, 1.0)],
)
def test_truth_on_a_hidden_task_is_what_the_answer_removes_of_it(monkeypatch, value, factor, share):
    delta, removed = compared_on_a_hidden_task(monkeypatch, value, True, factor)
    before, after = np.linalg.norm(delta), np.linalg.norm(delta - removed)
    assert 1.0 - after / before == pytest.approx(share, abs=1e-9)


@pytest.mark.parametrize("value", [1.5, 1.0, 1.25])
def test_hidden_task_without_reference_is_compared_with_its_prediction(monkeypatch, value):
    """The made-up model predicts what is recorded, so that nothing is left to remove."""
    delta, _ = compared_on_a_hidden_task(monkeypatch, value, reference=False)
    np.testing.assert_allclose(delta, 0.0, atol=1e-12)


def test_a_hidden_task_that_a_cause_leaves_as_it_is_has_no_gap_to_remove(tmp_path):
    """Who keeps a movement may show nothing in what was recorded: no reason to refuse a score."""
    same = {"time_s": [0.0, 0.5, 1.0], "angles_deg": np.zeros((3, 10)).tolist()}
    key = {"hidden_task": {"test": same, "reference": same}, "mode": {"reference": True}}
    opened = ScoredCase(tmp_path, tmp_path, key, None, 0.0)
    nowhere = tmp_path / "no_such.yaml"
    assert hidden_task.hidden_shrinkage(opened, {"label": RIGHT}, nowhere, tmp_path) is None
    key["mode"]["reference"] = False
    with pytest.raises(ConfigError, match="no_such"):
        hidden_task.hidden_shrinkage(opened, {"label": RIGHT}, nowhere, tmp_path)


def test_hidden_trials_have_the_emg_that_the_case_compares():
    """An electrode that was off on a visible trial is compared nowhere."""
    time = [0.0, 0.5, 1.0]
    emg = [[0.1, 0.3], [0.2, 0.4], [0.3, 0.5]]
    curves = {"time_s": time, "angles_deg": np.linspace(0.0, 40.0, 30).reshape(3, 10), "emg": emg}
    read = noise_free_trial(curves, ["EMG_a", "EMG_b"], "hidden", "test")
    kept = hidden_task._with_channels(read, SimpleNamespace(channels=("EMG_b",)))
    assert kept.emg.channels == ("EMG_b",)
    np.testing.assert_array_equal(kept.emg.values, [[0.3], [0.4], [0.5]])
    assert hidden_task._with_channels(read, SimpleNamespace(channels=())).emg is None


def test_hidden_trials_and_pairs_are_read_in_their_own_order():
    time = [0.0, 0.5, 1.0]
    angles = np.linspace(0.0, 40.0, 30).reshape(3, 10)
    curves = {"time_s": time, "angles_deg": angles.tolist(), "emg": [[0.1], [0.2], [0.3]]}
    channels = ["SC_rx", "EMG_b"]
    read = noise_free_trial(curves, channels, "hidden", "test")
    np.testing.assert_allclose(np.rad2deg(read.angles_rad), angles)
    assert read.emg.channels == ("EMG_b",)
    assert read.contact is None
    force = [[1.0, 2.0, 3.0]] * 3
    read = noise_free_trial({**curves, "emg": None, "force_N": force}, channels, "hidden", "test")
    assert read.emg is None
    np.testing.assert_allclose(read.contact.force_N, force)
    effects = library(Setup(("biceps",), CHANNELS, (CHANNELS,), False))
    load, weak = (
        next(e for e in effects if e.label == label) for label in ("body/hand_load", RIGHT)
    )
    for known in (effects, effects[::-1]):
        candidate = {"label": f"{load.label} + {weak.label}"}
        assert hidden_task._ordered(known, candidate) == [load, weak]


def test_a_difference_as_it_is_predicted_is_answered_with_its_effect():
    """As recorded, the same errors are most probable as in the diagnosis."""
    whole = case()
    records = read_records(whole, None, SETTINGS, [])
    found = assembly.assemble(whole, records, None, SETTINGS, [])
    again = with_difference(replace(found, settings=SETTINGS), found.residual.delta)
    assert again.session_shares == found.session_shares
    np.testing.assert_allclose(again.residual.covariance, found.residual.covariance)
    effect = {"label": RIGHT, "parameter": "f0_factor", "amplitude": 0.4}
    key = {"person": "yields", "effects": [effect]}
    delta = limits._predicted(key, found)
    [known] = [one for one in found.known[STIFFNESSES[0]] if one.label == RIGHT]
    np.testing.assert_allclose(delta, known.slope[:, 0] * np.log(0.4))
    key |= {"mode": {"reference": True}, "shown": True, "kind": "single"}
    scored = limits.ScoredCase(Path("it"), Path("it"), key, None, 0.0)
    inflation = inflation_of(found, whole)
    row = limits._row(scored, "as_predicted", with_difference(found, delta), inflation)
    assert (row.present, row.first, row.right, row.left) == (True, RIGHT, True, False)
    nothing = limits._row(scored, "as_predicted", with_difference(found, 0.0 * delta), inflation)
    assert not nothing.present
    for unknown in ({"label": "unknown/far/friction"}, {"parameter": None}):
        assert limits._predicted({**key, "effects": [effect | unknown]}, found) is None


def test_persons_who_are_as_assumed_are_answered_with_their_cause(monkeypatch):
    whole = case()
    records = read_records(whole, None, SETTINGS, [])
    found = replace(assembly.assemble(whole, records, None, SETTINGS, []), settings=SETTINGS)
    monkeypatch.setattr(assumed_answers, "evidence_of", lambda *_: (found, whole))
    table = assumed_answers.assumed_answers([Path("it")], 12, 1, Path("a.yaml"), Path())
    assert table["kind"].value_counts().to_dict() == {
        "single": 6, "pair": 2, "unknown": 2, "nothing": 1, "movement": 1,
    }  # fmt: skip
    singles = table[(table["kind"] == "single") & table["shown"]]
    assert singles["present"].mean() > 0.5
    assert singles.loc[singles["present"], "right_p"].mean() > 0.5
    assert rates(table, SETTINGS)["persons"]["single"] == 6


def test_keys_without_noise_free_curves_are_named(tmp_path):
    (tmp_path / "cases" / "it").mkdir(parents=True)
    (tmp_path / "it.json").write_text("{}", encoding="utf-8")
    with pytest.raises(DataError, match=r"it\.json: key 'noise_free' is missing"):
        limits.limits(tmp_path / "cases", tmp_path, Path("config.yaml"), tmp_path)
