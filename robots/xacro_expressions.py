"""Expressions of xacro files, evaluated over their syntax tree: they compute, and nothing else.

The package xacro hands `${...}` and `$(eval ...)` to Python's eval, from which ways lead to every
module. Here a node of the tree has a rule or is refused, a value is data or a function of the lists
below, and an attribute is a name of a namespace, a key of a YAML mapping or a method listed.
"""

import ast
import builtins
import datetime
import io
import math
import operator
import re
import string
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count, islice
from typing import Any

from sphshell_pin.base.regular_file import read_bytes

MOST_STEPS = 300_000
"""Nodes that are evaluated for a file; a robot takes some thousands."""

MOST_ITEMS = 1_000_000
"""Characters of a text, items of a list, bits of a whole number."""

_FUNCTIONS = (
    "abs all any bool complex dict divmod enumerate filter float frozenset hash int isinstance len "
    "list map max min ord range repr reversed round set sorted str sum tuple zip"
)
_BUILTINS: dict[str, Any] = {name: getattr(builtins, name) for name in _FUNCTIONS.split()}
_MATH = {name: value for name, value in vars(math).items() if not name.startswith("_")}
_XACRO = "abs_filename arg dotify error fatal load_yaml message print_location tokenize warning"
_SUBSTITUTIONS = ("arg", "dirname", "env", "find", "optenv")
_METHODS = {
    str: "capitalize casefold center count endswith expandtabs find format index isalnum isalpha "
    "isascii isdecimal isdigit isidentifier islower isnumeric isspace istitle isupper join ljust "
    "lower lstrip partition removeprefix removesuffix replace rfind rindex rjust rpartition rsplit "
    "rstrip split splitlines startswith strip swapcase title upper zfill",
    list: "copy count index pop",
    tuple: "count index",
    dict: "copy get items keys values",
    set: "copy difference intersection isdisjoint issubset issuperset symmetric_difference union",
    float: "is_integer",
}
_SIZED = (str, list, tuple, dict, set, frozenset)
_DATA = {*_SIZED, int, float, complex, bool, type(None), range, datetime.date, datetime.datetime}
_DATA |= {type({}.keys()), type({}.values()), type({}.items())}
_WIDTH = re.compile(r"%(?:\([^()]*\))?[^%a-zA-Z]*(?:\*|\d{5})")


def install(xacro: Any, substitution_args: Any) -> None:
    """Let the package xacro evaluate expressions and open files with what is here."""
    usual = xacro._global_symbols
    spaces: dict[str, Mapping[str, Any]] = {
        "python": _BUILTINS,
        "math": _MATH,
        "xacro": {name: usual["xacro"][name] for name in _XACRO.split()},
    }
    symbols: dict[str, Any] = {}
    for space, names in spaces.items():
        symbols |= {name: value for name, value in usual.items() if name in names}
        symbols[space] = xacro.NameSpace()
        symbols[space].update(names)
    functions = [*symbols.values(), *(one for names in spaces.values() for one in names.values())]
    steps = count()

    def evaluator(names: Callable[[str], Any], more: Sequence[Any] = ()) -> _Evaluator:
        return _Evaluator(names, [*functions, *more], xacro, steps)

    def in_parentheses(expression: str, _: object, names: Any) -> object:
        def value(name: str) -> object:
            try:
                return names[name]
            except KeyError:
                return _BUILTINS[name]

        return evaluator(value, [names[one] for one in _SUBSTITUTIONS]).evaluate(expression)

    xacro.safe_eval = lambda text, names, _=None: evaluator(names.__getitem__).evaluate(text)
    xacro._global_symbols, substitution_args.eval = symbols, in_parentheses
    xacro.open = lambda path: io.BytesIO(read_bytes(path))


class _Refused(Exception):
    """What an expression may not hold."""


class _Evaluator:
    """Evaluates one expression with the values of `names` and those functions."""

    def __init__(
        self,
        names: Callable[[str], Any],
        functions: Sequence[Any],
        xacro: Any,
        steps: Iterator[int],
    ) -> None:
        self._names, self._steps = names, steps
        self._functions = {id(one): one for one in functions if callable(one)}
        self._namespace, self._yaml = xacro.NameSpace, xacro.YamlDictWrapper
        self._kinds = {*_DATA, self._namespace, self._yaml, xacro.YamlListWrapper}
        self._local: dict[str, Any] = {}

    def evaluate(self, expression: str) -> Any:
        """Return the value; ValueError for what is refused, and whatever the operations raise."""
        try:
            return self._visit(ast.parse(expression.strip(), mode="eval").body)
        except _Refused as refused:
            short = " ".join(expression.split())
            short = short if len(short) <= 60 else short[:57] + "..."
            raise ValueError(f"{refused} is refused in the expression '{short}'") from None
        except RecursionError:
            raise ValueError("an expression is nested too deeply") from None

    def _visit(self, node: ast.AST) -> Any:
        if next(self._steps) > MOST_STEPS:
            raise ValueError(f"its expressions take more than {MOST_STEPS} steps")
        rule = getattr(self, f"_{type(node).__name__.lower()}", None)
        if rule is None:
            raise _Refused(type(node).__name__.lower())
        value = rule(node)
        if hasattr(type(value), "__next__"):  # of map, zip, ...
            value = [*islice(value, MOST_ITEMS + 1)]
        kind = type(value)
        if kind not in self._kinds and self._functions.get(id(value)) is not value:
            raise _Refused(f"'{ast.unparse(node)}'")
        _check_size(value.bit_length() if kind is int else len(value) if kind in _SIZED else 0)
        return value

    def _many(self, nodes: Sequence[ast.expr]) -> list[Any]:
        values: list[Any] = []
        for node in nodes:
            one = self._visit(node.value if isinstance(node, ast.Starred) else node)
            values += one if isinstance(node, ast.Starred) else [one]
        return values

    def _constant(self, node: ast.Constant) -> Any:
        return node.value

    def _name(self, node: ast.Name) -> Any:
        try:
            return self._local[node.id] if node.id in self._local else self._names(node.id)
        except KeyError:
            raise NameError(f"name '{node.id}' is not defined") from None

    def _list(self, node: ast.List) -> Any:
        return self._many(node.elts)

    def _tuple(self, node: ast.Tuple) -> Any:
        return tuple(self._many(node.elts))

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        return _OPERATORS[type(node.op)](self._visit(node.operand))

    def _binop(self, node: ast.BinOp) -> Any:
        return _OPERATORS[type(node.op)](self._visit(node.left), self._visit(node.right))

    def _boolop(self, node: ast.BoolOp) -> Any:
        value: Any = None
        for one in node.values:
            value = self._visit(one)
            if bool(value) == isinstance(node.op, ast.Or):
                break
        return value

    def _compare(self, node: ast.Compare) -> Any:
        left, value = self._visit(node.left), True
        for operation, one in zip(node.ops, node.comparators, strict=True):
            right = self._visit(one)
            value = _OPERATORS[type(operation)](left, right)
            if not value:
                break
            left = right
        return value

    def _ifexp(self, node: ast.IfExp) -> Any:
        return self._visit(node.body if self._visit(node.test) else node.orelse)

    def _subscript(self, node: ast.Subscript) -> Any:
        value, index = self._visit(node.value), node.slice
        if not isinstance(index, ast.Slice):
            return value[self._visit(index)]
        ends = (index.lower, index.upper, index.step)
        return value[slice(*(None if one is None else self._visit(one) for one in ends))]

    def _attribute(self, node: ast.Attribute) -> Any:
        return self._member(self._visit(node.value), node.attr)

    def _member(self, owner: Any, name: str) -> Any:
        if not isinstance(owner, (self._namespace, self._yaml)):
            raise _Refused(f"'.{name}'")
        try:
            return owner[name]
        except KeyError:
            raise NameError(f"name '{name}' is not defined") from None

    def _call(self, node: ast.Call) -> Any:
        called, owner = node.func, []
        if not isinstance(called, ast.Attribute):
            function = self._visit(called)
        else:
            value, name = self._visit(called.value), called.attr
            kind = next((one for one in _METHODS if isinstance(value, one)), object)
            if name in _METHODS.get(kind, "").split() and type(value) is not self._namespace:
                owner, function = [value], _FORMAT if name == "format" else getattr(kind, name)
            else:
                function = self._member(value, name)
        if not owner and self._functions.get(id(function)) is not function:
            raise TypeError(f"'{ast.unparse(called)}' is no function")
        given = self._many(node.args)
        named: dict[str, Any] = {}
        for one in node.keywords:
            value = self._visit(one.value)
            named |= value if one.arg is None else {one.arg: value}
        if owner:
            _check_size(max((one for one in given if isinstance(one, int)), default=0))
        return function(*owner, *given, **named)

    def _listcomp(self, node: ast.ListComp | ast.GeneratorExp) -> Any:
        outer, self._local = self._local, dict(self._local)
        values = [self._visit(node.elt) for _ in self._each(node.generators)]
        self._local = outer
        return values

    _generatorexp = _listcomp

    def _each(self, loops: Sequence[ast.comprehension]) -> Iterator[None]:
        """Bind the names of a comprehension to each of their values."""
        if not loops:
            yield
            return
        for value in self._visit(loops[0].iter):
            self._bind(loops[0].target, value)
            if all(self._visit(test) for test in loops[0].ifs):
                yield from self._each(loops[1:])

    def _bind(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            self._local[target.id] = value
        elif isinstance(target, ast.Tuple):
            for one, part in zip(target.elts, value, strict=True):
                self._bind(one, part)
        else:
            raise _Refused(f"'{ast.unparse(target)}'")


class _Format(string.Formatter):
    """str.format, whose fields are arguments alone, without attributes and keys."""

    def get_field(self, field_name: str, args: Any, kwargs: Any) -> Any:
        if not re.fullmatch(r"\w*", field_name):
            raise _Refused(f"the field '{field_name}' of a format")
        return super().get_field(field_name, args, kwargs)

    def format_field(self, value: Any, format_spec: str) -> Any:
        if re.search(r"\d{5}", format_spec):
            raise _Refused(f"the width '{format_spec[:20]}'")
        return super().format_field(value, format_spec)


_FORMAT = _Format().format


def _check_size(size: int) -> None:
    if size > MOST_ITEMS:
        raise ValueError(f"a value of its expressions has more than {MOST_ITEMS} items")


def _times(first: Any, second: Any) -> Any:
    for one, other in ((first, second), (second, first)):
        if isinstance(one, (str, list, tuple)) and isinstance(other, int):
            _check_size(len(one) * other)
    return first * second


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(base, int) and isinstance(exponent, int):
        _check_size(base.bit_length() * exponent)
    return base**exponent


def _shifted(value: Any, bits: Any) -> Any:
    _check_size(bits)
    return value << bits


def _remainder(first: Any, second: Any) -> Any:
    if isinstance(first, str) and _WIDTH.search(first):
        raise _Refused(f"the width in '{first[:20]}'")
    return first % second


_NAMED = (
    "Add add Sub sub Div truediv FloorDiv floordiv BitAnd and_ BitOr or_ BitXor xor RShift rshift "
    "USub neg UAdd pos Not not_ Invert invert Eq eq NotEq ne Lt lt LtE le Gt gt GtE ge Is is_ "
    "IsNot is_not"
)
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    **{
        getattr(ast, a): getattr(operator, b)
        for a, b in zip(*[iter(_NAMED.split())] * 2, strict=True)
    },
    ast.Mult: _times,
    ast.Pow: _power,
    ast.LShift: _shifted,
    ast.Mod: _remainder,
    ast.In: lambda one, many: one in many,
    ast.NotIn: lambda one, many: one not in many,
}
