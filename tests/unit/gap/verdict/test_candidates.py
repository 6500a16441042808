"""How deep the first cause is resolved by what it cannot be told from."""

import pytest

from scapulohumeral.gap.verdict.candidates import _level

pytestmark = pytest.mark.unit

INFRA, SUPRA = "body/strength_loss/infra", "body/strength_loss/supra"
LOAD, GAIN = "body/hand_load", "measurement/emg_gain/EMG_infra"


@pytest.mark.parametrize(
    ("label", "mates", "level"),
    [
        (INFRA, [], "member"),
        (INFRA, [SUPRA], "family"),
        (INFRA, [LOAD], "side"),
        (INFRA, [f"{GAIN} + {INFRA}"], "member"),
        (f"{INFRA} + {GAIN}", [f"{SUPRA} + {GAIN}"], "family"),
        (f"{INFRA} + {GAIN}", [f"{LOAD} + {GAIN}"], "side"),
    ],
)
def test_a_label_is_as_deep_as_its_mates_agree(label: str, mates: list[str], level: str) -> None:
    assert _level(label, [[label, *mates]]) == level
