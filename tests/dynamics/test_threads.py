"""What several threads may share gives right results; what they may not says that it is busy.

The programs run in processes of their own: what used to go wrong here killed the process.
"""

import pytest

from tests.programs import python
from tests.texts import DATA

SETUP = """
import collections, sys, threading, time
import numpy as np
import sphshell_pin as sp
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import Busy, SphshellError
from tests.models import FRICTION, LAW, ball, free_q, on_plate
sys.setswitchinterval(1e-6)
Q = free_q([0.0, 0.0, 0.049])
scene = on_plate(ball(), LAW, FRICTION)

def hammer(routines, seconds=0.5):
    '''Call each in a thread of its own, again and again; count what comes of it.'''
    end, seen = time.monotonic() + seconds, collections.Counter()
    def again(routine):
        while time.monotonic() < end:
            try:
                routine()
                seen["done"] += 1
            except Exception as error:
                seen[type(error).__name__] += 1
    threads = [threading.Thread(target=again, args=(one,)) for one in routines]
    for thread in threads: thread.start()
    for thread in threads: thread.join()
    return seen
"""


def passes(program: str) -> None:
    done = python(SETUP + program, cwd=DATA.parents[1])
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_scene_with_a_contact_source_is_right_in_every_thread() -> None:
    """How many contacts there are depends on the state: no thread gets those of another."""
    passes("""
def find(i, j):
    x = i.translation[0]
    n = 1 + int(abs(x) * 300)
    for _ in range(20): pass
    return np.tile([x, 0.0, 0.0], (n, 1)), np.tile([0.0, 0.0, 1.0], (n, 1)), np.full(n, 1e-4)

scene = sp.Scene(ball())
law = sp.ImpactLaw.from_adams()
scene.add_contact_source(find, "ball", "universe", law)
scene.add_contact_source(find, "universe", "ball", law, name="back")
states = [free_q([x, 0.0, 0.0]) for x in (0.0, 0.5, 1.0)]
counts = [len(scene.contacts(q)) for q in states]
def again(k):
    def routine():
        contacts = scene.contacts(states[k])
        assert len(contacts) == counts[k] and set(contacts.point_world[:, 0]) <= {states[k][0], 0.0}
        scene.external_forces(states[k])
        scene.contact_derivatives(states[k])
    return routine
seen = hammer([again(k) for k in (0, 1, 2)])
assert set(seen) == {"done"}, seen
""")


def test_a_scene_and_a_simulation_of_many_threads_keep_their_bits() -> None:
    passes("""
simulation = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4))
forces, end = scene.contacts(Q).normal_force, simulation.run(Q, None, 0.01).q
def look(): assert np.array_equal(scene.contacts(Q).normal_force, forces)
def go(): assert np.array_equal(simulation.run(Q, None, 0.01).q, end)
def roll():
    rollout = simulation.rollout([Q] * 2, None, 0.01, threads=2)
    assert np.array_equal(rollout[1].q[-1], end[-1])
seen = hammer([look, go, go, roll])
assert set(seen) == {"done"}, seen
""")


@pytest.mark.parametrize("friction", ["FRICTION", "sp.BristleFriction(0.5, 0.4, 1e5, 1e2)"])
def test_an_open_run_of_many_threads_is_busy_or_right(friction: str) -> None:
    """The calls that were not refused are those of one run; none is torn."""
    passes(f"""
scene = on_plate(ball(), LAW, {friction})
run = OpenRun(sp.Simulation(scene, sp.SemiImplicitEuler(1e-5)), Q, record_dt=1e-5)
rows, pushes = [], []
def other():
    changed = scene.with_pairs(scene.pairs)
    changed.replace_pair(scene.pairs[0].name, law=sp.ImpactLaw(1e5 + 1e5 * len(rows) % 7, 1.5))
    run.change(changed)
def read(): run._core.q; run._core.summaries; run.residual; run.time
seen = hammer([
    lambda: rows.append(run.advance(0.002)), lambda: rows.append(run.advance(0.003)),
    read, lambda: run.push("ball", [0.0, 0.0, 0.1]), other])
assert set(seen) == {{"done", "Busy"}}, seen
t = np.sort(np.concatenate([piece.t for piece in rows]))
np.testing.assert_allclose(t, 1e-5 * np.arange(len(t)), atol=1e-9)
assert abs(run.time - t[-1]) < 1e-9
""")


def test_who_is_busy_with_what_is_said() -> None:
    passes("""
run = OpenRun(sp.Simulation(scene, sp.SemiImplicitEuler(1e-6)), Q, record_dt=1e-2)
thread = threading.Thread(target=lambda: run.advance(0.3), name="slow")
thread.start()
while True:
    try:
        run.time
    except Busy as error:
        said = str(error)
        break
    assert thread.is_alive()
assert "thread 'slow' is in its advance()" in said and "one for each thread" in said, said
thread.join()
assert abs(run.time - 0.3) < 1e-5  # and it went on as if nothing had been
""")


def test_a_live_run_is_read_by_all_and_moved_by_one() -> None:
    passes("""
from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
live = LiveRun(build("ball_on_turntable"))
body, times = live.bodies[0], []
def look():
    times.append(live.time); live.q, live.v, live.contacts, live.residual
seen = hammer([lambda: live.advance(1e-3), look, lambda: live.push(body, [0, 0, 0.01], 0.01)])
assert set(seen) == {"done", "Busy"} or set(seen) == {"done"}, seen
assert live.ended is None and times == sorted(times)
""")


# Each in a thread of its own, with calls of Python routines and without.
DAEMONS = {
    "compiled": """
lambda: sim.run(Q, None, 100.0, record_dt=1),
lambda: sim.rollout([Q] * 9, None, 100.0, 2, record_dt=10),
lambda: [sim.rollout([Q] * 99, None, 1e-5, 2) for _ in range(9999)],
lambda: scene.pairs[0].side_j.shell.contacts_batch(np.random.rand(10**7, 3) - 0.5, 0.3),
""",
    "with Python routines": """
lambda: sim.run(Q, None, 100.0, still, record_dt=1),
lambda: sim.rollout([Q] * 9, None, 100.0, 2, record_dt=10, controller=still),
lambda: [scene2.contacts(Q) for _ in range(10**7)],
""",
}


@pytest.mark.parametrize("calls", DAEMONS)
def test_the_interpreter_ends_while_daemon_threads_compute(calls: str) -> None:
    program = f"""{SETUP}
sim, still = sp.Simulation(scene, sp.SemiImplicitEuler(1e-6)), lambda *state: np.zeros(6)
scene2 = sp.Scene(ball())
find = lambda i, j: ([[0, 0, 0]], [[0, 0, 1.0]], [1e-4])
scene2.add_contact_source(find, "ball", "universe", sp.ImpactLaw.from_adams())
for call in [{DAEMONS[calls]}]:
    threading.Thread(target=call, daemon=True).start()
time.sleep(0.3)
print("end")
"""
    done = python(program, cwd=DATA.parents[1])
    assert (done.returncode, done.stdout, done.stderr) == (0, "end\n", "")
