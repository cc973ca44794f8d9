"""The server behind `survey view`: on the loopback interface, and only for whoever has the token.

The token comes first in the path of the address, so that a request without it finds neither page
nor socket.
"""

import asyncio
import html
import logging
import secrets
import socket
import tempfile
import webbrowser
from contextlib import contextmanager, nullcontext
from urllib.parse import urlsplit

from survey.errors import BadInput
from survey.request import trust
from survey.viewer.shown import ShownMap
from survey.wording import counted, short

try:
    from bokeh.application import Application
    from bokeh.application.handlers import FunctionHandler
    from bokeh.server.server import Server
    from tornado.web import RequestHandler

    from survey.viewer.page import Page
except ModuleNotFoundError as error:
    needed = error.name.partition(".")[0]
    raise BadInput(f"survey view needs the package {needed}: pip install {needed}") from None

HOST = "127.0.0.1"  # loopback: no other machine reaches it


def serve(path, port, link="", say=print, browser=False, trust_scene=False):
    """Serve the survey in the file `path` to this machine, until interrupted (Ctrl-C).

    `link` is the address of an earlier view, or its query; that view is opened, also in the user's
    browser if `browser`. `say` is called with lines for the user. `trust_scene`: an untrusted scene
    may run. Raises BadInput, Damaged.
    """
    shown = ShownMap(path)
    if trust_scene:
        trust.allow(shown.ds.attrs.get("scene_hash", ""))
    query = urlsplit(link).query if "?" in link else link
    if query and "=" not in query:
        raise BadInput(
            f"--link {short(link)}: this is not the address of a view; copy it from the browser"
        )
    query = f"?{shown.link(shown.read(query))}" if query else ""

    async def run():
        server, address = start(shown, port)
        say(f"{path}: {counted(shown.ds.status.size, 'point')} at {address}{query}")
        say(
            "Only this machine can reach it, and only with the token in that address. Ctrl-C stops it."
        )
        at = urlsplit(address).port
        say(
            f"From another machine: ssh -L {at}:{HOST}:{at} THIS_MACHINE, and open the same address there."
        )
        with _redirect(address + query) if browser else nullcontext() as page:
            if browser:
                webbrowser.open(page)
            try:
                await asyncio.Event().wait()
            finally:
                logging.disable()  # whatever is interrupted now need not be reported
                server.stop()

    try:
        asyncio.run(run())
    except KeyboardInterrupt:
        say("stopped")


def start(shown, port):
    """(server, its address with a new token), on the running event loop; raises BadInput if the
    port is taken.
    """
    token, port = secrets.token_urlsafe(24), port or _free()
    try:
        server = Server(
            {"/": Application(FunctionHandler(lambda document: Page(shown, document)))},
            address=HOST, port=port, prefix=token, allow_websocket_origin=[f"{HOST}:{port}", f"localhost:{port}"],
            sign_sessions=True, secret_key=secrets.token_urlsafe(48), use_index=False, ico_path="none",
            default_handler_class=Refused,
        )  # fmt: skip
    except OSError as error:
        raise BadInput(
            f"--port {port}: {error.strerror}; choose another, or 0 for any free port"
        ) from None
    server.start()
    return server, f"http://{HOST}:{port}/{token}/"


@contextmanager
def _redirect(address):
    """The address of a file, readable only by this user, that redirects to `address`.

    The browser is given this one, since everyone on this machine can read the arguments of its
    processes.
    """
    with tempfile.NamedTemporaryFile("w", suffix=".html") as file:
        file.write(f'<meta http-equiv="refresh" content="0; url={html.escape(address)}">')
        file.flush()
        yield f"file://{file.name}"


def _free():
    """A free port."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return probe.getsockname()[1]


class Refused(RequestHandler):
    """The answer to whoever lacks the token."""

    def prepare(self):
        self.set_status(403)
        self.finish(
            "403: this address lacks the token of the running survey view; open the address that it printed.\n"
        )
