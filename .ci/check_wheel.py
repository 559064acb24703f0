#!/usr/bin/env python3
"""Check a wheel: what is in it, and that it works where there is no compiler.

    python .ci/check_wheel.py dist/sphshell_pin-*.whl
    python .ci/check_wheel.py --installed    # in an environment that has it, pytest and hypothesis

Needs nothing but Python. The wheel is installed in a new environment, whose programs find nothing
on their PATH but that environment's own. There the main job is run, and the tests of TESTS.
"""

import argparse
import fnmatch
import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path, PurePosixPath

PACKAGE = "sphshell_pin"
PLUGIN = "pytest_sphshell_pin"  # apart, so that pytest loads nothing heavy with it
LARGEST = 5_000_000  # [B]; pip would hide what swells it
# One file at least of each, below the package.
NEEDED = (
    "_core.*.so",
    "_built_against.py",
    "_core.pyi",
    "py.typed",
    "view/recording*.html",
    "view/live/page/*.js",
    "robots/urdf/*.urdf",
    "robots/meshes/*.stl",
    "scenario/drafting/*.template",
    "scenarios/*.toml",
    "scenarios/surfaces/*.LICENSE.txt",
)
UNWANTED = (
    *("*.cpp", "*.hpp", "*.o", "*.a", "*.pyc", "*.so.*"),
    *("*/tests/*", "*/docs/*", "*/benchmarks/*"),
)
# Where the compiled core looks for the libraries of Pinocchio's and Coal's own wheels.
RPATHS = (b"$ORIGIN/../cmeel.prefix/lib", b"@loader_path/../cmeel.prefix/lib")
# The newest versions of symbols that a system of this tag has, as auditwheel's policy states them.
# What a newer compiler needs beyond them, those of the image link into the core.
NEWEST = {"manylinux_2_28": {"GLIBC": (2, 28), "GLIBCXX": (3, 4, 24), "CXXABI": (1, 3, 11)}}
COMPILERS = ("cc", "c++", "gcc", "g++", "clang", "cmake", "ninja", "make")
JOB = "fingertip_on_blade"
EXTRAS = "view,robots,cad"  # of the job
FILES = ("run.npz", "contacts.csv", "summary.json", "recording.html", "force_and_depth.png")
# Of the checkout beside this file, run against what is installed: shells, contacts, motion. They
# need TEST_NEEDS and no extra.
ROOT = Path(__file__).resolve().parent.parent
TESTS = (
    "tests/shell/test_primitives.py",
    "tests/contact/test_laws.py",
    "tests/contact/test_contact_wrench.py",
    "tests/contact/test_invariance.py",
    "tests/dynamics/test_external_forces.py",
    "tests/test_pickling.py",
)
TEST_NEEDS = ("pytest>=8", "hypothesis>=6", "scipy>=1.15")


def newer_symbols(core: bytes, policy: str) -> list[str]:
    """Return the versions of symbols that the ELF file `core` needs and `policy` does not have."""
    found = []
    for library, newest in NEWEST.get(policy, {}).items():
        # Names of versions stand in the table of dynamic strings, each ended by a zero.
        for number in set(re.findall(rb"\0" + library.encode() + rb"_([0-9.]+)(?=\0)", core)):
            if tuple(map(int, number.split(b"."))) > newest:
                found.append(f"{library}_{number.decode()}")
    return sorted(found)


def check_contents(wheel: Path) -> list[str]:
    """Return what is wrong with the files in `wheel`, as sentences."""
    faults = []
    if wheel.stat().st_size > LARGEST:
        faults.append(f"it has {wheel.stat().st_size} bytes, more than {LARGEST}")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        for pattern in NEEDED:
            if not fnmatch.filter(names, f"{PACKAGE}/{pattern}"):
                faults.append(f"no {PACKAGE}/{pattern} in it")
        if f"{PLUGIN}/__init__.py" not in names:
            faults.append(f"no {PLUGIN} in it")
        for name in names:
            top = PurePosixPath(name).parts[0]
            if top not in (PACKAGE, PLUGIN) and not top.endswith(".dist-info"):
                faults.append(f"{name} lies outside the package")
            ours = name.startswith(f"{PACKAGE}/no_display/")  # compiled here, not a copy
            if not ours and any(fnmatch.fnmatch(name, pattern) for pattern in UNWANTED):
                faults.append(f"{name} does not belong in it")
        policy = "_".join(wheel.stem.split("-")[-1].split("_")[:3])
        for core in fnmatch.filter(names, f"{PACKAGE}/_core.*.so"):
            data = archive.read(core)
            if not any(path in data for path in RPATHS):
                faults.append(f"{core} does not look for its libraries in cmeel.prefix/lib")
            if newer := newer_symbols(data, policy):
                faults.append(f"{core} needs {', '.join(newer)}, which {policy} does not have")
    return faults


def run(*command: str | Path, folder: Path) -> None:
    """Print and run `command` in `folder`."""
    print("+", *command, flush=True)
    subprocess.run(command, cwd=folder, check=True)


def check_installed(folder: Path) -> list[str]:
    """Run the main job and the tests, in `folder`, with the package of this environment."""
    program = shutil.which("sphshell-pin", path=os.path.dirname(sys.executable))
    if program is None:
        return [f"no command sphshell-pin beside {sys.executable}"]
    python = [sys.executable, "-P"]  # -P: not what lies in the folder
    run(*python, "-m", "pip", "check", folder=folder)
    # A copy of the tests, so that they find no package beside them but what is installed.
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    run(
        *python,
        "-c",
        "import sphshell_pin as sp; print(sp.__version__, sp.__file__)",
        folder=folder,
    )
    run(program, "list", folder=folder)
    run(program, "run", JOB, "--out", folder / "out", folder=folder)
    draft = folder / "draft.toml"
    run(program, "new", "--robot", "panda", "--surface", "sphere", "--out", draft, folder=folder)
    run(program, "run", draft, "--out", folder / "drafted", folder=folder)
    run(program, "report", "--quick", "--out", folder / "report", folder=folder)
    missing = [name for name in FILES if not (folder / "out" / name).is_file()]
    quick = ["-m", "not (slow or study or browser)", "-p", "no:cacheprovider"]
    run(*python, "-m", "pytest", *quick, *TESTS, folder=folder)
    return [f"the run wrote no {name}" for name in missing]


def check_run(wheel: Path, folder: Path) -> list[str]:
    """Install `wheel` in a new environment in `folder`, and check what is installed there."""
    home = folder / "venv"
    venv.create(home, with_pip=True)
    programs = home / "bin"
    alone = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    alone |= {"PATH": str(programs), "HOME": str(folder)}
    found = [one for one in COMPILERS if shutil.which(one, path=alone["PATH"])]
    if found:
        return [f"a compiler is on the PATH: {', '.join(found)}"]

    def call(*command: str) -> int:
        print("+", *command, flush=True)
        return subprocess.run(
            [programs / "python", *command], env=alone, cwd=folder, check=False
        ).returncode

    # With the caller's cache: the robots' meshes are large.
    cache = subprocess.run(
        [sys.executable, "-m", "pip", "cache", "dir"], capture_output=True, text=True, check=False
    ).stdout.strip()
    cached = ["--cache-dir", cache] if cache else []
    install = ["-m", "pip", "install", "--quiet", *cached, "--only-binary", ":all:"]
    for what in ([str(wheel)], [f"{wheel}[{EXTRAS}]", *TEST_NEEDS]):
        if call(*install, *what) or call("-c", f"import {PACKAGE}"):
            return [f"it cannot be installed and imported: {', '.join(what)}"]
    return ["it does not work: see above"] if call(__file__, "--installed") else []


def main() -> int:
    """Check the wheel named on the command line; 0 if it is in order."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path, nargs="?")
    parser.add_argument("--contents-only", action="store_true", help="install nothing")
    parser.add_argument("--installed", action="store_true", help="check this environment's package")
    options = parser.parse_args()
    if options.installed == (options.wheel is not None):
        parser.error("state a wheel, or --installed")
    if options.installed:
        with tempfile.TemporaryDirectory() as folder:
            faults = check_installed(Path(folder).resolve())
        for fault in faults:
            print(f"error: {fault}", file=sys.stderr)
        return 1 if faults else 0
    wheel = options.wheel.resolve()
    faults = check_contents(wheel)
    if not faults and not options.contents_only:
        with tempfile.TemporaryDirectory() as folder:
            faults = check_run(wheel, Path(folder))
    for fault in faults:
        print(f"error: {wheel.name}: {fault}", file=sys.stderr)
    if not faults:
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.2f} MB, in order")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
