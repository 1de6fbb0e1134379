"""Lazy loading of a package's names.

The package's ``__init__.py`` imports the names below ``if TYPE_CHECKING`` for type checkers, and defines
``__getattr__ = lazily.loader(__name__, __file__)``, which finds them in these imports.
"""

import ast
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def loader(package: str, file: str) -> Callable[[str], Any]:
    """Return a module ``__getattr__`` for a package; ``file`` is its ``__init__.py``."""

    @cache  # parses the file, asked for each name
    def homes() -> dict[str, str]:
        blocks = (node for node in ast.parse(Path(file).read_text(encoding="utf-8")).body if isinstance(node, ast.If))
        imports = (node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom))
        return {alias.name: node.module or "" for node in imports for alias in node.names}

    def load(name: str) -> Any:
        if name.startswith("__") or name not in homes():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes()[name]), name)

    return load
