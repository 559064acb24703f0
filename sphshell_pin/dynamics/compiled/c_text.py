"""C text of expressions of CasADi, block by block."""

import math
from dataclasses import dataclass, field

from sphshell_pin.dynamics.compiled.joint_motion import Expression, casadi

_BINARY = {"OP_ADD": "+", "OP_SUB": "-", "OP_MUL": "*", "OP_DIV": "/"}
_UNARY = {
    "OP_ASSIGN": "{0}",
    "OP_NEG": "-{0}",
    "OP_SQ": "{0} * {0}",
    "OP_TWICE": "{0} + {0}",
    "OP_INV": "1. / {0}",
    "OP_SIN": "sin({0})",
    "OP_COS": "cos({0})",
    "OP_SQRT": "sqrt({0})",
}


@dataclass
class Storage:
    """Numbers that one block of a function leaves to the next, as `name`[0], `name`[1], ..."""

    name: str
    size: int = 0

    def take(self, count: int) -> list[str]:
        """Return C names of `count` more numbers."""
        self.size += count
        return [f"{self.name}[{self.size - count + k}]" for k in range(count)]


@dataclass
class Block:
    """Statements in one scope, which read and write numbers by their C names."""

    targets: list[str] = field(default_factory=list)
    values: list[Expression] = field(default_factory=list)

    def write(self, targets: list[str], values: Expression) -> None:
        """Write the entries of `values`, by columns, to `targets`."""
        entries = casadi().vec(casadi().densify(casadi().SX(values)))
        self.targets += targets
        self.values += [entries[k] for k in range(len(targets))]

    def keep(self, storage: Storage, values: Expression) -> Expression:
        """Write what is not constant of `values` to `storage`; return them for later blocks."""
        ca = casadi()
        known = ca.densify(values)
        kept = ca.SX(known)
        for row in range(known.shape[0]):
            for column in range(known.shape[1]):
                if not known[row, column].is_constant():
                    target = storage.take(1)
                    self.write(target, known[row, column])
                    kept[row, column] = ca.SX.sym(target[0])
        return ca.sparsify(kept)

    def text(self) -> tuple[str, int]:
        """Return the statements, and how many there are."""
        if not self.values:
            return "", 0
        ca = casadi()
        values = ca.cse(ca.vertcat(*self.values))
        read = ca.symvar(values)
        function = ca.Function("f", [ca.vertcat(*read)] if read else [ca.SX(0, 1)], [values])
        names = [one.name() for one in read]
        operations = _operations(ca)
        lines = [
            _line(function, k, operations, names, self.targets)
            for k in range(function.n_instructions())
        ]
        scratch = ", ".join(f"a{k}" for k in range(function.sz_w()))
        return "\n".join(["{", f"double {scratch};", *lines, "}"]), len(lines)


def _operations(ca: object) -> dict[int, str]:
    known = (*_BINARY, *_UNARY, "OP_INPUT", "OP_OUTPUT", "OP_CONST")
    return {int(getattr(ca, name)): name for name in known}


def _line(
    function: Expression, k: int, operations: dict[int, str], read: list[str], targets: list[str]
) -> str:
    """Return one statement; LookupError for an operation that no robot needs."""
    operation = operations[function.instruction_id(k)]
    into, of = function.instruction_output(k), function.instruction_input(k)
    if operation == "OP_OUTPUT":
        return f"{targets[into[1]]} = a{of[0]};"
    if operation == "OP_INPUT":
        value = read[of[1]]
    elif operation == "OP_CONST":
        number = float(function.instruction_constant(k))
        if not math.isfinite(number):
            raise ZeroDivisionError
        value = repr(number)
    elif operation in _BINARY:
        value = f"a{of[0]} {_BINARY[operation]} a{of[1]}"
    else:
        value = _UNARY[operation].format(f"a{of[0]}")
    return f"a{into[0]} = {value};"


def functions(name: str, blocks: list[Block], arguments: str, call: str, most: int) -> str:
    """Return static functions name_0, name_1, ... of at most about `most` statements, and name.

    `arguments` are their parameters in C, `call` the names of these.
    """
    parts: list[str] = []
    held, count = "", 0
    for block in blocks:
        text, size = block.text()
        if held and count + size > most:
            parts.append(held)
            held, count = "", 0
        held, count = held + text + "\n", count + size
    parts.append(held)
    named = [f"static void {name}_{k}({arguments}) {{\n{part}}}\n" for k, part in enumerate(parts)]
    calls = "".join(f"{name}_{k}({call});\n" for k in range(len(parts)))
    return "".join(named) + f"static void {name}({arguments}) {{\n{calls}}}\n"
