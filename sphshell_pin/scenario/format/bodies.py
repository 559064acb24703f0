"""The robots of a scenario, put together into one pinocchio model with its start state."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import off_unit_length
from sphshell_pin.dynamics.scene import models
from sphshell_pin.dynamics.scene.mimic import check_follows, count_of_all, mimics, shortened
from sphshell_pin.errors import MissingExtra, ScenarioError, SphshellError
from sphshell_pin.robots import LoadedRobot, load, load_file, mass_fault
from sphshell_pin.scenario.format import schema
from sphshell_pin.scenario.format.reach import Reach
from sphshell_pin.scenario.format.reading import item_key

# A tip that is brought somewhere: starts of the search, and how near it comes [m], [rad].
_SEEDS, _AT_TIP, _ALONG = 40, 1e-6, 1e-4


@dataclass(frozen=True)
class Assembly:
    """All robots as one model, before any joint is locked."""

    model: pin.Model
    """Names carry `label/` as soon as there are several robots."""
    visual_model: pin.GeometryModel
    q0: Array
    """Start configuration (nq,)."""
    v0: Array
    """Start velocity (nv,)."""
    lock: tuple[str, ...]
    """Joints to lock at their place in q0."""
    loaded: tuple[LoadedRobot, ...] = ()
    """The robots as they were loaded, one for each table."""
    prefixes: tuple[str, ...] = ()
    """What stands before the names of each robot."""


@contextmanager
def blamed_on(path: Path, key: str) -> Iterator[None]:
    """Name the scenario's file and `key` in any fault of the package that happens inside.

    So it does of numbers that are too large or too small to compute with.
    """
    try:
        yield
    except (ScenarioError, MissingExtra):
        raise
    except SphshellError as error:
        raise ScenarioError(path, key, str(error)) from error
    except ArithmeticError as error:
        why = f"has a number too large or too small to compute with ({error})"
        raise ScenarioError(path, key, why) from error


def to_se3(placement: schema.Placement) -> pin.SE3:
    """Return the SE3 of a placement table."""
    return pin.SE3(pin.rpy.rpyToMatrix(*np.deg2rad(placement.rpy_deg)), np.array(placement.xyz))


def assemble(
    scenario: schema.Scenario,
    path: Path,
    loaded: Mapping[tuple[object, ...], LoadedRobot] | None = None,
) -> Assembly:
    """Load all robots of `scenario` and append them into one model under its gravity.

    `loaded` are robots at hand, by the `origin` of their table.

    Raises
    ------
    ScenarioError
        A robot cannot be loaded, two share a label, or a start value does not fit its joint.
    MissingExtra
        A robot comes from a package that is not installed.
    """
    several = len(scenario.robot) > 1
    base, visual = pin.Model(), pin.GeometryModel()
    starts: list[tuple[str, Array, Array, Array]] = []
    lock: list[str] = []
    taken: list[LoadedRobot] = []
    prefixes: list[str] = []
    for i, section in enumerate(scenario.robot):
        key = item_key("robot", scenario.robot, i)
        with blamed_on(path, key):
            robot = (loaded or {}).get(origin(section)) or _load(section, path)
        taken.append(robot)
        model, geometry = robot.model.copy(), robot.visual_model.copy()
        q, v = _start(model, robot.q0, section, path, key)
        for j, joint in enumerate(section.lock):
            with blamed_on(path, f"{key}.lock[{j}]"):
                joint_spans(model, joint)
        prefix = ""
        if several:
            label = section.label or robot.name
            prefix = f"{label}/"
            if prefix in prefixes:
                raise ScenarioError(path, f"{key}.label", "two robots share this label", label)
            _rename(model, geometry, prefix)
        prefixes.append(prefix)
        lock += [prefix + joint for joint in section.lock]
        for name in list(model.names)[1:]:
            in_q, in_v = joint_spans(model, name)
            starts.append((name, q[in_q], v[in_v], np.array(model.armature[in_v])))
        stand = to_se3(section.placement)
        with blamed_on(path, f"{key}.frame"):
            carrier = models.find_frame(base, section.frame)
        if not several and stand.isIdentity():
            base, visual = model, geometry
        else:
            try:
                base, visual = pin.appendModel(base, model, visual, geometry, carrier, stand)
            except ValueError as error:
                why = f"robots whose joints and links share names cannot be combined: {error}"
                raise ScenarioError(path, key, why) from None
    base.gravity.linear = np.array(scenario.gravity)
    q0, v0, armature = pin.neutral(base), np.zeros(base.nv), np.zeros(base.nv)
    for name, q_joint, v_joint, inertia in starts:
        in_q, in_v = joint_spans(base, name)
        q0[in_q], v0[in_v], armature[in_v] = q_joint, v_joint, inertia
    if armature.any():
        base.armature = armature  # which pinocchio.appendModel (4.1) drops
    for i, section in enumerate(scenario.robot):
        key = f"{item_key('robot', scenario.robot, i)}.start.{schema.TIP_AT}"
        if section.tip_start is not None:
            with blamed_on(path, key):
                q0 = _with_tip(base, q0, section.tip_start, prefixes[i], section.lock, scenario)
    return Assembly(base, visual, q0, v0, tuple(lock), tuple(taken), tuple(prefixes))


def _with_tip(
    model: pin.Model,
    q: Array,
    tip: schema.TipAt,
    prefix: str,
    lock: Sequence[str],
    scenario: schema.Scenario,
) -> Array:
    """Return q (nq,) with the tip of the robot whose names begin with `prefix` where it shall be.

    From q on, then from seeds within the limits of its joints, always the same.
    """
    frame, offset = _tip_frame(model, tip, prefix, scenario)
    names = list(model.names)[1:]
    held = [
        name for name in names if not name.startswith(prefix) or name.removeprefix(prefix) in lock
    ]
    # A root that floats stays, as it would carry the tip anywhere.
    held += [name for name in names if models.find_joint(model, name).nv == 6 and len(names) > 1]
    reach = Reach(model, frame, offset, held)
    place, rng = np.array(tip.xyz), np.random.default_rng(0)
    turn = None
    if tip.along is not None:
        along = np.array(tip.along)
        if not along.any():
            raise SphshellError("along must be a direction, not [0, 0, 0]")
        turn = partial(reach.turn_of_axis, along / np.linalg.norm(along))
    best, least = q, np.inf
    for k in range(_SEEDS):
        seed = reach.into_limits(q) if k == 0 else reach.seed(q, rng)
        found, off = reach.solve(seed, place, turn=turn)
        reach.center(found)
        turned = 0.0 if turn is None else float(np.linalg.norm(turn()))
        if off < _AT_TIP and turned < _ALONG:
            return found
        if off + turned < least:
            best, least = found, off + turned
    center = reach.center(best)
    off = float(np.linalg.norm(center - place))
    if off < _AT_TIP and turn is not None:
        angle = np.rad2deg(np.linalg.norm(turn()))
        raise SphshellError(
            f"the joints bring frame '{frame}' there, but its z axis no nearer than {angle:.3g} "
            "degrees to along: leave that out, or take another place"
        )
    raise SphshellError(
        f"the tip on frame '{frame}' comes no nearer than {1e3 * off:.3g} mm, at "
        f"[{', '.join(f'{one:.4g}' for one in center)}]: its joints reach no farther"
        + ("" if turn is None else " with its z axis along")
    )


def _tip_frame(
    model: pin.Model, tip: schema.TipAt, prefix: str, scenario: schema.Scenario
) -> tuple[str, Sequence[float]]:
    """Return the frame of the tip and its offset, by default those of a contact's sphere."""
    if tip.frame is not None:
        return prefix + tip.frame, tip.offset
    for contact in scenario.contact:
        sphere = contact.sphere
        moves = (
            sphere is not None
            and sphere.frame.startswith(prefix)
            and models.joint_of(model, sphere.frame) > 0
        )
        if sphere is not None and moves:
            return sphere.frame, sphere.offset
    raise SphshellError("no contact has a sphere on this robot: name the frame of the tip")


def origin(section: schema.RobotSection) -> tuple[object, ...]:
    """Return what tells robots of one scenario's folder apart before they start and are placed."""
    plain = ("name", "path", "density", "srdf", "pose", "floats", "mimic")
    lists = tuple(section.package_dirs), tuple(section.xacro_args.items())
    return (*(getattr(section, one) for one in plain), *lists)


def check_masses(assembly: Assembly, lock: Collection[str]) -> None:
    """Raise SphshellError for a joint not in `lock` that moves no mass: what lacks one."""
    for robot, prefix in zip(assembly.loaded, assembly.prefixes, strict=True):
        held = {name.removeprefix(prefix) for name in lock if name.startswith(prefix)}
        fault = mass_fault(robot.model, robot.q0, robot.description, held)
        if fault is not None:
            raise SphshellError(f"{robot.name}: {fault}")


def reduce_visual(assembly: Assembly) -> pin.GeometryModel:
    """Return the visual geometry for the model with `assembly.lock` locked."""
    if not assembly.lock:
        return assembly.visual_model
    return models.reduced_geometry(
        assembly.model, assembly.visual_model, assembly.lock, assembly.q0
    )[1]


def restrict(model: pin.Model, reduced: pin.Model, q: Array, v: Array) -> tuple[Array, Array]:
    """Return the state (q, v) of `model` for the joints that `reduced` still has."""
    q_reduced, v_reduced = pin.neutral(reduced), np.zeros(reduced.nv)
    for name in list(reduced.names)[1:]:
        to_q, to_v = joint_spans(reduced, name)
        from_q, from_v = joint_spans(model, name)
        q_reduced[to_q], v_reduced[to_v] = q[from_q], v[from_v]
    return q_reduced, v_reduced


def joint_spans(model: pin.Model, name: str) -> tuple[slice, slice]:
    """Return the places of a joint's numbers in q and in v; NameNotFound lists the joints."""
    joint = models.find_joint(model, name)
    return slice(joint.idx_q, joint.idx_q + joint.nq), slice(joint.idx_v, joint.idx_v + joint.nv)


def _load(section: schema.RobotSection, path: Path) -> LoadedRobot:
    if section.name is not None:
        return load(section.name, free_flyer=section.floats, mimic=section.mimic, pose=section.pose)
    folder, file = path.parent, section.path or ""
    return load_file(
        folder / file,
        [folder / one for one in section.package_dirs],
        free_flyer=section.floats,
        mimic=section.mimic,
        name=Path(file).name.partition(".")[0],
        xacro_args=section.xacro_args,
        srdf=None if section.srdf is None else folder / section.srdf,
        pose=section.pose,
        density=section.density,
    )


def _start(
    model: pin.Model, q_default: Array, section: schema.RobotSection, path: Path, key: str
) -> tuple[Array, Array]:
    q, v = np.array(q_default, dtype=float), np.zeros(model.nv)
    if section.q is not None:
        every = count_of_all(model)
        if len(section.q) not in (model.nq, every):
            count = f"{model.nq} coordinates"
            if every != model.nq:
                count += f" ({every} with those of mimic joints)"
            raise ScenarioError(path, f"{key}.q", f"the robot has {count}, not {len(section.q)}")
        q = np.array(section.q)
        if len(q) != model.nq:
            with blamed_on(path, f"{key}.q"):
                q = shortened(model, q, check=True)
    rules = mimics(model)
    for name, value in section.joint_start.items():
        with blamed_on(path, f'{key}.start."{name}"'):
            models.set_joint(model, q, name, value)
    for name in (one for one in section.joint_start if one in rules):
        # What it mimics may be stated too, or another joint that mimics the same.
        rule, value = rules[name], section.joint_start[name]
        joint = models.find_joint(model, rule.of)
        if joint.nq == 1:
            with blamed_on(path, f'{key}.start."{name}"'):
                stated = value[0] if isinstance(value, list) else value
                check_follows(rule, stated, q[joint.idx_q])
    for name, value in section.speed.items():
        where = f'{key}.speed."{name}"'
        with blamed_on(path, where):
            _, span = joint_spans(model, name)
        if name in rules:
            raise ScenarioError(
                path, where, f"the joint mimics '{rules[name].of}': state the speed of that one"
            )
        values = np.atleast_1d(np.array(value, dtype=float))
        count = span.stop - span.start
        if len(values) != count:
            raise ScenarioError(path, where, f"the joint takes {count} numbers", value)
        v[span] = values
    unit = pin.normalize(model, q)
    # Rounded quaternions and cosines are set right; a wrong one (not of unit length) is a mistake.
    if not np.allclose(unit, q, rtol=0, atol=1e-2) or not pin.isNormalized(model, unit, 1e-3):
        where = f"{key}.start" if section.start or section.q is None else f"{key}.q"
        raise ScenarioError(path, where, str(off_unit_length(model, q)))
    return unit, v


def _rename(model: pin.Model, geometry: pin.GeometryModel, prefix: str) -> None:
    for j in range(1, model.njoints):
        model.names[j] = prefix + model.names[j]
    for f in range(1, model.nframes):
        model.frames[f].name = prefix + model.frames[f].name
    for one in geometry.geometryObjects:
        one.name = prefix + one.name
