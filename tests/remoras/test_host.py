"""Mesa's two classes are loaded without all else that Mesa has, and whoever asks for the rest gets it."""

import subprocess
import sys

import pytest


def said(program: str) -> str:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout


def test_a_fleet_loads_nothing_of_mesa_that_it_does_not_use():
    loaded = said("import sys, remoras.fleet; print(*sys.modules)").split()
    assert {"mesa", "mesa.agent", "mesa.model"} <= set(loaded)
    assert {"mesa.space", "mesa.datacollection", "scipy", "networkx"}.isdisjoint(loaded) or sys.version_info >= (3, 12)


@pytest.mark.parametrize("order", ["import mesa; import remoras.fleet", "import remoras.fleet; import mesa"])
def test_the_classes_are_those_of_mesa(order: str):
    program = (
        f"{order}; from remoras.fleet import Fleet; from remoras.vehicle import Vehicle; import mesa.space, mesa.agent;"
        "print(issubclass(Fleet, mesa.Model), issubclass(Vehicle, mesa.Agent), mesa.agent.Agent is mesa.Agent,"
        "mesa.space.ContinuousSpace.__name__, mesa.__version__ > '3')"
    )
    assert said(program).split() == ["True", "True", "True", "ContinuousSpace", "True"]


def test_who_asks_for_what_is_not_there_is_told():
    program = (
        "import remoras.fleet, mesa\ntry:\n    mesa.no_such_name\nexcept AttributeError as error:\n    print(error)"
    )
    assert "no_such_name" in said(program)


def test_a_mesa_that_cannot_be_loaded_in_parts_is_loaded_whole():
    program = (
        "import sys\n"
        "class InOrder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'mesa.model' and 'mesa.discrete_space' not in sys.modules:\n"
        "            raise ImportError('not yet')\n"
        "sys.meta_path.insert(0, InOrder())\n"
        "import remoras.fleet, mesa\n"
        "print('mesa.space' in sys.modules, issubclass(remoras.fleet.Fleet, mesa.Model))"
    )
    assert said(program).split() == ["True", "True"]
