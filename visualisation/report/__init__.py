"""Reports of studies and runs: one page of HTML, and a folder with LaTeX."""

from visualisation.report.document import write_report
from visualisation.report.run import run_report
from visualisation.report.study import study_report

__all__ = ["run_report", "study_report", "write_report"]
