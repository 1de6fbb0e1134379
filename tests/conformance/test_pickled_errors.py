"""Errors can be pickled: a process pool breaks if a worker cannot return one."""

import pickle

import pytest

from missions.errors import ConfigurationError, ConfigurationFault
from remoras.errors import StrategyError
from worldmodel.errors import OntologyError, UnknownNameError

FAULTS = [ConfigurationFault("channel.per", "2", "0 to 1", line=7)]


ERRORS = [
    ConfigurationError("sea.toml", FAULTS), StrategyError("strategy.queue", "1 to 64"),
    OntologyError(["two names", "no class"]), UnknownNameError(["unknown class 'Aria'"]),
]  # fmt: skip


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_keeps_its_message_across_processes(error: Exception) -> None:
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is type(error)
    assert str(back) == str(error)
    assert vars(back) == vars(error)


def test_a_faulty_configuration_names_file_line_key_and_value() -> None:
    assert str(ConfigurationError("sea.toml", FAULTS)) == "sea.toml:7: channel.per = 2: 0 to 1"
