"""Words that messages share."""


def counted(number, noun):
    """'1 point', '1,200 points'."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
