"""Report as a value, and its two forms: a self-contained page of HTML, and LaTeX with figures as PDF.

Both forms have the same texts. ``[@key]`` in a text cites an entry of ``REFERENCES``.
"""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from visualisation.output import html_page, write_folder

if TYPE_CHECKING:
    from visualisation.page import DrawnPage

PAGE, LATEX = "report.html", "latex"
LONG_TEXT = 30  # number of characters from which a table may break a text
MOST_ROWS = 45  # maximum number of rows of a table on one page
WIDEST_IN = 6.5  # maximum width of a figure in true size on the page of the document


class Reference(NamedTuple):
    """Entry of the bibliography: BibTeX type and fields."""

    kind: str
    author: str
    title: str
    year: str = ""
    published: str = ""
    more: Mapping[str, str] = {}

    def bibtex(self, key: str) -> str:
        """Return the entry in BibTeX."""
        place = {"article": "journal", "software": "note"}[self.kind]
        fields = {"author": self.author, "title": self.title, place: self.published, "year": self.year, **self.more}
        shown = {name: latex(text) for name, text in fields.items() if text}
        # Double braces keep the capitals of a title, and a group of authors as one name.
        shown |= {name: f"{{{shown[name]}}}" for name in ("title", *["author"] * (self.kind == "software"))}
        lines = [f"  {name} = {{{text}}}," for name, text in shown.items()]
        return "\n".join([f"@{self.kind.replace('software', 'misc')}{{{key},", *lines, "}", ""])

    def text(self) -> str:
        """Return the entry as one sentence."""
        numbers = ", ".join(f"{name} {text}" for name, text in self.more.items())
        author = self.author.replace(" and ", ", ")
        parts = (author, f"{self.title}", self.published, numbers, self.year)
        return ". ".join(part.rstrip(".") for part in parts if part) + "."


REFERENCES = {
    "remoras": Reference(
        "software", "The REMORAS simulator authors", "REMORAS simulator", "", "Computer program, version "
    ),
    "hartigan1969": Reference(
        "article", "Hartigan, J. A.", "Using subsample values as typical values", "1969",
        "Journal of the American Statistical Association", {"volume": "64", "pages": "1303–1317"},
    ),
    "romano2005": Reference(
        "article", "Romano, J. P. and Wolf, M.",
        "Exact and approximate stepdown methods for multiple hypothesis testing", "2005",
        "Journal of the American Statistical Association", {"volume": "100", "pages": "94–108"},
    ),
    "wilson1927": Reference(
        "article", "Wilson, E. B.", "Probable inference, the law of succession, and statistical inference", "1927",
        "Journal of the American Statistical Association", {"volume": "22", "pages": "209–212"},
    ),
    "zou2008": Reference(
        "article", "Zou, G. Y. and Donner, A.", "Construction of confidence limits about effect measures: "
        "a general approach", "2008", "Statistics in Medicine", {"volume": "27", "pages": "1693–1702"},
    ),
}  # fmt: skip
"""Citable works by key; the version of the program comes from the results."""
CITED = re.compile(rf"\[@({'|'.join(REFERENCES)})\]")


@dataclass(frozen=True)
class Picture:
    """Figure with its caption, rendered for each form; ``name`` is that of its file."""

    name: str
    drawn: DrawnPage


@dataclass(frozen=True)
class Table:
    """Table of texts with its caption; ``right`` are the numbers of right-aligned columns."""

    name: str
    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    right: Sequence[int] = ()


@dataclass(frozen=True)
class Items:
    """List of sentences."""

    texts: Sequence[str]


@dataclass(frozen=True)
class Commands:
    """Lines for a shell."""

    lines: Sequence[str]


Part = str | Picture | Table | Items | Commands
"""A text is a paragraph."""


@dataclass(frozen=True)
class Report:
    """Sections by heading; ``about`` is the provenance of figures, ``files`` are further files by name."""

    title: str
    version: str
    sections: Mapping[str, Sequence[Part]]
    about: Mapping[str, str]
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def references(self) -> dict[str, Reference]:
        """Cited works by key, in order of citation."""
        texts = (part for parts in self.sections.values() for part in parts if isinstance(part, str))
        keys = dict.fromkeys(key for text in texts for key in CITED.findall(text))
        cited = {key: REFERENCES[key] for key in keys}
        own = cited.get("remoras")
        return cited | ({"remoras": own._replace(published=own.published + self.version)} if own else {})


def write_report(report: Report, folder: Path) -> list[Path]:
    """Write ``report.html``, ``latex`` and further files; raise DrawingError on failure."""
    from visualisation import style

    pictures = [part for parts in report.sections.values() for part in parts if isinstance(part, Picture)]
    drawn = {
        form: {picture.name: style.rendered(picture.drawn.figure, form, report.about) for picture in pictures}
        for form in ("svg", "pdf")
    }
    tex = [(f"{name}.pdf", content) for name, content in drawn["pdf"].items()]
    tex += [("report.bib", "\n".join(ref.bibtex(key) for key, ref in report.references.items()).encode())]
    tex += [("report.tex", tex_text(report).encode())]
    files = [(PAGE, page_text(report, drawn["svg"]).encode())]
    files += [(name, text.encode()) for name, text in report.files.items()]
    return [*write_folder(folder, files), *write_folder(folder / LATEX, tex)]


STYLE = """
:root { color-scheme: light; }
body { margin: 0 auto; max-width: 64rem; padding: 1rem; font: 16px/1.5 Georgia, serif; color: #111; background: #fff; }
h1 { font-size: 1.5rem; line-height: 1.25; } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; }
h1, p, li, figcaption { overflow-wrap: anywhere; max-width: 46rem; }
figure { margin: 1.25rem 0; } figure img { display: block; max-width: 100%; height: auto; }
figcaption { font-size: .85rem; color: #333; padding: .4rem 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font: .8rem/1.35 system-ui, sans-serif; border: solid #111; border-width: 1.5px 0; }
th { border-bottom: 1px solid #111; text-align: left; vertical-align: bottom; }
td, th { padding: .2rem .55rem .2rem 0; max-width: 22rem; }
td { white-space: nowrap; } td.text { white-space: normal; } .right { text-align: right; }
pre { overflow-x: auto; padding: .6rem; background: #f3f3f3; font-size: .85rem; }
@media print {
  body { max-width: none; padding: 0; font-size: 10pt; } .wide { overflow: visible; } pre { white-space: pre-wrap; }
  table { font-size: 6.5pt; } figure, tr, pre { break-inside: avoid; } h2 { break-after: avoid; }
}
"""
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"


def page_text(report: Report, pictures: Mapping[str, bytes]) -> str:
    """Return the page, with the pictures (SVG by name) in it."""
    numbers = {key: number for number, key in enumerate(report.references, 1)}

    def of_text(text: str) -> str:
        cited = CITED.sub(lambda match: f"\0{numbers[match[1]]}\0", text)
        return re.sub("\0(\\d+)\0", r'<a href="#ref\1">[\1]</a>', html.escape(cited, quote=False))

    def of_table(table: Table) -> str:
        def row(tag: str, texts: Sequence[str]) -> str:
            kinds = (
                ' class="right"' if number in table.right else ' class="text"' * (len(text) > LONG_TEXT)
                for number, text in enumerate(texts)
            )
            entries = (f"<{tag}{kind}>{of_text(text)}</{tag}>" for text, kind in zip(texts, kinds, strict=True))
            return f"<tr>{''.join(entries)}</tr>"

        body = "\n".join(row("td", texts) for texts in table.rows)
        whole = f"<table>\n<thead>{row('th', table.heads)}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"
        caption = f"<figcaption>{of_text(table.caption)}</figcaption>"
        return f'<figure>{caption}<div class="wide" tabindex="0">{whole}</div></figure>'

    def of_picture(picture: Picture) -> str:
        source = base64.b64encode(pictures[picture.name]).decode()
        caption = of_text(picture.drawn.caption)
        return (
            f'<figure><img alt="{html.escape(picture.name)}" src="data:image/svg+xml;base64,{source}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )

    forms: dict[type, Callable[..., str]] = {
        str: lambda text: f"<p>{of_text(text)}</p>",
        Picture: of_picture,
        Table: of_table,
        Items: lambda items: "<ul>\n" + "\n".join(f"<li>{of_text(text)}</li>" for text in items.texts) + "\n</ul>",
        Commands: lambda commands: f"<pre>{html.escape(chr(10).join(commands.lines), quote=False)}</pre>",
    }
    body = [f"<h1>{html.escape(report.title, quote=False)}</h1>"]
    for heading, parts in report.sections.items():
        body += [f"<h2>{html.escape(heading, quote=False)}</h2>", *(forms[type(part)](part) for part in parts)]
    works = [f'<li id="ref{numbers[key]}">{of_text(work.text())}</li>' for key, work in report.references.items()]
    body += ["<h2>References</h2>", "<ol>", *works, "</ol>"] if works else []
    return html_page(report.title, POLICY, f"<style>{STYLE}</style>", "\n".join(body))


SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "_": r"\_\allowbreak{}",
    "%": r"\%", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "\u2013": "--", "\u2212": "$-$", "\u2265": r"$\geq$", "\u2264": r"$\leq$", "\u00d7": r"$\times$",
    "\u00b1": r"$\pm$", "\u2192": r"$\to$", '"': "''",
}  # fmt: skip
PREAMBLE = r"""\documentclass[10pt]{article}
\usepackage[utf8]{inputenc}
\usepackage[T1]{fontenc}
\usepackage[margin=2.2cm]{geometry}
\usepackage{booktabs,graphicx,longtable}
\sloppy
"""


def latex(text: str) -> str:
    """Escape a text for LaTeX; long names may break after underscores."""
    return "".join(SPECIAL.get(character, character) for character in text)


def tex_text(report: Report) -> str:
    """Return the report as a LaTeX document, from which authors take figure, table and paragraphs."""

    def of_text(text: str) -> str:
        parts = CITED.split(text)  # keys at odd places
        return "".join(rf"\cite{{{part}}}" if number % 2 else latex(part) for number, part in enumerate(parts))

    def of_picture(picture: Picture) -> str:
        wide = r"[width=\linewidth]" if picture.drawn.figure.get_figwidth() > WIDEST_IN else ""
        return "\n".join([
            r"\begin{figure}[htb]", r"\centering", rf"\includegraphics{wide}{{{picture.name}.pdf}}",
            rf"\caption{{{of_text(picture.drawn.caption)}}}", rf"\label{{fig:{picture.name}}}", r"\end{figure}",
        ])  # fmt: skip

    def of_table(table: Table) -> str:
        columns = "".join("r" if number in table.right else "l" for number in range(len(table.heads)))
        head, *rows = (" & ".join(map(of_text, row)) + r" \\" for row in (table.heads, *table.rows))
        look, caption = r"\scriptsize\setlength{\tabcolsep}{3pt}", rf"\caption{{{of_text(table.caption)}}}"
        caption += rf"\label{{tab:{table.name}}}"
        if len(rows) > MOST_ROWS:
            return "\n".join([
                rf"{{{look}", rf"\begin{{longtable}}{{{columns}}}", rf"{caption}\\", r"\toprule", head, r"\midrule",
                r"\endhead", *rows, r"\bottomrule", r"\end{longtable}}",
            ])  # fmt: skip
        return "\n".join([
            r"\begin{table}[htb]", rf"\centering{look}", caption, rf"\begin{{tabular}}{{{columns}}}", r"\toprule",
            head, r"\midrule", *rows, r"\bottomrule", r"\end{tabular}", r"\end{table}",
        ])  # fmt: skip

    forms: dict[type, Callable[..., str]] = {
        str: of_text,
        Picture: of_picture,
        Table: of_table,
        Items: lambda items: "\n".join([
            r"\begin{itemize}", *(rf"\item {of_text(text)}" for text in items.texts), r"\end{itemize}",
        ]),
        Commands: lambda commands: "\n".join([r"\begin{verbatim}", *commands.lines, r"\end{verbatim}"]),
    }  # fmt: skip
    body = [rf"\title{{{latex(report.title)}}}", r"\author{}", r"\date{}", r"\begin{document}", r"\maketitle"]
    for heading, parts in report.sections.items():
        body += ["", rf"\section*{{{latex(heading)}}}", *(f"{forms[type(part)](part)}\n" for part in parts)]
    works = [r"\bibliographystyle{plain}", r"\bibliography{report}"] if report.references else []
    return PREAMBLE + "\n".join([*body, *works, r"\end{document}", ""])
