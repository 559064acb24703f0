"""Seven checks of contact on a robot, by computations independent of the compiled core.

`check_robot` takes a name that sphshell_pin.robots knows or a file, and returns a RobotReport.
"""

import zlib
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pinocchio as pin

from sphshell_pin.base.checks import check_finite, check_positive
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import FrameNotFound, MissingExtra, NameNotFound, SphshellError
from sphshell_pin.robots import RobotError
from sphshell_pin.study.robot_check.checks import QUICK, SPEED, Sizes, run_checks
from sphshell_pin.study.robot_check.models import load_subject
from sphshell_pin.study.robot_check.report import RobotReport
from sphshell_pin.study.robot_check.setting import Touch, setting_of, touch_of

__all__ = ["QUICK", "RobotReport", "Sizes", "Touch", "check_robot", "contact_scene"]


def check_robot(
    robot: StrPath | pin.Model,
    *,
    frame: str | None = None,
    radius: float | None = None,
    free_flyer: bool = False,
    package_dirs: Sequence[StrPath] = (),
    xacro_args: Mapping[str, object] | None = None,
    density: float | None = None,
    mimic: bool = True,
    seed: int = 0,
    sizes: Sizes | None = None,
    progress: Callable[[str], object] | None = None,
) -> RobotReport:
    """Check contact on a robot: a name that sphshell_pin.robots knows, a file, or a model.

    A sphere of `radius` [m] sits at `frame`; without them it is a fingertip or foot that is known,
    else the end of the longest limb. A file is a URDF, xacro (`xacro_args` are its arguments) or
    MJCF; `free_flyer` frees the root link of a URDF, `package_dirs` are the folders that hold
    packages that it includes. `density` [kg/m^3] gives links of a URDF the mass of their geometry
    where it states none. Mimic joints are exact unless `mimic` is False. Meshes are not loaded. The
    same `seed` gives the same postures; `sizes` says how many; `progress` is called with the key of
    each check before it starts. A model is a pinocchio.Model.

    A robot that cannot be loaded on this machine, or whose sphere nothing can move, is reported as
    not checked, with the reason.

    Raises
    ------
    NameNotFound, SphshellError
        There is no such robot or file.
    FrameNotFound
        The robot has no frame of that name.
    MissingExtra
        The robot comes from a package that is not installed.
    InvalidParameter
        `radius` is not positive, or `free_flyer` is asked of a robot that is no URDF file.
    """
    if radius is not None:
        radius = check_positive("radius", radius, "m")
    try:
        subject = load_subject(
            robot,
            free_flyer=free_flyer,
            package_dirs=package_dirs,
            xacro_args=xacro_args,
            density=density,
            mimic=mimic,
        )
    except (MissingExtra, NameNotFound):
        raise
    except RobotError as error:
        return RobotReport(str(robot), reason=str(error).removeprefix(f"{robot}: "))
    rng = _random(seed, subject.name)
    try:
        setting = setting_of(subject, rng, frame, radius)
        findings = run_checks(setting, rng, sizes or Sizes(), progress or (lambda _: None))
    except (FrameNotFound, KeyboardInterrupt):
        raise
    except SphshellError as error:
        model = subject.robot.model
        return RobotReport(
            subject.name, nq=model.nq, nv=model.nv, notes=subject.notes, reason=str(error)
        )
    return RobotReport(
        subject.name,
        setting.sphere.frame,
        setting.radius,
        setting.model.nq,
        setting.model.nv,
        findings,
        setting.notes,
    )


def contact_scene(
    robot: StrPath | pin.Model,
    *,
    frame: str | None = None,
    radius: float | None = None,
    depth: float = 0.1,
    free: bool = False,
    free_flyer: bool = False,
    seed: int = 0,
) -> Touch:
    """Return a scene of a robot whose sphere is `depth` [radii] deep in a curved patch.

    Robot, frame, radius and seed are those of `check_robot`. At a random legal posture and velocity
    (`q`, `v` of what is returned) the sphere moves into the patch. The patch is fixed to the world;
    with `free` it floats, as the robot's root does, without gravity. A negative depth is a gap. The
    contact has damping and friction that fit the mass it feels.

    Raises what `check_robot` raises, and SphshellError if no joint moves the sphere.
    """
    if radius is not None:
        radius = check_positive("radius", radius, "m")
    subject = load_subject(robot, free_flyer=free_flyer)
    rng = _random(seed, subject.name)
    setting = setting_of(subject, rng, frame, radius)
    gap = -check_finite("depth", depth)
    return touch_of(setting, rng, gap, SPEED * setting.radius, free=free)


def _random(seed: int, name: str) -> np.random.Generator:
    """Return random numbers that do not depend on which other robots are checked."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])
