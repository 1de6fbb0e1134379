"""Replay of one or two runs: a self-contained HTML file."""

from visualisation.replay.page import ReplayPage, check_page_output, live_text, page_text, title_of, write_page
from visualisation.replay.payload import missing, run_data

__all__ = [
    "ReplayPage",
    "check_page_output",
    "live_text",
    "missing",
    "page_text",
    "run_data",
    "title_of",
    "write_page",
]
