"""The stub of the compiled core says what nanobind says of it: names, arguments, defaults.

It is written by hand, since nanobind does not know what is in a tuple or what a callable takes:
with the generated one mypy finds 43 errors in the package.
"""

import ast
from pathlib import Path

import pytest

import sphshell_pin
from sphshell_pin import _core

stubgen = pytest.importorskip("nanobind.stubgen")

UNNAMED = ("arg", "arg0")  # what nanobind calls an argument without a name


def members(text: str) -> dict[str, list[tuple[str, bool]]]:
    """Return by dotted name the arguments of each member, each with whether it has a default."""
    classes = {one.name: one for one in ast.parse(text).body if isinstance(one, ast.ClassDef)}
    found: dict[str, list[tuple[str, bool]]] = {}

    def read(body: list[ast.stmt], owner: str) -> None:
        for node in body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                for base in node.bases:
                    if ast.unparse(base).startswith("_"):  # what several classes share
                        read(classes[ast.unparse(base)].body, f"{node.name}.")
                read(node.body, f"{node.name}.")
            elif isinstance(node, ast.AnnAssign):
                found[owner + ast.unparse(node.target)] = []
            elif isinstance(node, ast.FunctionDef) and node.name.strip("_") in (node.name, "init"):
                of = node.args
                names = [one.arg for one in (*of.posonlyargs, *of.args, *of.kwonlyargs)]
                first = len(names) - len(of.defaults) - sum(map(bool, of.kw_defaults))
                arguments = [(name, k >= first) for k, name in enumerate(names)]
                found.setdefault(owner + node.name, [one for one in arguments if one[0] != "self"])

    read(ast.parse(text).body, "")
    return found


def test_the_stub_is_that_of_the_core() -> None:
    generator = stubgen.StubGen(_core)
    generator.put(_core)
    core = members(generator.get())
    stub = members((Path(sphshell_pin.__file__).parent / "_core.pyi").read_text("utf-8"))
    stub = {name: one for name, one in stub.items() if not name.startswith("_")}
    assert set(core) == set(stub)
    for name, arguments in core.items():
        if arguments and arguments[0][0] in UNNAMED:
            assert len(stub[name]) == len(arguments), name
        else:
            assert stub[name] == arguments, name
