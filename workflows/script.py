"""What these scripts share: their command line and progress messages."""

import argparse
import sys
from pathlib import Path


def parser(doc, what):
    """Parser of a script's command line; its `output`, the folder for `what`, is created if necessary."""
    options = argparse.ArgumentParser(description=doc.splitlines()[0])
    options.add_argument("-o", "--output", default="results", metavar="DIR", type=_folder, help=f"folder for {what}")
    return options


def _folder(text):
    path = Path(text)
    path.mkdir(parents=True, exist_ok=True)
    return path


def say(line):
    """Report progress on stderr."""
    print(f"{Path(sys.argv[0]).stem}: {line}", file=sys.stderr)
