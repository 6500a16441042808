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
    with_emg = [trial.name for trial in trials if trial.emg is not None]
    with_force = [trial.name for trial in trials if trial.contact is not None]
    having = {
        channel: [t.name for t in trials if t.emg is not None and channel in t.emg.channels]
        for channel in known
    }
    recorded = {f"EMG channel {channel}": names for channel, names in having.items()}
    notes = []
    if with_emg and not known:
        notes.append(
            f"EMG of {len(with_emg)} trials is not compared: the participant file has no "
            "emg.channels, which say what muscles lie under each electrode"
        )
    for what, names in {**recorded, "joint force": with_force}.items():
        lacking = [trial.name for trial in trials if trial.name not in names]
        if names and lacking:
            notes.append(f"{what} is not compared: not recorded in {', '.join(lacking)}")
    return notes
