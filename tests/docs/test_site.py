"""The documentation site builds without a warning, complete, with executed notebooks, readable offline."""

import fcntl
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html import unescape
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from browsing import PATIENCE_MS, Window

import remoras
from missions.mapping.mission import MappingMission
from missions.runs.metrics import CORE_METRICS
from missions.scenarios.explanations import explanations
from missions.sweeps.study import study_explanations
from remoras.recorder import TABLES
from worldmodel import core_ontology_paths, ontology_path, read_tbox
from worldmodel.ontology import terms_of

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS).with_suffix("").as_posix() for path in DOCS.rglob("*.md"))
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.md"))
PACKAGES = [
    "remoras.testing",
    *sorted(
        ".".join(path.parent.relative_to(ROOT).parts)
        for package in ("remoras", "exchange", "worldmodel", "missions", "visualisation")
        for path in (ROOT / package).rglob("__init__.py")
        if "__all__" in path.read_text(encoding="utf-8") and "cli" not in path.parts
    ),
]
"""Packages that promise names; of the command line the commands are what one uses."""
FETCHED = re.compile(
    r"""<(?:script|img|iframe|source)\b[^>]*\bsrc\s*=\s*["']?(?:https?:)?//|<link\b[^>]*\bhref\s*=\s*["']?(?:https?:)?//""",
    re.IGNORECASE,
)
FETCHED_BY_STYLE = re.compile(r"""@import\s+["'](?:https?:)?//|url\(\s*["']?(?:https?:)?//""", re.IGNORECASE)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as users are told to; -W makes every warning an error. Workers that share the tests share it."""
    pytest.importorskip("sphinx")
    root = tmp_path_factory.getbasetemp()
    folder = (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / "documentation"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "built").exists():
            command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-j", "auto", "-b", "html"]
            command += ["-d", str(folder / "trees"), str(DOCS), str(folder / "site")]
            environment = {**os.environ, "PYTHONPATH": str(ROOT)}
            built = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
            assert built.returncode == 0, built.stderr
            (folder / "built").touch()
    return folder / "site"


def test_nothing_is_fetched(site: Path) -> None:
    assert FETCHED.search('<script async src="https://cdn.example/mathjax.js">') is not None
    pages = list(site.rglob("*.html"))
    assert len(pages) >= len(PAGES)
    assert [page.name for page in pages if FETCHED.search(page.read_text(encoding="utf-8"))] == []
    styles = list(site.rglob("*.css"))
    assert styles
    assert [style.name for style in styles if FETCHED_BY_STYLE.search(style.read_text(encoding="utf-8"))] == []


def test_every_page_is_reached_from_the_contents(site: Path) -> None:
    contents = (site / "index.html").read_text(encoding="utf-8")
    assert len(PAGES) > 20
    assert [page for page in PAGES if page != "index" and f'href="{page}.html"' not in contents] == []


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_notebook_was_executed(site: Path, notebook: Path) -> None:
    html = (site / "notebooks" / f"{notebook.stem}.html").read_text(encoding="utf-8")
    text = notebook.read_text(encoding="utf-8")
    assert text.count("remove-cell") == 1  # its sentences, held to what came out
    cells = text.count("```{code-cell}") - 1
    assert cells >= 3
    assert html.count("cell_input") >= cells
    assert html.count("cell_output") >= cells - 1
    assert "Traceback" not in html


def test_the_reference_has_every_public_name(site: Path) -> None:
    """By the package that promises it, or by `remoras`, which offers some of them."""
    files = site / "reference.html", site / "seams.html", *(site / "packages").glob("*.html")
    pages = [page.read_text(encoding="utf-8") for page in files]
    described = {name for page in pages for name in re.findall(r'id="([\w.]+)"', page)}
    assert len(PACKAGES) > 14
    for package in PACKAGES:
        for name in import_module(package).__all__:
            found = getattr(import_module(package), name)
            is_ours = name in remoras.__all__ and found is getattr(remoras, name)
            assert f"{'remoras' if is_ours else package}.{name}" in described


def test_the_reference_has_every_key(site: Path) -> None:
    text = re.sub(r"<[^>]+>", "", (site / "keys.html").read_text(encoding="utf-8"))
    known = explanations() | study_explanations()
    assert len(known) > 100
    assert [key for key in known if f"{key}  (" not in text] == []


def test_a_page_has_every_table_and_metric_of_a_run(site: Path) -> None:
    text = unescape(re.sub(r"<[^>]+>", "", (site / "tables.html").read_text(encoding="utf-8")))
    names = [one.name for one in (*TABLES, *CORE_METRICS)]
    assert len(names) > 50
    assert [name for name in names if f"\n{name}" not in text] == []
    assert all(column.name in text for table in TABLES for column in table.columns)


def test_a_page_has_every_term_of_the_ontology_with_its_definition(site: Path) -> None:
    text = unescape(re.sub(r"<[^>]+>", "", (site / "ontology.html").read_text(encoding="utf-8")))
    optional = (ontology_path("bans"), ontology_path("needs"), ontology_path("abilities"))
    terms = terms_of(read_tbox(*core_ontology_paths(), *optional, *MappingMission.vocabulary))
    assert len(terms) > 110
    assert [term.name for term in terms if f"{term.name}  ({term.kind})" not in text or term.meaning not in text] == []


def test_pages_name_no_address_in_memory(site: Path) -> None:
    """They would differ from build to build."""
    assert [page.name for page in site.rglob("*.html") if re.search(r"0x[0-9a-f]{8,}", page.read_text("utf-8"))] == []


@pytest.fixture
def opened(chrome: Any, site: Path) -> Iterator[Any]:
    """Opens a page of the site from disk; at the end, no request left the disk and the console was silent."""
    context = chrome.new_context(viewport={"width": 1280, "height": 720})
    context.set_default_timeout(PATIENCE_MS)
    window = Window(context.new_page())

    def open_page(name: str) -> Any:
        file, mark, query = name.partition("?")
        window.page.goto((site / file).as_uri() + mark + query, wait_until="networkidle")
        return window.page

    yield open_page
    assert window.requests
    assert [url for url in window.requests if not url.startswith(("file:", "data:"))] == []
    assert window.faults == []
    context.close()


@pytest.mark.parametrize(
    ("name", "n_figures"),
    [
        *((name, 0) for name in ("index", "tutorial", "keys", "reference", "seams", "packages")),
        ("notebooks/gallery", 16),
        ("notebooks/mission", 5),
        ("notebooks/comparison", 2),
    ],
)
def test_pages_show_their_figures_from_disk(opened: Any, name: str, n_figures: int) -> None:
    page = opened(f"{name}.html")
    widths = page.evaluate("() => [...document.images].map((image) => image.complete ? image.naturalWidth : 0)")
    assert len(widths) >= n_figures
    assert all(width > 0 for width in widths)
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
