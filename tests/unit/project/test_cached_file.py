"""Files of the user cache: made once, whole or not at all."""

from pathlib import Path

import pytest

from scapulohumeral.cached_file import cached_file

pytestmark = pytest.mark.unit


def test_a_missing_file_is_made_with_its_folder_and_then_kept(tmp_path: Path) -> None:
    path = tmp_path / "cache" / "kernels.so"
    assert cached_file(path, lambda unfinished: unfinished.write_text("first")) == path
    cached_file(path, lambda unfinished: unfinished.write_text("second"))
    assert path.read_text() == "first"
    assert list(path.parent.iterdir()) == [path]


def test_a_making_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    def fail(unfinished: Path) -> None:
        unfinished.write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        cached_file(tmp_path / "kernels.so", fail)
    assert not list(tmp_path.iterdir())
