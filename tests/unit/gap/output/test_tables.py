"""Every table of a diagnosis holds what its columns say, for a difference that is known."""

import base64
import io
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from gap_files import GAIN, finished_diagnosis
from gap_movement import CHANNELS, NODES, SETUP

from scapulohumeral.gap.curve_files import TABLES, read_table, write_curves
from scapulohumeral.gap.detection.presence import DifferenceMap
from scapulohumeral.gap.detection.regions import EnteringCurve
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.isolation.channel_gains import gain_factors
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.laplace import TaskAmplitude, fit
from scapulohumeral.gap.output.figures import CIRCLES, NO_HALVES, figures
from scapulohumeral.gap.output.tables import (
    amplitude_table,
    enters_table,
    factors_table,
    isolability_table,
    overlay_table,
    shows_table,
    signature_table,
)
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.residual import Residual

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
TASKS = ("a", "b")
FUNCTIONS = phase_functions(NODES, 4)
# Standard deviation of every coefficient without any effect.
NOISE = 0.5
ERROR = 0.1
EFFECTS = {effect.label: effect for effect in library(SETUP)}
DAMPING, LOAD = "body/joint_damping/GH", "body/hand_load"
GAIN_A = GAIN.replace("EMG_infra", "EMG_a")
CHANNEL = 3
# Coefficients of the difference of that channel in the first task.
SHAPE = np.array([3.0, -2.0, 1.0, 0.5])


def residual():
    """One channel differs, in the second task twice as much."""
    delta = np.zeros((len(TASKS), len(NAMES), len(SHAPE)))
    delta[:, CHANNEL] = SHAPE * [[1.0], [2.0]]
    covariance = NOISE**2 * np.eye(delta.size)
    return Residual(delta.ravel(), covariance, covariance, FUNCTIONS, TASKS, NAMES, (5.0, 5.0))


def fitted(label, there):
    """An effect that changes what differs, and a little of another channel, fitted."""
    effect = EFFECTS[label]
    slope = np.zeros((len(there.delta), len(effect.params)))
    slope[:, 0] = there.delta + 0.1 * np.roll(there.delta, len(SHAPE))
    nothing, off = np.zeros((len(slope), 1)), np.zeros(slope.shape[1])
    return fit(Hypothesis((effect,), off, nothing, slope, 1.0), there, ERROR)


def row_of(table, **key):
    """The row with these values."""
    for name, value in key.items():
        table = table[table[name] == value]
    assert len(table) == 1
    return table.iloc[0]


@pytest.fixture(name="there")
def _there():
    return residual()


def shown(sigma):
    """A map of these z values whose threshold is 4."""
    null = np.linspace(1.0, 4.0, 100)
    return DifferenceMap(
        sigma,
        sigma,
        float(np.abs(sigma).max()),
        4.0,
        0.01,
        null,
        np.full(sigma.shape, 1.96),
        sigma[None],
    )


def map_with_two_regions():
    """One region at the end of a channel, and one in the middle of another."""
    sigma = np.zeros((NODES, len(NAMES)))
    sigma[-4:, CHANNEL] = 5.0
    sigma[4:8, 0] = -6.0
    return shown(sigma)


def halves_with_the_first_region_only(there):
    """Both halves have what shows in `CHANNEL`; what shows in channel 0 only one has."""
    curves = np.zeros((2, len(TASKS), NODES, len(NAMES)))
    curves[:, :, -4:, CHANNEL] = 20.0
    curves[0, :, 4:8, 0] = -20.0
    return [there.compress(list(half)) for half in curves]


def test_points_are_repeated_if_both_halves_have_their_region(there):
    found = map_with_two_regions()
    table = shows_table(there, found, halves_with_the_first_region_only(there))
    assert tuple(table.columns) == TABLES["shows"]
    assert len(table) == NODES * len(NAMES)
    grids = {
        name: table.pivot(index="phase_percent", columns="channel", values=name)[list(NAMES)]
        for name in ("effect_sigma", "repeated")
    }
    np.testing.assert_array_equal(grids["effect_sigma"], found.sigma)
    assert set(table["threshold_sigma"]) == {4.0}
    expected = np.full(found.sigma.shape, None, dtype=object)
    expected[-4:, CHANNEL], expected[4:8, 0] = True, False
    np.testing.assert_array_equal(grids["repeated"].to_numpy(dtype=object), expected)
    np.testing.assert_allclose(grids["repeated"].index, np.linspace(0.0, 100.0, NODES))


def test_nothing_is_said_of_halves_that_are_not_there(there):
    one = halves_with_the_first_region_only(there)[:1]
    for halves in (one, []):
        assert shows_table(there, map_with_two_regions(), halves)["repeated"].isna().all()


def drawn(there, halves):
    """The figure of the map with two regions."""
    table = shows_table(there, map_with_two_regions(), halves)
    return figures(finished_diagnosis(curves={"shows": table}))["shows"]


def test_circles_are_drawn_where_a_region_is_not_repeated(there):
    """Two signs; the circle about the one of the region that only one half has is visible."""
    halves = halves_with_the_first_region_only(there)
    both = [halves[0], halves[0]]
    visible = [drawn(there, chosen).svg.count("stroke: #333333") for chosen in (halves, both, [])]
    assert visible[0] == visible[1] + 1
    assert visible[1] == visible[2]


def test_the_caption_says_if_there_are_too_few_trials_for_halves(there):
    caption = drawn(there, halves_with_the_first_region_only(there)).caption
    assert CIRCLES in caption
    assert NO_HALVES not in caption
    caption = drawn(there, []).caption
    assert NO_HALVES in caption
    assert CIRCLES not in caption


def test_curves_that_enter_keep_their_names_units_and_thresholds():
    curve = np.linspace(-1.0, 2.0, NODES)
    table = enters_table(
        [
            EnteringCurve("dof", "GH_rz", curve, np.full(NODES, 0.7), "N m"),
            EnteringCurve("channel", "EMG_a", 2.0 * curve, 0.1 * curve, "fraction_of_mvc"),
        ]
    )
    assert tuple(table.columns) == TABLES["enters"]
    assert len(table) == 2 * NODES
    last = row_of(table, name="EMG_a", phase_percent=100.0)
    assert (last["kind"], last["unit"]) == ("channel", "fraction_of_mvc")
    assert (last["effect"], last["threshold"]) == (4.0, 0.2)
    first = row_of(table, name="GH_rz", phase_percent=0.0)
    assert (first["kind"], first["unit"], first["effect"]) == ("dof", "N m", -1.0)


def test_overlay_has_the_difference_its_explanation_and_the_floor(there):
    best = fitted(DAMPING, there)
    table = overlay_table(there, best.predicted, referenced=True)
    assert tuple(table.columns) == TABLES["overlay"]
    assert len(table) == len(TASKS) * len(NAMES) * NODES
    part = table[(table["task"] == "b") & (table["channel"] == NAMES[CHANNEL])]
    np.testing.assert_allclose(part["difference"], FUNCTIONS @ (2.0 * SHAPE))
    np.testing.assert_allclose(part["with_effect"], there.curves(best.predicted)[1, :, CHANNEL])
    half = 1.96 * NOISE * np.sqrt(np.sum(FUNCTIONS**2, axis=1))
    np.testing.assert_allclose(part["floor_high"], half)
    np.testing.assert_allclose(part["floor_low"], -half)
    units = table.groupby("channel")["unit"].first()
    assert units["AC_rx"] == "deg"
    assert units["EMG_a"] == "fraction_of_mvc"


@pytest.mark.parametrize(
    ("referenced", "words", "others"),
    [
        (True, "test minus reference trials", "recorded minus model"),
        (False, "recorded minus model", "test minus reference trials"),
    ],
)
def test_the_overlay_says_what_is_subtracted_from_what(there, referenced, words, others):
    best = fitted(DAMPING, there)
    table = overlay_table(there, best.predicted, referenced)
    drawn = figures(finished_diagnosis(curves={"overlay": table}))["overlay"]
    for text in (drawn.caption, drawn.svg):
        assert words in text
        assert others not in text
    assert "no effect" in drawn.svg
    coded = drawn.data_uri.partition("base64,")[2]
    numbers = pd.read_csv(io.BytesIO(base64.b64decode(coded)))
    panel = f"b, {NAMES[CHANNEL]}"
    shown = numbers[f"{panel} | {words}, deg"]
    np.testing.assert_allclose(shown, FUNCTIONS @ (2.0 * SHAPE), rtol=1e-4)
    assert not numbers[f"{panel} | no effect, deg"].any()
    np.testing.assert_allclose(
        numbers[f"{panel} | most probable effect, deg"],
        there.curves(best.predicted)[1, :, CHANNEL],
        rtol=1e-4,
    )


def test_signature_splits_the_gap_into_the_effect_and_a_rest(there):
    best = fitted(DAMPING, there)
    table = signature_table(there, best.predicted)
    assert tuple(table.columns) == TABLES["signature"]
    np.testing.assert_allclose(
        table["residual_sigma"], table["signature_sigma"] + table["rest_sigma"], atol=1e-12
    )
    deviation = NOISE * np.sqrt(np.sum(FUNCTIONS**2, axis=1))
    own = table[table["channel"] == NAMES[CHANNEL]]
    expected = 3.0 / np.sqrt(2.0) * (FUNCTIONS @ SHAPE) / deviation
    np.testing.assert_allclose(own["residual_sigma"], expected)
    untouched = table[table["channel"] == "EMG_b"]
    assert not untouched["residual_sigma"].any()


def test_isolability_names_each_two_effects_once(there):
    fits = [fitted(label, there) for label in (DAMPING, LOAD, GAIN_A)]
    apart = np.array([[np.nan, 0.6, 0.7], [0.6, np.nan, 0.9], [0.7, 0.9, np.nan]])
    table = isolability_table(fits, apart)
    assert tuple(table.columns) == TABLES["isolability"]
    found = {frozenset((row.label_a, row.label_b)): row.p_apart for row in table.itertuples()}
    assert found == {
        frozenset((DAMPING, LOAD)): 0.6,
        frozenset((DAMPING, GAIN_A)): 0.7,
        frozenset((LOAD, GAIN_A)): 0.9,
    }


def test_amplitudes_have_their_interval_in_their_own_unit(there):
    """A factor is estimated as a logarithm, so that its interval is lopsided."""
    best = fitted(GAIN_A, there)
    by_task = [TaskAmplitude("a", np.log(2.0), 0.05), TaskAmplitude("b", 0.0, 9.0)]
    table = amplitude_table(best, by_task, 4.0)
    assert tuple(table.columns) == TABLES["amplitude"]
    row = row_of(table, task="a")
    assert (row["parameter"], row["unit"]) == ("gain_factor", "1")
    assert row["value"] == pytest.approx(2.0)
    assert (row["low"], row["high"]) == pytest.approx((2.0 * np.exp(-0.196), 2.0 * np.exp(0.196)))
    row, [param] = row_of(table, task="b"), best.hypothesis.effects[0].params
    assert (row["low"], row["high"]) == pytest.approx((param.low, param.high))


def test_factors_belong_to_their_effect_and_channel(there):
    """They are those under the movement that the effect supposes."""
    moved = replace(there, covariance=4.0 * there.covariance, moved_deg=6.0)
    one, other = fitted(DAMPING, moved), fitted(GAIN_A, there)
    table = factors_table({0.0: there, 6.0: moved}, [one, other], ERROR)
    assert tuple(table.columns) == TABLES["factors"]
    assert len(table) == 2 * len(NAMES)
    own = table[table["label"] == DAMPING].set_index("channel")["factor"]
    [expected] = gain_factors(one, moved, ERROR)
    np.testing.assert_allclose(own[list(NAMES)], expected)
    assert own[NAMES[CHANNEL]] != pytest.approx(own["EMG_b"], rel=1e-6)
    assert set(table[table["label"] == GAIN_A]["factor"]) == {1.0}
    assert set(table["effect"]) == {DAMPING, GAIN_A}


def test_written_tables_keep_what_is_not_known(there, tmp_path):
    for halves, known in (([], 0), (halves_with_the_first_region_only(there), 8)):
        write_curves({"shows": shows_table(there, map_with_two_regions(), halves)}, tmp_path)
        assert read_table(tmp_path, "shows")["repeated"].notna().sum() == known
