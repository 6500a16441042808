"""The table of EMG channels fits the model, and a wrong table is refused with its place."""

import csv
from pathlib import Path

import numpy as np
import pytest
from emg_study import CHANNELS, CONFIG

from scapulohumeral.emg.channels import read_channels
from scapulohumeral.errors import DataError, ModelError

pytestmark = pytest.mark.unit


@pytest.fixture(scope="module")
def muscles() -> dict[str, str]:
    """Muscle that each element of the model belongs to."""
    with (CONFIG / "model" / "muscles.csv").open(encoding="utf-8") as handle:
        return {row["muscle"]: row["group"] for row in csv.DictReader(handle)}


def test_eight_channels_in_six_groups() -> None:
    assert len(CHANNELS.names) == 8
    assert len(CHANNELS.groups) == len(CHANNELS.scaled_muscles) == 6
    assert CHANNELS.channel_groups.count("scapular_deltoid") == 2
    assert CHANNELS.channel_groups.count("scapular_trapezius") == 2


def test_channel_is_the_mean_of_its_elements(muscles: dict[str, str]) -> None:
    names = list(muscles)
    excitations = np.zeros(len(names))
    excitations[[names.index("infra_2"), names.index("infra_4")]] = [0.6, 0.3]
    values = dict(zip(CHANNELS.names, CHANNELS.matrix(names) @ excitations, strict=True))
    assert values.pop("infraspinatus") == pytest.approx(0.3)
    assert not any(values.values())


def test_scalers_act_on_whole_muscles(muscles: dict[str, str]) -> None:
    members = CHANNELS.members(list(muscles.values()))
    deltoid = members[CHANNELS.groups.index("scapular_deltoid")]
    selected = [name for name, member in zip(muscles, deltoid, strict=True) if member]
    assert selected == [f"delt_scap_{k}" for k in range(1, 10)] + ["delt_scap10", "delt_scap11"]
    assert members.sum(axis=0).max() == 1


def test_every_channel_sees_elements_that_its_group_scales(muscles: dict[str, str]) -> None:
    seen = CHANNELS.matrix(list(muscles)) > 0.0
    members = CHANNELS.members(list(muscles.values()))
    for channel, group in enumerate(CHANNELS.channel_groups):
        assert members[CHANNELS.groups.index(group), seen[channel]].all()


def test_neighbours_are_mutual() -> None:
    adjacency = CHANNELS.adjacency()
    assert (adjacency == adjacency.T).all()
    assert not adjacency.diagonal().any()
    assert not adjacency[CHANNELS.names.index("serratus_anterior")].any()


def test_model_without_an_element_is_refused(muscles: dict[str, str]) -> None:
    with pytest.raises(ModelError, match="infraspinatus: element infra_2 is not in the model"):
        CHANNELS.matrix([name for name in muscles if name != "infra_2"])
    with pytest.raises(ModelError, match="infraspinatus: the model has no element of 'infra'"):
        CHANNELS.members([muscle for muscle in muscles.values() if muscle != "infra"])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("anterior_deltoid,cl", "lateral_deltoid,cl", "row 3, column channel: .* twice"),
        ("infra_2 infra_3 infra_4", "", "row 6, column elements: none for 'infraspinatus'"),
        ("delt_scap,delt_scap_3", "infra,delt_scap_3", "row 5, column scaled_muscle: 'infra'"),
        ("trap_clav_1,upper_trapezius", "trap_clav_1,", "row 7, column neighbours: 'clavicular_"),
        ("trap_clav_1,upper_trapezius", "trap_clav_1,upper", "row 2, column neighbours: 'upper'"),
        ("group,", "groups,", "row 1: missing column group"),
    ],
)
def test_wrong_table_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = (CONFIG / "emg" / "channels.csv").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "channels.csv"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DataError, match=message):
        read_channels(path)
