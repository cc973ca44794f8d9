"""What the scripts here share: their command line, and what they report as they run."""

import argparse
import sys
from pathlib import Path


def parser(doc, what):
    """Parser of a script's command line; its `output`, where `what` goes, is a folder that is made
    where none is.
    """
    words = argparse.ArgumentParser(description=doc.split("\n\n")[0])
    words.add_argument(
        "-o", "--output", default="results", metavar="DIR", type=_folder, help=f"folder for {what}"
    )
    return words


def _folder(text):
    path = Path(text)
    path.mkdir(parents=True, exist_ok=True)
    return path


def say(line):
    print(f"{Path(sys.argv[0]).stem}: {line}", file=sys.stderr)
