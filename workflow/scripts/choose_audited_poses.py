"""Rule choose_audited_poses: poses of a prediction at which its muscle geometry is audited."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

import numpy as np

from scapulohumeral.stages.geometry_audit import audited_poses

pose = audited_poses(Path(snakemake.input.solution), snakemake.params.every)
np.savez(snakemake.output.poses, pose=pose)
