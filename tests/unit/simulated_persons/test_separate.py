"""Plants and diagnosis share no code that could make a case easy."""

from pathlib import Path

import pytest

from scapulohumeral import provenance
from scapulohumeral.errors import ConfigError
from simulated_persons import generate

pytestmark = pytest.mark.unit

PLANTS = Path(generate.__file__).parent
# Numerics of the diagnosis that a plant must do without.
FORBIDDEN = ("scapulohumeral.gap", "scapulohumeral.ocp", "scapulohumeral.dynamics.hill")


@pytest.mark.parametrize("path", sorted(PLANTS.rglob("*.py")), ids=lambda path: path.name)
def test_plants_do_without_the_diagnosis_and_its_numerics(path: Path) -> None:
    parts = path.relative_to(PLANTS).with_suffix("").parts
    names = list(provenance.imported_names(path, ".".join(("simulated_persons", *parts))))
    assert not [name for name in names if name.startswith(FORBIDDEN)]


def draw_with_keys_in(keys: Path, elsewhere: Path) -> None:
    arguments = ["--seed", "1", "--cases", "1", "--names", "par1", "--keys", str(keys)]
    for name in ("results", "participants", "out"):
        arguments += [f"--{name}", str(elsewhere)]
    generate.main(arguments)


def test_keys_inside_the_checkout_are_refused(tmp_path: Path, repository: Path) -> None:
    with pytest.raises(ConfigError, match="Name a folder outside"):
        draw_with_keys_in(repository / "results" / "keys", tmp_path)


def test_keys_are_never_drawn_into_one_folder_twice(tmp_path: Path) -> None:
    keys = tmp_path / "keys"
    keys.mkdir()
    (keys / "draw.json").write_text("{}")
    with pytest.raises(ConfigError, match="holds files already"):
        draw_with_keys_in(keys, tmp_path)
