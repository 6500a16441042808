"""OpenSim Moco on the exported model and the tracked motion.

Its problems are easier: the model in the file has no thorax contact and no conoid ligament, reserve
torques help the muscles, and MocoInverse prescribes the motion.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import opensim

from scapulohumeral.stages.peers.limited import Notes

# Torque of the actuators that help the muscles at full control [N m].
RESERVE_NM = 10.0


def moco_solve(name: str, model: Path, states: Path, step: float) -> Callable[[Notes], None]:
    """Work that finds the excitations of a motion by one of Moco's tools.

    Parameters
    ----------
    name : key of :data:`TOOLS`; model : .osim file; states : .sto file of the tracked motion
    step : mesh interval [s]
    """
    make, model, states = TOOLS[name], model.resolve(), states.resolve()

    def work(notes: Notes) -> None:
        _solve(make(opensim.TableProcessor(str(states))), model, states, step, notes)

    return work


def _inverse(motion: opensim.TableProcessor) -> opensim.MocoInverse:
    """Prescribes a motion."""
    tool = opensim.MocoInverse()
    tool.setKinematics(motion)
    tool.set_kinematics_allow_extra_columns(True)
    return tool


def _track(motion: opensim.TableProcessor) -> opensim.MocoTrack:
    """Tracks a motion."""
    tool = opensim.MocoTrack()
    tool.setStatesReference(motion)
    tool.set_allow_unused_references(True)
    return tool


TOOLS: dict[str, Callable[[opensim.TableProcessor], opensim.MocoTool]] = {
    "inverse": _inverse,
    "track": _track,
}


def _solve(tool: opensim.MocoTool, model: Path, states: Path, step: float, notes: Notes) -> None:
    begin = time.process_time()
    # One thread, as the other peers.
    os.environ["OPENSIM_MOCO_PARALLEL"] = "0"
    opensim.Logger.setLevelString("info")
    time_s = opensim.TimeSeriesTable(str(states)).getIndependentColumn()
    tool.setModel(_processed(model))
    tool.set_initial_time(time_s[0])
    tool.set_final_time(time_s[-1])
    tool.set_mesh_interval(step)
    study = tool.initialize()
    notes.add(build_seconds=time.process_time() - begin)
    begin = time.process_time()
    solution = study.solve()
    notes.add(
        solve_seconds=time.process_time() - begin,
        iterations=solution.getNumIterations(),
        optimal=solution.success(),
        message=solution.getStatus(),
    )


def _processed(path: Path) -> opensim.ModelProcessor:
    """The model with muscles that Moco can solve for."""
    model = opensim.Model(str(path))
    model.initSystem()
    for k in range(model.getCoordinateSet().getSize()):
        # Moco refuses a coordinate that is locked.
        model.updCoordinateSet().get(k).set_locked(False)
    model.finalizeConnections()
    processor = opensim.ModelProcessor(model)
    processor.append(opensim.ModOpReplaceMusclesWithDeGrooteFregly2016())
    processor.append(opensim.ModOpIgnoreTendonCompliance())
    processor.append(opensim.ModOpAddReserves(RESERVE_NM))
    return processor
