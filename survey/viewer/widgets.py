"""Pieces of the page: HTML, and models of bokeh."""

import html
import io
import re
from base64 import b64encode

from bokeh.models import CustomJSTickFormatter

from survey.show.boundaries import CURVES
from survey.show.text import MAX_TEXT, formula
from survey.viewer import raster
from survey.viewer.shown import short
from survey.wording import plain

ENTRY = "white-space:nowrap;margin-right:14px"
SWATCH = "display:inline-block;width:13px;height:13px;border:1px solid #555;vertical-align:-2px;margin-right:5px"
HOLLOW = {"fill_alpha": 0, "line_width": 2.5}
IMAGE = {key: key for key in ("image", "x", "y", "dw", "dh")} | {"level": "image"}
LABEL = {
    "x": 0, "y": 0, "text": "", "visible": False, "text_font_size": "12px", "text_line_height": 1.35, "padding": 6,
    "background_fill_color": "white", "background_fill_alpha": 0.92, "border_line_color": "#888888",
}  # fmt: skip
COPYING = """
navigator.clipboard.writeText(copy.tags[0]).then(() => { copy.label = "Copied" },
                                                 () => { copy.label = "Select it below and copy it" })
"""
MARKERS = {"D": "diamond", "o": "circle"}


def curve(plot, name):
    """A renderer of the boundaries of a class, drawn as in `survey.show.boundaries`."""
    _, line = CURVES[name]
    if "marker" in line:
        style = {
            "marker": MARKERS[line["marker"]],
            "size": 1.6 * line["ms"],
            "line_color": line["mec"],
        }
        return plot.scatter("x", "y", source={"x": [], "y": []}, fill_color=line["mfc"], **style)
    dash = "solid" if line["ls"] == "-" else list(line["ls"][1])
    style = {"line_dash": dash, "line_width": 1.5 * line["lw"], "line_color": line["color"]}
    return plot.multi_line("x", "y", source={"x": [], "y": []}, **style)


def legend(entries):
    """HTML of entries (kind, colour, text after it)."""
    return "".join(
        f"<span style='{ENTRY}'><span style='{SWATCH};background:{_swatch(kind, colour)}'></span>"
        f"{html.escape(literal(kind.replace('_', ' ')))}{after}</span> "
        for kind, colour, after in entries
    )


def _swatch(kind, colour):
    if kind not in raster.NO_ANSWER:
        return colour
    lines = [
        f"repeating-linear-gradient({angle}deg,#777 0 1px,transparent 1px 4px)"
        for angle in (45, 135)
    ]
    return ",".join(lines[: 2 if kind == "failed" else 1]) + ",white"


def picture(drawn):
    """A matplotlib figure as HTML."""
    file = io.BytesIO()
    drawn.savefig(file, format="png", dpi=150)
    return f"<img class='motion' style='width:100%' src='data:image/png;base64,{b64encode(file.getvalue()).decode()}'>"


def labels(values):
    """A slider's formatter, from positions to the values there."""
    return CustomJSTickFormatter(
        args={"values": [short(value) for value in values]}, code="return values[tick]"
    )


def literal(text):
    """Text from a file for bokeh: nothing in it is TeX, which bokeh finds between $$, \\( and \\[."""
    return re.sub(r"([$\\])(?=[$(\[])", r"\1 ", plain(str(text), MAX_TEXT))


def text_of(path, digest, text):
    """HTML of a scene's file, for a reader who must decide whether it may run: nothing is hidden."""
    style = "max-height:360px;overflow:auto;background:#f4f4f4;border:1px solid #888;padding:6px;white-space:pre-wrap"
    content = html.escape(plain(text, len(text), lines=True))
    return (
        f"<b>{html.escape(plain(path))}</b><br>sha256 {digest}<pre style='{style}'>{content}</pre>"
    )


def code(text):
    """HTML of a few lines of Python, to be selected."""
    style = "background:#f4f4f4;padding:6px;white-space:pre-wrap;user-select:all"
    return f"<pre style='{style}'>{html.escape(plain(text, len(text), lines=True))}</pre>"


def label(variable, tex=True):
    """`long name, symbol (unit)`."""
    symbol = variable.attrs.get("symbol", "")
    units = literal(variable.attrs.get("units", "1"))
    text = literal(variable.attrs.get("long_name", variable.name))
    if (
        symbol
        and tex
        and not re.search(r"[\\${}^~]", text + units)
        and formula(symbol, "") == f"${symbol}$"
    ):
        text = re.sub(r"([_%&#])", r"\\\1", text) + f", $${symbol}$$"  # TeX reads the text, too
    return text + ("" if units in ("1", "") else f" ({units})")
