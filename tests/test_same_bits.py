"""Models use only operations that IEEE 754 rounds alike everywhere; checked in their sources.

These are + - * /, square roots, comparisons, whole numbers and the exact parts of a float. What a C library, a compiler
or NumPy may round in its own way is refused: its functions, powers, and sums whose order is left open. The model takes
such functions from ``exchange.arithmetic``.
"""

import ast
from collections.abc import Iterator

import pytest
from test_architecture import FOR_ALL, SOURCES, parsed, within

MODEL = ("worldmodel", "exchange", "remoras", "missions")
EXACT = {
    "ceil", "copysign", "fabs", "floor", "frexp", "fsum", "gcd", "inf", "isclose", "isfinite", "isinf", "isnan",
    "isqrt", "lcm", "ldexp", "nan", "nextafter", "pi", "prod", "radians", "sqrt", "tau", "trunc", "ulp",
}  # fmt: skip
"""Names of ``math`` that are rounded once, if at all; ``radians`` is one product."""
EXACT_STATISTICS = {"median", "fmean"}
"""Of ``statistics``: ``fmean`` is ``math.fsum`` over the number."""
FROM_NUMPY = {
    "angle", "arccos", "arccosh", "arcsin", "arcsinh", "arctan", "arctan2", "arctanh", "average", "cbrt", "convolve",
    "corrcoef", "cos", "cosh", "cov", "cross", "dot", "einsum", "exp", "exp2", "expm1", "fft", "float_power", "hypot",
    "inner", "interp", "linalg", "log", "log10", "log1p", "log2", "logaddexp", "matmul", "mean", "nanmean", "nansum",
    "norm", "outer", "percentile", "polyfit", "polyval", "power", "sin", "sinc", "sinh", "std", "sum",
    "tan", "tanh", "tensordot", "trapezoid", "vdot", "var", "vecdot",
}  # fmt: skip
METHODS = {"dot", "mean", "std", "sum", "trace", "var"}
"""Of arrays: sums in an order that NumPy chooses."""
MODULES = {"cmath", "scipy", "statistics"}
EXCEPT = {
    "missions.figure": "ends of axes, which enter no result",
    "missions.statistics": "figures about finished runs, which enter none",
    "missions.comparison": "figures about finished runs, which enter none",
    "missions.verification": "an independent reader of finished runs, which enters none",
    "remoras.cli.reproduction": "figures about finished runs, which enter none",
    "remoras.testing": "checks of plug-ins, which enter no run",
    "missions.sweeps.study": "SciPy's hypercube is made of shuffles and uniform draws; values are kept to six digits",
    "remoras.strategies.allocation": "costs are whole milliseconds, so all sums of the assignment are exact",
    "remoras.strategies.initial_roles": "the programme is one of whole numbers, and so is its answer",
    "exchange.study.stating": "sums of whole numbers of items",
    "exchange.study.study": "sums and products of whole numbers of slots, exact below 2^53",
}
"""Rooms and modules that may use anything, each with its reason."""


def inexact(source: str) -> Iterator[str]:
    """Operations of a source whose rounding depends on the platform."""
    tree = parsed(source)
    imported = {
        one.asname or one.name for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom) for one in n.names
    }
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module="math", names=names):
                yield from (f"line {node.lineno}: math.{one.name}" for one in names if one.name not in EXACT)
            case ast.ImportFrom(module="numpy", names=names):
                yield from (f"line {node.lineno}: numpy.{one.name}" for one in names if one.name in FROM_NUMPY)
            case ast.Import(names=names):
                yield from (f"line {node.lineno}: {one.name}" for one in names if one.name.split(".")[0] in MODULES)
            case ast.ImportFrom(module=str(module), names=names) if module.split(".")[0] in MODULES:
                yield from (
                    f"line {node.lineno}: {module}.{one.name}" for one in names if one.name not in EXACT_STATISTICS
                )
            case ast.Attribute(value=ast.Name(id="math"), attr=attr) if attr not in EXACT:
                yield f"line {node.lineno}: math.{attr}"
            case ast.Attribute(value=ast.Name(id="np" | "numpy"), attr=attr) if attr in FROM_NUMPY:
                yield f"line {node.lineno}: numpy.{attr}"
            case ast.Call(func=ast.Attribute(value=owner, attr=attr), args=given) if attr in METHODS:
                is_of_array = attr == "dot" or all(isinstance(one, ast.Constant) for one in given)  # at most an axis
                if is_of_array and not (isinstance(owner, ast.Name) and owner.id in imported):
                    yield f"line {node.lineno}: {ast.unparse(node)}"
            case ast.Call(func=ast.Name(id="pow")):
                yield f"line {node.lineno}: pow"
            case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
                yield f"line {node.lineno}: @"
            case ast.BinOp(op=ast.Pow(), left=base, right=by) if not (_is_literal(base) and _is_literal(by)):
                yield f"line {node.lineno}: {ast.unparse(node)}"
            case ast.AugAssign(op=ast.Pow()):
                yield f"line {node.lineno}: **="


def _is_literal(node: ast.expr) -> bool:
    """A whole number, written out; powers of these are exact as far as floats go."""
    value = node.operand if isinstance(node, ast.UnaryOp) else node
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float) and value.value == int(value.value)


def test_models_use_portable_arithmetic_only() -> None:
    found = [
        f"{module}, {one}"
        for module, text in SOURCES.items()
        if module.split(".")[0] in MODEL and module != FOR_ALL and not any(within(module, room) for room in EXCEPT)
        for one in inexact(text)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("room", EXCEPT)
def test_every_listed_exception_is_inexact(room: str) -> None:
    """A reason that is needed no more goes."""
    assert any(list(inexact(text)) for module, text in SOURCES.items() if within(module, room))


@pytest.mark.parametrize("line", ["math.exp(x)", "x ** 2", "a @ b", "x.mean(axis=1)", "import scipy.special"])
def test_platform_dependent_rounding_is_detected(line: str) -> None:
    assert list(inexact(f"import math\nimport numpy as np\n{line}"))
