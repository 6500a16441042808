"""Rule audit_geometry: muscle geometry of the solver against OpenSim along a prediction."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.stages.geometry_audit import audit_geometry

dynamics = compiled.load(Path(snakemake.input.equations))
forces = MuscleForces(dynamics, load_geometry(Path(snakemake.input.geometry)))
table = audit_geometry(forces, Path(snakemake.input.samples))
table.to_csv(snakemake.output.audit, index=False, float_format="%.6g")
