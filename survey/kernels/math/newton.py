"""Newton's method kept inside a bracket: the one loop for zeros that are simple and of whose sign
both ends are known.

Others differ in more than their function: `math.quartic.root` starts from parabolas and ends in
double-double, `cylinder.returns.solved` stops at the image of another orbit, or one that is
accurate enough, and keeps the last image; `nutation.wells.lowest` keeps its steps strictly inside.
Polishing a zero that is known already, by a fixed number of steps, needs no bracket.
"""

from survey.kernels.jit import inline


@inline
def bracketed(residual, solution, given, start, bracket, close, most):
    """The last x in `bracket` at which the residual was evaluated, and the next one, which is the
    zero.

    residual(solution, given, x) -> (value, slope, does the zero lie above x?). `solution` is a kernel that the
    residual calls: within the tuple `given` it would be called through a pointer. A step that leaves the bracket is
    replaced by its middle. The two are at most close[0] + close[1] |x| apart, or the same after `most` steps.
    """
    x, (low, high) = start, bracket
    for _ in range(most):
        value, slope, above = residual(solution, given, x)
        if above:
            low = x
        else:
            high = x
        new = x - value / slope if slope != 0.0 else low
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - x) <= close[0] + close[1] * abs(x):
            return x, new
        x = new
    return x, x
