"""Rule add_real_emg: recorded trials beside their EMG, which is a table of its own."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.gap.benchmark.real_emg import read_emg
from scapulohumeral.gap.recording.trials import TrialEntry, read_trial
from scapulohumeral.laboratory.record import write_trial
from scapulohumeral.model.motion import Motion

folder = Path(snakemake.output.trials)
folder.mkdir(parents=True)
for file in map(Path, snakemake.input.trials):
    trial, _ = read_trial(file, TrialEntry())
    write_trial(folder / file.name, Motion(trial.time_s, trial.angles_rad))
    emg = read_emg(Path(snakemake.input.emg), file.stem, trial.time_s)
    emg.to_csv(folder / f"{file.stem}_emg.csv", index=False, float_format="%.5f")
