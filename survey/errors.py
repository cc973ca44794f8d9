"""What can go wrong, and the exit code that says so."""

from survey.wording import LINE, short


class SurveyError(Exception):
    """A failure that is told in one line; `exit_code` is what the command returns."""

    exit_code = 4

    def __init__(self, *said: object) -> None:
        super().__init__(*(short(part, LINE) for part in said))  # whatever a file or a name brings into it


class BadInput(SurveyError, ValueError):
    """The input is refused before any work: the line names the key, the value, what is allowed, what to do."""

    exit_code = 2


class Damaged(SurveyError):
    """A file is incomplete or its bits have changed."""

    exit_code = 3


class Stopped(SurveyError):
    """A worker, disk or scheduler failure stopped the run; finished blocks are safe."""

    exit_code = 4
