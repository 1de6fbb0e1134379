"""Settings of the documentation site, which is built and read offline: ``python -m sphinx -W -b html docs site``."""

import ast
import gc
import inspect
import os
import sys
import tomllib
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from pydantic import BaseModel
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
gc.set_threshold(50_000, 20, 100)  # usual thresholds take a fifth of the time, as documents have few cycles
# Kernels of notebooks are processes of their own, and document this checkout too.
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))

import remoras  # noqa: E402
from missions.files import MISSIONS  # noqa: E402
from missions.runs.metrics import CORE_METRICS  # noqa: E402
from missions.scenarios.explanations import explanations  # noqa: E402
from missions.scenarios.organisation import FORMATION_WORDS  # noqa: E402
from missions.sweeps.study import study_explanations  # noqa: E402
from remoras.cli.reproduction.entries import entries  # noqa: E402
from remoras.mission import ABILITIES  # noqa: E402
from worldmodel import core_ontology_paths, ontology_path, read_tbox  # noqa: E402
from worldmodel.ontology import terms_of  # noqa: E402

project = "REMORAS"
author = "The REMORAS simulator authors"
version = release = remoras.__version__
language = "en"
smartquotes = False  # quotes in the text are mostly TOML's

extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_nb"]
templates_path: list[str] = []
exclude_patterns = ["jupyter_execute"]

html_theme = "furo"
html_title = f"REMORAS {release}"
html_static_path = ["static"]
html_css_files = ["tables.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # it would fetch each page found, which browsers refuse on a disk
html_show_copyright = False

# Equations are text, as they stand: MathJax would come from the network. Dollars stay dollars.
myst_enable_extensions: list[str] = []
myst_heading_anchors = 3

nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 900  # seconds for a cell, on a busy machine
nb_output_stderr = "remove"  # progress, for terminals

# Several classes have a field "type", which annotations with the built-in type are then taken to mean.
suppress_warnings = ["ref.python"]

toc_object_entries = False  # each page has the contents of all in its margin: a thousand names more, copied 70 times

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "undoc-members": False}
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True  # fields of dataclasses are listed once


class Keys(SphinxDirective):
    """A list of every key of scenarios or of studies, as ``remoras explain`` has it: type, range, default, meaning."""

    required_arguments = 1
    known: ClassVar = {"scenario": explanations, "study": study_explanations}

    def run(self) -> list[nodes.Node]:
        """A definition for each key; keys of one table stand together, in the order of the files."""
        listed = nodes.definition_list()
        for key, (kind, meaning) in self.known[self.arguments[0]]().items():
            term = nodes.term("", "", nodes.literal("", key), nodes.Text(f"  ({kind})"))
            said = nodes.paragraph()
            for number, part in enumerate(meaning.split("`")):  # every second one stood between backticks
                said += nodes.literal("", part) if number % 2 else nodes.Text(part)
            listed += nodes.definition_list_item("", term, nodes.definition("", said))
        return [listed]


class Terms(SphinxDirective):
    """A list of the classes and attributes of one shipped ontology file: what each is, and its definition.

    A file of a mission is named with its folder: ``mapping/finds``.
    """

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """A definition for each term."""
        listed = nodes.definition_list()
        mission, _, file = self.arguments[0].rpartition("/")
        optional = (ontology_path("bans"), ontology_path("needs"), ABILITIES, FORMATION_WORDS)
        more = sorted((MISSIONS / mission).glob("*.ttl")) if mission else optional
        for term in terms_of(read_tbox(*core_ontology_paths(), *more)):
            if term.file == file:
                name = nodes.term("", "", nodes.literal("", term.name), nodes.Text(f"  ({term.kind})"))
                said = nodes.paragraph("", "", nodes.Text(term.meaning))
                listed += nodes.definition_list_item("", name, nodes.definition("", said))
        if not listed.children:
            raise self.error(f"no shipped ontology file {self.arguments[0]} declares a term")
        return [listed]


def definition(name: str, kind: str, texts: Collection[str]) -> nodes.definition_list_item:
    """One entry of a list; what stands between backticks is literal."""
    body = nodes.definition("")
    for text in filter(None, texts):
        said = nodes.paragraph()
        for number, part in enumerate(text.replace("``", "`").split("`")):
            said += nodes.literal("", part) if number % 2 else nodes.Text(part)
        body += said
    return nodes.definition_list_item("", nodes.term("", "", nodes.literal("", name), nodes.Text(kind)), body)


class Tables(SphinxDirective):
    """List of the tables of results: columns with units, and the text below each declaration."""

    def run(self) -> list[nodes.Node]:
        """A definition for each table, by name."""
        entries = {}
        for package in ("remoras", "missions"):
            for file in (ROOT / package).rglob("*.py"):
                if "templates" in file.parts:
                    continue
                body = ast.parse(file.read_text(encoding="utf-8")).body
                for made, after in zip(body, [*body[1:], None], strict=True):
                    if not (isinstance(made, ast.Assign) and ast.unparse(made.value).startswith("Table(")):
                        continue
                    module = ".".join(file.relative_to(ROOT).with_suffix("").parts)
                    table = getattr(import_module(module), ast.unparse(made.targets[0]))
                    texts = inspect.cleandoc(after.value.value).split("\n\n") if isinstance(after, ast.Expr) else []
                    columns = [
                        f"`{column.name}`" + (f" ({column.unit})" * bool(column.unit)) for column in table.columns
                    ]
                    owner = "" if package == "remoras" else f"  (missions/{file.relative_to(ROOT).parts[1]})"
                    entries[table.name] = definition(table.name, owner, [", ".join(columns), *texts])
        return [nodes.definition_list("", *(entries[name] for name in sorted(entries)))]


class Metrics(SphinxDirective):
    """A list of the metrics of every run: unit, better direction, meaning."""

    def run(self) -> list[nodes.Node]:
        """A definition for each metric, in the order of the summary."""
        listed = nodes.definition_list()
        for metric in CORE_METRICS:
            meaning = "" if metric.of.__name__ == "<lambda>" else inspect.getdoc(metric.of) or ""
            about = ", ".join(filter(None, [metric.unit, f"{metric.better.value} is better"]))
            texts = [f"{metric.label[0].upper()}{metric.label[1:]}.", meaning.partition("\n\n")[0], metric.note]
            listed += definition(metric.name, f"  ({about})", [" ".join(filter(None, texts))])
        return [listed]


class Papers(SphinxDirective):
    """The items of the three papers with verdicts, and the entries of ``remoras reproduce``."""

    def run(self) -> list[nodes.Node]:
        """A sentence with counts, and a table for each section."""
        sections = tomllib.loads((ROOT / "docs" / "papers.toml").read_text(encoding="utf-8"))["section"]
        verdicts = Counter(verdict for section in sections for _, verdict, _ in section["items"])
        counts = ", ".join(f"{number} {verdict}" for verdict, number in verdicts.items())
        text = f"{verdicts.total()} items: {counts}.\n\n"
        for section in sections:
            rows = [
                (item, verdict, f"`remoras {detail}`" if verdict == "works" else detail)
                for item, verdict, detail in section["items"]
            ]
            text += f"**{section['title']}**\n\n" + table(("Item", "", "Command or reason"), rows)
        rows = [(f"`{e.name}`", e.duration, e.origin, f"`{e.recipe}`" if e.recipe else "") for e in entries().values()]
        text += "**Entries of remoras reproduce**\n\n" + table(("Name", "Duration", "Source", "Recipe"), rows)
        return self.parse_text_to_nodes(text)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [heads, ["---"] * len(heads), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) + "\n"


class Picture(SphinxDirective):
    """Figure of a run of a shipped scenario, drawn when the site is built unless notebooks are off."""

    required_arguments = 3  # scenario, seed, figure

    def run(self) -> list[nodes.Node]:
        """The figure with its caption."""
        if self.config.nb_execution_mode == "off":
            return []
        scenario, seed, kind = self.arguments
        drawn = remoras.run(scenario, seed=int(seed)).plot(kind)
        file = Path(self.env.doctreedir) / f"{scenario}-{kind}.png"
        drawn.savefig(file, dpi=150)
        # Both addresses are relative to the page, also outside of the sources.
        image = nodes.image(uri=os.path.relpath(file, Path(self.env.doc2path(self.env.docname)).parent), alt=kind)
        return [nodes.figure("", image, nodes.caption("", drawn.caption))]


class Public(SphinxDirective):
    """The documented names of a package's ``__all__`` that ``remoras`` does not offer itself."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Names as links, then the entry of each by autodoc: classes, functions, values."""
        package = self.arguments[0]
        documented = sorted(self.directives(), key=lambda one: ("data::" in one[1], "autofunction" in one[1]))
        links = ", ".join(f":py:obj:`{name} <{package}.{name}>`" for name, _ in documented)
        text = "\n".join(lines for _, lines in documented)
        return self.parse_text_to_nodes(
            f"```{{eval-rst}}\n.. py:currentmodule:: {package}\n\n{links if len(documented) > 1 else ''}\n\n{text}\n```"
        )

    def directives(self) -> Iterator[tuple[str, str]]:
        """Each name with its directive."""
        package = self.arguments[0]
        for name in import_module(package).__all__:
            value: Any = getattr(import_module(package), name)
            where = f"{package}.{name}"
            if inspect.ismodule(value) or (name in remoras.__all__ and value is getattr(remoras, name)):
                continue
            if inspect.isclass(value):  # fields of models are keys, which have a list of their own
                yield name, f".. autoclass:: {where}\n" + "   :no-members:\n" * issubclass(value, BaseModel)
            elif inspect.isroutine(value):
                yield name, f".. autofunction:: {where}\n"
            else:
                several = value if isinstance(value, Collection) and not isinstance(value, str) else [value]
                names = [one if isinstance(one, str) else getattr(one, "name", repr(one)) for one in several]
                yield name, f".. py:data:: {name}\n\n   {', '.join(f'``{one}``' for one in names)}\n"


def keep_first_line(app: Sphinx, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Keep napoleon from taking what stands before a colon for the type of an attribute or property."""
    if what in ("attribute", "property") and lines:
        lines[0] = lines[0].replace(": ", " – ")


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directives of this site."""
    app.add_directive("keys", Keys)
    app.add_directive("terms", Terms)
    app.add_directive("tables", Tables)
    app.add_directive("metrics", Metrics)
    app.add_directive("papers", Papers)
    app.add_directive("picture", Picture)
    app.add_directive("public", Public)
    app.connect("autodoc-process-docstring", keep_first_line, priority=400)  # napoleon has 500
    return {"parallel_read_safe": True, "parallel_write_safe": True}
