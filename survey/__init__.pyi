"""What a type checker sees of the package: the names that `__init__.py` finds when they are asked for."""

from survey.analysis.edge import edge as edge
from survey.analysis.join import concat as concat
from survey.api import describe as describe
from survey.api import evaluate as evaluate
from survey.api import open as open
from survey.api import run as run
from survey.api import scenes as scenes
from survey.errors import BadInput as BadInput
from survey.errors import Damaged as Damaged
from survey.errors import Stopped as Stopped
from survey.errors import SurveyError as SurveyError
from survey.model.reader import Model as Model
from survey.request.user_scene import abel as abel
from survey.request.user_scene import floquet as floquet
from survey.request.user_scene import hill as hill
from survey.request.user_scene import orbit as orbit

__version__: str
