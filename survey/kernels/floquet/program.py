"""The power series of a matrix A(t) in many steps at once: those of its basis functions, operation by operation.

A matrix is a sum of `terms` (basis, row, column, number): number * basis function; `measures.floquet.trace` makes
it of a user's code. `operations` (count, 5) are the rows (code, a, b, first, last) of the basis functions: a and b
those that they are made of, first to last the rows (basis, number) of `inside` that a combination adds. The series
of a function h(y) follows from h' y': b is h', with the sign in `signs`; where y is linear in t its code is larger
by OF_LINE. A state of a nonlinear system x' = f(t, x) begins with the number a; first to last are the rows of `inside`
that make up its f, whose lower orders give its own (`measures.floquet.orbit`).

S[basis, n, lane] is the coefficient of tau^n, t = middle + tau * half; V[number, lane] are the numbers.

Source: A. Griewank, A. Walther, Evaluating Derivatives (2008), chapter 13.
"""

import math

from survey.kernels.jit import kernel

_NAMES = (
    "one time combination product quotient sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt "
    "erf state"
)
CODES = {name: code for code, name in enumerate(_NAMES.split())}
OF_LINE = 32
ONE, TIME, COMBINATION, PRODUCT, QUOTIENT, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH = range(13)
TANH, ASINH, ACOSH, ATANH, EXP, LOG, SQRT, ERF, STATE = range(13, 22)
BASIS, ROW, COLUMN, NUMBER = range(4)  # columns of `terms`


@kernel
def function(code, x):
    """The function of this code at x; NaN outside its domain."""
    if code == SIN:
        return math.sin(x)
    if code == COS:
        return math.cos(x)
    if code == TAN:
        return math.tan(x)
    if code == ASIN:
        return math.asin(x) if abs(x) <= 1.0 else math.nan
    if code == ACOS:
        return math.acos(x) if abs(x) <= 1.0 else math.nan
    if code == ATAN:
        return math.atan(x)
    if code == SINH:
        return math.sinh(x) if abs(x) < 700.0 else math.nan
    if code == COSH:
        return math.cosh(x) if abs(x) < 700.0 else math.nan
    if code == TANH:
        return math.tanh(x)
    if code == ASINH:
        return math.asinh(x)
    if code == ACOSH:
        return math.acosh(x) if x >= 1.0 else math.nan
    if code == ATANH:
        return math.atanh(x) if abs(x) < 1.0 else math.nan
    if code == EXP:
        return math.exp(x) if x < 709.0 else math.nan
    if code == LOG:
        return math.log(x) if x > 0.0 else math.nan
    if code == SQRT:
        return math.sqrt(x) if x >= 0.0 else math.nan
    return math.erf(x)


@kernel
def extend(operations, signs, inside, order, V, middle, half, S, n):
    """Fill S[:, n], order n of the basis functions in `order`, from the lower orders."""
    lanes = S.shape[2]
    for at in range(len(order)):
        i = order[at]
        code, a, b = operations[i, 0], operations[i, 1], operations[i, 2]
        own = S[i, n]
        if code == ONE:
            own[:] = 1.0 if n == 0 else 0.0
        elif code == TIME:
            for lane in range(lanes):
                own[lane] = middle[lane] if n == 0 else (half[lane] if n == 1 else 0.0)
        elif code == COMBINATION:
            own[:] = 0.0
            for k in range(operations[i, 3], operations[i, 4]):
                one, number = S[inside[k, 0], n], V[inside[k, 1]]
                for lane in range(lanes):
                    own[lane] += one[lane] * number[lane]
        elif code == STATE:
            if n == 0:
                own[:] = V[a]
            else:
                own[:] = 0.0
                for k in range(operations[i, 3], operations[i, 4]):
                    one, number = S[inside[k, 0], n - 1], V[inside[k, 1]]
                    for lane in range(lanes):
                        own[lane] += one[lane] * number[lane]
                for lane in range(lanes):
                    own[lane] *= half[lane] / n
        elif code == PRODUCT:
            own[:] = 0.0
            for k in range(n + 1):
                one, two = S[a, k], S[b, n - k]
                for lane in range(lanes):
                    own[lane] += one[lane] * two[lane]
        elif code == QUOTIENT:
            one, two = S[a, n], S[b, 0]
            own[:] = one
            for k in range(1, n + 1):
                below, before = S[b, k], S[i, n - k]
                for lane in range(lanes):
                    own[lane] -= below[lane] * before[lane]
            for lane in range(lanes):
                own[lane] /= two[lane]
        elif n == 0:
            plain = code if code < OF_LINE else code - OF_LINE
            for lane in range(lanes):
                own[lane] = function(plain, S[a, 0, lane])
        else:
            own[:] = 0.0
            for k in range(1, n + 1 if code < OF_LINE else 2):
                one, two = S[a, k], S[b, n - k]
                for lane in range(lanes):
                    own[lane] += k * one[lane] * two[lane]
            factor = signs[i] / n
            for lane in range(lanes):
                own[lane] *= factor
