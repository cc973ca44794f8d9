"""The columns of the rows that kernels and methods of the family "cylinder" fill, and its measures
read.

Angles are in radians; a name with _BAR is the error bound of the value named before it.
"""

# A solution in the order of the parameters: SIX of the system (columns B12 to S3 of `flow`), then
# its initial state; of a flow of one's own the further columns of its `program`, from BOUND_F on,
# follow. Of one on a separatrix the number of the saddle stands in the place of w0.
SIX = 6
PHI0, W0 = 6, 7
NUMBER = W0
GIVEN = 8
# A start: phi0 and w0, and what they may be off; an exact start: phi0 and w0 alone.
START_PHI, START_W, START_PHI_BAR, START_W_BAR = range(4)
START, EXACT_START = 4, 2
# A solution at a time.
PHI, W, PHI_BAR, W_BAR = range(4)
# A solution at an angle: w and t there, or phi and t of the turning point before it.
VALUE, TIME, VALUE_BAR, TIME_BAR = range(4)
STATE = 4
# A fate: verdict, row of the table of its limit, turning points and unwrapped turns of the limit,
# status; where g = 0 also the angle that is reached.
VERDICT, LIMIT, TURNINGS, NET_TURNS, STATUS, LIMIT_PHI, LIMIT_PHI_BAR = range(7)
RISING_FROM = NET_TURNS  # of a rotation that grows from turn to turn and needs cycles: its last |w|
FATE, FREE_FATE = 5, 7
