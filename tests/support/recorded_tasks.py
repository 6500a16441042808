"""Which participants did the tasks that simulated persons repeat."""

from collections.abc import Iterable
from pathlib import Path

from simulated_persons.plan import TASKS


def with_all_tasks(recordings: Iterable[Path]) -> list[Path]:
    """Folders of the participants, among recorded motions, who did all that persons repeat."""
    tasks: dict[Path, set[str]] = {}
    for path in recordings:
        tasks.setdefault(path.parent, set()).add(path.stem)
    return [folder for folder, names in tasks.items() if names.issuperset(TASKS)]
