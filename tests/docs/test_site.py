"""The documentation builds as a site: without a warning, whole, with its notebooks executed, and readable offline."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import remoras
from missions.scenarios.explanations import explanations
from missions.sweeps.study import study_explanations

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS).with_suffix("").as_posix() for path in DOCS.rglob("*.md"))
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.md"))
FETCHED = re.compile(
    r"""<(?:script|img|iframe|source)\b[^>]*\bsrc\s*=\s*["']?(?:https?:)?//|<link\b[^>]*\bhref\s*=\s*["']?(?:https?:)?//""",
    re.IGNORECASE,
)
FETCHED_BY_STYLE = re.compile(r"""@import\s+["'](?:https?:)?//|url\(\s*["']?(?:https?:)?//""", re.IGNORECASE)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as users are told to; -W makes every warning an error."""
    pytest.importorskip("sphinx")
    folder = tmp_path_factory.mktemp("documentation")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    built = subprocess.run(
        [*command, "-d", str(folder / "trees"), str(DOCS), str(folder / "site")],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert built.returncode == 0, built.stderr
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
    cells = notebook.read_text(encoding="utf-8").count("```{code-cell}")
    assert cells >= 3
    assert html.count("cell_input") >= cells
    assert html.count("cell_output") >= cells - 1
    assert "Traceback" not in html


def test_the_reference_has_every_public_name(site: Path) -> None:
    html = (site / "reference.html").read_text(encoding="utf-8")
    assert [name for name in remoras.__all__ if f'id="remoras.{name}"' not in html] == []


def test_the_reference_has_every_key(site: Path) -> None:
    text = re.sub(r"<[^>]+>", "", (site / "reference.html").read_text(encoding="utf-8"))
    known = explanations() | study_explanations()
    assert len(known) > 100
    assert [key for key in known if f"{key}  (" not in text] == []
