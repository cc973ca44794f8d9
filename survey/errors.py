"""What can go wrong, and the exit code that says so."""

import shlex

from survey.wording import plain


class SurveyError(Exception):
    """A failure described in one line; `exit_code` is what the command returns."""

    exit_code = 4

    def __init__(self, *parts: object) -> None:
        super().__init__(*(plain(str(part)) for part in parts))  # it may quote an untrusted file

    def _render_traceback_(self, *_: object, **__: object) -> list[str]:
        """What IPython shows instead of a traceback: the line."""
        return [f"{type(self).__name__}: {self}"]


class BadInput(SurveyError, ValueError):
    """The input is refused before any work: the line names the key, the value, what is allowed and
    what to do.
    """

    exit_code = 2


class Untrusted(BadInput):
    """A survey's scene is a Python file that this user has not run here before; `text` is what would run."""

    def __init__(self, path: str, digest: str, text: str) -> None:
        super().__init__(
            f"scene = {path!r} is a Python file that you have not run here before, and points can only be solved "
            f"by running it; read it ({self.reading(path)}), and if you trust it, give --trust-scene, or in Python "
            "survey.open(path, trust_scene=True)"
        )
        self.path, self.digest, self.text = path, digest, text

    def __reduce__(self) -> tuple[object, ...]:
        return Untrusted, (self.path, self.digest, self.text)

    @staticmethod
    def reading(path: str) -> str:
        """The command that shows the file with its control characters escaped."""
        return f"cat -v -- {shlex.quote(path)}"


class Damaged(SurveyError):
    """A file is incomplete or its bits have changed."""

    exit_code = 3


class Stopped(SurveyError):
    """A worker, disk or scheduler failure stopped the run; finished blocks are safe."""

    exit_code = 4
