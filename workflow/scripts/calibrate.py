"""Rule calibrate: scalers of muscle groups from EMG."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.stages.calibration import CalibrationFiles, CalibrationSettings, calibrate
from scapulohumeral.stages.refinement import RefinementSettings

chosen = snakemake.params.calibration
calibrate(
    files=CalibrationFiles(
        model=model_files(snakemake),
        channels=Path(snakemake.input.channels),
        tracked=[Path(path) for path in snakemake.input.tracked],
        envelopes=[Path(path) for path in snakemake.input.envelopes],
    ),
    settings=CalibrationSettings(
        solve=solve_settings(snakemake),
        pause_s=snakemake.params.pause_s,
        force_bounds=tuple(chosen["force_bounds"]),
        fibre_bounds=tuple(chosen["fibre_bounds"]),
        envelope=EnvelopeSettings(**snakemake.params.envelope),
        refinement=RefinementSettings(**chosen["refinement"]),
        identifiable=chosen["identifiable"],
    ),
    solution=(Path(snakemake.output.solution), Path(snakemake.output.summary)),
    scalers=Path(snakemake.output.scalers),
    solver_log=Path(snakemake.log.solver),
)
