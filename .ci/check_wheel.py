#!/usr/bin/env python3
"""Check a wheel: what is in it, and that it runs the main job where there is no compiler.

    python .ci/check_wheel.py dist/sphshell_pin-*.whl

Needs nothing but Python. The wheel is installed in a new environment, whose programs find nothing
on their PATH but that environment's own.
"""

from __future__ import annotations

import argparse
import fnmatch
import os
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
    "_core.pyi",
    "py.typed",
    "view/recording.html",
    "view/live/page/*.js",
    "robots/urdf/*.urdf",
    "robots/meshes/*.stl",
    "scenarios/*.toml",
    "scenarios/surfaces/*.LICENSE.txt",
    "benchmarks/*.py",
)
UNWANTED = ("*.cpp", "*.hpp", "*.o", "*.a", "*.pyc", "*.so.*", "*/tests/*", "*/docs/*")
# Where the compiled core looks for the libraries of Pinocchio's and Coal's own wheels.
RPATHS = (b"$ORIGIN/../cmeel.prefix/lib", b"@loader_path/../cmeel.prefix/lib")
COMPILERS = ("cc", "c++", "gcc", "g++", "clang", "cmake", "ninja", "make")
JOB = "fingertip_on_blade"
FILES = ("run.npz", "contacts.csv", "summary.json", "recording.html", "force_and_depth.png")


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
            if any(fnmatch.fnmatch(name, pattern) for pattern in UNWANTED):
                faults.append(f"{name} does not belong in it")
        for core in fnmatch.filter(names, f"{PACKAGE}/_core.*.so"):
            if not any(path in archive.read(core) for path in RPATHS):
                faults.append(f"{core} does not look for its libraries in cmeel.prefix/lib")
    return faults


def check_run(wheel: Path, folder: Path) -> list[str]:
    """Install `wheel` in a new environment in `folder`, and run the main job there."""
    home = folder / "venv"
    venv.create(home, with_pip=True)
    programs = home / "bin"
    alone = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    alone |= {"PATH": str(programs), "HOME": str(folder)}
    found = [one for one in COMPILERS if shutil.which(one, path=alone["PATH"])]
    if found:
        return [f"a compiler is on the PATH: {', '.join(found)}"]

    def call(*command: str) -> None:
        print("+", " ".join(command), flush=True)
        subprocess.run([programs / command[0], *command[1:]], env=alone, cwd=folder, check=True)

    # With the caller's cache: the robots' meshes are large.
    cache = subprocess.run(
        [sys.executable, "-m", "pip", "cache", "dir"], capture_output=True, text=True, check=False
    ).stdout.strip()
    cached = ["--cache-dir", cache] if cache else []
    install = ["-m", "pip", "install", "--quiet", *cached, "--only-binary", ":all:"]
    call("python", *install, str(wheel))
    call("python", "-m", "pip", "check")
    call("python", "-c", "import sphshell_pin as sp; print(sp.__version__, sp.Shell.__module__)")
    call("sphshell-pin", "list")
    call("python", *install, f"{wheel}[view,robots]")
    call("python", "-m", "pip", "check")
    call("sphshell-pin", "run", JOB, "--out", str(folder / "out"))
    missing = [name for name in FILES if not (folder / "out" / name).is_file()]
    return [f"the run wrote no {name}" for name in missing]


def main() -> int:
    """Check the wheel named on the command line; 0 if it is in order."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--contents-only", action="store_true", help="install nothing")
    options = parser.parse_args()
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
