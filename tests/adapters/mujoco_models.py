"""Models of MuJoCo for the tests of its adapter."""

import pytest

import sphshell_pin as sp
from tests import models

mujoco = pytest.importorskip("mujoco")

from benchmarks.in_mujoco import ball  # noqa: E402
from sphshell_pin.adapters.mujoco import attach, reserve  # noqa: E402

LAW = sp.HuntCrossleyLaw(1e5, 1.5, 0.2)
STIFF, STICKS = sp.HuntCrossleyLaw(1e6, 1.5, 5.0), sp.BristleFriction(0.6, 0.5, 1e4, 60.0)
SOFT = sp.HuntCrossleyLaw(1e5, 1.5, 1.0)


def model_of(xml: str, *rooms: dict[str, int]):
    """A model with its data, and room for so many attachments that remember."""
    spec = mujoco.MjSpec.from_string(xml)
    for room in rooms:
        reserve(spec, **room)
    model = spec.compile()
    return model, mujoco.MjData(model)


def sliding(option: str) -> str:
    """A ball that does not turn."""
    slides = "".join(f'<joint type="slide" axis="{a}"/>' for a in ("1 0 0", "0 1 0", "0 0 1"))
    return ball(0.02, 0.1, options=option).replace("<freejoint/>", slides)


def plate(half: float = 1.0) -> sp.Shell:
    return models.square(2 * half)


def slab(count: int, radius: float = 0.02) -> str:
    """A plate, and balls that begin in touch with it."""
    balls = "".join(
        f'<body pos="{0.05 * k} 0 {0.95 * radius}"><freejoint/>'
        f'<geom name="ball{k}" type="sphere" size="{radius}" mass=".1"/></body>'
        for k in range(count)
    )
    return f"""<mujoco><option timestep="5e-5"/><worldbody>
      <body name="part"><geom name="slab" type="box" size=".1 .1 .01" pos="0 0 -.01"/></body>
      {balls}</worldbody></mujoco>"""


def on_slab(model, *names: str, **given):
    return attach(model, plate(0.1), names, body="part", law=SOFT, **given)
