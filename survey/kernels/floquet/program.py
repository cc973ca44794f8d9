"""The power series of a matrix A(t) in many steps at once: those of its basis functions, operation
by operation.

A matrix is a sum of `terms` (BASIS, ROW, COLUMN, NUMBER), sorted by rows: number * basis function;
`measures.floquet.trace` makes it of a user's code. `operations` (count, OPERATION) are the rows of
the basis functions: LEFT and RIGHT those that they are made of, FIRST to LAST the rows of `inside`
(ADDED, FACTOR) that a combination adds. The series of a function h(y) follows from h' y': RIGHT is
h', with the sign in `signs`; where y is linear in t its code is larger by OF_LINE. A state of a
nonlinear system x' = f(t, x) begins with the number LEFT; FIRST to LAST are the rows of `inside`
that make up its f, whose lower orders give its own (`measures.floquet.orbit`).

S[basis, n, lane] is the coefficient of tau^n, t = middle + tau * half; V[number, lane] are the
numbers.

Source: A. Griewank, A. Walther, Evaluating Derivatives (2008), chapter 13.
"""

from survey.kernels.jit import part
from survey.kernels.math.functions import NAMES, function

ONE, TIME, COMBINATION, PRODUCT, QUOTIENT, FUNCTIONS = range(6)  # the last: of the first of NAMES
STATE = FUNCTIONS + len(NAMES)
CODES = {
    "one": ONE,
    "time": TIME,
    "combination": COMBINATION,
    "product": PRODUCT,
    "quotient": QUOTIENT,
}
CODES |= {"state": STATE} | {name: FUNCTIONS + k for k, name in enumerate(NAMES)}
OF_LINE = 32
BASIS, ROW, COLUMN, NUMBER = range(4)  # columns of `terms`
TERM = 4
CODE, LEFT, RIGHT, FIRST, LAST = range(5)  # of `operations`
OPERATION = 5
ADDED, FACTOR = range(2)  # of `inside`: a basis function, and the number before it


@part
def extend(operations, signs, inside, order, V, middle, half, S, n):
    """Fill S[:, n], order n of the basis functions in `order`, from the lower orders."""
    lanes = S.shape[2]
    for at in range(len(order)):
        i = order[at]
        code, a, b = operations[i, CODE], operations[i, LEFT], operations[i, RIGHT]
        own = S[i, n]
        if code == ONE:
            own[:] = 1.0 if n == 0 else 0.0
        elif code == TIME:
            for lane in range(lanes):
                own[lane] = middle[lane] if n == 0 else (half[lane] if n == 1 else 0.0)
        elif code == COMBINATION:
            own[:] = 0.0
            for k in range(operations[i, FIRST], operations[i, LAST]):
                one, number = S[inside[k, ADDED], n], V[inside[k, FACTOR]]
                for lane in range(lanes):
                    own[lane] += one[lane] * number[lane]
        elif code == STATE:
            if n == 0:
                for lane in range(lanes):
                    own[lane] = V[a, lane]
            else:
                own[:] = 0.0
                for k in range(operations[i, FIRST], operations[i, LAST]):
                    one, number = S[inside[k, ADDED], n - 1], V[inside[k, FACTOR]]
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
            for lane in range(lanes):
                own[lane] = one[lane]
            for k in range(1, n + 1):
                below, before = S[b, k], S[i, n - k]
                for lane in range(lanes):
                    own[lane] -= below[lane] * before[lane]
            for lane in range(lanes):
                own[lane] /= two[lane]
        elif n == 0:
            plain = (code if code < OF_LINE else code - OF_LINE) - FUNCTIONS
            for lane in range(lanes):
                own[lane] = function(plain, S[a, 0, lane])
        elif code >= OF_LINE:
            one, two, factor = S[a, 1], S[b, n - 1], signs[i] / n
            for lane in range(lanes):
                own[lane] = one[lane] * two[lane] * factor
        else:
            own[:] = 0.0
            for k in range(1, n + 1):
                one, two = S[a, k], S[b, n - k]
                for lane in range(lanes):
                    own[lane] += k * one[lane] * two[lane]
            factor = signs[i] / n
            for lane in range(lanes):
                own[lane] *= factor
