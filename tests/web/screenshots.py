"""Pictures of every story at the width of a desk, a tablet and a phone, by day and by night: python3 tests/web/screenshots.py FOLDER [STORY...]

With --docs instead of the folder: those of docs/guide/dashboard.md, in docs/images.
"""
import pathlib
import sys

from devtools import Browser
from stub_farm import StubFarm

SIZES = {"desk": {"width": 1280, "height": 860}, "tablet": {"width": 768, "height": 1024}, "phone": {"width": 390, "height": 800, "phone": True}}
SCHEMES = ("light", "dark")
DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs" / "images"
PUBLISHED = [*(("job", size, scheme) for size in SIZES for scheme in SCHEMES), ("jobs", "desk", "light"), ("viewer", "tablet", "dark"), ("submit-ready", "tablet", "light"), ("workers", "desk", "dark")]
QUALITY = 75  # of a JPEG


def take(browser, farm, story, size, scheme, path, whole):
    page = browser.open(f"{farm.url}/demo.html?view={story}", **SIZES[size], scheme=scheme)
    page.wait("!document.querySelector('.stage live-image') || document.querySelector('.stage live-image').dataset.painted || document.querySelector('.stage-text')")
    page.screenshot(path, whole, QUALITY)
    page.close()


def main(folder, wanted):
    with Browser() as browser, StubFarm() as farm:
        if folder == "--docs":
            for story, size, scheme in PUBLISHED:
                take(browser, farm, story, size, scheme, DOCS / f"dashboard-{story}-{size}-{scheme}.jpg", whole=False)
            return
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
        index = browser.open(f"{farm.url}/demo.html")
        for story in wanted or index.evaluate("[...document.querySelectorAll('li a')].map(a => a.innerText)"):
            for size in SIZES:
                for scheme in SCHEMES:
                    take(browser, farm, story, size, scheme, pathlib.Path(folder) / f"{story}-{size}-{scheme}.png", whole=True)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
