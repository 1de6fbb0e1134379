"""Names of a package that are loaded when they are first used.

Its ``__init__.py`` imports them for those who read and check code, below ``if TYPE_CHECKING``, and has
``__getattr__ = lazily.loader(__name__, __file__)``: what is asked for is looked up in those imports.
"""

import ast
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def loader(package: str, file: str) -> Callable[[str], Any]:
    """The function by which a package gives its names.

    Args:
        package: its name; file: its ``__init__.py``.
    """

    @cache
    def homes() -> dict[str, str]:
        blocks = (node for node in ast.parse(Path(file).read_text(encoding="utf-8")).body if isinstance(node, ast.If))
        imports = (node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom))
        return {alias.name: node.module or "" for node in imports for alias in node.names}

    def load(name: str) -> Any:
        if name.startswith("__") or name not in homes():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes()[name]), name)

    return load
