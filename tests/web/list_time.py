"""How long the list of many jobs takes on the dashboard, from a coordinator of this machine: python3 tests/web/list_time.py [JOBS]

The jobs wait, since there is no worker. Milliseconds from the click (of the first row: from the beginning of loading) until the
rows are there, and bytes that came meanwhile.
"""
import json
import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from devtools import Browser  # noqa: E402
from local_farm import SCENE, LocalFarm  # noqa: E402

RUNS = 5
ROWS = "document.querySelectorAll('[data-job]')"
FIRST = "document.querySelector('[data-job] .name a')?.innerText"
UNTIL = """new Promise((resolve) => {
  const began = performance.now();
  %s;
  const look = () => ((%s) ? resolve(Math.round(performance.now() - began)) : requestAnimationFrame(look));
  requestAnimationFrame(look);
})"""
SEARCH = "(() => { const e = document.getElementById('list-search'); e.value = %s; e.dispatchEvent(new Event('input', { bubbles: true })); })()"
BUTTON = "[...document.querySelectorAll('%s')].find((b) => b.innerText.startsWith('%s')).click()"


def received(page):
    """Bytes of all answers so far, as they came over the wire."""
    return sum(params["encodedDataLength"] for method, params in page.events() if method == "Network.loadingFinished")


def main(jobs=10000):
    with LocalFarm() as farm, Browser() as browser:
        began = time.monotonic()
        for n in range(jobs):
            farm.submit(SCENE, spp=1, name=f"shot-{n:05}")
        print(f"{jobs} jobs submitted in {time.monotonic() - began:.0f} s", flush=True)
        answer = json.dumps(farm.get("/api/v1/jobs?sort=active&limit=50&offset=0"))
        print(f"one page of the list in JSON: {len(answer)} bytes before compression")
        last = f"shot-{jobs - 1:05}"
        # Each step is an action on the page and the rows that it leads to. All steps use one page, one after the other.
        steps = {
            "first rows": ("", f"{ROWS}.length === 50 && {FIRST}"),
            "search": (SEARCH % json.dumps(last), f"{ROWS}.length === 1 && {FIRST} === {json.dumps(last)}"),
            "end of the search": (SEARCH % '""', f"{ROWS}.length === 50"),
            "sort by name": (BUTTON % (".sort", "Scene"), f"{FIRST} === 'shot-00000'"),
            "next page": (BUTTON % (".pager button", "Next"), f"{FIRST} === 'shot-00050'"),
            "last page": (BUTTON % (".pager button", "Last"), f"[...{ROWS}].at(-1)?.querySelector('.name a').innerText === {json.dumps(last)}"),
        }
        times, sizes = {name: [] for name in steps}, {name: [] for name in steps}
        for _ in range(RUNS):
            page = browser.open(f"{farm.url()}/#token={farm.token}", width=1280, height=900)
            before = 0
            for name, (action, there) in steps.items():
                times[name].append(page.evaluate(UNTIL % (action, there) if action else f"{UNTIL % ('', there)}.then(() => Math.round(performance.now()))"))
                now = received(page)
                sizes[name].append(now - before)
                before = now
            page.close()
        for name in steps:
            print(f"| {name} | {statistics.median(times[name]):.0f} ({min(times[name])} – {max(times[name])}) | {statistics.median(sizes[name]):.0f} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
