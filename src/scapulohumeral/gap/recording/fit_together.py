"""Refusal of files that are sound one by one, but cannot be compared with each other."""

from __future__ import annotations

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording.case import Case


def check_tasks(case: Case) -> None:
    """Refuse reference trials none of which is of a task of the test trials.

    Raises
    ------
    DataError                        names the tasks on both sides
    """
    references = dict.fromkeys(trial.task for trial in case.reference)
    if references and not references.keys() & set(case.tasks):
        raise DataError(
            f"tasks of the test trials: {', '.join(case.tasks)}; of the reference trials: "
            f"{', '.join(references)}; expected at least one on both sides. Rename files to "
            "TASK_rN, give trials.<stem>.task in the participant file, or leave out --reference."
        )


def check_channels(case: Case) -> None:
    """Refuse EMG none of whose columns the participant file knows, though it names channels.

    Raises
    ------
    DataError                        names file, columns, and channels
    """
    known = case.participant.emg_channels
    for trial in (*case.test, *case.reference):
        if known and trial.emg is not None and not known.keys() & set(trial.emg.channels):
            raise DataError(
                f"{trial.source}, columns {', '.join(trial.emg.channels)}: none is in emg.channels "
                f"of the participant file, {', '.join(known)}. Rename the columns or the channels."
            )
