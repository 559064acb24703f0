# %% [markdown]
"""Friction and stiffness from measured rebounds.

Kharaz, Gorham and Salman (Powder Technology 120 (2001) 281) threw alumina balls of 5 mm at a thick
glass plate, at 3.9 m/s and angles from 2 to 85 degrees, and measured how fast they were along the
plate and how fast they spun afterwards. Two numbers of a scenario are fitted to their points: the
coefficient of friction, and Young's modulus of the glass as the tangential stiffness has it.
"""

# %%
from math import cos, pi, radians, sin
from pathlib import Path

import sphshell_pin as sp
from tests.validation.cases import read

RADIUS, DENSITY, SPEED = 2.5e-3, 4000.0, 3.9  # [m, kg/m^3, m/s]
mass = 4 / 3 * pi * RADIUS**3 * DENSITY
inertia = 0.4 * mass * RADIUS**2
Path("alumina.urdf").write_text(f"""\
<robot name="alumina"><link name="ball"><inertial>
  <mass value="{mass}"/>
  <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/>
</inertial></link></robot>
""")
Path("rebound.toml").write_text(f"""\
title = "A ball of alumina rebounds from glass"
gravity = [0.0, 0.0, 0.0]  # the impact takes 15 microseconds

[robot]
file = "alumina.urdf"
free_flyer = true

[robot.start]
root_joint = [0.0, 0.0, {RADIUS + 1e-7}, 0.0, 0.0, 0.0, 1.0]

[robot.speed]
root_joint = [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]

[[shell]]
name = "glass"
primitive = {{ type = "half-space", extent = 0.1 }}

[[contact]]
name = "ball"
sphere = {{ frame = "ball", radius = {RADIUS} }}
shell = "glass"

[contact.law]
type = "hertz"
young = 3.8e11     # alumina [Pa]
poisson = 0.23
young_2 = 7.0e10     # glass [Pa]
poisson_2 = 0.25
restitution = 0.98   # at every angle
speed = 1.0

[contact.friction]
type = "mindlin"
mu_static = 0.15     # where the search starts
mu_dynamic = 0.15
young = 3.8e11
poisson = 0.23
young_2 = 3.0e10     # where the search starts
poisson_2 = 0.25
rings = 8            # with micro-slip

[run]
duration = 4e-5
rtol = 1e-6
""")

# %% [markdown]
# Each point is an experiment of its own: one value, measured after the impact. The velocity with
# which the ball comes, and the speed at which its restitution holds, follow from the angle. The
# figures of the paper were digitised three times; these are the points as Kratos has them.

# %%
DURATION = 4e-5
points = read("kharaz").where("reading", "kratos")
experiments = []
for quantity, column in (
    ("restitution", "frames.ball.vx [m/s]"),
    ("spin", "frames.ball.wy [rad/s]"),
):
    chosen = points.where("quantity", quantity)
    for angle, value in zip(chosen["angle"], chosen["value"], strict=True):
        along, down = SPEED * sin(radians(angle)), SPEED * cos(radians(angle))
        measured = value * along if quantity == "restitution" else value
        experiments.append(
            sp.Experiment(
                {"t [s]": [DURATION], column: [measured]},
                changes={
                    "robot.0.speed.root_joint": f"[{along}, 0.0, {-down}, 0.0, 0.0, 0.0]",
                    "contact.ball.law.speed": down,
                },
                name=f"{quantity} at {angle:.0f} degrees",
            )
        )

friction = "contact.ball.friction."
found = sp.fit(
    "rebound.toml",
    experiments,
    [f"{friction}mu_static+{friction}mu_dynamic", f"{friction}young_2"],
)
print(found)
print(found.correlation)
found

# %%
figure = found.plot()
figure.savefig("fit.png", dpi=110)
found.write_scenario("rebound.fitted.toml")
figure
