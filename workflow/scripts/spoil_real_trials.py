"""Rule spoil_real_trials: recorded trials with an error of measurement put in."""

import shutil
from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.gap.recording.trials import TrialEntry, read_trial
from scapulohumeral.laboratory.record import record_path, write_trial
from scapulohumeral.model.motion import Motion
from simulated_persons.spoilt import spoilt

error = snakemake.params.error
folder = Path(snakemake.output.trials)
folder.mkdir(parents=True)
patterns = [Path(pattern) for pattern in snakemake.params.patterns]
for file in (file for one in patterns for file in sorted(one.parent.glob(one.name))):
    trial, _ = read_trial(file, TrialEntry())
    angles = spoilt(trial.angles_rad, error.segment, error.axis, error.deg, error.growing)
    write_trial(folder / file.name, Motion(trial.time_s, angles))
    # What the angles rest on is the same as before.
    if record_path(file).is_file():
        shutil.copy(record_path(file), folder)
