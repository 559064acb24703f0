"""Importing the package brings in what every user needs, and nothing else; imports go one way."""

import ast
import json
import re
import shutil
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.programs import python

PACKAGE = Path(__file__).parent.parent / "sphshell_pin"

NEEDED = ("trimesh", "pydantic", "typer", "rich", "scipy")
EXTRAS = (
    *("meshcat", "matplotlib", "pandas", "tornado", "zmq", "OCP", "crocoddyl", "casadi", "mcap"),
    *("pyarrow", "playwright", "imageio_ffmpeg"),
)


@pytest.fixture(scope="module")
def loaded() -> set[str]:
    program = "import json, sys, sphshell_pin; print(json.dumps(list(sys.modules)))"
    return set(json.loads(python(program, check=True).stdout))


def test_no_heavy_module_is_loaded(loaded: set[str]) -> None:
    assert {name.partition(".")[0] for name in loaded}.isdisjoint((*NEEDED, *EXTRAS))


@pytest.mark.parametrize(
    "module",
    ["scenario.drafting.new", "scenario.running.run", "study.robot_check", "view.live", "plot"],
)
def test_commands_load_without_extras(module: str) -> None:
    """What an extra brings is imported where it is used, so that its absence is told."""
    program = f"""if True:
        import sys
        for name in {EXTRAS}:
            sys.modules[name] = None
        import sphshell_pin.{module}"""
    python(program, check=True)


def test_public_names_exist() -> None:
    import sphshell_pin

    missing = [name for name in sphshell_pin.__all__ if not hasattr(sphshell_pin, name)]
    assert not missing
    contract = """Shell Sphere ImpactLaw HuntCrossleyLaw CoulombFriction contact_wrench Scene
        Simulation SemiImplicitEuler RungeKutta4 Result GravityCompensation JointPD
        CartesianImpedance"""
    assert set(contract.split()) <= set(sphshell_pin.__all__)


def test_what_is_listed_is_public() -> None:
    """`dir` lists names and parts; of an object no method of the compiled core's bindings."""
    import sphshell_pin as sp

    assert set(dir(sp)) == {*sp.__all__, *sp._PARTS, "__version__"}
    for part in ("contact", "dynamics", "patches"):  # as type checkers see them
        source = (PACKAGE / part / "__init__.py").read_text()
        shown = set(re.findall(r"import (\w+) as \1$", source, re.MULTILINE))
        inner = {part: set(names.split()) for part, names in sp._NAMES.items()}
        families = {one for name in inner if name.startswith(f"{part}.") for one in inner[name]}
        assert shown - families == inner[part]
    shown = {name: set(dir(getattr(sp, name))) for name in sp.__all__}
    private = {"alone", "core", "from_blocks", "made", "numbers", "to_core"}
    assert {name: bad for name, attributes in shown.items() if (bad := attributes & private)} == {}


NO_METADATA = """
from importlib import metadata
def version(name):
    raise metadata.PackageNotFoundError(name)
metadata.version = version
"""
NO_REDIRECT = "import sys; sys.meta_path = [f for f in sys.meta_path if isinstance(f, type)]; "
OTHER = {"pinocchio": "3.9.1", "coal": "3.0.0"}


def failing_import(folder: Path, core: str | None, built: dict[str, str] | None = None) -> str:
    """Import a copy of the package in `folder`, with the module `core` as its core: the last line.

    `built` are the versions that it was compiled against; those of this environment by default.
    """
    package = folder / "sphshell_pin"
    package.mkdir()
    for name in ("__init__", "_interrupts", "_versions", "errors"):
        shutil.copy(PACKAGE / f"{name}.py", package)
    if core is not None:
        (package / "_core.py").write_text(core, encoding="utf-8")
        built = built or {"pinocchio": version("pin"), "coal": version("coal")}
        (package / "_built_against.py").write_text(f"VERSIONS = {built}", encoding="utf-8")
    # Without the finder of an editable install.
    done = python(NO_REDIRECT + "import sphshell_pin", cwd=folder)
    assert done.returncode == 1
    assert "direct cause" not in done.stderr
    assert "During handling" not in done.stderr
    return done.stderr.splitlines()[-1]


def test_a_core_that_cannot_be_loaded_names_what_it_was_built_for(tmp_path: Path) -> None:
    linker = "libboost_python311.so.1.2.3: cannot open shared object file: No such file"
    said = failing_import(tmp_path, f"raise ImportError({linker!r})")
    begins = "ImportError: the compiled core of sphshell_pin does not load: "
    assert said.startswith(begins + linker)
    installed = {name: version(name) for name in ("pin", "coal", "cmeel-boost")}
    assert f"compiled against pinocchio {installed['pin']} and coal {installed['coal']}" in said
    for name, number in installed.items():
        assert f"{name} {number}" in said
    assert re.search(r"python -m pip install 'pin==\d+\.\d+\.\*' 'coal==\d+\.\d+\.\*'$", said)


@pytest.mark.parametrize("wrong", OTHER)
def test_a_core_of_other_versions_is_not_loaded(tmp_path: Path, wrong: str) -> None:
    installed = {"pinocchio": version("pin"), "coal": version("coal")}
    built = {**installed, wrong: "2.6.1"}
    said = failing_import(tmp_path, "raise SystemError('the core was loaded')", built)
    assert said.startswith(
        f"ImportError: sphshell_pin was compiled against {wrong} 2.6.1, but {wrong} "
        f"{installed[wrong]} is installed: python -m pip install 'pin=="
    )
    assert f"'{'pin' if wrong == 'pinocchio' else 'coal'}==2.6.*'" in said


def test_without_the_wheels_the_libraries_are_not_those_of_pip(tmp_path, monkeypatch):
    """Conda's and ROS's packages have no metadata, or other ones."""
    hide = tmp_path / "hide"
    hide.mkdir()
    (hide / "sitecustomize.py").write_text(NO_METADATA, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(hide))
    said = failing_import(tmp_path, "", OTHER)
    assert said == (
        f"ImportError: sphshell_pin was compiled against pinocchio 3.9.1, but pinocchio "
        f"{version('pin')} is installed: install pinocchio 3.9 and coal 3.0, or compile "
        "sphshell_pin again (docs/install.md)"
    )


def test_a_checkout_that_is_not_built_says_so(tmp_path: Path) -> None:
    said = failing_import(tmp_path, None)
    assert said.startswith(f"ImportError: sphshell_pin is not built in {tmp_path}")
    assert "pip install -e ." in said
    assert "another folder" in said
    assert "circular" not in said


# A module imports from its own layer and from those before it, inside functions too. All others,
# such as errors and units, are before the first.
LAYERS = (
    ("shell",),
    ("contact",),
    ("dynamics",),
    ("adapters",),
    ("patches", "robots"),
    ("scenario",),
    ("plot", "view", "export"),
    ("results", "upper_layers"),
    ("sphshell_pin",),
    ("scenarios", "testing"),
    ("study",),
    ("cli",),
)
LEVEL = {folder: k for k, folders in enumerate(LAYERS) for folder in folders}
# Installed below the package, and beside it in a checkout.
BESIDE = ("robots", "scenarios")


def imports_of(file: Path, modules: set[str], *, inside: bool) -> set[str]:
    """Return which of `modules` are imported in `file`, but for type hints alone.

    They are those imported `inside` functions, or those imported with the module.
    """
    nodes: list[ast.AST] = [ast.parse(file.read_text(encoding="utf-8"))]
    if inside:
        nodes = [node for node in ast.walk(nodes[0]) if isinstance(node, ast.FunctionDef)]
    found: set[str] = set()
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            nodes += node.orelse
            continue
        within = ast.iter_child_nodes(node)
        nodes += [one for one in within if inside or not isinstance(one, ast.FunctionDef)]
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in modules else str(node.module) for name in names}
    return found & modules


def files_of(package: Path) -> dict[str, Path]:
    """Return the modules of the package by their names, with those of folders beside it."""
    folders = [package, *(package.parent / name for name in BESIDE)]
    named = {
        file: file.relative_to(package.parent) for top in folders for file in top.rglob("*.py")
    }
    named[package / "_core.pyi"] = Path("sphshell_pin", "_core.py")
    files = {}
    for file, path in named.items():
        parts = path.with_suffix("").parts
        parts = parts if parts[0] == package.name else (package.name, *parts)
        files[".".join(parts).removesuffix(".__init__")] = file
    return files


@pytest.fixture(scope="module")
def called() -> dict[str, set[str]]:
    """What functions of each module of the package import when they are called."""
    modules = files_of(PACKAGE)
    return {name: imports_of(file, set(modules), inside=True) for name, file in modules.items()}


@pytest.fixture(scope="module")
def graph(called: dict[str, set[str]]) -> dict[str, set[str]]:
    """What each module of the package imports, at once or later."""
    return {
        name: (imports_of(file, set(called), inside=False) | called[name]) - {name}
        for name, file in files_of(PACKAGE).items()
    }


def level(module: str) -> int:
    """Return the layer of a module's folder."""
    return LEVEL.get(folder(module), -1)


def folder(module: str) -> str:
    """Return the folder of a module below the package; the package itself is one."""
    return (module.split(".") * 2)[1]


def check_no_circle(graph: dict[str, set[str]]) -> None:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def test_no_imports_run_in_circles(graph: dict[str, set[str]]) -> None:
    check_no_circle(graph)


def test_imports_go_down_the_layers(graph: dict[str, set[str]]) -> None:
    edges = [(name, other) for name, others in graph.items() for other in others]
    assert not [f"{name} -> {other}" for name, other in edges if level(other) > level(name)]


def test_no_two_layers_import_each_other(graph: dict[str, set[str]]) -> None:
    """Within a layer, too: folders are no circle either."""
    folders: dict[str, set[str]] = {}
    for name, others in graph.items():
        folders.setdefault(folder(name), set()).update(map(folder, others))
    check_no_circle({name: (folders[name] & LEVEL.keys()) - {name} for name in LEVEL})


def test_values_have_types() -> None:
    """`Any` stands where a foreign library has no types, and nowhere else."""
    text = "\n".join(file.read_text(encoding="utf-8") for file in PACKAGE.rglob("*.py"))
    lines = [line for line in text.splitlines() if re.search(r"\bAny\b", line)]
    assert len([line for line in lines if " import " not in line]) <= 60
