"""The fleet shared by tests of vehicles."""

from collections.abc import Iterator

import pytest
from resting import fleet_at_rest

from remoras.fleet.fleet import Fleet


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    """The shipped mission before the first packet."""
    with fleet_at_rest() as resting:
        yield resting
