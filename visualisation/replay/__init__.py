"""The replay of a run, or of two: one HTML file that is opened from disk and asks for nothing."""

from visualisation.replay.page import check_output, page_text, write
from visualisation.replay.payload import missing, run_data

__all__ = ["check_output", "missing", "page_text", "run_data", "write"]
