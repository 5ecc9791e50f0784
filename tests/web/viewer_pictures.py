"""Pictures of the viewer of a farm of this machine, at three sizes, light and dark: python3 tests/web/viewer_pictures.py FOLDER

The bath with 4 samples a pixel, compared with 16 of them (wipe), and its denoised layer. Needs Open Image Denoise
(deploy/install-denoiser.sh).
"""
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from devtools import Browser  # noqa: E402
from local_farm import ROOT, LocalFarm, bin_dir  # noqa: E402

SIZES = {"desk": {"width": 1280, "height": 860}, "tablet": {"width": 820, "height": 1100}, "phone": {"width": 390, "height": 800, "phone": True}}
PATIENCE = 3600  # seconds
POINTED = (0.42, 0.6)  # of the view's width and height, where the pointer is


def submit(farm, scene, *more):
    environment = dict(os.environ, LIGHTSHAFT_URL=farm.url(), LIGHTSHAFT_TOKEN=farm.token)
    said = subprocess.run([bin_dir() / "lightshaft", "submit", scene, "--size", "480x360", *more], check=True, capture_output=True, text=True, env=environment).stdout
    job = said.split()[0]
    farm.wait_for_job(job, patience=PATIENCE)
    return job


def picture(browser, farm, view, theme, out, **size):
    page = browser.open("about:blank", **size)
    page.call("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
    page.go(f"{farm.url()}/#token={farm.token}")
    page.wait("document.querySelector('.link.live')")
    page.evaluate(f"void (location.hash = '#/view/{view}')")
    page.wait("document.querySelector('float-view')?.dataset.painted", timeout=PATIENCE)
    x, y = page.evaluate(f"(() => {{ const b = document.querySelector('float-view').getBoundingClientRect(); return [b.left + {POINTED[0]} * b.width, b.top + {POINTED[1]} * b.height]; }})()")
    page.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": x, "y": y})
    page.wait("document.querySelector('.viewer-reading .viewer-value')")
    page.screenshot(out, whole=False)
    page.close()


def main(folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with LocalFarm() as farm, Browser() as browser:
        scene = farm.folder / "bath"
        subprocess.run([sys.executable, ROOT / "scenes/bath/make_bath.py", scene], check=True)
        farm.add_workers(2, fake=False)
        noisy = submit(farm, scene / "bath.xml", "--spp", "4", "--denoise")
        clean = submit(farm, scene / "bath.xml", "--spp", "16")
        for kind, size in SIZES.items():
            for theme in ("light", "dark"):
                picture(browser, farm, f"{noisy}?with={clean}&region=250,180,330,240", theme, folder / f"viewer-{kind}-{theme}.jpg", **size)
        picture(browser, farm, f"{noisy}?layer=denoised", "dark", folder / "viewer-denoised.jpg", **SIZES["desk"])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
