"""The size of the installed packages stays within the number in ``size.toml``."""

import ast
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMIT = tomllib.loads(Path(__file__).with_name("size.toml").read_text(encoding="utf-8"))["code_proper"]


def code_proper(source: str) -> int:
    """Number of non-blank lines that are neither comment nor docstring."""
    lines = source.splitlines()
    docstrings = {
        number
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for number in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    return sum(
        1
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith("#") and number not in docstrings
    )


def test_the_installed_packages_keep_their_size() -> None:
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    names = [name.removesuffix("*") for name in packages["find"]["include"]]
    files = [file for name in names for file in (ROOT / name).rglob("*.py")]
    size = sum(code_proper(file.read_text(encoding="utf-8")) for file in files)
    assert len(files) > 300
    assert size <= LIMIT, f"{size} lines of code, {LIMIT} allowed: remove code, or raise the number in size.toml"
