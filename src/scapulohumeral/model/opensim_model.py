"""The model in OpenSim: built from the tables, scaled to a participant, and recorded as plain data.

OpenSim serves as the geometry engine (wrapping, scaling); its muscle dynamics are not used. The
class Thelen2003Muscle carries path, strength and lengths because, unlike OpenSim's rigid tendon
class, it scales optimal fibre and tendon slack lengths with the path. This module and
`opensim_sampling` are the only ones to import opensim, which cannot share a process with casadi.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import opensim
from scipy.optimize import brentq

from scapulohumeral.errors import ModelError
from scapulohumeral.model.choices import ModelChoices
from scapulohumeral.model.constants import ConoidLigament, UpperArm, WrapClearance
from scapulohumeral.model.girdle_range import girdle_range, resting
from scapulohumeral.model.muscle_paths.opensim_sampling import muscle_lengths
from scapulohumeral.model.muscle_paths.pose_region import (
    elevation_angles,
    elevation_poses,
    recorded_angles,
)
from scapulohumeral.model.muscle_paths.thorax_clearance import (
    arm_hanging,
    attachment_levels,
    segment_frames,
)
from scapulohumeral.model.participant import Participant
from scapulohumeral.model.participant_schema import SCALED_SEGMENTS
from scapulohumeral.model.record import (
    ConoidRecord,
    CoordinateRecord,
    JointRecord,
    ModelRecord,
    MuscleRecord,
    PointRecord,
    SegmentRecord,
    WrapRecord,
)
from scapulohumeral.model.rotations import Array, trial_to_pose
from scapulohumeral.model.tables import (
    GROUND,
    Coordinate,
    Joint,
    ModelTables,
    Muscle,
    WrapObject,
)

PRONATION = "PS_y"
# Body masses that replace the published ones if masses are anthropometric. Clavicle and scapula
# have no fraction of their own in de Leva 1996, so they keep their share relative to the humerus.
ANTHROPOMETRIC_PARTS = {
    "upper_arm": (("humerus_r",), ("clavicle_r", "scapula_r")),
    "forearm": (("ulna_r", "radius_r"), ()),
    "hand": (("hand_r",), ()),
}

# Least share of its depth that a flattened thorax surface keeps.
FLATTEST = 0.1
DEPTH, ALL_AXES = [False, False, True], [True, True, True]

opensim.Logger.setLevelString("error")


def participant_model(
    tables: ModelTables, participant: Participant, choices: ModelChoices
) -> opensim.Model:
    """The model of a participant: built, scaled, fibres adjusted, forearm locked.

    Parameters
    ----------
    tables : ModelTables
    participant : Participant
    choices : ModelChoices

    Returns
    -------
    opensim.Model                    with all muscle elements of the tables
    """
    tables = _with_paths(tables, choices)
    model = build_model(tables)
    scale_model(model, participant)
    if choices.masses == "anthropometric":
        set_anthropometric_masses(model, participant, tables)
    elif choices.masses == "divided":
        divide_masses(model, tables.constants.authors_masses.divisor)
    lock_pronation(model, np.deg2rad(tables.constants.forearm.pronation_deg))
    if choices.serratus_path != "as_scaled":
        follow = choices.serratus_path == "flattened_rescaled"
        flatten_thorax_surfaces(model, participant, tables, follow)
    if choices.fibres == "published":
        set_published_fibres(model, tables)
    else:
        adjust_fibres(model, participant, tables, choices.fibres == "suspended")
    model.setGravity(_vec3(participant.gravity_mps2))
    model.setName(participant.name)
    model.finalizeConnections()
    return model


def _with_paths(tables: ModelTables, choices: ModelChoices) -> ModelTables:
    return tables.with_published_paths() if choices.paths == "published" else tables


def build_model(tables: ModelTables) -> opensim.Model:
    """The unscaled model, with every muscle element of the tables.

    Coordinates are neither clamped nor locked, so that any pose can be set.

    Returns
    -------
    opensim.Model                    connected; call ``initSystem`` for a state
    """
    model = opensim.Model()
    model.setName("base")
    model.setGravity(_vec3(tables.constants.gravity.vector_mps2))
    for segment in tables.segments.values():
        inertia = opensim.Inertia(*segment.inertia_kgm2)
        body = opensim.Body(segment.name, segment.mass_kg, _vec3(segment.com_m), inertia)
        model.addBody(body)
    for joint in tables.joints.values():
        coordinates = [c for c in tables.coordinates.values() if c.joint == joint.name]
        model.addJoint(_joint(model, joint, coordinates))
        for coordinate in coordinates:
            _set_range(model.updCoordinateSet().get(coordinate.name), coordinate)
    for wrap_object in tables.wrap_objects.values():
        _frame(model, wrap_object.segment).addWrapObject(_wrap_object(wrap_object))
    model.finalizeConnections()
    for muscle in tables.muscles.values():
        model.addForce(_muscle(model, muscle, tables))
    for name, point in tables.markers.items():
        frame = _frame(model, point.segment)
        model.addMarker(opensim.Marker(name, frame, _vec3(point.location_m)))
    model.finalizeConnections()
    return model


def _vec3(values: Sequence[float]) -> opensim.Vec3:
    return opensim.Vec3(*(float(value) for value in values))


def _tuple3(vector: opensim.Vec3) -> tuple[float, float, float]:
    return vector.get(0), vector.get(1), vector.get(2)


def _frame(model: opensim.Model, name: str) -> opensim.PhysicalFrame:
    return model.updGround() if name == GROUND else model.updBodySet().get(name)


def _joint(model: opensim.Model, joint: Joint, coordinates: list[Coordinate]) -> opensim.Joint:
    child = _frame(model, joint.child)
    place = (_vec3(joint.location_m), _vec3(joint.orientation_rad))
    origin = (opensim.Vec3(0.0), opensim.Vec3(0.0))
    parent = _frame(model, joint.parent)
    if joint.kind == "weld":
        return opensim.WeldJoint(joint.name, parent, *place, child, *origin)
    if joint.kind != "rotation" or not 1 <= len(coordinates) <= 3:
        raise ModelError(
            f"joint {joint.name}: type '{joint.kind}' with {len(coordinates)} coordinates; "
            "expected 'weld' with none, or 'rotation' with one to three. Correct joints.csv."
        )
    transform = _rotations(coordinates)
    return opensim.CustomJoint(joint.name, parent, *place, child, *origin, transform)


def _rotations(coordinates: list[Coordinate]) -> opensim.SpatialTransform:
    transform = opensim.SpatialTransform()
    axes = [np.array(coordinate.axis) for coordinate in coordinates]
    # OpenSim wants three independent axes; those without a coordinate stay at zero angle.
    spare = np.eye(3)[np.argsort(np.abs(axes[0]))]
    for i in range(3):
        axis = transform.updTransformAxis(i)
        if i < len(coordinates):
            axis.setCoordinateNames(opensim.ArrayStr(coordinates[i].name, 1))
            axis.setAxis(_vec3(coordinates[i].axis))
            axis.set_function(opensim.LinearFunction(1.0, 0.0))
        else:
            axis.setAxis(_vec3(spare[i - 1]))
            axis.set_function(opensim.Constant(0.0))
    return transform


def _set_range(target: opensim.Coordinate, source: Coordinate) -> None:
    target.set_clamped(False)
    target.set_locked(False)
    target.setRangeMin(source.min_rad)
    target.setRangeMax(source.max_rad)
    target.setDefaultValue(source.default_rad)


def _wrap_object(source: WrapObject) -> opensim.WrapObject:
    if source.kind == "ellipsoid":
        target = opensim.WrapEllipsoid()
        target.set_dimensions(_vec3(source.dimensions_m))
    elif source.kind == "sphere":
        target = opensim.WrapSphere()
        target.set_radius(source.dimensions_m[0])
    else:
        target = opensim.WrapCylinder()
        target.set_radius(source.dimensions_m[0])
        target.set_length(source.dimensions_m[1])
    target.setName(source.name)
    target.set_translation(_vec3(source.translation_m))
    target.set_xyz_body_rotation(_vec3(source.rotation_rad))
    target.set_quadrant(source.quadrant)
    return target


def _muscle(model: opensim.Model, source: Muscle, tables: ModelTables) -> opensim.Muscle:
    target = opensim.Thelen2003Muscle()
    target.setName(source.name)
    target.setMaxIsometricForce(source.max_isometric_force_N)
    target.setOptimalFiberLength(source.optimal_fibre_length_m)
    target.setTendonSlackLength(source.tendon_slack_length_m)
    target.setPennationAngleAtOptimalFiberLength(source.pennation_rad)
    for i, point in enumerate(source.points, start=1):
        frame = _frame(model, point.segment)
        target.addNewPathPoint(f"{source.name}-P{i}", frame, _vec3(point.location_m))
    path = opensim.GeometryPath.safeDownCast(target.updPath())
    for i, wrap in enumerate(source.wraps):
        segment = tables.wrap_objects[wrap.wrap_object].segment
        path.addPathWrap(_frame(model, segment).upd_WrapObjectSet().get(wrap.wrap_object))
        use = path.updWrapSet().get(i)
        use.set_method(wrap.method)
        use.set_range(0, wrap.first_point)
        use.set_range(1, wrap.last_point)
    return target


def scale_model(model: opensim.Model, participant: Participant) -> None:
    """Scale segments, paths, muscle lengths and masses in place, as OpenSim's scale tool does.

    Optimal fibre and tendon slack lengths follow the path length in the default pose. All masses
    together become the participant's published total.

    Parameters
    ----------
    model : opensim.Model            as from `build_model`
    participant : Participant

    Raises
    ------
    ModelError                       OpenSim refuses the scale factors
    """
    scales = opensim.ScaleSet()
    for segment, factors in participant.scale.items():
        scale = opensim.Scale()
        scale.setSegmentName(segment)
        scale.setScaleFactors(_vec3(factors))
        scale.setApply(True)
        scales.cloneAndAppend(scale)
    done = model.scale(
        model.initSystem(),
        scales,
        participant.preserve_mass_distribution,
        participant.published_total_mass_kg,
    )
    if not done:
        raise ModelError(f"{participant.name}: OpenSim could not scale the model; see its message.")


def set_anthropometric_masses(
    model: opensim.Model, participant: Participant, tables: ModelTables
) -> None:
    """Replace the masses of the arm by fractions of body mass, and where the upper arm has its own.

    The upper arm gets its mass centre and its inertia; inertia of the other segments follows their
    mass. Source: de Leva 1996, table 4. Unknown sex: mean of both. Unknown body mass: `body_mass`.
    """
    mass, _ = body_mass(participant, tables)
    bodies = model.updBodySet()
    for part, (segments, followers) in ANTHROPOMETRIC_PARTS.items():
        target = mass * tables.constants.anthropometry.share(part, participant.sex)
        ratio = target / sum(bodies.get(segment).getMass() for segment in segments)
        for segment in (*segments, *followers):
            bodies.get(segment).scaleMass(float(ratio))
    _distribute_upper_arm(model, tables.constants.anthropometry.upper_arm(participant.sex))


def _distribute_upper_arm(model: opensim.Model, upper_arm: UpperArm) -> None:
    """Mass centre and inertia of the humerus, by its length from the head to the elbow's centre."""
    humerus = model.updBodySet().get("humerus_r")
    elbow = np.array(_tuple3(model.getJointSet().get("hu").get_frames(0).get_translation()))
    length = np.linalg.norm(elbow)
    axis = elbow / length
    along = np.outer(axis, axis)
    squared = upper_arm.radius_across**2 * (np.eye(3) - along) + upper_arm.radius_along**2 * along
    inertia = humerus.getMass() * length**2 * squared
    humerus.setMassCenter(_vec3((upper_arm.centre * elbow).tolist()))
    humerus.setInertia(opensim.Inertia(*np.diag(inertia), *inertia[np.triu_indices(3, 1)]))


def divide_masses(model: opensim.Model, divisor: float) -> None:
    """Divide masses and inertias of clavicle, scapula and arm by a number."""
    bodies = model.updBodySet()
    for segment in SCALED_SEGMENTS:
        if segment != "thorax":
            bodies.get(segment).scaleMass(1.0 / divisor)


def body_mass(participant: Participant, tables: ModelTables) -> tuple[float, str]:
    """Body mass [kg] and its source: the participant, or else the mean of all participants."""
    if participant.body_mass_kg is not None:
        return participant.body_mass_kg, "participant"
    return tables.constants.anthropometry.mean_body_mass_kg, "mean of the participants"


def lock_pronation(model: opensim.Model, angle_rad: float) -> None:
    """Hold the forearm at an angle: the paper's model has no forearm rotation."""
    coordinate = model.updCoordinateSet().get(PRONATION)
    coordinate.setDefaultValue(float(angle_rad))
    coordinate.setDefaultLocked(True)


def flatten_thorax_surfaces(
    model: opensim.Model, participant: Participant, tables: ModelTables, fibres_follow: bool
) -> None:
    """Flatten thorax ellipsoids until the attachments of their muscles stay outside when recorded.

    Applies to the surfaces that muscles wrap over; daily tasks do not count. The width (x) shrinks
    by a fixed share, the depth (z) as far as needed, both about the centre: the sides, over which
    the muscles bend, almost stay where they are, and with them the moment arms. Clearance, share
    and reasons are in constants.yaml, `wrap_clearance`. Surfaces that are clear already keep their
    size. Where a recording puts a bone so deep into the thorax that no depth is enough, all radii
    shrink. So they do where an arm that hangs straight down from the recorded girdle would be
    inside.

    If `fibres_follow`, slack and optimal lengths of muscles change with their path in the default
    pose, in which OpenSim scales them, too: normalised fibre lengths there stay what they were.

    Raises
    ------
    ModelError                       if an attachment comes close to the centre of the thorax
    """
    rule = tables.constants.wrap_clearance
    record = model_record(model, participant, tables, ModelChoices())
    angles = elevation_angles(participant)
    poses = trial_to_pose(angles)
    hanging = arm_hanging(poses[resting(angles)])
    names = list(tables.muscles)
    scaled = _default_lengths(model, names)
    for name in attachment_levels(record, poses):
        radii = _clear_of(record, name, poses, hanging, rule)
        if radii is None:
            raise ModelError(
                f"{participant.name}: a recorded pose puts a muscle attachment into the middle of "
                f"the thorax (surface {name}). Check the angles of the SC and AC joint."
            )
        surface = model.updBodySet().get("thorax").upd_WrapObjectSet().get(name)
        opensim.WrapEllipsoid.safeDownCast(surface).set_dimensions(_vec3(radii.tolist()))
    if fibres_follow:
        for name, ratio in zip(names, _default_lengths(model, names) / scaled, strict=True):
            muscle = model.updMuscles().get(name)
            muscle.setOptimalFiberLength(float(ratio) * muscle.getOptimalFiberLength())
            muscle.setTendonSlackLength(float(ratio) * muscle.getTendonSlackLength())


def _clear_of(
    record: ModelRecord, name: str, recorded: Array, hanging: Array, rule: WrapClearance
) -> Array | None:
    """Radii (3,) [m] of a surface clear of recorded poses and of a hanging arm; None if none are.

    The level plus one falls with the square of all radii together.
    """
    [scaled_radii] = (w.dimensions_m for w in record.wrap_objects if w.name == name)

    def level(radii: Array, poses: Array) -> float:
        return float(attachment_levels(record.with_surface(name, tuple(radii)), poses)[name].min())

    def clearance(radii: Array) -> float:
        return level(radii, recorded) - rule.min_level

    radii = _clear_radii(np.array(scaled_radii), clearance, rule.width_share)
    if radii is None:
        return None
    return radii * min(1.0, np.sqrt((1.0 + level(radii, hanging)) / (1.0 + rule.min_level)))


def _default_lengths(model: opensim.Model, names: Sequence[str]) -> Array:
    """Muscle-tendon lengths (M,) [m] with all coordinates at their defaults."""
    return muscle_lengths(model, np.empty((1, 0)), names, ())[0]


def _clear_radii(
    radii: Array, clearance: Callable[[Array], float], width_share: float
) -> Array | None:
    """Radii (3,) [m] without negative clearance: less depth, else less of all; None if none do."""
    if clearance(radii) >= 0.0:
        return radii
    narrow = radii * [width_share, 1.0, 1.0]
    if clearance(narrow) >= 0.0:
        return narrow
    for axes in (DEPTH, ALL_AXES):

        def shrunk(share: float, axes=axes) -> Array:
            return np.where(axes, share * narrow, narrow)

        if clearance(shrunk(FLATTEST)) >= 0.0:
            root = brentq(lambda share, s=shrunk: clearance(s(share)), FLATTEST, 1.0, xtol=1e-6)
            return shrunk(root - 1e-6)
    return None


def adjust_fibres(
    model: opensim.Model, participant: Participant, tables: ModelTables, suspended: bool
) -> None:
    """Lengthen optimal fibres that the recorded motions would stretch beyond a limit.

    If the girdle is `suspended`, the muscles that carry it are set to a limit of their own instead,
    longer or shorter. Limits, muscles and reasons are in constants.yaml, `fibre_adjustment`; daily
    tasks do not count.
    """
    rule = tables.constants.fibre_adjustment
    names = list(tables.muscles)
    angles = elevation_angles(participant)
    longest = muscle_lengths(model, angles, muscles=names).max(axis=0)
    for name, length in zip(names, longest, strict=True):
        muscle = model.updMuscles().get(name)
        stretched = float(length - muscle.getTendonSlackLength())
        if suspended and tables.muscles[name].group in rule.suspending_muscles:
            muscle.setOptimalFiberLength(stretched / rule.suspending_length)
            continue
        needed = stretched / rule.max_normalised_length
        muscle.setOptimalFiberLength(max(muscle.getOptimalFiberLength(), needed))


def set_published_fibres(model: opensim.Model, tables: ModelTables) -> None:
    """Give the muscles that the authors set by hand their optimal lengths and strengths.

    The table holds them for the base model; optimal lengths follow the scale of the participant.
    """
    for name, fibre in tables.published_fibres.items():
        muscle = model.updMuscles().get(name)
        scale = muscle.getOptimalFiberLength() / tables.muscles[name].optimal_fibre_length_m
        muscle.setOptimalFiberLength(scale * fibre.optimal_fibre_length_m)
        muscle.setMaxIsometricForce(fibre.max_isometric_force_N)


def write_osim(model: opensim.Model, path: Path) -> None:
    """Write the model in OpenSim's own format."""
    model.printToXML(str(path))


def model_record(
    model: opensim.Model, participant: Participant, tables: ModelTables, choices: ModelChoices
) -> ModelRecord:
    """All that the equations of motion and the muscles need, as plain data.

    Parameters
    ----------
    model : opensim.Model            as from `participant_model`
    participant, tables, choices     what it was made from
    """
    tables = _with_paths(tables, choices)
    bodies = model.getBodySet()
    mass, mass_source = body_mass(participant, tables)
    constants = tables.constants
    record = ModelRecord(
        schema="model/1",
        participant=participant.name,
        masses=choices.masses,
        choices=choices,
        body_mass_kg=mass,
        body_mass_source=mass_source,
        gravity_mps2=_three(participant.gravity_mps2),
        segments={name: _segment_record(bodies.get(name)) for name in SCALED_SEGMENTS},
        joints={name: _joint_record(model, tables.joints[name]) for name in tables.joints},
        axes={name: _three(tables.coordinates[name].axis) for name in ("EL_x", PRONATION)},
        coordinates={
            name: CoordinateRecord(c.min_rad, c.max_rad, c.default_rad)
            for name, c in tables.coordinates.items()
        },
        girdle_range_rad=girdle_range(
            tables.coordinates,
            recorded_angles(participant),
            choices.girdle_stops,
            np.deg2rad(constants.girdle_stops.margin_deg),
        ),
        pronation_rad=float(np.deg2rad(constants.forearm.pronation_deg)),
        markers={name: _marker_record(model, name) for name in tables.markers},
        conoid=_conoid_record(model, constants.conoid_ligament),
        muscles=tuple(
            _muscle_record(model.getMuscles().get(name), tables.muscles[name])
            for name in tables.active_muscles
        ),
        wrap_objects=tuple(
            _wrap_record(model, w, participant) for w in tables.wrap_objects.values()
        ),
        published_thorax_ellipsoid=participant.thorax_ellipsoid,
        constants=constants,
    )
    length = float(np.median(conoid_distances(record, elevation_poses(participant))))
    return replace(record, conoid=replace(record.conoid, length_m=length))


def conoid_distances(record: ModelRecord, poses: Array) -> Array:
    """Distance of origin and insertion of the conoid ligament, shape (P,) [m], at poses (P, 13)."""
    frames, conoid = segment_frames(record, poses), record.conoid
    ends = []
    for body, place in (
        (conoid.origin_body, conoid.origin_m),
        (conoid.insertion_body, conoid.insertion_m),
    ):
        origin, matrix = frames[body]
        ends.append(origin + matrix @ np.array(place))
    return np.linalg.norm(ends[1] - ends[0], axis=1)


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _segment_record(body: opensim.Body) -> SegmentRecord:
    inertia = body.getInertia()
    moments, products = _tuple3(inertia.getMoments()), _tuple3(inertia.getProducts())
    return SegmentRecord(body.getMass(), _tuple3(body.getMassCenter()), (*moments, *products))


def _joint_record(model: opensim.Model, joint: Joint) -> JointRecord:
    frame = model.getJointSet().get(joint.name).get_frames(0)
    return JointRecord(
        parent=joint.parent,
        child=joint.child,
        location_m=_tuple3(frame.get_translation()),
        orientation_rad=_tuple3(frame.get_orientation()),
    )


def _marker_record(model: opensim.Model, name: str) -> PointRecord:
    marker = model.getMarkerSet().get(name)
    return PointRecord(marker.getParentFrame().getName(), _tuple3(marker.get_location()))


def _path_points(muscle: opensim.Muscle) -> tuple[PointRecord, ...]:
    points = opensim.GeometryPath.safeDownCast(muscle.updPath()).getPathPointSet()
    casts = [opensim.PathPoint.safeDownCast(points.get(i)) for i in range(points.getSize())]
    return tuple(
        PointRecord(point.getParentFrame().getName(), _tuple3(point.get_location()))
        for point in casts
    )


def _conoid_record(model: opensim.Model, rule: ConoidLigament) -> ConoidRecord:
    """The ligament between bones as they are; its length follows from recorded poses."""
    ac_joint = model.getJointSet().get("ac1").get_frames(0).get_translation()
    biceps_origin = np.array(_path_points(model.getMuscles().get("bic_l"))[0].location_m)
    return ConoidRecord(
        origin_body="clavicle_r",
        origin_m=(rule.origin_fraction_of_ac * ac_joint.get(0), rule.origin_y_m, rule.origin_z_m),
        insertion_body="scapula_r",
        insertion_m=_three((biceps_origin + rule.insertion_from_bic_l_m).tolist()),
        stiffness_N_per_m=rule.stiffness_N_per_m,
        eps_m=rule.eps_m,
        length_m=np.nan,
    )


def _muscle_record(muscle: opensim.Muscle, source: Muscle) -> MuscleRecord:
    return MuscleRecord(
        name=source.name,
        group=source.group,
        max_isometric_force_N=muscle.getMaxIsometricForce(),
        optimal_fibre_length_m=muscle.getOptimalFiberLength(),
        tendon_slack_length_m=muscle.getTendonSlackLength(),
        activation_time_s=source.activation_time_s,
        deactivation_time_s=source.deactivation_time_s,
        points=_path_points(muscle),
        wraps=tuple(wrap.wrap_object for wrap in source.wraps),
    )


def _wrap_record(model: opensim.Model, source: WrapObject, participant: Participant) -> WrapRecord:
    target = _frame(model, source.segment).getWrapObject(source.name)
    dimensions: tuple[float, ...]
    if source.kind == "ellipsoid":
        dimensions = _tuple3(opensim.WrapEllipsoid.safeDownCast(target).get_dimensions())
    elif source.kind == "sphere":
        dimensions = (opensim.WrapSphere.safeDownCast(target).get_radius(),)
    else:
        cylinder = opensim.WrapCylinder.safeDownCast(target)
        dimensions = (cylinder.get_radius(), cylinder.get_length())
    return WrapRecord(
        name=source.name,
        type=source.kind,
        body=source.segment,
        translation_m=_tuple3(target.get_translation()),
        rotation_rad=_tuple3(target.get_xyz_body_rotation()),
        quadrant=source.quadrant,
        dimensions_m=dimensions,
        scaled_dimensions_m=_scaled_dimensions(source, participant),
    )


def _scaled_dimensions(
    source: WrapObject, participant: Participant
) -> tuple[float, float, float] | None:
    """Radii of an ellipsoid as OpenSim scales them, before any flattening; None for other kinds."""
    if source.kind != "ellipsoid":
        return None
    radii = np.array(source.dimensions_m) * participant.scale[source.segment]
    return _three(radii.tolist())
