"""Sphinx's configuration; `build.py` beside this file assembles the pages and calls it. No network
is needed.
"""

import re
import sys
from pathlib import Path

import numpy.typing as npt
from docutils import nodes
from sphinx.util.typing import stringify_annotation

sys.path.insert(0, str(Path(__file__).parent))
import formulas

import survey.api  # so that the API pages show what users call  # noqa: F401

project = "survey"
author = "the survey founders"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx_click"]
mathjax_path = "mathjax/tex-svg.js"  # one file, without a network: see static/mathjax
mathjax3_config = {"svg": {"fontCache": "none"}, "options": {"enableMenu": False}}
html_theme = "furo"
html_title = "survey"
html_static_path = ["static"]
html_css_files = ["survey.css"]
html_show_copyright = False
html_copy_source = False
exclude_patterns = ["results/README.md"]
smartquotes = False  # y'' is no quotation
default_role = "code"
nitpicky = False
myst_heading_anchors = 3
myst_enable_extensions = ["deflist", "dollarmath"]
nb_execution_mode = "off"  # nbmake has executed them: see build.py
autodoc_typehints = "signature"
autodoc_preserve_defaults = True


ARRAY_LIKE = stringify_annotation(npt.ArrayLike, "smart")


def setup(app):
    app.connect("doctree-read", _as_written)
    app.connect("autodoc-process-docstring", _plain)
    app.connect("autodoc-process-signature", _short)


def _as_written(app, doctree):
    r"""Displayed formulas go to MathJax as they are: Sphinx would put several lines into `split`,
    which has no \tag.
    """
    for node in doctree.findall(nodes.math_block):
        node["no-wrap"] = node["nowrap"] = True  # the second until Sphinx 8.2
        node[:] = [nodes.Text(rf"\[{node.astext()}\]")]


def _plain(app, what, name, thing, options, lines):
    """Docstrings are plain text: formulas are typeset, bars are no markup; those of modules stand
    as they are.
    """
    if what == "module":
        lines[:] = ["::", "", *(f"   {line}" for line in lines), ""]
        return
    out, section = [], ""
    for line in lines:
        line = formulas.typeset(re.sub(r"(`[^`]+`)(?=\w)", r"\1\\ ", line)).replace("|", r"\|")
        entry = re.match(r"(\*{0,2}\w+(?:, \w+)*) : (.*)", line)
        if re.fullmatch("-{3,}", line):
            section = out.pop()
            out += [f"**{section}**", ""]
        elif section == "Parameters" and entry:
            out += ["", f"* ``{entry[1]}``: {entry[2]}"]
        elif section == "Parameters" and line.startswith("    "):
            out.append(line[2:])
        else:
            out.append(line)
    lines[:] = out


def _short(app, what, name, thing, options, signature, returns):
    """What numpy calls ArrayLike is called so."""
    return signature and signature.replace(ARRAY_LIKE, "ArrayLike"), returns
