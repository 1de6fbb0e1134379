"""Figures that pages print and that a command makes again: an entry is of one line, and differences are found."""

from pathlib import Path
from typing import Any

import pytest

from benchmarks import printed
from benchmarks.house import ROOT
from benchmarks.printed import Measured, PrintedLine, Source, drawn, lines, main, summaries_of

PAPER = "| AUV02 finishes its area | 1738 s |"


@pytest.mark.parametrize("line", list(lines()), ids=lambda line: line.template[:40])
def test_every_entry_is_of_one_line_of_its_page(line: PrintedLine) -> None:
    assert line.printed((ROOT / line.page).read_text(encoding="utf-8")) is not None
    assert line.sources


@pytest.mark.slow
def test_what_is_printed_of_the_run_of_the_paper_repeats() -> None:
    (line,) = (line for line in lines() if line.template.startswith(PAPER))
    made = line.made({source: summaries_of(source) for source in line.sources})
    assert made == line.printed((ROOT / line.page).read_text(encoding="utf-8"))


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page with two lines, and runs of which the time is ten times the seed."""
    (tmp_path / "page.md").write_text("| none | 15 (10 to 20) |\n| some | 10, 21 |\n", encoding="utf-8")
    (tmp_path / "entries.toml").write_text(
        """[[printed]]
page = "page.md"
line = "| none | {run.t_s.mean:.0f} ({run.t_s.least:.0f} to {run.t_s.greatest:.0f}) |"
seeds = "1-2"
runs = { run = "mission" }
[[printed]]
page = "page.md"
line = "| <how> | {run.t_s.each:.0f} |"
where = { how = ["some"] }
seeds = "1-2"
runs = { run = "mission --<how>" }
""",
        encoding="utf-8",
    )

    def ten_times(source: Source) -> list[dict[str, Any]]:
        return [{"t_s": 10.0 * source[1]}]

    monkeypatch.setattr(printed, "ROOT", tmp_path)
    monkeypatch.setattr(printed, "ENTRIES", tmp_path / "entries.toml")
    monkeypatch.setattr(printed, "summaries_of", ten_times)
    return tmp_path / "page.md"


def test_a_figure_that_does_not_repeat_is_named_and_mended(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 1
    assert capsys.readouterr().out == (
        "page.md\n  prints  | some | 10, 21 |\n  made    | some | 10, 20 |\n1 of 2 lines repeat (4 runs)\n"
    )
    assert main(["--write"]) == 1
    assert page.read_text(encoding="utf-8") == "| none | 15 (10 to 20) |\n| some | 10, 20 |\n"
    assert main([]) == 0


def test_a_sample_is_a_share_of_the_lines_and_another_by_another_seed() -> None:
    among = list(lines())
    tenth = drawn(among, 0.1, 1)
    assert len(tenth) == round(len(among) / 10)
    assert tenth == drawn(among, 0.1, 1)
    assert tenth != drawn(among, 0.1, 2)
    assert len(drawn(among, 0.001, 1)) == 1


def test_fields_are_taken_over_seeds() -> None:
    summaries = [
        {"completed": seed > 1, "t_s": float(seed), "milestones": [{"name": "done", "vehicle": "A", "time_s": 5.0}]}
        for seed in (1, 2, 3)
    ]
    of = Measured(summaries)
    assert (of.n, of.completed.count, of.t_s.least, of.t_s.mean, of.t_s.greatest) == (3, 2, 1.0, 2.0, 3.0)
    assert of.t_s.half == pytest.approx(4.303 / 3**0.5, abs=1e-3)  # Student's t of 2 degrees of freedom, 0.975
    assert of.done_A.mean == of.done.mean == 5.0
    with pytest.raises(KeyError, match="allowed: completed, done"):
        _ = of.none


def test_what_a_mechanism_bears_is_a_paired_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it the times are 12, 14 and 19 instead of 10, 20 and 30: -5 in the mean, 1 of 3 above."""
    times_s = {True: (12.0, 14.0, 19.0), False: (10.0, 20.0, 30.0)}
    monkeypatch.setattr(printed, "measured", lambda of, seed, is_out: times_s[is_out][seed - 1])
    runs = {"on": "mechanism 'battery fact' with", "off": "mechanism 'battery fact' without"}
    text = "{d.measured:.0f} ({d.measured.low:.2f} to {d.measured.high:.2f}), {d.measured.share:.0f} %, "
    text += "{d.measured.n_above} above"
    line = PrintedLine("page.md", text, runs, (1, 2, 3), {"d": ("off", "on")}, True)
    half = 4.3027 * ((7.0**2 + 1.0**2 + 6.0**2) / 2 / 3) ** 0.5
    made = line.made({source: summaries_of(source) for source in line.sources})
    assert made == f"-5 ({-5.0 - half:.2f} to {-5.0 + half:.2f}), -25 %, 1 above"


def test_runs_of_a_study_are_paired_by_repeat(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the order in which they ended."""
    rows = [
        {"repeat": n, "weight": w, "t_s": 10.0 * n + w} for n, w in ((2, 0), (1, 5), (3, 5), (1, 0), (3, 0), (2, 5))
    ]
    monkeypatch.setattr(printed, "swept", lambda study: rows)
    of = {w: Measured(printed.runs_of_study("study", {"weight": w})).t_s.values for w in ("0", "5")}
    assert of == {"0": [10.0, 20.0, 30.0], "5": [15.0, 25.0, 35.0]}


@pytest.mark.parametrize("wrong", [["--sample", "0"], ["--sample", "2"], ["--page", "none.md"]])
def test_what_is_asked_wrongly_is_refused(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(wrong)
    assert "allowed" in capsys.readouterr().err
