"""`python -m survey` is the program `survey`."""

import os
import sys
from pathlib import Path

# Python puts the current folder first, where a stranger's numpy.py may lie; it stays, last, if survey itself lies there
if sys.path and sys.path[0] == os.getcwd():
    here = sys.path.pop(0)
    sys.path += [here] * (Path(__file__).parent.parent == Path(here))

from survey.cli import main

main()
