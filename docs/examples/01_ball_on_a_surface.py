# %% [markdown]
"""A ball dropped on a surface from CAD.

Ten lines: a surface file, a robot, a force law, a run, figures. Any other surface file will do in
place of this bowl; its length unit is stated, never guessed.
"""

# %%
import numpy as np

import sphshell_pin as sp
from sphshell_pin import robots, scenarios

bowl = sp.Shell.from_file(scenarios.__path__[0] + "/surfaces/bowl.shl", unit="mm")
ball = robots.load("ball")  # radius 12 mm, flies freely; or robots.load_file("my.urdf")
scene = sp.Scene(ball.model)
law = sp.ImpactLaw.hertz(0.012, 5e6, 0.49, 70e9, 0.33, restitution=0.7, speed=1.0)  # rubber
friction = sp.CoulombFriction(mu_static=0.2, mu_dynamic=0.15, v_static=1e-3, v_dynamic=1e-2)
scene.add_contact(sp.Sphere(0.012, "ball"), bowl, law=law, friction=friction, name="ball-bowl")
q0 = np.array([0.06, 0.02, 0.10, 0, 0, 0, 1])  # position [m], then the quaternion x y z w
result = sp.Simulation(scene, sp.Adaptive()).run(q0, duration=1.5, record_dt=2e-4)
scene

# %% [markdown]
# What happened, in numbers. A notebook shows the last value of a cell.

# %%
figures = result.stats.pairs["ball-bowl"]
print(f"{figures.touches} touches, hardest {figures.peak_force:.0f} N")
print(f"energy residual {np.abs(result.energy.residual).max():.1e} J")
result

# %% [markdown]
# Forces, depth and energy over time; then where on the bowl it bounced and rolled: each element is
# colored by the normal impulse that it took. A notebook shows figures by itself, a script saves
# them.

# %%
overview = result.plot()
overview.savefig("overview.png")
overview

# %%
contact_map = result.plot("map")
contact_map.savefig("contact_map.png")
contact_map

# %% [markdown]
# The recording plays in the notebook, and as a page of its own in any browser.

# %%
recording = result.view(visual_model=ball.visual_model, speed=0.5)
recording.save("ball.html")
recording
