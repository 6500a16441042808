"""Plants and diagnosis share no code that could make a case easy."""

from pathlib import Path

import pytest
from plants import generate

from scapulohumeral import provenance
from scapulohumeral.errors import ConfigError

pytestmark = pytest.mark.unit

PLANTS = Path(generate.__file__).parent
# Numerics of the diagnosis that a plant must do without.
FORBIDDEN = ("scapulohumeral.gap", "scapulohumeral.ocp", "scapulohumeral.dynamics.hill")


@pytest.mark.parametrize("path", sorted(PLANTS.glob("*.py")), ids=lambda path: path.name)
def test_plants_do_without_the_diagnosis_and_its_numerics(path: Path) -> None:
    names = list(provenance.imported_names(path, f"plants.{path.stem}"))
    assert not [name for name in names if name.startswith(FORBIDDEN)]


def test_keys_inside_the_checkout_are_refused(tmp_path: Path, repository: Path) -> None:
    folders = {"results": tmp_path, "participants": tmp_path, "out": tmp_path}
    arguments = ["--seed", "1", "--cases", "1", "--keys", str(repository / "results" / "keys")]
    for name, folder in folders.items():
        arguments += [f"--{name}", str(folder)]
    with pytest.raises(ConfigError, match="Name a folder outside"):
        generate.main(arguments)
