"""Where two involute gears touch: an example of contact points that come from one's own routine.

The gears are those of the robot gear_pair: 20 and 40 teeth, module 5 mm, pressure angle 20 degrees.
Involute flanks touch on a straight line, the line of action, that is tangent to both base circles,
so the contact points are a matter of school geometry:

- the gears' angles say where each flank cuts the line of action;
- the depth is how far a flank of one gear has passed its partner's;
- only points between the two tip circles count: one or two pairs of teeth at a time.

The tips are relieved a little, as on real gears, so that a pair of teeth takes its load gradually.
"""

import numpy as np
import pinocchio as pin

from sphshell_pin import Result, Scene
from sphshell_pin.base.arrays import Array
from sphshell_pin.results import SceneContacts

TEETH_1, TEETH_2 = 20, 40
MODULE = 0.005  # pitch diameter / teeth [m]
ALPHA = np.deg2rad(20.0)  # pressure angle
BACKLASH = 1e-4  # play along the line of action [m]
RELIEF, RELIEF_LENGTH = 3e-5, 0.008  # at a tip: how much, over how much of the line of action [m]

CENTRES = MODULE * (TEETH_1 + TEETH_2) / 2
BASE_1 = MODULE * TEETH_1 / 2 * np.cos(ALPHA)
BASE_2 = MODULE * TEETH_2 / 2 * np.cos(ALPHA)
PITCH = np.pi * MODULE * np.cos(ALPHA)  # from one flank to the next, along the line of action
# The stretch between the tip circles, measured from the line's tangent point on base circle 1.
START = CENTRES * np.sin(ALPHA) - np.sqrt((MODULE * (TEETH_2 / 2 + 1)) ** 2 - BASE_2**2)
END = np.sqrt((MODULE * (TEETH_1 / 2 + 1)) ** 2 - BASE_1**2)
# Angle from a tooth's middle to where its involute starts.
HALF_TOOTH = np.pi / (2 * TEETH_1) + np.tan(ALPHA) - ALPHA


def find(pose_i: pin.SE3, pose_j: pin.SE3) -> tuple[Array, Array, Array]:
    """Return the contact points of gear_2 (i) with gear_1 (j).

    `pose_i` and `pose_j` are those of the two gears in the world, axles along z.
    Returns points_world (k,3) [m], normals_world (k,3) from j to i, depths (k,) [m].
    """
    angle_1, angle_2 = turned(pose_j.rotation), turned(pose_i.rotation)
    advance = (BASE_1 * angle_1 + BASE_2 * angle_2 + PITCH / 2) % PITCH - PITCH / 2
    points, normals, depths = [], [], []
    # Gear 1 pushes with its front flanks (+1) when it leads, with its back flanks (-1) otherwise.
    for side in (1, -1):
        overlap = side * advance - BACKLASH / 2
        if overlap <= 0:
            continue
        first = BASE_1 * (side * angle_1 + HALF_TOOTH + ALPHA)
        for s in np.arange(first - np.floor((first - START) / PITCH) * PITCH, END, PITCH):
            relief, slope = tip_relief(s)
            if overlap <= relief:
                continue
            # The relief bends the flank: its normal passes gear 1's center at base * (1 - slope).
            # With this lever the contact gives back exactly the energy it stores.
            lever = BASE_1 * (1 - slope)
            tilt = np.arccos((lever + BASE_2) / CENTRES)
            normal = np.array([np.sin(tilt), side * np.cos(tilt), 0.0])
            tangent = lever * np.array([np.cos(tilt), -side * np.sin(tilt), 0.0])
            points.append(pose_j.translation + tangent + s * normal)
            normals.append(normal)
            depths.append(overlap - relief)
    return np.reshape(points, (-1, 3)), np.reshape(normals, (-1, 3)), np.array(depths)


def tip_relief(s: float) -> tuple[float, float]:
    """Return how much the flanks are relieved at `s` on the line of action [m], and its slope."""
    enter = max(0.0, 1 - (s - START) / RELIEF_LENGTH)
    leave = max(0.0, 1 - (END - s) / RELIEF_LENGTH)
    slope = 2 * RELIEF / RELIEF_LENGTH * (leave - enter)
    return RELIEF * (enter**2 + leave**2), slope


def turned(rotation: Array) -> float:
    """Return the angle of a rotation about z [rad]."""
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


SPEED = 10.0  # what the motor on gear 1 holds [rad/s]
LOAD = 12.0  # torque of the brake on gear 2 [N m]


def drive(t: float, q: Array, v: Array, contacts: SceneContacts) -> Array:
    """Return the joint torques: a motor holds gear 1's speed, a brake is put on gear 2 in 0.1 s."""
    u = min(t / 0.1, 1.0)
    brake = LOAD * u * u * (3 - 2 * u)
    return np.array([0.5 * (SPEED - v[0]) + brake * TEETH_1 / TEETH_2, brake])


def speed_ratio(result: Result, scene: Scene) -> float:
    """Return the mean speed of gear 1 over that of gear 2, over the second half of the run."""
    half = len(result.t) // 2
    return float(-result.v[half:, 0].mean() / result.v[half:, 1].mean())


def tooth_force(result: Result, scene: Scene) -> float:
    """Return the force between the gears [N], over the second half of the run."""
    half = result.t[-1] / 2
    log = result.contacts
    return float(log.normal_force[log.t >= half].sum() / np.count_nonzero(result.t >= half))
