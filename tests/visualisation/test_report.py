"""Reports of studies and runs: true statements, the same bytes, no network, valid LaTeX."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from synthetic_sweeps import FEW, HORIZON_S, SEVEN, TEN, Sweep, law

import remoras
from missions.comparison import compare
from missions.comparison.sentences import statements
from missions.comparison.table import number
from missions.runs.results import Results
from missions.statistics import detectable
from missions.sweeps.folder import STUDY_TEXT, SweepResults
from remoras.cli.report import _of_run
from visualisation.page import DrawnPage
from visualisation.report import study_report, write_report
from visualisation.report.document import REFERENCES, Items, Report, Table, latex, tex_text

ROOT = Path(__file__).parents[2]
ENDS = re.compile(r"\\(begin|end)\{(\w+)\}")
VOID = {"meta", "link", "img", "br"}


def never(*given: Any) -> dict[str, Any]:
    """The law, but `fixed-partition` does not complete with a loss above a half."""
    own = law(*given)
    completed = given[0] != "fixed-partition" or given[2] <= 0.5
    return {**own, "completed": completed, "mission_time_s": own["mission_time_s"] if completed else HORIZON_S}


def no_map(run: Results) -> DrawnPage:
    raise AssertionError("synthetic sweeps have no tables")


def studied(folder: Path, comment: str = "# Who is faster?\n", **given: Any) -> SweepResults:
    sweep = Sweep(**{"strategies": SEVEN[:3], "channels": [("bernoulli", FEW, {})], "repeats": 10, **given})
    results = sweep.write(folder)
    (folder / STUDY_TEXT).write_text(f"{comment}\n[study]\n", encoding="utf-8")
    return results


def texts_of(report: Report) -> str:
    return "\n".join(str(part) for parts in report.sections.values() for part in parts)


class Balanced(HTMLParser):
    """Collects the open elements and the addresses of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]
        self.open += [] if tag in VOID else [tag]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def check_tex(text: str) -> None:
    """Braces and environments are balanced, and rows of a table have its number of columns."""
    opened: list[str] = []
    for kind, name in ENDS.findall(text):
        if kind == "begin":
            opened.append(name)
        else:
            assert opened.pop() == name
    assert not opened
    plain = re.sub(r"\\begin\{verbatim\}.*?\\end\{verbatim\}", "", text, flags=re.DOTALL)
    depth = 0
    for character in re.sub(r"\\[{}]", "", plain):
        depth += {"{": 1, "}": -1}.get(character, 0)
        assert depth >= 0
    assert depth == 0
    for columns, body in re.findall(
        r"\\begin\{(?:tabular|longtable)\}\{(\w+)\}(.*?)\\end\{(?:tabular|longtable)\}", plain, flags=re.DOTALL
    ):
        rows = re.findall(r"^(.*) \\\\$", body, flags=re.MULTILINE)
        assert rows
        assert {len(re.findall(r"(?<!\\)&", row)) for row in rows} == {len(columns) - 1}


@given(st.text())
def test_any_text_is_safe_in_latex(text: str) -> None:
    safe = latex(text)
    check_tex(safe)
    assert not re.search(r"(?<!\\)[&#%_~^<>]", safe.replace("\\_", ""))


def test_statements_agree_with_the_comparison(tmp_path: Path) -> None:
    """Significance with p, direction with the sign, numbers with the row; none without a number."""
    results = studied(tmp_path / "sweep", summary=never)
    for name in ("mission_time_s", "n_bytes"):
        metric, rows = results.metrics[name], compare(results, [name])
        compared = [row for row in rows if row.diff_to_baseline is not None]
        stated = statements(metric, rows)
        assert len(stated) == len(compared) == 2 * len(FEW)
        for row, (subject, text, significant) in zip(compared, stated, strict=True):
            assert subject == row.strategy
            assert f" at PER {row.per:g}" in text
            if row.n_reached == 0:
                assert significant is None
                assert f"{row.strategy} completed 0 of 10 runs (95 % CI 0 to 28 %, significantly below" in text
                assert "both completed in 0 of 10 pairs" in text
                continue
            assert row.p_holm is not None
            assert row.diff_to_baseline is not None
            assert significant == (row.p_holm < 0.05) == ("did not differ significantly" not in text)
            assert "n = 10 instances, paired" in text
            words = ("faster", "slower") if name == "mission_time_s" else ("lower", "higher")
            if significant:
                assert words[row.diff_to_baseline > 0] in text
                assert words[row.diff_to_baseline < 0] not in text
            size, low, high = (
                float(value.replace("\N{MINUS SIGN}", "-"))
                for value in re.search(r"([\d.+\N{MINUS SIGN}]+) \w+ \(95 % CI (\S+) to (\S+),", text).groups()  # type: ignore[union-attr]
            )
            assert low <= size <= high
            assert f"{number(abs(row.diff_to_baseline))} " in text  # as in the table
            assert abs(size) == pytest.approx(abs(row.diff_to_baseline), rel=0.001)
            assert not (low > 0.0 or high < 0.0) or row.p_holm < 0.5


@pytest.mark.parametrize(("label", "within"), [("Bytes sent", "bytes sent"), ("SNR of packets", "SNR of packets")])
def test_statements_keep_abbreviations(tmp_path: Path, label: str, within: str) -> None:
    results = studied(tmp_path / "sweep", strategies=SEVEN[:2])
    stated = statements(replace(results.metrics["n_bytes"], label=label), compare(results, ["n_bytes"]))
    assert stated
    assert all(f" in {within} at PER " in text for _, text, _ in stated)


def test_detectable_difference_is_detected_in_four_of_five_studies() -> None:
    """20,000 samples: the share has a standard deviation of 0.3 %."""
    drawn = np.random.default_rng(1).normal(detectable(3.0, 8), 3.0, (20_000, 8))
    assert np.mean(stats.ttest_1samp(drawn, 0.0, axis=1).pvalue < 0.05) == pytest.approx(0.8, abs=0.015)


def test_report_of_a_study_is_reproducible_without_network_and_complete(tmp_path: Path) -> None:
    results = studied(tmp_path / "sweep", summary=never)
    written = [write_report(study_report(results, None, no_map)[0], tmp_path / name) for name in ("first", "again")]
    assert [path.read_bytes() for path in written[0]] == [path.read_bytes() for path in written[1]]
    names = {str(path.relative_to(tmp_path / "first")) for path in written[0]}
    assert names == {"report.html", "study.toml", "latex/report.tex", "latex/report.bib", "latex/mission-time-1.pdf"}
    page, shown = (tmp_path / "first" / "report.html").read_text(encoding="utf-8"), Balanced()
    shown.feed(page)
    assert shown.open == []
    assert all(address.startswith(("data:", "#ref")) for address in shown.addresses)
    assert "Who is faster?" in page
    tex, bib = (
        (tmp_path / "first" / "latex" / f"report.{kind}").read_text(encoding="utf-8") for kind in ("tex", "bib")
    )
    check_tex(tex)
    check_tex(bib)
    assert {*re.findall(r"\\cite\{(\w+)\}", tex)} == {*re.findall(r"@\w+\{(\w+),", bib)} >= {"remoras", "romano2005"}
    for part in (r"\toprule", r"\includegraphics{mission-time-1.pdf}", "of 90 runs did not complete", "80 \\% power"):
        assert part in tex
    assert "n = 10 instances" in page


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"strategies": ["remoras"]}, "no two treatments share conditions and repeats"),
        ({"n_remaining": 7}, "the study is not finished: done 83, at most 7 to do"),
        ({"repeats": 5}, "5 pairs or fewer allow no interval and no p below 0.062"),
    ],
)
def test_what_a_study_lacks_is_stated(tmp_path: Path, given: dict[str, Any], said: str) -> None:
    report, notes = study_report(studied(tmp_path / "sweep", **given), None, no_map)
    text = texts_of(report)
    assert said in text or said.capitalize() in text or said[0].upper() + said[1:] in text
    assert [note for note in notes if said in note] or "pairs or fewer" in said
    assert ("faster than" in text or "slower than" in text or "differ significantly" in text) == ("no two" not in said)


@pytest.mark.parametrize("comment", ["", "# study.toml\n"])
def test_question_without_a_comment_names_the_factors(tmp_path: Path, comment: str) -> None:
    report, _ = study_report(studied(tmp_path / "sweep", comment=comment), "n_bytes", no_map)
    question = str(report.sections["Question"][0])
    assert question == "What is the effect of strategy (remoras, fixed-partition, central) on bytes?"
    assert "--metric n_bytes" in texts_of(report)


def slower_fleets(*given: Any) -> dict[str, Any]:
    """The law; a fleet of four takes 100 s longer than one of two, the range has no effect."""
    own = law(*given[:4], {})
    return {**own, "completed": True, "mission_time_s": 1500.0 + 50.0 * given[4]["fleet.size"] + 10.0 * given[3] ** 0.5}


def test_effects_of_a_factorial_study_are_stated(tmp_path: Path) -> None:
    factors = {"fleet.size": [2, 4], "communication.range_m": [100, 200]}
    results = studied(tmp_path / "sweep", strategies=["remoras"], factorial=factors, summary=slower_fleets)
    report, notes = study_report(results, None, no_map)
    assert notes == []
    tables = {part.name for parts in report.sections.values() for part in parts if isinstance(part, Table)}
    assert tables == {"effects", "design"}
    check_tex(tex_text(report))
    text = texts_of(report)
    assert "fleet.size from 2 to 4 changed mission time by +100 s (" in text
    assert "Of 8 effects on mission time, 4 are significant" in text


def test_long_table_runs_over_pages(tmp_path: Path) -> None:
    report, _ = study_report(
        studied(tmp_path / "sweep", channels=[("bernoulli", TEN, {})], strategies=SEVEN), None, no_map
    )
    tex = tex_text(report)
    check_tex(tex)
    assert tex.count(r"\begin{longtable}") == 1
    [listed] = [part for part in report.sections["Statistical statements"] if isinstance(part, Items)]
    assert all("did not differ" not in text for text in listed.texts)
    assert "other comparisons." in texts_of(report)


def test_report_of_a_run_has_its_changes_and_the_command_that_repeats_it(tmp_path: Path) -> None:
    """The written scenario gives the same run."""
    run = remoras.run("mapping-rendezvous", per=0.5, seed=3, set={"scenario.duration_s": 150.0})
    run.save(tmp_path / "run")
    report = _of_run(Results.read(tmp_path / "run"))
    written = write_report(report, tmp_path / "report")
    text = texts_of(report)
    for part in ("'scenario.duration_s', '14400.0', '150.0'", "'channel.per', '0.0', '0.5'", "did not complete: "):
        assert part in text
    assert {"latex/trajectories.pdf", "latex/roles.pdf"} <= {
        str(path.relative_to(tmp_path / "report")) for path in written
    }
    check_tex((tmp_path / "report" / "latex" / "report.tex").read_text(encoding="utf-8"))
    again = remoras.run(str(tmp_path / "report" / "scenario.toml"), seed=3)
    assert again.summary == run.summary


def test_program_is_cited_as_its_citation_file_says() -> None:
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\ntitle: {REFERENCES['remoras'].title}\n" in cited
    assert f"- name: {REFERENCES['remoras'].author}\n" in cited
