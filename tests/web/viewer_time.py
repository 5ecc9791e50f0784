"""How long the viewer takes to show a 4K image with 20 layers, of fake workers on this machine: python3 tests/web/viewer_time.py [WIDTH HEIGHT]

From the click to the first pixel in the middle of the window, and to the whole picture: while the job is in memory, after it
is done and on the disk only, and again after a restart of the coordinator; then the change to another layer.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from devtools import Browser  # noqa: E402
from local_farm import SCENE, LocalFarm, wait_until  # noqa: E402

# With colour, standard error, relative error and samples: 20 layers.
AOVS = "albedo,coverage,depth,direct,emission,geo_normal,indirect,material_id,multiple,normal,position,shape_id,single,surface,uv,volume"
PATIENCE = 3600  # seconds
SHOW = """new Promise((resolve) => {
  const began = performance.now();
  let first = null;
  document.querySelector("float-view")?.removeAttribute("data-painted");
  location.hash = %r;
  const look = () => {
    const view = document.querySelector("float-view"), canvas = view?.querySelector("canvas");
    if (canvas && first === null && canvas.getContext("2d").getImageData(canvas.width >> 1, canvas.height >> 1, 1, 1).data[3] > 0) first = performance.now() - began;
    if (view?.dataset.painted === %r) resolve([first, performance.now() - began].map(Math.round));
    else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})"""


def show(farm, browser, job, query="", layer="rgb", page=None):
    """(milliseconds to the first pixel, to the whole picture, the page)."""
    if page is None:
        page = browser.open(f"{farm.url()}/#token={farm.token}", width=1280, height=800)
        page.wait("document.querySelector('.link.live')")
    first, whole = page.evaluate(SHOW % (f"#/view/{job}{query}", f"{layer} a"), timeout=300)
    return first, whole, page


def main(width=3840, height=2160):
    with LocalFarm() as farm, Browser() as browser:
        farm.add_workers(2)
        farm.wait_for_workers(2)
        job = farm.submit(SCENE, spp=2, size=f"{width}x{height}", aov=AOVS)
        total = farm.job(job)["units_total"]
        wait_until(lambda: farm.job(job)["units_done"] >= total - total // 8, "most of the job is rendered", PATIENCE)
        farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "paused"}')
        farm.wait_for_job(job, ("paused",))
        print("in memory, ms to the first pixel and to the whole picture:", *show(farm, browser, job)[:2], flush=True)
        farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "running"}')
        farm.wait_for_job(job, patience=PATIENCE)
        print("MiB on the disk:", sum(f.stat().st_size for f in (farm.data / "jobs" / job).iterdir()) >> 20)
        for what in ("on the disk", "after a restart"):
            first, whole, page = show(farm, browser, job)
            print(f"{what}:", first, whole, flush=True)
            print("  another layer:", *show(farm, browser, job, "?layer=position", "position", page)[:2], flush=True)
            print("  one to one:", *show(farm, browser, job, f"?zoom=1&x={width // 2}&y={height // 2}", "rgb", page)[:2], flush=True)
            if what == "on the disk":
                farm.restart_coordinator()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
