"""What `FloquetScene` and `OrbitScene` share: functions that fill an array, and whose operations are recorded."""

import numpy as np

from survey.measures.floquet.system import Raised
from survey.measures.floquet.trace import Unsupported
from survey.request.function_scene import FunctionScene, reason


class TracedScene(FunctionScene):
    """A scene of functions that run as Python on numbers, and on symbols."""

    def _filled(self, function, arguments, shape):
        """The array of this shape that the function, run on numbers, fills or returns; NaN where it is undefined."""
        out = np.zeros(shape)
        with np.errstate(all="ignore"):
            try:
                value = getattr(function, "py_func", function)(*arguments, out)
            except (ArithmeticError, ValueError):
                return np.full(shape, np.nan)
        return out if value is None else np.asarray(value, dtype=float)

    def _tried(self, function, call, arguments, shape, sizes, what):
        """As `_filled`, but BadInput if the function fails; `sizes` says what it may index, `what` it must fill."""
        try:
            value = self._filled(function, arguments, shape)
        except IndexError as error:
            if "only integers" in str(error):
                self._refuse_index(call, error)
            self._refuse(f"{call} indexes beyond an array ({error})", sizes)
        except Exception as error:
            self._refuse(f"{call} fails ({type(error).__name__}: {reason(error)})", "correct it")
        if value.shape != shape:
            self._refuse(f"{call} returns an array of shape {value.shape}", f"it must fill out, {what}")
        return value

    def _called(self, function, *arguments):
        try:
            return function(*arguments)
        except Unsupported as error:
            self._refuse(str(error), "use + - * / ** and functions such as sin, exp, sqrt of math or numpy")
        except Raised as error:
            cause = error.__cause__
            self._refuse(f"{error} fails ({type(cause).__name__}: {reason(cause)})", "correct it")
