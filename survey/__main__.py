"""`python -m survey` is the program `survey`."""

import os
import sys
from pathlib import Path

# Python puts the current folder first, which may contain an untrusted numpy.py; it moves last, if
# survey lies in it
if sys.path and sys.path[0] == os.getcwd():
    here = sys.path.pop(0)
    sys.path += [here] * (Path(__file__).parent.parent == Path(here))

from survey.cli import main

main()
