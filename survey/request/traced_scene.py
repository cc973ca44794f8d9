"""What `FloquetScene` and `OrbitScene` share: functions that fill an array, and whose operations
are recorded.
"""

import dis

import numpy as np

from survey.measures.floquet.system import Raised
from survey.measures.floquet.trace import Unsupported
from survey.request.function_scene import FunctionScene, reason


def rebinds(function):
    """Does the function, of Python, assign to the name of its last argument, which leaves the array
    as it was?
    """
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    if code is None or not code.co_argcount:
        return False
    last = code.co_varnames[code.co_argcount - 1]
    return any(
        i.opname.startswith("STORE_FAST") and last in np.atleast_1d(i.argval)
        for i in dis.get_instructions(code)
    )


class TracedScene(FunctionScene):
    """A scene of functions that run as Python on numbers, and on symbols."""

    def _filled(self, function, arguments, shape):
        """The array of this shape that the function, run on numbers, fills or returns; NaN where it
        is undefined.
        """
        out = np.zeros(shape)
        with np.errstate(all="ignore"):
            try:
                value = getattr(function, "py_func", function)(*arguments, out)
            except (ArithmeticError, ValueError):
                return np.full(shape, np.nan)
        return out if value is None else np.asarray(value, dtype=float)

    def _elsewhere(self, points):
        """Other parameters near these (N, n), where none is special, as far as their domains reach."""
        moved = 1.07 * points + 0.31 + 0.01 * np.arange(points.shape[1])
        inside = np.stack([p.holds(moved[:, k]) for k, p in enumerate(self.own)], axis=1)
        return np.where(inside, moved, points)

    def _of(self, function, arguments, shape):
        """As `_filled`, but NaN where the function fails in any way."""
        try:
            return self._filled(function, arguments, shape)
        except (Exception, SystemExit):
            return np.full(shape, np.nan)

    def _again(self, function, call, arguments, shape):
        """As `_filled`, but BadInput, naming the time, if the function fails there, though not where
        it was tried first.
        """
        try:
            return self._filled(function, arguments, shape)
        except (Exception, SystemExit) as error:
            why = f"{type(error).__name__}: {reason(error)}"
            self._refuse(f"{call} fails at t = {arguments[0]:g} ({why})", "correct it")

    def _tried(self, function, call, arguments, shape, sizes, what):
        """As `_filled`, but BadInput if the function fails; `sizes` says what it may index, `what`
        it must fill.
        """
        try:
            value = self._filled(function, arguments, shape)
        except IndexError as error:
            if "only integers" in str(error):
                self._refuse_name(call)
            self._refuse(f"{call} indexes beyond an array ({error})", sizes)
        except (Exception, SystemExit) as error:
            if isinstance(error, AttributeError) and "'numpy.ndarray'" in str(error):
                self._refuse_name(call)
            if isinstance(error, TypeError) and "'complex'" in str(error):
                self._refuse(
                    f"{call} fills in a complex number",
                    "write real and imaginary parts as two states",
                )
            self._refuse(f"{call} fails ({type(error).__name__}: {reason(error)})", "correct it")
        if value.shape != shape:
            self._refuse(
                f"{call} returns an array of shape {value.shape}", f"it must fill out, {what}"
            )
        return value

    def _defined(self, name, function, point):
        """Refuse the function of this name if it fails at the point."""
        try:
            function(point)
        except (Exception, SystemExit) as error:
            self._refuse(f"{name}(p) fails ({type(error).__name__}: {reason(error)})", "correct it")

    def _called(self, function, *arguments):
        try:
            return function(*arguments)
        except Unsupported as error:
            self._refuse(str(error), error.remedy)
        except Raised as error:
            cause = error.__cause__
            self._refuse(f"{error} fails ({type(cause).__name__}: {reason(cause)})", "correct it")
