"""Figures that pages print and that a command recomputes; each entry matches one line."""

import pytest

from benchmarks.printed import ROOT, PrintedLine, lines, summaries_of

PAPER = "| AUV02 finishes its area | 1738 s |"


@pytest.mark.parametrize("line", list(lines()), ids=lambda line: line.template[:40])
def test_every_entry_matches_one_line_of_its_page(line: PrintedLine) -> None:
    assert line.printed((ROOT / line.page).read_text(encoding="utf-8")) is not None
    assert line.sources


@pytest.mark.slow
def test_printed_figures_of_the_paper_run_repeat() -> None:
    (line,) = (line for line in lines() if line.template.startswith(PAPER))
    made = line.made({source: summaries_of(source) for source in line.sources})
    assert made == line.printed((ROOT / line.page).read_text(encoding="utf-8"))
