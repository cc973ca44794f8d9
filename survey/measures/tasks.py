"""How the tasks of a measure are run: `each(task, items, what)`, wherever a measure takes an
`each`.

It returns [task(item) for item in items]; tasks may run in any order, and on threads. `what` names
the items for reports of progress, such as "parts of the edges".
"""


def in_turn(task, items, what=""):
    """The tasks one after another: what measures do unless their caller says otherwise."""
    return [task(item) for item in items]
