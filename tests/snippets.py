"""What stands in the README and the documentation, run as it stands: the fenced blocks of a page,
in a small copy.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
FEWEST = 8  # values on an axis of a small workflow


def fenced(text, language):
    """The contents of the blocks that are fenced with this word."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def small(text):
    """The workflow with at most FEWEST values on each axis, refined no further than needed."""
    text = re.sub(r"num = (\d+)", lambda found: f"num = {min(int(found[1]), FEWEST)}", text)
    return re.sub(r"(width = ).*", r"\g<1>0.2", text)


def copy_workflows(folder):
    """Small copies of all workflows in `folder`/workflows, and an empty folder for their results."""
    (folder / "workflows").mkdir()
    (folder / "results").mkdir()
    for path in (ROOT / "workflows").glob("*.toml"):
        (folder / "workflows" / path.name).write_text(small(path.read_text()))
