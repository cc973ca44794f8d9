r"""Formulas of the pages as SVG pictures drawn by matplotlib: neither LaTeX nor a network is needed.

A Sphinx extension: `$...$` in the text, `$$...$$` on lines of its own.
"""

import html
import io
import re

from docutils import nodes

FONT, EM = "cm", 10.0  # size in points at which formulas are drawn; the page scales them to its own


def setup(app):
    app.add_html_math_renderer("drawn", (_inline, None), (_display, None))
    return {"parallel_read_safe": True}


def svg(formula):
    """The picture of a formula, as tall and as deep below the line as its letters ask for."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import MathTextParser, math_to_image

    text = f"${' '.join(formula.split())}$"
    font, out = FontProperties(size=EM, math_fontfamily=FONT), io.StringIO()
    math_to_image(text, out, prop=font, format="svg")
    _, _, depth, *_ = MathTextParser("path").parse(text, prop=font)
    picture = out.getvalue()[out.getvalue().index("<svg") :].strip()
    width, height = (float(re.search(rf'{name}="([\d.]+)pt"', picture)[1]) for name in ("width", "height"))
    sizes = f"width: {width / EM:.3f}em; height: {height / EM:.3f}em; vertical-align: {-depth / EM:.3f}em"
    picture = re.sub(r' (width|height)="[\d.]+pt"', "", picture, count=2)
    for other in (r"<metadata>.*?</metadata>", r'<g id="patch_1">.*?</g>', r"<!--.*?-->"):  # a white ground
        picture = re.sub(other, "", picture, flags=re.DOTALL)
    words = f'<svg role="img" aria-label="{html.escape(formula)}" style="{sizes}; fill: currentColor"'
    return picture.replace("<svg", words, 1)


def _inline(visitor, node):
    visitor.body.append(svg(node.astext()))
    raise nodes.SkipNode


def _display(visitor, node):
    visitor.body.append(f'<div class="formula">{svg(node.astext())}</div>')
    raise nodes.SkipNode
