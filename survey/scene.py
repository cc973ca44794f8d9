"""The classes with which a scene describes itself: parameters, options, outputs, and requests."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

MANY = 1000  # values of which the least and the greatest are found sooner than all are compared


@dataclass(frozen=True)
class Parameter:
    """A real number of the system: an axis of a survey or one fixed value.

    `symbol` is TeX. `default=None` means that it must be given. `excluded` and open ends are not part of the domain;
    outputs whose names begin with `but_for` exist at the excluded values too.
    `instead_of` names the parameter that this one replaces when it is given. `when` holds the option
    values for which the parameter exists ("": where the option does not). An axis of an `uncut` parameter is never cut
    into blocks. One that is `number_option` may also stand among the options, as one number; a `whole` one is an
    integer.
    """

    name: str
    long_name: str
    symbol: str
    units: str = "1"
    default: float | None = None
    minimum: float = -inf
    maximum: float = inf
    open_minimum: bool = False
    open_maximum: bool = False
    excluded: tuple[float, ...] = ()
    but_for: str = ""
    instead_of: str | None = None
    when: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    uncut: bool = False
    number_option: bool = False
    whole: bool = False

    def holds(self, values: npt.ArrayLike, outputs: Collection[str] = ()) -> npt.NDArray[np.bool_]:
        """True where `values` (any shape) lie in the domain, that of `outputs` alone if these are
        given.

        NaN and infinities do not.
        """
        values = np.asarray(values, dtype=float)
        above = self.open_minimum or self.minimum == -inf
        below = self.open_maximum or self.maximum == inf
        inside = values > self.minimum if above else values >= self.minimum
        inside &= values < self.maximum if below else values <= self.maximum
        if self.whole:
            inside = inside & (values == np.floor(values))
        if self.excluded and not (
            self.but_for and outputs and all(name.startswith(self.but_for) for name in outputs)
        ):
            for value in self.excluded:
                inside = inside & (values != value)
        return inside

    def holds_all(self, values: npt.NDArray[np.float64], outputs: Collection[str] = ()) -> bool:
        """Do all `values` (any shape) lie in the domain of `holds`?"""
        if values.size > MANY and not self.whole and not self.excluded:
            values = np.array([values.min(), values.max()])  # an interval; NaN if there is one
        return bool(self.holds(values, outputs).all())

    @property
    def domain(self) -> str:
        """The domain in words, such as `0 <= k <= 10, k != 1`."""
        low = (
            f"{self.minimum:g} {'<' if self.open_minimum else '<='} " if self.minimum > -inf else ""
        )
        high = (
            f" {'<' if self.open_maximum else '<='} {self.maximum:g}" if self.maximum < inf else ""
        )
        words = [f"{low}{self.name}{high}"] if low or high else []
        words += [f"{self.name} != {value:g}" for value in self.excluded]
        words += ["a whole number"] * self.whole
        if self.but_for:
            words[-1] += f" (there request the variables {self.but_for}* alone)"
        return ", ".join(words) or "any finite number"


@dataclass(frozen=True)
class Option:
    """A switch of the scene; the first choice is the default unless `default` says otherwise.

    It exists only with the parameter `only_with`, only where other options have the values that
    `when` allows, and not beside the parameter `replaced_by`, which specifies the same.
    """

    name: str
    choices: tuple[str, ...]
    long_name: str
    default: str = ""
    only_with: str = ""
    replaced_by: str = ""
    when: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "default", self.default or self.choices[0])


@dataclass(frozen=True)
class Output:
    """A result per point. A float comes with `NAME_error`; one with `flags` is an int8 code, else
    an int32 count.

    `applies` states when the output applies; where it does not, a float is NaN and an integer is
    `fill`. `dims` names extra (padded) dimensions, whose coordinates are the scene's `DIMENSIONS`.
    One that is `on_request` is given only if it is named.
    """

    name: str
    long_name: str
    symbol: str = ""
    units: str = "1"
    flags: Mapping[str, int] | None = None
    integer: bool = False
    fill: int = -1
    applies: str = ""
    when: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    dims: tuple[str, ...] = ()
    on_request: bool = False

    @property
    def dtype(self) -> np.dtype[Any]:
        if self.flags is not None:
            return np.dtype("int8")
        return np.dtype("int32") if self.integer else np.dtype("float64")


@dataclass(frozen=True)
class Request:
    """What is asked at every point of a survey: option values, method, accuracy and the requested
    outputs.

    `out` holds the arrays in which these are stored, in the block's shape; a scene may fill some of
    them itself and return them, or take no notice.
    """

    options: Mapping[str, str]
    method: str = "auto"
    rtol: float = 1e-10
    variables: frozenset[str] = frozenset()
    lines: Mapping[str, tuple[int, float, float]] = field(default_factory=dict)
    fixed: frozenset[str] = frozenset()
    ranges: Mapping[str, tuple[int, float, float]] = field(default_factory=dict)
    out: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict, compare=False, repr=False)

    def line(self, name: str) -> tuple[int, float, float] | None:
        """(number, least, greatest) of the full axis of the parameter `name`, which no other
        shares; or None.

        What depends on an axis depends on all of it, never on the block, so that the bits do not
        depend on blocks.
        """
        return self.lines.get(name)


@dataclass(frozen=True)
class Trajectory:
    """One point solved in time: `data` as xarray.Dataset takes it, {name: (dimensions, values,
    attributes)}, and how `survey.show.portrait` draws it: `panels`, each its kind and the names of
    the variables that it shows.
    """

    data: Mapping[str, tuple[Any, ...]]
    panels: tuple[tuple[str, ...], ...]


def plus_minus(value: Any, bar: Any) -> str:
    """A value with its error bar, in few digits."""
    return f"{float(value):.6g} +- {float(bar):.1g}"


def named(answer: Any, name: str) -> str:
    """`name = value +- bar` of an output that is known at a point."""
    return f"{name} = {plus_minus(answer[name], answer[f'{name}_error'])}"


def condition(scene: Any, when: Mapping[str, tuple[str, ...]], own: str = "") -> str:
    """When the parameter `own` exists, in words: `; only with l; only when question = fate |
    portrait`; or nothing.
    """
    words = []
    options = {option.name: option for option in scene.OPTIONS}
    for name, allowed in when.items():
        beside = options[name].only_with
        if not any(allowed):
            words.append(f"without {beside or name}")
        elif beside and set(allowed) == set(options[name].choices):
            words += [f"with {beside}"] * (beside != own)
        else:
            words.append(f"when {name} = {' | '.join(allowed)}")
    return "".join(f"; only {word}" for word in words)


def exists(item: Parameter | Output | Option, options: Mapping[str, str]) -> bool:
    """Does this parameter or output exist under these option values?"""
    return all(options.get(name, "") in allowed for name, allowed in item.when.items())


def existing_outputs(scene: Any, options: Mapping[str, str]) -> tuple[Output, ...]:
    """The Outputs of a scene that exist under these option values."""
    return _existing_outputs(scene, tuple(options.items()))


@lru_cache(maxsize=64)
def _existing_outputs(scene: Any, options: tuple[tuple[str, str], ...]) -> tuple[Output, ...]:
    return tuple(output for output in scene.OUTPUTS if exists(output, dict(options)))
