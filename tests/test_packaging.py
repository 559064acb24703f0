"""Packaging and release: what pyproject.toml, the workflows and the wheel promise each other."""

import fnmatch
import importlib.metadata
import importlib.util
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import sphshell_pin
from tests.programs import module_of
from tests.texts import text_of

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
WHEELS = PROJECT["tool"]["cibuildwheel"]
WORKFLOWS = ROOT / ".github" / "workflows"
NAME = re.compile(r"[A-Za-z0-9_.-]+")


INSTALL = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")


def test_it_is_compiled_against_the_versions_it_runs_with():
    stated = PROJECT["build-system"]["requires"], PROJECT["project"]["dependencies"]
    built, runs = ({NAME.match(one)[0]: one.split("==")[-1] for one in each} for each in stated)
    for name in ("pin", "coal"):
        assert built[name] == runs[name], name
        assert importlib.metadata.version(name).startswith(runs[name].rstrip("*"))


def test_versions_and_entry_points_agree():
    assert importlib.metadata.version("sphshell-pin") == sphshell_pin.__version__
    # An editable install may be older than its extras, but not than its commands.
    (command,) = importlib.metadata.entry_points(group="console_scripts", name="sphshell-pin")
    assert command.value == PROJECT["project"]["scripts"]["sphshell-pin"]
    assert callable(command.load())
    for group in PROJECT["project"].get("entry-points", {}).values():
        for module in group.values():
            assert importlib.util.find_spec(module.partition(":")[0]) is not None, module


def test_every_extra_is_in_the_table_and_in_all():
    table = re.findall(r"^\| `(\w+)` \|", INSTALL, re.MULTILINE)
    assert set(EXTRAS) <= set(table), "the table of extras in docs/install.md lacks some"
    (everything,) = EXTRAS["all"]
    assert set(everything.partition("[")[2].rstrip("]").split(",")) == set(EXTRAS) - {"all"}


def test_an_extra_that_an_error_names_exists():
    folders = ("sphshell_pin", "robots", "scenarios", "benchmarks")
    files = (file for folder in folders for file in (ROOT / folder).rglob("*.py"))
    source = "\n".join(file.read_text(encoding="utf-8") for file in files)
    named = set(re.findall(r'MissingExtra\(\s*"[^"]+",\s*"(\w+)"', source))
    assert named
    assert named <= set(EXTRAS)


def test_nothing_is_bundled_into_a_wheel():
    """A second registry of Boost.Python would know no pinocchio.Model."""
    assert WHEELS["macos"]["repair-wheel-command"] == ""
    command = shlex.split(WHEELS["linux"]["repair-wheel-command"])
    assert command[:2] == ["auditwheel", "repair"]
    left_out = [command[k + 1] for k, word in enumerate(command) if word == "--exclude"]
    readelf = shutil.which("readelf")
    if readelf is None or sys.platform != "linux":
        pytest.skip("no readelf on this machine")
    core = sphshell_pin._core.__file__
    told = subprocess.run([readelf, "-d", core], capture_output=True, text=True, check=True).stdout
    needed = re.findall(r"NEEDED.*\[(.+)\]", told)
    system = ("libstdc++.so*", "libm.so*", "libgcc_s.so*", "libc.so*", "ld-linux*", "libpthread*")
    ours = [one for one in needed if not any(fnmatch.fnmatch(one, name) for name in system)]
    assert any("pinocchio" in one for one in ours)
    for one in ours:
        assert any(fnmatch.fnmatch(one, name) for name in left_out), f"{one} would be bundled"
    (path,) = re.findall(r"R(?:UN)?PATH.*\[(.+)\]", told)
    assert "$ORIGIN/../cmeel.prefix/lib" in path.split(":")


@pytest.mark.skipif(sys.platform != "linux", reason="the policy is that of Linux wheels")
def test_the_policy_of_the_wheels_is_that_of_pinocchios():
    """A wheel for an older system could not be installed there: its dependencies have none."""
    policies = set()
    for name in ("pin", "coal"):
        wheel = importlib.metadata.distribution(name).read_text("WHEEL")
        policies |= set(re.findall(r"^Tag: .*-(manylinux_\d+_\d+)_\w+$", wheel, re.MULTILINE))
    assert policies == {WHEELS["linux"][f"manylinux-{one}-image"] for one in ("x86_64", "aarch64")}
    assert "--plat $AUDITWHEEL_PLAT --only-plat" in WHEELS["linux"]["repair-wheel-command"]


def load(file):
    """Return what a YAML file of the checkout says."""
    yaml = pytest.importorskip("yaml", reason="needs PyYAML, which comes with the extra docs")
    return yaml.safe_load(in_checkout(file).read_text(encoding="utf-8"))


def in_checkout(file):
    if not file.is_file():
        pytest.skip(f"{file.name} is part of the checkout")
    return file


def test_only_a_tag_publishes_and_only_what_was_checked():
    release = load(WORKFLOWS / "release.yml")
    trigger, jobs = release[True], release["jobs"]  # YAML 1.1 takes the key "on" for true
    assert trigger["push"] == {"tags": ["v*"]}
    assert "pull_request" not in trigger
    publish = jobs.pop("publish")
    assert publish["if"] == "startsWith(github.ref, 'refs/tags/v')"
    assert set(publish["needs"]) == set(jobs) >= {"tests"}
    # Trusted publishing: no stored token.
    assert publish["permissions"] == {"id-token": "write"}
    assert release["permissions"] == {"contents": "read"}
    assert "secrets." not in (WORKFLOWS / "release.yml").read_text(encoding="utf-8")
    for job in jobs.values():
        assert "permissions" not in job
        told = " ".join(step.get("run", "") for step in job["steps"])
        assert ".ci/check_wheel.py" in told or told.strip() == ".ci/run"


def test_actions_are_pinned():
    for file in WORKFLOWS.glob("*.yml"):
        text = file.read_text(encoding="utf-8")
        uses = re.findall(r"uses: (\S+)", text)
        assert uses
        # By the hash of a commit, beside its version: a tag can be moved.
        assert all(re.search(r"@[0-9a-f]{40}$", one) for one in uses), uses
        assert len(re.findall(r"@[0-9a-f]{40}  # v\d+\.\d+\.\d+$", text, re.M)) == len(uses)
        for line in re.findall(r"pip install (cibuildwheel\S*)", text):
            assert re.fullmatch(r"cibuildwheel==\d+\.\d+\.\d+", line)


def script(name):
    """Import a script of .ci/."""
    return module_of(in_checkout(ROOT / ".ci" / f"{name}.py"))


@pytest.fixture
def faults_of(tmp_path):
    """Returns what is wrong with a wheel of GOOD and these files; None leaves one out."""

    def faults_of(change, name="a.whl"):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            for file, data in {**GOOD, **change}.items():
                if data is not None:
                    archive.writestr(file, data)
        return script("check_wheel").check_contents(tmp_path / name)

    return faults_of


CORE = "sphshell_pin/_core.cpython-311-x86_64-linux-gnu.so"
WHEEL = tomllib.loads(text_of("wheel.toml"))
GOOD = {CORE: b"\0$ORIGIN/../cmeel.prefix/lib\0", **dict.fromkeys(WHEEL["files"], b"")}
BAD = [(CORE, b"$ORIGIN", "cmeel.prefix")]
BAD += [(file, b"", said) for file, said in WHEEL["added"]]
BAD += [(file, None, said) for file, said in WHEEL["left_out"]]


def test_a_good_wheel_passes_its_check(faults_of):
    assert faults_of({}) == []


@pytest.mark.parametrize(("file", "data", "said"), BAD)
def test_a_wheel_is_refused_with(file, data, said, faults_of):
    faults = faults_of({file: data})
    assert any(said in fault for fault in faults), faults


@pytest.mark.parametrize(
    ("tag", "newer"),
    [("manylinux_2_28_x86_64", "GLIBCXX_3.4.30, GLIBC_2.35"), ("linux_x86_64", None)],
)
def test_symbols_must_be_those_of_the_tag(tag, newer, faults_of):
    names = "GLIBC_2.2.5 GLIBC_2.28 GLIBC_2.35 GLIBCXX_3.4.24 GLIBCXX_3.4.30 CXXABI_1.3.9"
    symbols = "".join(f"\0{name}" for name in names.split()) + "\0"
    wheel = f"sphshell_pin-1.0-cp311-cp311-{tag}.whl"
    faults = faults_of({CORE: GOOD[CORE] + symbols.encode()}, wheel)
    assert faults == ([f"{CORE} needs {newer}, which {tag[:14]} does not have"] if newer else [])


def test_the_tests_of_a_wheel_exist():
    check = script("check_wheel")
    assert all((ROOT / file).is_file() for file in check.TESTS)
    assert list(check.TEST_NEEDS) == WHEELS["test-requires"]
    assert check.EXTRAS.split(",") == WHEELS["test-extras"]
    assert ".ci/check_wheel.py --installed" in WHEELS["test-command"]


def test_the_license_of_every_package_is_stated():
    own = [EXTRAS[name] for name in EXTRAS if name not in {"all", "test", "docs"}]
    needed = {*PROJECT["project"]["dependencies"], *(one for extra in own for one in extra)}
    names = {re.match(r"[\w-]+", one)[0] for one in needed} - {"sphshell-pin"}
    rows = re.findall(r"^\| (`[^|]*)\|", INSTALL.partition("## Licenses")[2], re.MULTILINE)
    assert names == {name for row in rows for name in re.findall(r"`([\w-]+)`", row)}
