"""A player for tests of the live page: a ball on a plate, with a dynamics of three lines."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin

from sphshell_pin.dynamics.scene.scene_contacts import ROW, SceneContacts
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.scenario.running.rows import Rows
from tests import models
from tests.view.stand_ins import contact_pair, plate

RADIUS, MASS, GRAVITY = 0.05, 1.0, 9.81


class BallPlayer:
    """A ball held up by a spring, without friction; x, y and z are free."""

    title = "A ball on a plate"
    patches = None
    visual_model = None
    start = 0.0
    planned = None

    def __init__(self, height=0.049, stiffness=5e3, friction=None, wall_per_second=0.0):
        joint = pin.JointModelTranslation()
        self.model, self.plate = models.ball(GRAVITY, MASS, RADIUS, joint), plate()
        self.friction = friction
        self.height = height
        self.knob_values = {"stiffness": stiffness, "radius": RADIUS}
        self.wall_per_second = wall_per_second
        self.calls = []
        self._make_scene()
        self.reset()

    def _make_scene(self):
        ball = self.model, "ball", self.knob_values["radius"], self.plate
        pair = contact_pair(*ball, name="ball", friction=self.friction)
        self.scene = SimpleNamespace(model=self.model, pairs=(pair,))

    @property
    def parameters(self):
        def slider(key, value):
            about = {"label": key, "unit": "", "low": value / 10, "high": value * 10, "log": True}
            return SimpleNamespace(key=key, value=value, **about)

        return tuple(slider(*one) for one in self.knob_values.items())

    bodies = ("ball",)

    def reset(self):
        self.time, self.ended = 0.0, None
        self.q, self.v = np.array([0.0, 0.0, self.height]), np.zeros(3)
        self.force, self.push_end = np.zeros(3), -1.0
        self.residual, self.exchanged = 1e-9, 1.0

    def depth(self):
        return self.knob_values["radius"] - self.q[2]

    @property
    def contacts(self):
        touching = self.depth() > 0.0
        force = self.knob_values["stiffness"] * self.depth()
        friction = [0.0] * 3 if self.friction is None else [-0.1 * force, 0.0, 0.0]
        rows = np.zeros(int(touching), ROW)
        rows["point_world"] = [self.q[0], self.q[1], 0]
        rows["normal_world"] = [0, 0, 1]
        rows["depth"], rows["normal_force"] = self.depth(), force
        rows["friction_force_world"], rows["slip_velocity_world"] = friction, self.v
        return SceneContacts.from_rows(rows.tobytes())

    def advance(self, duration, wall=np.inf):
        self.calls.append((duration, wall))
        if self.wall_per_second:
            duration = min(duration, wall / self.wall_per_second)
        end = self.time + duration
        t, normal = [], []
        while self.time < end - 1e-12:
            dt = min(1e-3, end - self.time)
            push = self.force if self.time < self.push_end else np.zeros(3)
            lift = max(0.0, self.knob_values["stiffness"] * self.depth()) - 20.0 * self.v[2]
            lift = lift if self.depth() > 0.0 else 0.0
            self.v = self.v + dt * (push + [0.0, 0.0, lift - MASS * GRAVITY]) / MASS
            self.q = self.q + dt * self.v
            self.time += dt
            t.append(self.time)
            normal.append(max(0.0, lift))
        column = np.array(normal).reshape(-1, 1)
        return Rows(np.array(t), column, 0.1 * column, 1e-3 * column)

    def change(self, key, value):
        if not value > 0.0:
            raise InvalidParameter(key, value, "must be positive")
        self.knob_values[key] = value
        if key == "radius":
            self._make_scene()

    def push(self, body, force_world, seconds):
        self.force, self.push_end = np.asarray(force_world), self.time + seconds


class ArmPlayer(BallPlayer):
    """Pinocchio's sample manipulator with its geometry, which stands still and touches nothing."""

    def __init__(self):
        super().__init__(height=1.0)
        model = pin.buildSampleModelManipulator()
        pair = contact_pair(model, "effector_body", 0.08, plate())
        self.visual_model = pin.buildSampleGeometryModelManipulator(model)
        self.scene = SimpleNamespace(model=model, pairs=(pair,))
        self.q = pin.integrate(model, pin.neutral(model), np.linspace(0.1, 0.6, model.nv))

    contacts = property(lambda _: SceneContacts.from_rows(b""))

    def advance(self, duration, wall=np.inf):
        return Rows.empty(1)
