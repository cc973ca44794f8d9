"""Frames a second of a shared page while it is moved and zoomed, in headless Chromium; and how soon
it is sharp.

    survey share results/satellite_prolate_small.nc -o map.html
    python workflows/page_frames.py map.html --size 3840x2160

A frame is a call of requestAnimationFrame, in which the view changes; the browser's compositor
draws each. Needs selenium, and Chromium with its driver (Debian: chromium chromium-driver).
"""

import argparse
import os
import time
from pathlib import Path

import numpy as np
import viewer

# The view circles, then breathes, 4 s each; it begins at rest, sharp.
MOVED = """
const [kind, seconds, done] = arguments, at = [], own = []
const half = 0.25, {x, y} = home()
const side = ([a, b], middle, size) => [a + (b - a) * (middle - size), a + (b - a) * (middle + size)]
const show = t => {
  const turn = t * 2 * Math.PI / 4, far = kind === "pan" ? 1 : 0
  const size = kind === "zoom" ? half * Math.exp(-Math.sin(turn)) : half
  setView(side(x, 0.5 + 0.15 * far * Math.sin(turn), size), side(y, 0.5 + 0.1 * far * Math.sin(2 * turn), size))
}
const rested = then => idle() ? then() : setTimeout(rested, 5, then)
const move = begun => {
  const now = performance.now(), t = (now - begun) / 1000
  at.push(now)
  if (window.drawn) own.push(window.drawn.milliseconds)
  if (t < seconds) { show(t); requestAnimationFrame(() => move(begun)) }
  else rested(() => done({at, own, sharp: performance.now() - now}))
}
show(0)
setTimeout(rested, 500, () => move(performance.now()))
"""


def processor_time(root):
    """Seconds that the threads of a process and of its children have taken, by thread's name."""
    fields = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields[int(stat.parent.name)] = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
    own, total = {root}, {}
    for _ in range(4):
        own |= {pid for pid, words in fields.items() if int(words[1]) in own}
    for pid in own:
        try:
            for task in Path(f"/proc/{pid}/task").iterdir():
                name, rest = (task / "stat").read_text().split("(", 1)[1].rsplit(")", 1)
                spent = sum(map(int, rest.split()[11:13])) / os.sysconf("SC_CLK_TCK")
                total[name] = total.get(name, 0.0) + spent
        except OSError:
            continue
    return total


def measured(driver, kind, seconds):
    """One line about a motion."""
    root = driver.service.process.pid
    before = processor_time(root)
    found = driver.execute_async_script(MOVED, kind, seconds)
    after = processor_time(root)
    gaps = np.diff(found["at"])
    spent = {name: 1000 * (after[name] - before.get(name, 0.0)) / gaps.size for name in after}
    words = ", ".join(f"{name} {value:.1f}" for name, value in spent.items() if value > 0.3)
    rate, tail = 1000 * gaps.size / (found["at"][-1] - found["at"][0]), np.percentile(gaps, 95)
    return (
        f"{kind}: {rate:.1f} frames a second, gap {np.median(gaps):.1f} ms in the median, {tail:.1f} ms at 95 %, "
        f"{gaps.max():.0f} ms at most; the page's script {np.median(found['own']):.1f} ms, "
        f"processor time {sum(spent.values()):.1f} ms a frame ({words}); sharp {found['sharp']:.0f} ms after it rests"
    )


def main():
    words = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    words.add_argument("path", metavar="MAP.html", type=Path, help="the page (survey share)")
    words.add_argument("--size", default="3840x2160", help="of the window, in pixels")
    words.add_argument("--seconds", type=float, default=8.0, help="of each motion")
    given = words.parse_args()
    if viewer.missing():
        raise SystemExit(f"missing: {viewer.missing()}")
    with viewer.browser(f"--window-size={given.size.replace('x', ',')}") as driver:
        driver.set_script_timeout(120)
        driver.get(f"file://{given.path.resolve()}")
        while not driver.execute_script(
            "return typeof idle == 'function' && model !== null && idle()"
        ):
            time.sleep(0.1)
        size = driver.execute_script("return [plot.box.width, plot.box.height, devicePixelRatio]")
        print(f"plot of {size[0]} x {size[1]} pixels in a window of {given.size}")
        for kind in ("pan", "zoom"):
            driver.execute_async_script(MOVED, kind, 1.0)
            print(measured(driver, kind, given.seconds), flush=True)


if __name__ == "__main__":
    main()
