"""Rule sample_muscle_geometry: muscle lengths and their gradients at random poses. Runs opensim."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

import numpy as np
import opensim

from scapulohumeral.model.muscle_paths.authors_fit import draw_poses
from scapulohumeral.model.muscle_paths.opensim_sampling import sample_geometry
from scapulohumeral.model.muscle_paths.pose_region import Region, draw_sample_angles
from scapulohumeral.model.muscle_paths.thorax_clearance import is_clear
from scapulohumeral.model.participant import participant_of
from scapulohumeral.model.published_arm import followed_poses
from scapulohumeral.model.record import read_record
from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose

settings = snakemake.params
participant = participant_of(Path(snakemake.input.participant))
record = read_record(Path(snakemake.input.model))
muscles = list(record.muscle_names)
count = settings.poses + settings.held_out_poses
rng = np.random.default_rng(settings.seed)
if record.choices.paths == "published":
    angles = pose_to_trial(draw_poses(record, followed_poses(participant), count, rng))
else:
    angles = draw_sample_angles(
        participant,
        snakemake.wildcards.formulation,
        Region(settings.margin_deg, tuple(settings.scapula_turn_deg), settings.girdle_turn_deg),
        count,
        rng,
        lambda poses: is_clear(record, poses, settings.clearance),
        followed_poses(participant) if settings.published_arm else None,
    )
samples = sample_geometry(opensim.Model(snakemake.input.osim), trial_to_pose(angles), muscles)
held_out = np.arange(count) >= settings.poses
np.savez(snakemake.output.samples, muscles=muscles, angles=angles, held_out=held_out, **samples)
