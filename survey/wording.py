"""Words that messages share, and strangers' words made harmless."""

import unicodedata

SHOWN = 60  # characters of a value in a message
LISTED = 200  # of the names that are allowed
LINE = 1200  # of a whole message: some name several paths


def counted(number, noun):
    """'1 point', '1,200 points'."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def plain(text, most=LINE, lines=False):
    """The text with all that a terminal would obey, or no reader see, written out, such as \\x1b; its middle cut out
    where it is longer than `most` characters. Ends of lines are kept if `lines`.
    """
    if len(text) > most:
        half = most // 2
        text = f"{text[:half]} [... {len(text) - 2 * half:,} characters ...] {text[-half:]}"
    if text.isprintable():
        return text
    return "".join(c if _is_seen(c) or (lines and c == "\n") else c.encode("unicode_escape").decode() for c in text)


def short(text, most=SHOWN):
    """The text in one plain line of at most so many characters, its middle left out."""
    text = plain(str(text), LINE)
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


def _is_seen(character):
    return character.isprintable() or unicodedata.category(character) == "Zs"
