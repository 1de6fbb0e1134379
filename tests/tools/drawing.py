"""Mutants that a seed draws: small changes to the syntax tree of kernels and of the code that decides.

A list of chosen mutants cannot say what was not chosen. Here every place that one of the changes of ``changes_of`` fits
is a mutant, and a seed draws among all of them with equal chances. Left out are annotations, decorators, docstrings and
the other texts, for their tests would pin words.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

FOLDERS = (
    "exchange", "exchange/acoustics", "missions", "missions/mapping", "missions/meeting", "missions/runs", "remoras",
    "remoras/executive", "remoras/functional", "remoras/htn", "remoras/social", "remoras/strategies", "worldmodel",
)  # fmt: skip
"""Folders whose files are drawn from; below them stand readers of files, drivers, processes and the command line."""
TYPES = frozenset({"bool", "bytes", "dict", "float", "int", "list", "set", "str", "tuple"})
LEFT_OUT = frozenset(
    {"figures.py", "__init__.py", "__main__.py", "errors.py", "version.py", "testing.py", "face.py", "swept.py"}
)
OTHER_COMPARISON: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
OTHER_OPERATOR: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Add,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}  # fmt: skip


class Drawn(NamedTuple):
    """A change to one place of a file.

    Attributes:
        file: from the root of the checkout; line: from 1.
        kind: of change, in words.
        begin, end: of the text that is replaced, in bytes of the file.
        before: that text; after: what takes its place.
    """

    file: str
    line: int
    kind: str
    begin: int
    end: int
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {_line(self.before)} -> {_line(self.after)}"

    def applied(self, content: str) -> str:
        """The content of the file with the change."""
        raw = content.encode()
        return (raw[: self.begin] + self.after.encode() + raw[self.end :]).decode()


def _line(text: str) -> str:
    return " ".join(text.split())


def draw(root: Path, n: int, seed: int) -> list[Drawn]:
    """Mutants drawn with equal chances among all places that a change fits.

    Args:
        root: of the checkout; n: how many; seed: of the draw.
    """
    return random.Random(seed).sample(list(places(root)), n)


def places(root: Path) -> Iterator[Drawn]:
    """Every mutant there is, in the order of the files and of their lines."""
    for path in sorted(path for folder in FOLDERS for path in (root / folder).glob("*.py")):
        if path.name not in LEFT_OUT:
            yield from mutants_of(path.read_text(encoding="utf-8"), path.relative_to(root).as_posix())


def mutants_of(source: str, file: str) -> Iterator[Drawn]:
    """The mutants of one file; none compiles to what was there before.

    >>> [str(found) for found in mutants_of("def half(x):\\n    return x / 2\\n", "half.py")]
    ['half.py:2: x / 2 -> (x * 2)', 'half.py:2: 2 -> 3', 'half.py:2: 2 -> 1']
    """
    starts = [0]
    for text in source.encode().split(b"\n"):
        starts.append(starts[-1] + len(text) + 1)
    for node in _walk(ast.parse(source)):
        for kind, place, after in changes_of(node):
            begin = starts[place.lineno - 1] + place.col_offset
            end = starts[(place.end_lineno or place.lineno) - 1] + (place.end_col_offset or 0)
            before = source.encode()[begin:end].decode()
            yield Drawn(file, place.lineno, kind, begin, end, before, after)


def _walk(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    """Expressions and statements below a node that run, in their order."""
    if isinstance(node, ast.expr | ast.stmt):
        yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.JoinedStr | ast.Import | ast.ImportFrom) or _is_for_checkers(child):
                continue
            if isinstance(child, ast.AST):
                yield from _walk(child)


def _is_for_checkers(node: object) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def changes_of(node: ast.expr | ast.stmt) -> Iterator[tuple[str, ast.expr | ast.stmt, str]]:
    """Changes that fit a node: the kind, the part of it that is replaced, and the text that takes its place."""
    match node:
        case ast.Compare(left, [operator], [right]) if type(operator) in OTHER_COMPARISON:
            yield "comparison", node, _text(ast.Compare(left, [OTHER_COMPARISON[type(operator)]()], [right]))
        case ast.BoolOp(joined, values):
            yield "and, or", node, _text(ast.BoolOp(ast.Or() if isinstance(joined, ast.And) else ast.And(), values))
        case ast.BinOp(left, operation, right) if type(operation) in OTHER_OPERATOR and not _is_type(node):
            yield "operator", node, _text(ast.BinOp(left, OTHER_OPERATOR[type(operation)](), right))
        case ast.UnaryOp(ast.Not(), operand):
            yield "condition", node, _text(operand)
        case ast.UnaryOp(ast.USub(), operand) if not isinstance(operand, ast.Constant):
            yield "sign", node, _text(operand)
        case ast.Constant(bool() as value):
            yield "constant", node, str(not value)
        case ast.Constant(int() | float() as value):
            yield "constant", node, repr(value + 1)
            yield "constant", node, repr(value - 1) if value >= 1 else f"({value - 1!r})"
        case ast.If(test) | ast.While(test) | ast.IfExp(test):
            if not isinstance(test, ast.Compare | ast.BoolOp | ast.UnaryOp):  # those have changes of their own
                yield "condition", test, _text(ast.UnaryOp(ast.Not(), test))
        case ast.Call(function, [first, second, *rest], keywords):
            are_starred = isinstance(first, ast.Starred) or isinstance(second, ast.Starred)
            if not are_starred and ast.dump(first) != ast.dump(second):
                yield "arguments", node, ast.unparse(ast.Call(function, [second, first, *rest], keywords))
        case ast.Expr(ast.Call()) | ast.AugAssign() | ast.Continue() | ast.Break():
            yield "statement", node, "pass"
        case ast.Assign([ast.Attribute() | ast.Subscript()]):
            yield "statement", node, "pass"


def _text(node: ast.expr) -> str:
    return f"({ast.unparse(node)})"


def _is_type(node: ast.BinOp) -> bool:
    """True for ``Block | None`` and the like outside an annotation."""
    names = [part.id for part in (node.left, node.right) if isinstance(part, ast.Name)]
    return isinstance(node.op, ast.BitOr) and any(name[0].isupper() or name in TYPES for name in names)
