"""The hint at the end of messages about unknown names."""

import pytest

from worldmodel import suggestion


@pytest.mark.parametrize(
    ("given", "hint"),
    [
        ("positon", "; did you mean 'position'?"),
        ("xyz", ""),
        ("Position", "; did you mean 'position'?"),  # 14 of 16 letters match
        ("", ""),
    ],
)
def test_a_similar_name_is_proposed_and_no_other(given, hint):
    assert suggestion(given, (name for name in ("location", "position"))) == hint


def test_nothing_is_proposed_when_nothing_is_known():
    assert suggestion("position", ()) == ""
