"""What of files that are sound one by one cannot be compared with each other."""

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


def not_compared(case: Case) -> list[str]:
    """What was recorded in some trials but is not compared, one sentence each."""
    known, trials = case.participant.emg_channels, case.trials
    emg = [() if trial.emg is None else trial.emg.channels for trial in trials]
    recorded = {f"EMG channel {name}": [name in channels for channels in emg] for name in known}
    recorded["joint force"] = [trial.contact is not None for trial in trials]
    notes = []
    if any(emg) and not known:
        notes.append(
            f"EMG of {sum(map(bool, emg))} trials is not compared: the participant file has no "
            "emg.channels, which say what muscles lie under each electrode"
        )
    for what, has in recorded.items():
        lacking = [trial.name for trial, there in zip(trials, has, strict=True) if not there]
        if any(has) and lacking:
            notes.append(f"{what} is not compared: not recorded in {', '.join(lacking)}")
    return notes
