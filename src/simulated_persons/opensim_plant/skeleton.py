"""OpenSim's model of one person, and what it says about frames of a movement.

Letters: F frames, M muscles, A activations.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import opensim

from scapulohumeral.model.rotations import ANGLE_NAMES
from simulated_persons.opensim_plant.body import Body
from simulated_persons.opensim_plant.mechanics import ACTIVATIONS, GH_SEQUENCE, Mechanics
from simulated_persons.opensim_plant.outside import array_of, axes_of, outside_forces

GH_JOINTS = ("gh1", "gh2", "gh3")
PARTS = {
    "clavicle": ("clavicle_r",),
    "scapula": ("scapula_r",),
    "humerus": ("humerus_r",),
    "forearm": ("ulna_r", "radius_r", "hand_r"),
}
ARM = ("humerus_r", "ulna_r", "radius_r", "hand_r")
HAND = "hand_r"
# The weight is gripped a little beyond the centre of the hand.
GRIP_SHARE, GRIP_RADIUS_M = 1.03, 0.04
# Points of the scapula that slide on the thorax, and the surface whose normals they feel.
CONTACT_MARKERS, THORAX_SURFACE = ("TS", "AI"), "serr_ant"

opensim.Logger.setLevelString("error")


class Skeleton:
    """A participant's exported model with another person's masses and muscles."""

    def __init__(self, osim: Path, muscles: Sequence[str], body: Body) -> None:
        """Read a model, of whose muscle elements the named ones are kept."""
        self.body = body
        self.model = opensim.Model(str(osim))
        _set_masses(self.model, body)
        _turn_humerus_without_gimbal_lock(self.model)
        self.muscles = _replace_muscles(self.model, muscles, body)
        self.model.setGravity(opensim.Vec3(*map(float, body.gravity)))
        self.model.finalizeConnections()
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()
        self.solver = opensim.InverseDynamicsSolver(self.model)
        coordinates = self.model.getCoordinateSet()
        # The chain has no branches, so speeds come in the order of the coordinates.
        every = [coordinates.get(k).getName() for k in range(coordinates.getSize())]
        self.columns = [every.index(name) for name in ANGLE_NAMES]
        self.coordinates = [coordinates.get(name) for name in ANGLE_NAMES]
        bodies = self.model.getBodySet()
        self.bodies = {b.getName(): b for b in (bodies.get(k) for k in range(bodies.getSize()))}
        self.weight = _arm_mass(self.model, body) * np.array(body.gravity)
        self.surface = _thorax_surface(self.model)

    def mechanics(
        self, coordinates: np.ndarray, speeds: np.ndarray, accelerations: np.ndarray
    ) -> Mechanics:
        """Mechanics at frames of coordinates, and of their first and second derivatives (F, 10)."""
        rows = []
        for q, u, a in zip(coordinates.tolist(), speeds.tolist(), accelerations, strict=True):
            self._set(q, u)
            rows.append(self._frame(a))
        return Mechanics(*(np.array(column) for column in zip(*rows, strict=True)))

    def _set(self, values: Sequence[float], speeds: Sequence[float]) -> None:
        for coordinate, value, speed in zip(self.coordinates, values, speeds, strict=True):
            coordinate.setValue(self.state, value, False)
            coordinate.setSpeedValue(self.state, speed)
        self.model.realizeVelocity(self.state)

    def _frame(self, acceleration: np.ndarray) -> tuple[np.ndarray, ...]:
        """The parts of `Mechanics` at the pose that is set."""
        into_scapula = axes_of(self.bodies["scapula_r"], self.state).T
        forces = outside_forces(self.bodies, self.state, self.body)
        torque = self._inverse_dynamics(acceleration) - self._torque(self._loaded(forces))
        burden = self.weight + sum(forces[name][1] for name in ARM if name in forces)
        arms, pull = zip(*(self._unit_tension(muscle) for muscle in self.muscles), strict=True)
        support = np.array([self._torque(self._loaded(f)) for f in self._supports()])
        return (
            torque,
            np.array(arms),
            self._tendon_forces(),
            support,
            np.array(pull) @ into_scapula.T,
            into_scapula @ burden,
        )

    def _inverse_dynamics(self, acceleration: np.ndarray) -> np.ndarray:
        every = opensim.Vector(self.state.getNU(), 0.0)
        for column, value in zip(self.columns, acceleration.tolist(), strict=True):
            every.set(column, value)
        return self.solver.solve(self.state, every).to_numpy()[self.columns]

    def _torque(self, forces: opensim.VectorOfSpatialVec) -> np.ndarray:
        """Generalised forces (10,) of forces on bodies, by virtual work."""
        result = opensim.Vector(self.state.getNU(), 0.0)
        self.matter.multiplyBySystemJacobianTranspose(self.state, forces, result)
        return result.to_numpy()[self.columns]

    def _no_forces(self) -> opensim.VectorOfSpatialVec:
        zero = opensim.SpatialVec(opensim.Vec3(0.0), opensim.Vec3(0.0))
        return opensim.VectorOfSpatialVec(self.model.getNumBodies() + 1, zero)

    def _loaded(self, forces: dict[str, np.ndarray]) -> opensim.VectorOfSpatialVec:
        """Moments and forces (2, 3) at the origins of named bodies, ground axes."""
        result = self._no_forces()
        for name, (moment, force) in forces.items():
            place = self.bodies[name].getMobilizedBodyIndex()
            vectors = (opensim.Vec3(*map(float, v)) for v in (moment, force))
            result.set(place, opensim.SpatialVec(*vectors))
        return result

    def _unit_tension(self, muscle: opensim.Muscle) -> tuple[np.ndarray, np.ndarray]:
        """Torque (10,), and force on the arm (3,) in ground axes, of a tendon force of 1 N."""
        forces, on_coordinates = self._no_forces(), opensim.Vector(self.state.getNU(), 0.0)
        muscle.getPath().addInEquivalentForces(self.state, 1.0, forces, on_coordinates)
        own = [forces.get(self.bodies[name].getMobilizedBodyIndex()).get(1) for name in ARM]
        pull = np.sum([[force.get(k) for k in range(3)] for force in own], axis=0)
        return self._torque(forces) + on_coordinates.to_numpy()[self.columns], pull

    def _tendon_forces(self) -> np.ndarray:
        """Tendon forces (A, M) [N] with fibres in equilibrium, as fast as their share of the path.

        OpenSim shares the speed of a path between fibre and tendon by their stiffness.
        """
        result = np.empty((len(ACTIVATIONS), len(self.muscles)))
        for row, activation in zip(result, ACTIVATIONS.tolist(), strict=True):
            for place, muscle in enumerate(self.muscles):
                muscle.setActivation(self.state, activation)
                muscle.computeFiberEquilibrium(self.state, True)
                row[place] = muscle.getTendonForce(self.state)
        return result

    def _supports(self) -> list[dict[str, np.ndarray]]:
        """Unit forces of thorax and conoid ligament on the girdle; the thorax does not move."""
        scapula, clavicle = self.bodies["scapula_r"], self.bodies["clavicle_r"]
        centre, radii = self.surface
        result = []
        for name in CONTACT_MARKERS:
            point = array_of(self.model.getMarkerSet().get(name).getLocationInGround(self.state))
            normal = (point - centre) / radii**2
            result.append({"scapula_r": self._at(scapula, point, normal / np.linalg.norm(normal))})
        ends = [
            array_of(bone.findStationLocationInGround(self.state, opensim.Vec3(*map(float, end))))
            for bone, end in zip((clavicle, scapula), self.body.conoid_m, strict=True)
        ]
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        both = {
            "clavicle_r": self._at(clavicle, ends[0], along),
            "scapula_r": self._at(scapula, ends[1], -along),
        }
        return [*result, both]

    def _at(self, bone: opensim.Body, point: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Moment about the origin of a body, and force (2, 3), of a force at a point."""
        lever = point - array_of(bone.getPositionInGround(self.state))
        return np.array([np.cross(lever, force), force])


def _set_masses(model: opensim.Model, body: Body) -> None:
    """Heavier or lighter segments, and a weight in the hand: a ball, rigid with it."""
    bodies = model.updBodySet()
    for factor, names in zip(body.mass_factor.tolist(), PARTS.values(), strict=True):
        for name in names:
            bodies.get(name).scaleMass(factor)
    mass = float(body.load_kg)
    if mass > 0.0:
        inertia = 0.4 * mass * GRIP_RADIUS_M**2
        centre = opensim.Vec3(0.0)
        ball = opensim.Body("load", mass, centre, opensim.Inertia(inertia, inertia, inertia))
        model.addBody(ball)
        hand = bodies.get(HAND)
        place = opensim.Vec3(*(GRIP_SHARE * array_of(hand.getMassCenter())).tolist())
        none = opensim.Vec3(0.0)
        model.addJoint(opensim.WeldJoint("grip", hand, place, none, ball, none, none))


def _arm_mass(model: opensim.Model, body: Body) -> float:
    return sum(model.getBodySet().get(name).getMass() for name in ARM) + float(body.load_kg)


def _turn_humerus_without_gimbal_lock(model: opensim.Model) -> None:
    """Give the three joints of the humerus the axes of `GH_SEQUENCE`."""
    for name, axis in zip(GH_JOINTS, GH_SEQUENCE, strict=True):
        first = "XYZ".index(axis)
        transform = opensim.CustomJoint.safeDownCast(model.updJointSet().get(name))
        for place in range(3):  # OpenSim wants three independent axes; two of them stay at zero
            vector = opensim.Vec3(*np.eye(3)[(first + place) % 3].tolist())
            transform.updSpatialTransform().updTransformAxis(place).setAxis(vector)


def _replace_muscles(
    model: opensim.Model, names: Sequence[str], body: Body
) -> list[opensim.Millard2012EquilibriumMuscle]:
    """Muscles with elastic tendons on the same paths. They are asked for forces, and apply none."""
    made = []
    for k, name in enumerate(names):
        old = model.getMuscles().get(name)
        muscle = opensim.Millard2012EquilibriumMuscle(
            name,
            float(body.force_factor[k]) * old.getMaxIsometricForce(),
            float(body.fibre_factor[k]) * old.getOptimalFiberLength(),
            old.getTendonSlackLength(),
            old.getPennationAngleAtOptimalFiberLength(),
        )
        tendon = opensim.TendonForceLengthCurve()
        tendon.setStrainAtOneNormForce(float(body.tendon_strain[k]))
        muscle.setTendonForceLengthCurve(tendon)
        muscle.set_path(old.getPath())
        muscle.set_appliesForce(False)
        made.append(muscle)
    model.updForceSet().clearAndDestroy()
    for muscle in made:
        model.addForce(muscle)
    return made


def _thorax_surface(model: opensim.Model) -> tuple[np.ndarray, np.ndarray]:
    """Centre and radii (3,) [m] of the ellipsoid under the scapula, along thorax axes."""
    surface = model.getBodySet().get("thorax").getWrapObject(THORAX_SURFACE)
    ellipsoid = opensim.WrapEllipsoid.safeDownCast(surface)
    return array_of(ellipsoid.get_translation()), array_of(ellipsoid.get_dimensions())
