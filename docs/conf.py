"""Settings of the documentation site, which is built and read offline: ``python -m sphinx -W -b html docs site``."""

import os
import sys
from pathlib import Path
from typing import ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
# Kernels of notebooks are processes of their own, and document this checkout too.
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))

from missions.scenarios.explanations import explanations  # noqa: E402
from missions.sweeps.study import study_explanations  # noqa: E402
from remoras import __version__  # noqa: E402

project = "REMORAS"
author = "The REMORAS simulator authors"
version = release = __version__
language = "en_GB"

extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_nb"]
templates_path: list[str] = []
exclude_patterns = ["jupyter_execute"]

html_theme = "furo"
html_title = f"REMORAS {release}"
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False

# No math: nothing on a page asks for MathJax, which would come from the network. Dollars stay dollars.
myst_enable_extensions: list[str] = []
myst_heading_anchors = 3

nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 900  # seconds for a cell, on a busy machine
nb_output_stderr = "remove"  # progress, for terminals

# Several classes have a field "type", which annotations with the built-in type are then taken to mean.
suppress_warnings = ["ref.python"]

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
            listed += nodes.definition_list_item("", term, nodes.definition("", nodes.paragraph("", meaning)))
        return [listed]


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive ``keys``."""
    app.add_directive("keys", Keys)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
