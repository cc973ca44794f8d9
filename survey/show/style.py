"""The styles of pictures: for the screen, or for papers in column widths."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from survey import modules
from survey.errors import BadInput


@dataclass(frozen=True)
class Style:
    """A style: figure sizes in inches by width, and settings of matplotlib."""

    sizes: Mapping[str, tuple[float, float]]
    dpi: int
    paper: bool = False
    rc: Mapping[str, object] = field(default_factory=dict)


_WIDE = (7.2, 5.2)
_RC = {
    "text.usetex": False,
    "axes.formatter.use_mathtext": True,
}  # an untrusted file must not reach LaTeX, which reads and writes files
STYLES = {
    "screen": Style({"single": _WIDE, "double": _WIDE}, 150, rc=_RC),
    # columns of 85 and 175 mm; fonts are embedded as TrueType (42), as journals ask
    "paper": Style({"single": (3.35, 2.9), "double": (6.89, 4.4)}, 600, True, _RC | {
        "font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 9, "axes.labelsize": 9,
        "xtick.labelsize": 8, "ytick.labelsize": 8, "axes.linewidth": 0.6, "xtick.major.width": 0.6,
        "ytick.major.width": 0.6, "hatch.linewidth": 0.35, "pdf.fonttype": 42, "ps.fonttype": 42,
        "svg.fonttype": "none",
    }),
}  # fmt: skip
WIDTHS = ("single", "double")


def style_named(style):
    """The Style of this name (None: for the screen); raises BadInput for an unknown one."""
    if style is not None and style not in STYLES:
        raise BadInput(modules.unknown("style", style, list(STYLES)))
    return STYLES[style or "screen"]


def figure_size(style, width):
    """(width, height) in inches; raises BadInput for an unknown width."""
    if width not in WIDTHS:
        raise BadInput(modules.unknown("width", width, list(WIDTHS)))
    return style_named(style).sizes[width]
