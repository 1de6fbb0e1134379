"""The usual run leaves out the slow tests."""

import pytest


def test_the_usual_run_leaves_out_slow_tests(pytestconfig: pytest.Config) -> None:
    assert "not slow and not thorough" in pytestconfig.getini("addopts")
