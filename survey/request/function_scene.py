"""What the scenes of a user's functions share: how they travel to other processes, and how they refuse."""

import html
import re
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from survey.errors import BadInput
from survey.scene import Parameter
from survey.wording import plain

_KEYS = re.compile(
    r"\b(PARAMETERS|PERIOD|EVEN|BREAKS|STATES|STRUCTURE|CONSERVED|START|CONTINUATION|REVERSED|HELD|TRANSVERSE|DAMPING)\b"
)
# Beginnings of those lines of numba's messages that do not say what is wrong.
CHATTER = (
    "Failed in",
    "During",
    "This error",
    "There are",
    "- Of which",
    "Overload",
    "File ",
    "Unknown",
    "^",
    "[1]",
)
_known = {}  # by hash: a worker process compiles a scene once, for all of its blocks


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FunctionScene:
    """Base of the scenes of a user's functions; `own`: the functions' parameters, `about`: the
    scene's docstring.
    """

    own: tuple[Parameter, ...]
    NAME: str
    TEXT: str
    HASH: str
    TITLE: str
    about: str
    REFERENCES: tuple[str, ...]

    def __post_init__(self):
        object.__setattr__(self, "__doc__", self.about)

    @property
    def PARAMETERS(self):
        """All parameters: those of the functions, unless a family adds its own."""
        return self.own

    def check(self, points: Any) -> None:
        """Raise BadInput if the functions are wrong at these points (N, n)."""
        raise NotImplementedError

    def __repr__(self):
        return "\n".join([self.TITLE, *(f"  {name}: {text}" for name, text in self._rows())])

    def _repr_html_(self):
        rows = "".join(
            f"<tr><th>{html.escape(name)}</th><td style='text-align:left'>{html.escape(plain(text))}</td></tr>"
            for name, text in self._rows()
        )
        title = html.escape(plain(self.TITLE))
        return f"<div class='tex2jax_ignore mathjax_ignore'><table><caption>{title}</caption>{rows}</table></div>"

    def _rows(self):
        """Yield (what, text) of the scene: what survey.evaluate takes and gives."""
        yield "scene", self.NAME
        for p in self.PARAMETERS:
            default = "" if p.default is None else f", default {p.default:g}"
            yield (
                p.name,
                f"{p.long_name}, {p.domain}{default}"
                if p.long_name != p.name
                else f"{p.domain}{default}",
            )
        for option in self.OPTIONS:
            yield option.name, f"{' | '.join(option.choices)} (default {option.default})"
        yield "outputs", ", ".join(dict.fromkeys(o.name for o in self.OUTPUTS))

    def __reduce__(self):
        return _restored, (
            type(self),
            self.HASH,
            {field.name: getattr(self, field.name) for field in fields(self)},
        )

    def _points(self, point):
        """The parameters of the functions at the points of a block (N, n), and the block's shape."""
        shape = np.broadcast_shapes(*(np.shape(values) for values in point.values()))
        columns = [np.broadcast_to(point[p.name], shape).reshape(-1) for p in self.own]
        return np.stack(columns, axis=1).astype(float), shape

    def _where(self, point):
        return ", ".join(f"{p.name} = {value:g}" for p, value in zip(self.own, point, strict=True))

    @property
    def _named(self):
        """How many parameters are named: one text, of several letters, is one name."""
        n, first = len(self.own), self.own[0].name
        return str(n) if n > 1 or len(first) == 1 else f"1 ({first!r}; several are ('a', 'b', ...))"

    def _refuse(self, what, remedy):
        raise refusal(self.NAME, f"{what}; {remedy}")

    def _refuse_name(self, call):
        """Refuse a function that takes p, or x, for a mapping."""
        if "x, p" in call:
            self._refuse(
                f"{call} accesses an array by a name, but x and p hold numbers",
                "write x[0], ..., p[0], ...",
            )
        self._refuse(
            f"{call} accesses a parameter by name, but p is an array", "write p[0], p[1], ..."
        )

    def _refuse_index(self, call, error):
        """Refuse a function that raised this IndexError, as `call` is written."""
        n = len(self.own)
        if "only integers" in str(error):
            self._refuse_name(call)
        self._refuse(
            f"{call} indexes beyond an array ({error})",
            f"PARAMETERS names {self._named}: p[0] to p[{n - 1}]",
        )


def refusal(name, message):
    """The BadInput of a scene."""
    return BadInput(f"{name}: {with_keys(name, message)}")


def with_keys(name, message):
    """The message with the keys of the scene: what its file calls EVEN is `even` to who gave it to
    `survey.hill`, and so on.
    """
    return message if name.endswith(".py") else _KEYS.sub(lambda key: key[0].lower(), message)


def reason(error):
    """The line of a many-line message that says what is wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return next((line for line in lines if not line.startswith(CHATTER)), type(error).__name__)


def _restored(kind, digest, values):
    """The scene with these values; the same object for the same hash, so that its kernels are
    compiled once.
    """
    return _known.setdefault(digest, kind(**values))
