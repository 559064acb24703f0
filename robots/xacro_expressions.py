"""What expressions of a xacro file may do: compute, and nothing else.

The package xacro evaluates `${...}` and `$(eval ...)` with Python's eval. It refuses some names,
but an expression can come by them in other ways, and then run any command. Here its syntax tree is
checked before it is evaluated: from numbers, strings, lists and the functions that xacro offers,
attributes with a leading underscore and the frames of generators are the only ways out.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

# Frames, code and tracebacks; and str.format, which reads attributes that its text names.
_NAMES = (
    "gi_frame gi_code gi_yieldfrom cr_frame cr_code ag_frame ag_code tb_frame f_back f_builtins "
    "f_code f_globals f_locals format format_map mro"
)
_WAYS_OUT = frozenset(_NAMES.split())
_REFUSED = (ast.Lambda, ast.Await, ast.Yield, ast.YieldFrom, ast.NamedExpr)
_FUNCTIONS = (
    "abs all any bool dict divmod enumerate filter float int len list map max min pow range "
    "reversed round set sorted str sum tuple zip"
)
_BUILTINS = {name: getattr(builtins, name) for name in _FUNCTIONS.split()}


def check(expression: str) -> None:
    """Raise ValueError if the expression does more than compute, SyntaxError if it is none."""
    try:
        tree = ast.parse(expression.strip(), mode="eval")
    except (RecursionError, MemoryError):
        # Python might still evaluate what is nested too deeply to be looked at.
        raise ValueError(f"the expression '{_short(expression)}' is nested too deeply") from None
    for node in ast.walk(tree):
        name = {ast.Name: "id", ast.Attribute: "attr"}.get(type(node))
        used = getattr(node, name) if name else ""
        if used.startswith("_") or (isinstance(node, ast.Attribute) and used in _WAYS_OUT):
            raise ValueError(f"'{used}' is refused in the expression '{_short(expression)}'")
        if isinstance(node, _REFUSED):
            kind = type(node).__name__.lower()
            raise ValueError(f"{kind} is refused in the expression '{_short(expression)}'")


@contextmanager
def checked(xacro: Any, substitution_args: Any) -> Iterator[None]:
    """Have both of xacro's evaluators check expressions, within a block."""
    usual: Callable[..., object] = xacro.safe_eval

    def in_braces(expression: str, globals: Any, locals: Any = None) -> object:
        check(expression)
        return usual(expression, globals, locals)

    def in_parentheses(expression: str, _: object, names: Any) -> object:
        check(expression)
        return eval(expression, {"__builtins__": _BUILTINS}, names)

    xacro.safe_eval, substitution_args.eval = in_braces, in_parentheses
    try:
        yield
    finally:
        xacro.safe_eval = usual
        del substitution_args.eval


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."
