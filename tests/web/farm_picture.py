"""A picture of the dashboard while a farm of this machine renders: python3 tests/web/farm_picture.py OUT.png SPP SCENE.xml [FILES...]"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from devtools import Browser  # noqa: E402
from local_farm import LocalFarm  # noqa: E402

PICTURED_AT = 0.7  # of the job


def main(out, spp, files):
    with LocalFarm() as farm, Browser() as browser:
        farm.add_workers(2, fake=False)
        farm.wait_for_workers(2)
        page = browser.open(f"http://127.0.0.1:{farm.http}/#token={farm.token}", width=1360, height=880)
        page.wait("document.querySelector('.link.live')")
        page.evaluate("void (location.hash = '#/submit')")
        page.wait("document.getElementById('files')")
        page.set_files("#files", files)
        page.wait("document.querySelector('.settings button:not([disabled])')")
        page.click("#set-spp")
        page.type(spp)
        page.click(".settings button")
        page.wait(f"Number(document.querySelector('.bar.wide')?.getAttribute('aria-valuenow')) >= {100 * PICTURED_AT} && document.querySelector('.mark-tile')", timeout=3600)
        page.screenshot(out, whole=False)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
