"""CAD files on a machine without the libraries of a display, which OpenCASCADE links to."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.texts import text_of

VALVE_BODY = Path(__file__).parents[2] / "scenarios" / "surfaces" / "valve_body.step"
READ = """
import ctypes, sys
import sphshell_pin as sp
for name in ("libGL.so.1", "libX11.so.6"):
    try:
        ctypes.CDLL(name)
    except OSError:
        continue
    sys.exit(f"{name} is there")
print(len(sp.Shell.from_file(sys.argv[1]).faces))
"""


@pytest.fixture
def without_display() -> list[str]:
    """Return the words before a command that hide the libraries from it."""
    unshare = shutil.which("unshare")
    hidden = [str(unshare), "--mount", "bash", "-c", text_of("hide_display.sh"), "-"]
    if unshare is None or subprocess.run([*hidden, "true"], check=False, stderr=-3).returncode:
        pytest.skip("hiding a library needs the rights to make a mount namespace")
    return hidden


def call(*command: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)


def test_a_step_file_is_read_without_them(without_display: list[str]) -> None:
    read = call(*without_display, sys.executable, "-c", READ, VALVE_BODY)
    assert (read.returncode, read.stdout, read.stderr) == (0, "27\n", "")


def test_the_demo_runs_without_them(without_display: list[str], tmp_path: Path) -> None:
    """What `make demo` runs when it has built; the job demo of CI builds too."""
    program = Path(sys.executable).with_name("sphshell-pin")
    run = [program, "run", "fingertip_on_blade", "--out", tmp_path / "r"]
    done = call(*without_display, *run)
    assert done.returncode == 0, done.stderr
    assert "as expected" in done.stdout
    assert "missed" not in done.stdout
    assert (tmp_path / "r" / "recording.html").exists()
