"""What states a version, a dependency or a title more than once states the same."""

import re
import tomllib
from datetime import date
from xml.etree import ElementTree

from packaging.version import Version

import sphshell_pin
from tests import test_packaging
from tests.test_packaging import NAME, ROOT, load

PROJECT = test_packaging.PROJECT["project"]
RECIPE = ROOT / "packaging" / "conda" / "recipe.yaml"
# What a package on PyPI is called on conda-forge, where that differs.
CONDA = {"pin": "pinocchio", "meshcat": "meshcat-python", "matplotlib": "matplotlib-base"}


def released():
    """Return the last version of the changelog."""
    return next(iter(changes()))


def changes():
    """Return the date of each released version of the changelog, the latest first."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    return dict(re.findall(r"^## \[([0-9.]+)\] - (\d{4}-\d\d-\d\d)$", text, re.MULTILINE))


def test_the_version_is_stated_once_and_that_of_the_release_everywhere():
    assert PROJECT["dynamic"] == ["version"]
    version = released()
    current = Version(sphshell_pin.__version__)
    assert current.is_devrelease or str(current) == version
    assert current >= Version(version)
    assert ElementTree.parse(ROOT / "package.xml").findtext("version") == version
    assert load(ROOT / "CITATION.cff")["version"] == version
    assert load(RECIPE)["context"]["version"] == version


def test_the_citation_is_of_this_release():
    citation = load(ROOT / "CITATION.cff")
    assert {"cff-version", "message", "title", "authors", "license"} <= set(citation)
    assert citation["date-released"] == date.fromisoformat(changes()[released()])
    assert citation["license"] == PROJECT["license"]
    assert [one["name"] for one in citation["authors"]] == [a["name"] for a in PROJECT["authors"]]
    assert citation["title"].startswith("sphshell_pin")


def wanted(requirements):
    """Return {name on conda-forge: bound} of requirements as pip writes them."""
    found = {}
    for one in requirements:
        name = NAME.match(one)[0]
        found[CONDA.get(name, name)] = one[len(name) :].removeprefix("==")
    return found


def test_the_recipe_wants_what_pip_wants():
    recipe = load(RECIPE)
    context = recipe["context"]
    (package,) = (one for one in recipe["outputs"] if one["package"]["name"] == PROJECT["name"])
    needs = package["requirements"]

    def bounds(lines):
        filled = (re.sub(r"\$\{\{ (\w+) \}\}", lambda m: context[m[1]], one) for one in lines)
        return {name: bound for name, _, bound in (one.partition(" ") for one in filled)}

    run = bounds(needs["run"])
    assert run.pop("python") == ""
    assert run == wanted(PROJECT["dependencies"])
    pixi = tomllib.loads((ROOT / "pixi.toml").read_text(encoding="utf-8"))["dependencies"]
    assert {name: pixi[name] for name in ("pinocchio", "coal")}.items() <= run.items()
    assert bounds(needs["run_constraints"]) == wanted(PROJECT["optional-dependencies"]["view"])
    host = bounds(one for one in needs["host"] if isinstance(one, str))
    requires = test_packaging.PROJECT["build-system"]["requires"]
    assert wanted(one.replace("[build]", "") for one in requires).items() <= host.items()
    (command,) = package["build"]["python"]["entry_points"]
    assert command == f"sphshell-pin = {PROJECT['scripts']['sphshell-pin']}"
    older = PROJECT["requires-python"].replace(">=", "<")
    assert f'match(python, "{older}")' in package["build"]["skip"]
