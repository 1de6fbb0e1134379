"""Examples in docstrings give their stated output."""

import doctest
import inspect
import re
from functools import cached_property
from importlib import import_module
from pathlib import Path

import pytest

import remoras

ROOT = Path(__file__).parents[2]
PACKAGES = ("exchange", "worldmodel", "remoras", "missions", "visualisation")
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
WITH_EXAMPLES = [
    path.relative_to(ROOT).with_suffix("") for path in SOURCES if ">>> " in path.read_text(encoding="utf-8")
]


def example_of(thing: object) -> str:
    """Tested lines of the docstring of a class or function; constants have none of their own."""
    text = thing.__doc__ if inspect.isclass(thing) or inspect.isfunction(thing) else None
    parsed = doctest.DocTestParser().get_examples(text or "")
    return "".join(example.source for example in parsed if doctest.SKIP not in example.options)


def test_each_public_name_has_an_example_which_uses_it() -> None:
    """A class or function in its own docstring, a constant in that of any."""
    things = {name: getattr(remoras, name) for name in remoras.__all__}
    own = {name: example_of(thing) for name, thing in things.items()}
    shown = {name: own[name] if callable(thing) else "".join(own.values()) for name, thing in things.items()}
    assert [name for name, text in shown.items() if not re.search(rf"\b{name}\b", text)] == []


@pytest.mark.parametrize("path", WITH_EXAMPLES, ids=lambda path: ".".join(path.parts))
def test_docstring_examples_give_their_stated_output(path: Path) -> None:
    module = import_module(".".join(path.parts).removesuffix(".__init__"))
    cached = {
        f"{name}.{attribute}": value.func
        for name, kind in vars(module).items()
        if isinstance(kind, type) and kind.__module__ == module.__name__
        for attribute, value in vars(kind).items()
        if isinstance(value, cached_property)  # which doctest passes by
    }
    found = doctest.testmod(module)
    n_attempted, n_failed = found.attempted, found.failed
    runner = doctest.DocTestRunner()
    for name, function in cached.items():
        for example in doctest.DocTestFinder().find(function, name, module, globs=vars(module)):
            of_one = runner.run(example)
            n_attempted, n_failed = n_attempted + of_one.attempted, n_failed + of_one.failed
    assert n_attempted
    assert not n_failed
