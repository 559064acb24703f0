"""The C++ library: built and installed without Python, used from the installed package.

What these tests build is left in build/cpp and beside it: the next run compiles what has changed.
"""

import fcntl
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import example_robot_data
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.base import cache
from sphshell_pin.dynamics.compiled.robot import compile_robot
from tests import meshes

ROOT = Path(__file__).parent.parent
EXAMPLE = ROOT / "docs" / "examples" / "cpp"
PAGE = ROOT / "docs" / "cpp.md"
# .ci/sanitize sets a folder, and CXXFLAGS to which no kind of build adds any.
BUILD = Path(os.environ.get("SPHSHELL_CPP_BUILD", ROOT / "build"))
KIND = "" if "SPHSHELL_CPP_BUILD" in os.environ else "Release"
# Its programs bring their own sanitizer; compilers need none.
ENVIRONMENT = {name: text for name, text in os.environ.items() if name != "LD_PRELOAD"}
PINOCCHIO = Path(pin.__file__).parents[4]  # the wheels' prefix, of which this is lib/python/...
WITHOUT_PYTHON = "-DSPHSHELL_PIN_PYTHON=OFF", "-DCMAKE_DISABLE_FIND_PACKAGE_Python=ON"
CACHE = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def call(*command: object, cwd: Path = ROOT, fails: bool = False, given: str | None = None) -> str:
    """Return what the command prints, `given` this input; fail where it does, or does not."""
    # The programs that pip has installed come first: cmake, ninja.
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ["PATH"]])
    words = [shutil.which(str(command[0]), path=path) or command[0], *command[1:]]
    more = {"env": {**ENVIRONMENT, "PATH": path}, "cwd": cwd, "text": True}
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    done = subprocess.run([*map(str, words)], check=False, input=given, **both, **more)
    assert (done.returncode != 0) == fails, f"{command}\n{done.stdout}"
    return done.stdout


@pytest.fixture(scope="module")
def built() -> Path:
    return build_all()


def build_all() -> Path:
    """Build the library, cpp and cpp-installed, and its users, cpp-finger and cpp-tests.

    Return their folder. `make test` does it before the tests, on all cores.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "cpp.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one process of the tests builds, the others wait
        build("cpp", ROOT, PINOCCHIO, *WITHOUT_PYTHON, kind=KIND)
        call("cmake", "--install", BUILD / "cpp", "--prefix", BUILD / "cpp-installed")
        both = f"{BUILD / 'cpp-installed'};{PINOCCHIO}"
        build("cpp-finger", EXAMPLE, both)
        page = BUILD / "cpp-page.cpp"
        if not page.exists() or page.read_text() != program_of_page():
            page.write_text(program_of_page())
        build("cpp-tests", ROOT / "tests" / "cpp", both, f"-DPAGE={page}")
    return BUILD


def build(name: str, source: Path, prefix: object, *options: str, kind: str = "") -> None:
    # Consumers are neither optimized nor for a debugger: so they are compiled fastest.
    ready = [f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCMAKE_BUILD_TYPE={kind}", *CACHE, *options]
    call("cmake", "-G", "Ninja", "-S", source, "-B", BUILD / name, *ready)
    # Compilers leave the cores to tests that wait for a browser or a clock.
    call("nice", "-n", "10", "cmake", "--build", BUILD / name)


def program_of_page() -> str:
    """Return the blocks of docs/cpp.md but for the whole program, each in a function of its own."""
    found = [text for kind, text in FENCE.findall(PAGE.read_text()) if kind == "cpp"]
    bodies = [text for text in found if "int main" not in text]
    assert bodies
    includes = re.compile(r"^#include .*\n", re.MULTILINE)
    lines = {line for text in bodies for line in includes.findall(text)}
    out = "".join(sorted(lines)) + "#undef NDEBUG\n#include <cassert>\n"
    out += "namespace pin = pinocchio;\nnamespace sp = sphshell_pin;\n"
    for k, text in enumerate(bodies):
        out += f"void block_{k}() {{\n{includes.sub('', text)}}}\n"
    calls = "".join(f"  block_{k}();\n" for k in range(len(bodies)))
    return f"{out}int main() {{\n{calls}}}\n"


def test_the_example_comes_to_the_numbers_of_python(built):
    urdf = ROOT / "robots" / "urdf" / "three_link_finger.urdf"
    lines = call(built / "cpp-finger" / "finger_on_wall", urdf).splitlines()
    printed = np.array(lines[0].split()[1:], float)
    found = re.match(r"force (\S+) N, depth (\S+) m, element 0", lines[1])
    assert found
    force, depth = map(float, found.groups())

    model = pin.buildModelFromUrdf(str(urdf))
    corners = [[0.07, -0.1, 0.0], [0.07, 0.1, 0.0], [0.07, 0.1, 0.2], [0.07, -0.1, 0.2]]
    scene, wall = sp.Scene(model), sp.Shell(corners, [[0, 1, 2, 3]])
    laws = sp.ImpactLaw(1e6, 1.5, 20.0, 1e-4), sp.CoulombFriction(0.5, 0.4, 0.005, 0.05)
    scene.add_contact(sp.Sphere(0.010, "tip"), wall, "universe", None, *laws)
    data, dt = model.createData(), 2e-5
    q, v = np.array([0.2, 0.6, 0.4]), np.zeros(3)
    wanted = q + 0.2
    for _ in range(15_000):
        tau = 0.5 * (wanted - q) - 0.01 * v
        v = v + dt * pin.aba(model, data, q, v, tau, scene.external_forces(q, v))
        q = pin.integrate(model, q, dt * v)
    contacts = scene.contacts(q, v)
    np.testing.assert_allclose(printed, q, rtol=1e-10)
    np.testing.assert_allclose([force, depth], [*contacts.normal_force, *contacts.depth], rtol=1e-8)
    assert "usage: finger_on_wall URDF" in call(built / "cpp-finger" / "finger_on_wall", fails=True)


@pytest.mark.parametrize("name", ["laws", "surfaces", "scenes", "page"])
def test_in_cpp(built, name):
    tests = built / "cpp-tests"
    call("ctest", "--output-on-failure", "-R", f"^{name}$", "--no-tests=error", cwd=tests)


def test_contacts_are_those_of_python_to_the_bit(built):
    rng = np.random.default_rng(3)
    vertices, quads = meshes.grid_plate(8, 8, size=8.0, quads=True)
    x, y = vertices.T[:2]
    vertices[:, 2] = 0.5 * np.sin(x) * np.cos(0.7 * y) + 0.2 * rng.standard_normal(len(x))
    quads[::3, 3] = -1  # triangles, and holes beside them
    radius = rng.uniform(0.2, 2, 300)
    center = rng.uniform([-4.5, -4.5, -1], [4.5, 4.5, 2], (300, 3))
    method = rng.integers(0, 3, 300)

    text = [f"{len(vertices)} {len(quads)} {len(center)}"]
    text += [" ".join(map(repr, row)) for row in vertices.tolist()]
    text += [" ".join(map(str, row)) for row in quads.tolist()]
    for place, size, how in zip(center.tolist(), radius.tolist(), method, strict=True):
        text.append(" ".join(map(repr, [*place, size])) + f" {how}")
    printed = call(built / "cpp-tests" / "contacts_of", given="\n".join(text))

    shell = sp.Shell(vertices, quads, clean=False)
    rows = []
    for k in range(len(center)):
        found = shell.contacts(center[k], radius[k], ("facets", "elements", "smooth")[method[k]])
        columns = found.point, found.normal, found.depth, found.element, found.feature, found.weight
        rows.append(np.column_stack([np.full(len(found.depth), k), *columns]))
    wanted = np.concatenate(rows)
    assert len(wanted) > 300
    np.testing.assert_array_equal(np.loadtxt(printed.splitlines()), wanted)


def test_a_loop_of_its_own_moves_a_compiled_robot_as_pinocchio_does(built, monkeypatch, tmp_path):
    monkeypatch.setenv(cache.CACHE, str(tmp_path / "cache"))
    panda = example_robot_data.load("panda")
    printed = call(built / "cpp-tests" / "press", panda.urdf, compile_robot(panda.model), 10, 40)
    found = re.search(r"touching 1, apart (\S+)", printed)
    assert found, printed
    assert float(found[1]) < 1e-13
    other = panda.urdf, ROOT / "README.md", 1, 2
    refused = call(built / "cpp-tests" / "press", *other, fails=True)
    assert "must be what compile_robot() made for this model" in refused


@pytest.mark.skipif(sys.platform != "linux", reason="nm lists the names of an ELF library")
def test_only_the_public_names_are_exported(built):
    library = built / "cpp-installed" / "lib" / "libsphshell_pin.so"
    names = call("nm", "-D", "--defined-only", library)
    assert "_ZN12sphshell_pin5Scene" in names
    assert "_ZN8sphshell" not in names


def test_the_package_may_be_moved(built):
    files = list((built / "cpp-installed" / "lib" / "cmake").rglob("*.cmake"))
    assert len(files) == 4
    assert not [file for file in files if str(ROOT) in file.read_text()]


def test_the_page_has_the_example():
    found = dict(reversed([(kind, text) for kind, text in FENCE.findall(PAGE.read_text())]))
    assert found["cmake"] == (EXAMPLE / "CMakeLists.txt").read_text()
    programs = [text for kind, text in FENCE.findall(PAGE.read_text()) if "int main" in text]
    assert programs == [(EXAMPLE / "main.cpp").read_text()]


if __name__ == "__main__":
    build_all()
