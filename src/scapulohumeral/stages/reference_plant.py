"""Simulated EMG: what an arm with other muscle parameters would show while it does the same.

The reference plant has the participant's equations, but muscle strength, fibre lengths and
activation constants of its own, and the excitations that are best for these.

Letters: N nodes, C channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from scapulohumeral.documents import read_mapping
from scapulohumeral.dynamics.compliant_tendon import Pull, compliant_excitation
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.emg.channels import Channels, read_channels
from scapulohumeral.emg.recording import write_failed_recording, write_recording
from scapulohumeral.emg.synthesis import (
    SimulationSettings,
    random_stream,
    simulate_mvc,
    simulate_recording,
)
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.problems.calibrated_groups import muscle_groups
from scapulohumeral.problems.composite import compose, composite_target
from scapulohumeral.problems.model_files import ModelFiles, load_model
from scapulohumeral.problems.posed_problem import (
    PosedProblem,
    SolveSettings,
    Target,
    hashes,
    header,
    pose,
    read_result,
    solve_posed,
    store,
    unsolved,
)
from scapulohumeral.stages.tracking import (
    held_load,
    read_trial,
    tracking_failure,
    tracking_target,
)

MODULE = "scapulohumeral.stages.reference_plant"


@dataclass(frozen=True)
class Plant:
    """Factors on a participant's muscle parameters [1].

    Attributes
    ----------
    force, fibre : maximum isometric force and optimal fibre length by virtual muscle group
    activation_time, deactivation_time : of all muscles
    """

    force: Mapping[str, float]
    fibre: Mapping[str, float]
    activation_time: float
    deactivation_time: float


@dataclass(frozen=True)
class PlantFiles:
    """A plant, the channels its EMG is read on, and the participant's model.

    Its tendons are rigid, or stretch by ``tendon_strain`` [1] at the maximum isometric force.
    """

    plant: Path
    channels: Path
    model: ModelFiles
    tendon_strain: float = 0.0

    @property
    def participant(self) -> str:
        """Name of the participant."""
        return self.model.participant.parent.name


@dataclass(frozen=True)
class PlantOutputs:
    """Files to write: raw EMG by trial, solution, its summary and the progress of the solver."""

    raw: Mapping[str, Path]
    solution: Path
    summary: Path
    solver_log: Path


def read_plant(path: Path, groups: tuple[str, ...]) -> Plant:
    """Read the parameters of a plant.

    Raises
    ------
    ConfigError
        If a key or virtual muscle group is missing or unknown, or a factor is not positive.
    """
    document = read_mapping(path, "the groups of a plant", "Restore the file.")
    keys = [field.name for field in fields(Plant)]
    if document.pop("schema", None) != "plant/1" or set(document) != set(keys):
        raise ConfigError(
            f"{path}: keys {', '.join(document)}; expected schema plant/1 and {', '.join(keys)}"
        )
    plant = Plant(**document)
    for kind in ("activation_time", "deactivation_time"):
        if not getattr(plant, kind) > 0:
            raise ConfigError(f"{path}, {kind}: {document[kind]}; expected a positive factor")
    for kind in ("force", "fibre"):
        factors = getattr(plant, kind)
        if set(factors) != set(groups) or not all(value > 0 for value in factors.values()):
            raise ConfigError(
                f"{path}, {kind}: {factors}; expected a positive factor for each of "
                f"{', '.join(groups)}"
            )
    return plant


def scaler_values(plant: Plant, scalers: Scalers) -> np.ndarray:
    """Factors in the order of scalers, shape (2, G), forces first."""
    return np.array([[kind[name] for name in scalers.names] for kind in (plant.force, plant.fibre)])


def plant_muscles(record: ModelRecord, channels: Channels, plant: Plant) -> MuscleParameters:
    """Muscle parameters of the plant of a participant."""
    scalers = muscle_groups(record, channels)
    muscles = scalers.apply(muscle_parameters(record), scaler_values(plant, scalers))
    return replace(
        muscles,
        activation_time=muscles.activation_time * plant.activation_time,
        deactivation_time=muscles.deactivation_time * plant.deactivation_time,
    )


def simulate_elevations(
    files: PlantFiles,
    tracked: Sequence[Path],
    settings: SolveSettings,
    pause_s: float,
    electrodes: SimulationSettings,
    outputs: PlantOutputs,
) -> None:
    """Let the plant do the composite motion; write its raw EMG of each elevation.

    Tendons that stretch change excitations only: forces are shared as they are with rigid ones.
    A solve that fails is written too, sealed by its status, and so is the EMG that it was to make;
    so is one whose motions were not tracked.

    Parameters
    ----------
    tracked : tracking solutions of the elevations, in the order of the composite motion
    """
    motions = [read_solution(path, allow_failed=True) for path in tracked]
    composite = compose(motions, settings.time_step_s, pause_s)
    motion = _Motion("composite", held_load(files.model, composite.nodes), tracked)
    posed = _pose(files, composite_target(composite), settings, motion)
    missing = tracking_failure(motions)
    done = _solve(posed, composite.trajectory, settings, outputs, files, motion, missing)
    channels = read_channels(files.channels)
    if not done.optimal:
        _seal(done, channels, outputs)
        return
    excitation = _excitation(posed, done, files) @ channels.matrix(done.muscles.tolist()).T
    for elevation in motions:
        trial = elevation.header["trial"]
        nodes = slice(*composite.nodes[trial])
        stream = random_stream(electrodes.seed, files.participant, trial)
        recording = simulate_recording(
            elevation.time_s, excitation[nodes], channels, electrodes, stream
        )
        write_recording(outputs.raw[trial], recording)


def simulate_task(
    trial: str,
    files: PlantFiles,
    settings: SolveSettings,
    electrodes: SimulationSettings,
    outputs: PlantOutputs,
) -> None:
    """Let the plant do a daily task as recorded; write its raw EMG.

    Both are sealed if the solve fails.
    """
    recording = read_trial(files.model, trial)
    target = tracking_target(recording, settings.time_step_s)
    motion = _Motion(trial, recording.hand_load_kg, [recording.file])
    posed = _pose(files, target, settings, motion)
    done = _solve(posed, posed.cold_start(), settings, outputs, files, motion)
    channels = read_channels(files.channels)
    if not done.optimal:
        _seal(done, channels, outputs)
        return
    excitation = _excitation(posed, done, files) @ channels.matrix(done.muscles.tolist()).T
    stream = random_stream(electrodes.seed, files.participant, trial)
    raw = simulate_recording(done.time_s, excitation, channels, electrodes, stream)
    write_recording(outputs.raw[trial], raw)


def simulate_contractions(
    participant: str, channels: Path, electrodes: SimulationSettings, mvc: Path
) -> None:
    """Write raw EMG of maximum voluntary contractions."""
    stream = random_stream(electrodes.seed, participant, "mvc")
    write_recording(mvc, simulate_mvc(read_channels(channels), electrodes, stream))


@dataclass(frozen=True)
class _Motion:
    """Name of what the plant does, what its hand holds, and the files that say so."""

    trial: str
    hand_load_kg: float
    sources: Sequence[Path]


def _pose(
    files: PlantFiles, target: Target, settings: SolveSettings, motion: _Motion
) -> PosedProblem:
    model = load_model(files.model)
    channels = read_channels(files.channels)
    plant = read_plant(files.plant, channels.groups)
    muscles = plant_muscles(model.record, channels, plant)
    return pose(model, muscles, target, settings, motion.hand_load_kg)


def _excitation(posed: PosedProblem, done: Solution, files: PlantFiles) -> np.ndarray:
    """Excitations (N, M) of the plant, for tendons that stretch if its own do."""
    if files.tendon_strain == 0.0:
        return done.excitation
    length, velocity = posed.model.forces.lengths(done.q, done.u)
    pull = Pull(length, velocity, done.activation, done.excitation, posed.objective.step)
    return compliant_excitation(pull, posed.muscles, files.tendon_strain)


def _solve(
    posed: PosedProblem,
    start: Trajectory,
    settings: SolveSettings,
    outputs: PlantOutputs,
    files: PlantFiles,
    motion: _Motion,
    missing: str = "",
) -> Solution:
    """Solve and store; with anything `missing`, which is said, nothing is solved."""
    if missing:
        result = unsolved(posed, start, missing, outputs.solver_log)
    else:
        result = solve_posed(posed, start, settings, outputs.solver_log)
    about = header(
        posed,
        result,
        settings,
        participant=files.participant,
        trial=motion.trial,
        simulated=True,
        hand_load_kg=motion.hand_load_kg,
        hashes=hashes(files.model, [files.plant, files.channels, *motion.sources], MODULE),
    )
    done = read_result(posed, result, about)
    store(done, result, (outputs.solution, outputs.summary), {})
    return done


def _seal(done: Solution, channels: Channels, outputs: PlantOutputs) -> None:
    """Write that there is no EMG, and why."""
    reason = f"simulated EMG of {done.header['trial']}: {done.header['message']}"
    print(f"{reason}. Look at {outputs.solver_log}", flush=True)
    for raw in outputs.raw.values():
        write_failed_recording(raw, channels.names, reason)
