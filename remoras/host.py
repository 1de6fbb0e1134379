"""What hosts vehicles: ``Agent`` and ``Model`` of Mesa.

The package loads all that it has for spaces, data and batches, too, with SciPy, pandas and NetworkX: that takes as long
as a short mission, and no fleet uses it. So the modules of the two classes are loaded without it. Anybody else who asks
``mesa`` for something gets it, whole and with the same classes; only then does the package load itself.
"""

import importlib
import sys
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mesa import Agent, Model

__all__ = ["Agent", "Model"]
PACKAGE = "mesa"


class _Package(ModuleType):
    """The package before anybody has asked it for something."""

    def __init__(self, spec: ModuleSpec) -> None:
        super().__init__(spec.name)
        places = list(spec.submodule_search_locations or ())
        self.__dict__.update(__spec__=spec, __loader__=spec.loader, __package__=spec.name, __path__=places)
        self.__file__ = spec.origin

    def __getattr__(self, name: str) -> Any:
        loader = self.__spec__.loader if self.__spec__ is not None else None
        if loader is None or name.startswith("__"):  # whoever looks at all modules asks for such names
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        self.__class__ = ModuleType  # type: ignore[assignment]
        loader.exec_module(self)
        return getattr(self, name)


def _hosts() -> tuple[Any, Any]:
    spec = find_spec(PACKAGE) if PACKAGE not in sys.modules else None
    if spec is not None:
        sys.modules[PACKAGE] = _Package(spec)
        try:
            return _classes()
        except Exception:  # a version whose modules cannot be loaded in this order: it is loaded as it loads itself
            for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
                del sys.modules[name]
    importlib.import_module(PACKAGE)
    return _classes()


def _classes() -> tuple[Any, Any]:
    agent, model = (importlib.import_module(f"{PACKAGE}.{name}") for name in ("agent", "model"))
    return agent.Agent, model.Model


if not TYPE_CHECKING:
    Agent, Model = _hosts()
