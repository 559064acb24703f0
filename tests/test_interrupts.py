"""Ctrl-C while libraries load: it is neither lost nor fatal."""

import signal
import subprocess
import sys
import time

import pytest

# Tests that run in the background pass on that Ctrl-C is to be ignored.
HEARS = "import os, signal, sys\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
WHEN = """
def watch(event, given):
    if event == "import" and given[0] == {name!r} and not seen:
        seen.append({action})
seen = []
sys.addaudithook(watch)
"""
PRESS = "os.kill(os.getpid(), signal.SIGINT)"


def start(code):
    return subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.05])
def test_the_import_is_interrupted_without_a_crash(delay):
    """Boost.Python's modules, which crash when an exception comes up while they load."""
    told = WHEN.format(name="coal.coal_pywrap", action="print(flush=True)")
    child = start(HEARS + told + "import sphshell_pin\nimport time; time.sleep(60)")
    child.stdout.readline()
    time.sleep(delay)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == -signal.SIGINT
    assert errors.rstrip().endswith("KeyboardInterrupt")


def test_a_library_that_swallows_it_does_not():
    """Trimesh takes any exception for a sign that a package is missing."""
    code = HEARS + WHEN.format(name="networkx", action=PRESS)
    code += """if True:
        import coal, sphshell_pin as sp
        from sphshell_pin.scenario.drafting.part import Part
        try: Part.of(sp.Shell.from_geometry(coal.Sphere(1.0)), sp.find_material("steel"))
        except KeyboardInterrupt: print("heard")"""
    told, errors = start(code).communicate(timeout=60)
    assert (told, errors) == ("heard\n", "")


@pytest.mark.parametrize("name", ["coal", "typer", "pydantic", "meshcat"])
def test_a_command_that_starts_ends_with_130(name):
    code = HEARS + WHEN.format(name=name, action=PRESS)
    code += "sys.argv = ['sphshell-pin', 'view', 'sphere_on_shell', '--no-open']\n"
    code += "from sphshell_pin.cli import main; main()"
    child = start(code)
    try:
        told, errors = child.communicate(timeout=60)
    finally:
        child.kill()
    assert (child.returncode, told, errors.splitlines()[-1]) == (130, "", "interrupted")
