"""How long the list of jobs takes to appear over a slow link, as Chromium emulates it: python3 tests/web/load_time.py

Prints milliseconds from the navigation, requests and bytes: of a link with a token in a fresh browser, and of a second visit.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from devtools import Browser  # noqa: E402
from local_farm import SCENE, LocalFarm  # noqa: E402

SLOW = {"offline": False, "latency": 400, "downloadThroughput": 50_000, "uploadThroughput": 50_000}  # ms for each request, bytes a second


def visit(page, what, *navigation):
    seen = len(page.events())
    page.call(*navigation)
    page.wait("document.querySelector('[data-job]')")
    milliseconds = page.evaluate("Math.round(performance.now())")
    page.wait("document.querySelector('.link.live')")
    events = page.events()[seen:]
    cached = {params["requestId"] for method, params in events if method == "Network.requestServedFromCache"}
    asked = {params["requestId"] for method, params in events if method == "Network.requestWillBeSent"} - cached
    size = sum(params["encodedDataLength"] for method, params in events if method == "Network.loadingFinished" and params["requestId"] in asked)
    print(f"{what}: {milliseconds} ms, {len(asked)} requests, {size:.0f} bytes", flush=True)


def main():
    with LocalFarm() as farm, Browser() as browser:
        farm.submit(SCENE, spp=4)
        for _ in range(3):
            page = browser.open("about:blank")
            page.call("Network.emulateNetworkConditions", SLOW)
            visit(page, "a link with a token", "Page.navigate", {"url": f"{farm.url()}/#token={farm.token}"})
            visit(page, "a second visit", "Page.reload")
            page.close()


if __name__ == "__main__":
    main()
