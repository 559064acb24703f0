"""Expressions of xacro files from a grammar, and meshes that results hold."""

import contextlib
import random
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import coal
import numpy as np

from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import xacro_expressions
from sphshell_pin.robots.plain_mesh import plain_mesh
from sphshell_pin.view.meshes import lit_facets, pack_facets, take_out_numbers
from tests.fuzz.meshes import SHAPES, WRITERS
from tests.texts import text_of

_ATOMS = (
    *("0", "1", "-3", "2.5", "1e300", "1000", "True", "None", "'a'", "'{0.real}'", "'%9d'", "a"),
    *("k", "python", "math", "xacro", "python.vars", "python.type", "math.pi", "d", "d.a", "_x"),
    *("len", "str", "map", "dict", "list", "python.set", "__import__", "b'a'", "...", "x"),
)
_FORMS = (
    *("{0} + {1}", "{0} * {1}", "{0} ** {1}", "{0} % {1}", "{0} << {1}", "{0} // {1}", "not {0}"),
    *("{0} if {1} else {2}", "{0} < {1} <= {2}", "{0} in {1}", "{0} and {1}", "[{0}, *{1}]"),
    *("{0}[{1}]", "{0}[{1}:{2}]", "[{0} for x in {1} if {2}]", "({0} for x, y in {1})", "({0},)"),
    *("{0}({1})", "{0}({1}, key={2})", "{0}(*{1}, **{2})", "{0}.format({1})", "{0}.join({1})"),
    *("{0}.__class__", "{0}.mro()", "{0}.a", "{0}.__getattr__({1})", "{0}.items()", "{0}.split()"),
    *("lambda: {0}", "(y := {0})", "max({0}, {1})", "list(map({0}, {1}))", "python.zip({0}, {1})"),
    *("[{0} for x in python.range(300) for y in python.range(300)]", "{0}.gi_frame", "-{0}"),
    *("{0} is {1}", "{0}.replace({1}, {2})", "str({0})", "dict(a={0})", "xacro.tokenize({0})"),
)


def expression(rng: random.Random, _: bytes = b"") -> bytes:
    """Return an expression from the grammar of what may be tried."""
    texts = [rng.choice(_ATOMS) for _ in range(8)]
    for _ in range(rng.choice((1, 2, 3, 5, 12))):
        texts.append(rng.choice(_FORMS).format(*(f"({text})" for text in rng.choices(texts, k=3))))
    return texts[-1][:20_000].encode()


def expression_corpus() -> tuple[bytes, ...]:
    """Return expressions that compute."""
    return (
        b"pi / 2 + radians(90)",
        b"[x * k for x in [1, 2] if x > 1][0]",
        b"', '.join(sorted(d.keys())) + str(max([1, 2]))",
        b"'a %5.2f' % d['a'] if k else d.a",
    )


_FAULTS = (
    *(ArithmeticError, LookupError, NameError, TypeError, ValueError, MemoryError),
    *(SyntaxError, AttributeError),
)


def read_expression(path: Path) -> None:
    """Evaluate an expression as xacro would: what comes of it is data or a listed function."""
    import xacro

    space, other = SimpleNamespace(**vars(xacro)), SimpleNamespace()
    xacro_expressions.install(space, other)
    table = xacro.Table(space._global_symbols)
    for name, value in {"k": 3, "d": xacro.YamlDictWrapper(a=1.5), "_x": [1], "a": "b"}.items():
        table[name] = value
    other_names = {name: (lambda *_: "") for name in ("arg", "dirname", "env", "find", "optenv")}
    text = path.read_text(errors="replace")
    listed = [*space._global_symbols.values()]
    listed += [v for s in ("python", "math", "xacro") for v in space._global_symbols[s].values()]
    for evaluate, names in ((space.safe_eval, (table,)), (other.eval, ({}, other_names))):
        try:
            value = evaluate(text, *names)
        except (*_FAULTS, xacro.XacroException) as one:
            fault: Exception = one
        else:
            data = type(value).__module__ in ("builtins", "xacro") and not isinstance(value, type)
            given = any(value is one for one in [*listed, *other_names.values()])
            assert given or (data and not callable(value)), type(value)
            return
    raise SphshellError(str(fault))


def mesh_corpus(suffix: str) -> tuple[bytes, ...]:
    """Return the meshes of a format that robots' pictures have."""
    if suffix != ".dae":
        writers = [write for one, write in WRITERS.values() if one == suffix]
        return tuple(write(shape()) for write in writers for shape in SHAPES)
    images = "<library_images><image><init_from>/dev/zero</init_from></image></library_images>"
    mark = "<library_geometries"
    return (text_of("robots/tetrahedron.dae").replace(mark, images + mark).encode(),)


def read_drawn(suffix: str) -> Callable[[Path], None]:
    """Return what does with a kept mesh what showing it does."""

    def read(path: Path) -> None:
        content = path.read_bytes()
        take_out_numbers(content.decode("latin-1"))
        pack_facets(lit_facets(content))
        plain = plain_mesh(suffix, content)
        if plain is None:
            raise SphshellError("no mesh")
        assert not {b"mtllib", b"init_from", b"usemtl"}.intersection(plain.split())
        assert plain_mesh(suffix, plain) == plain
        place = path.with_name(f"plain{suffix}")
        place.write_bytes(plain)
        with contextlib.suppress(ValueError, RuntimeError):
            coal.MeshLoader().load(str(place), np.ones(3))

    return read
