"""Words that messages share."""


def counted(number, noun):
    """'1 point', '1,200 points'."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def sized(number):
    """'20 MiB', '1.5 GiB', '2,000 GiB': so many bytes."""
    for unit in ("KiB", "MiB", "GiB"):
        number /= 1024
        if number < 1000:
            break
    return f"{number:,.{1 if number < 10 else 0}f} {unit}"
