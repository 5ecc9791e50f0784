"""Pictures of every story, at the width of a desk and of a phone: python3 tests/web/screenshots.py FOLDER [STORY...]"""
import pathlib
import sys

from devtools import Browser
from stub_farm import StubFarm


def main(folder, wanted):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with Browser() as browser, StubFarm() as farm:
        index = browser.open(f"{farm.url}/demo.html")
        names = wanted or index.evaluate("[...document.querySelectorAll('li a')].map(a => a.innerText)")
        for name in names:
            for kind, size in {"desk": {"width": 1280, "height": 860}, "phone": {"width": 390, "height": 800, "phone": True}}.items():
                page = browser.open(f"{farm.url}/demo.html?view={name}", **size)
                page.wait("!document.querySelector('.stage live-image') || document.querySelector('.stage live-image').dataset.painted || document.querySelector('.stage-text')")
                page.screenshot(folder / f"{name}-{kind}.png")
                page.close()


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
