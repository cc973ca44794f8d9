"""Words that messages share, and strangers' words made harmless."""

import unicodedata

MOST = 2000  # characters of a message


def counted(number, noun):
    """'1 point', '1,200 points'."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def plain(text, most=MOST, lines=False):
    """The text with all that a terminal would obey, or no reader see, written out, such as \\x1b; its middle cut out
    where it is longer than `most` characters. Ends of lines are kept if `lines`.
    """
    if len(text) > most:
        half = most // 2
        text = f"{text[:half]} [... {len(text) - 2 * half:,} characters ...] {text[-half:]}"
    if text.isprintable():
        return text
    return "".join(c if _is_seen(c) or (lines and c == "\n") else c.encode("unicode_escape").decode() for c in text)


def _is_seen(character):
    return character.isprintable() or unicodedata.category(character) == "Zs"
