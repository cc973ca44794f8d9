"""A picture of `survey view` in headless Chromium: a map with its edges, the point under the
pointer, and its motion.

    python workflows/viewer.py results/satellite_tongues.nc -o results

Needs the extra `view`, selenium, and Chromium with its driver (Debian: chromium chromium-driver).
"""

import contextlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from script import parser

FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-dev-shm-usage --window-size=1300,800"
).split()
POINT = 0.86, 1.36  # k and rho: in the widest tongue but two, near its edge
# true once the page is drawn and nothing is in progress
IDLE = """
const models = [...(window.Bokeh?.documents[0]?._all_models.values() ?? [])]
const image = models.find(model => model.type == "ImageRGBA")
const texts = models.filter(model => model.type == "Div").map(model => model.text)
return image !== undefined && models.some(m => m.type == "ColumnDataSource" && m.data.image?.length == 1)
  && !texts.some(text => text.endsWith(" ..."))
"""
PLOT = """
const plot = Bokeh.documents[0].roots()[0].children[0]
const view = Bokeh.index.roots[0].child_views[0]
const area = view.el.getBoundingClientRect(), box = view.frame.bbox
return [area.left + box.left, area.top + box.top, box.width, box.height,
        plot.x_range.start, plot.x_range.end, plot.y_range.start, plot.y_range.end]
"""


@contextlib.contextmanager
def served(path, *options):
    """The address at which the file is served by `survey view`, and the process."""
    command = [
        sys.executable,
        "-m",
        "survey",
        "view",
        str(path),
        "--no-browser",
        "--port",
        "0",
        *options,
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        line = process.stderr.readline()
        found = re.search(r"http://\S+", line)
        if not found:
            raise SystemExit(line + process.stderr.read())
        yield found[0], process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)


def missing():
    """What is missing for a browser, as text; empty if nothing is."""
    try:
        import selenium  # noqa: F401
    except ImportError:
        return "selenium (pip install selenium)"
    absent = [name for name in ("chromium", "chromedriver") if not shutil.which(name)]
    return (
        f"{' and '.join(absent)} (Debian: apt-get install chromium chromium-driver)"
        if absent
        else ""
    )


@contextlib.contextmanager
def browser(*flags):
    """Headless Chromium with its own profile."""
    from selenium import webdriver

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for flag in (*FLAGS, *flags, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
        try:
            yield driver
        finally:
            driver.quit()


def wait(driver, done=lambda: True, seconds=120):
    """Wait until the page is drawn, and `done()`; raises TimeoutError."""
    end = time.monotonic() + seconds
    while not (driver.execute_script(IDLE) and done()):
        if time.monotonic() > end:
            raise TimeoutError(driver.current_url)
        time.sleep(0.1)


def act(driver, x, y, click=False):
    """Move the pointer to a point of the map (its coordinates, linear axes), and click there."""
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.actions.action_builder import ActionBuilder

    left, top, width, height, x0, x1, y0, y1 = driver.execute_script(PLOT)
    position = left + width * (x - x0) / (x1 - x0), top + height * (y1 - y) / (y1 - y0)
    moves = ActionBuilder(driver)
    moves.pointer_action.move_to_location(*map(round, position))
    moves.perform()
    if click:
        ActionChains(driver).click().perform()


def main():
    options = parser(__doc__, "viewer.png")
    options.add_argument("path", metavar="OUT.nc", help="the survey to show")
    given = options.parse_args()
    if missing():
        raise SystemExit(f"missing: {missing()}")
    with served(given.path) as (address, _), browser() as driver:
        driver.get(address)
        wait(driver)
        act(driver, *POINT, click=True)
        wait(driver, lambda: "point=" in driver.current_url)
        path = given.output / "viewer.png"
        driver.save_screenshot(path)
    print(path)


if __name__ == "__main__":
    main()
