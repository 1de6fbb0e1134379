"""What one must hold in mind stays little: files that an event enters, files that know of a feature."""

import statistics

import pytest

from benchmarks.house import EVENTS, MOST_FILES, SCENARIO, SEED, SETTINGS, entered, naming


def test_no_feature_is_named_in_more_than_three_files() -> None:
    named = naming()
    assert {name: n for name, n in named.items() if n > MOST_FILES} == {}
    assert min(named.values()) > 0  # its words are still those of some file


@pytest.mark.slow
def test_an_event_enters_few_files() -> None:
    """Of the mission with 30 % loss and nothing optional on, which the benchmark prints."""
    found, _ = entered(SCENARIO, SETTINGS, SEED)
    medians = {name: statistics.median(files) for name, files in found.items()}
    assert medians.keys() == EVENTS.keys()
    assert {name: n for name, n in medians.items() if n > EVENTS[name][1]} == {}
