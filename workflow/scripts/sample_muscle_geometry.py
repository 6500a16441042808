"""Rule sample_muscle_geometry: muscle lengths and their gradients at random poses. Runs opensim."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

import numpy as np
import opensim

from scapulohumeral.model.opensim_sampling import sample_geometry
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.pose_region import draw_poses, recorded_poses
from scapulohumeral.model.tables import read_tables

settings = snakemake.params
folder = Path(snakemake.input.participant).parent
recorded = recorded_poses(read_participant(folder.parent, folder.name))
muscles = read_tables(Path(snakemake.input.tables[0]).parent).active_muscles
count = settings.poses + settings.held_out_poses
rng = np.random.default_rng(settings.seed)
poses = draw_poses(recorded, settings.margin_deg, count, rng)
samples = sample_geometry(opensim.Model(snakemake.input.osim), poses, muscles)
held_out = np.arange(count) >= settings.poses
np.savez(
    snakemake.output.samples, muscles=muscles, held_out=held_out, seed=settings.seed, **samples
)
