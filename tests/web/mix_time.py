"""How many mixes of 8 light groups the viewer draws in a second: python3 tests/web/mix_time.py [WIDTH HEIGHT]

The picture is drawn one to one. Each frame has another gain of one group, as while its slider is dragged.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from devtools import Browser  # noqa: E402
from local_farm import SCENE, LocalFarm  # noqa: E402

GROUPS = 8
FRAMES = 40
LAMP = """<emitter type="point"><point name="position" x="{x}" y="3" z="3"/><rgb name="intensity" value="{r}, 4, 2"/>
  <string name="light_group" value="lamp{i}"/></emitter>"""
# With the sky there are GROUPS groups
ROOM = SCENE.replace("</scene>", "".join(LAMP.format(i=i, x=i - 3, r=i + 1) for i in range(GROUPS - 1)) + "</scene>")
DRAG = """(async () => {
  const view = document.querySelector("float-view"), slider = document.querySelector("[aria-label='lamp0: gain slider']");
  const began = performance.now();
  for (let i = 1; i <= %d; i += 1) {
    const before = view.dataset.pictures;
    slider.value = String(i / 10 %% 4);
    slider.dispatchEvent(new Event("input"));
    while (view.dataset.pictures === before || !view.dataset.painted) await new Promise(requestAnimationFrame);
  }
  return performance.now() - began;
})()"""


def busy(page):
    """Seconds for which the page's thread has had a processor: other work on the machine does not count."""
    return next(metric["value"] for metric in page.call("Performance.getMetrics")["metrics"] if metric["name"] == "TaskDuration")


def main(width=1920, height=1080):
    with LocalFarm() as farm, Browser() as browser:
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        job = farm.submit(ROOM, spp=2, size=f"{width}x{height}", aov="light_groups")
        farm.wait_for_job(job, patience=3600)
        page = browser.open(f"{farm.url()}/#token={farm.token}", width=width + 500, height=height + 400)
        page.wait("document.querySelector('.link.live')")
        page.evaluate(f"void (location.hash = '#/view/{job}?layer=mix&mix=lamp0*g0.1&zoom=1&x={width // 2}&y={height // 2}')")
        page.wait("document.querySelector('float-view')")
        page.evaluate(f"document.querySelector('float-view').style.cssText = 'width: {width}px; height: {height}px', document.querySelector('.viewer-side').style.display = 'block'")
        page.wait(f"document.querySelectorAll('.mix-group').length === {GROUPS} && document.querySelector('float-view').dataset.painted === 'mix a'", timeout=600)
        page.call("Performance.enable", {"timeDomain": "threadTicks"})
        for _ in range(3):
            before = busy(page)
            milliseconds = page.evaluate(DRAG % FRAMES, timeout=600)
            print(f"{1000 * FRAMES / milliseconds:.1f} mixes of {GROUPS} groups a second, {width} x {height}; {1000 * (busy(page) - before) / FRAMES:.0f} ms of processor time of the page for each", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
