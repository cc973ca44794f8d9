"""Words that messages share."""

SHOWN = 60  # characters of a value in a message
LISTED = 200  # of the names that are allowed
LINE = 1200  # of a whole message: some name several paths


def counted(number, noun):
    """'1 point', '1,200 points'."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def printable(text):
    """The text as one line in which a terminal finds nothing to obey: what is not printable is escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c in "\n\t\r" else ascii(c)[1:-1] for c in text)


def short(text, most=SHOWN):
    """The text in one printable line of at most so many characters, its middle left out."""
    text = printable(str(text))
    end = most // 3
    return text if len(text) <= most else f"{text[: most - end - 5]} ... {text[-end:]}"


def shown(value, most=SHOWN):
    """A value as a message shows it: its repr in one short line."""
    try:
        return short(repr(value), most)
    except Exception:  # an integer of more than 4300 digits, or an object whose repr fails
        return f"a value of type {type(value).__name__} that is too long to show"


def listed(names):
    """'a, b, c', or 'a, b, c and 17 more'."""
    names = [short(name) for name in names]
    first = len(names)
    while first > 1 and len(", ".join(names[:first])) > LISTED:
        first -= 1
    return ", ".join(names[:first]) + (f" and {len(names) - first} more" if first < len(names) else "")
