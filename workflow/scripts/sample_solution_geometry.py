"""Rule sample_solution_geometry: OpenSim's muscle lengths along a prediction. Runs opensim."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

import numpy as np
import opensim

from scapulohumeral.model.muscle_paths.opensim_sampling import sample_geometry
from scapulohumeral.model.record import read_record

record = read_record(Path(snakemake.input.model))
muscles = list(record.muscle_names)
with np.load(snakemake.input.poses) as data:
    poses = data["pose"]
samples = sample_geometry(opensim.Model(snakemake.input.osim), poses, muscles)
np.savez(snakemake.output.samples, muscles=muscles, **samples)
