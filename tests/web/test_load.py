"""What the dashboard costs a slow link: requests and bytes of the real coordinator, not times."""
import pytest
from local_farm import SCENE, LocalFarm

# The page, its two scripts, its style and the icon; then who is signed in, the session, who is signed in now, the list, the workers,
# the event stream, the list again when that stream opens, a small picture, the announced jobs. Served module by module it would be some 80.
MOST_REQUESTS = 15
MOST_BYTES = 100_000  # of which the scripts in gzip are 73,000; without compression they are three times as long


@pytest.fixture
def real_farm(tmp_path, programs):
    with LocalFarm(tmp_path, programs) as farm:
        farm.submit(SCENE, spp=4)
        yield farm


def of_network(page, since=0):
    """(requests, bytes as they came over the line) of all that the page has fetched since that many events."""
    events = page.events()[since:]
    asked = {params["requestId"] for method, params in events if method == "Network.requestWillBeSent"}
    cached = {params["requestId"] for method, params in events if method == "Network.requestServedFromCache"}
    size = sum(params["encodedDataLength"] for method, params in events if method == "Network.loadingFinished" and params["requestId"] in asked - cached)
    return len(asked - cached), size


def test_the_dashboard_comes_in_few_requests_and_bytes(real_farm, open_page):
    page = open_page(f"http://127.0.0.1:{real_farm.http}/#token={real_farm.token}")
    page.wait("document.querySelector('[data-job]') && document.querySelector('.link.live')")

    requests, size = of_network(page)

    assert requests <= MOST_REQUESTS
    assert size <= MOST_BYTES


def test_a_second_visit_fetches_neither_script_nor_style_again(real_farm, open_page):
    page = open_page(f"http://127.0.0.1:{real_farm.http}/#token={real_farm.token}")
    page.wait("document.querySelector('[data-job]')")
    before = len(page.events())

    page.go(f"http://127.0.0.1:{real_farm.http}/")
    page.wait("document.querySelector('[data-job]')")

    events = page.events()[before:]
    cached = {params["requestId"] for method, params in events if method == "Network.requestServedFromCache"}
    fetched = [params["request"]["url"] for method, params in events if method == "Network.requestWillBeSent" and params["requestId"] not in cached]
    assert [url for url in fetched if url.endswith((".js", ".css"))] == []


def test_the_list_is_asked_for_before_the_whole_page_is_there(real_farm, open_page):
    """By the small first script: whoever is signed in waits for the longer one of the two ways, not for both."""
    page = open_page(f"http://127.0.0.1:{real_farm.http}/#token={real_farm.token}")
    page.wait("document.querySelector('[data-job]')")
    page.call("Network.setCacheDisabled", {"cacheDisabled": True})
    page.call("Network.emulateNetworkConditions", {"offline": False, "latency": 50, "downloadThroughput": 50_000, "uploadThroughput": 50_000})
    before = len(page.events())

    page.go(f"http://127.0.0.1:{real_farm.http}/")
    page.wait("document.querySelector('[data-job]')")

    events = page.events()[before:]
    urls = {params["requestId"]: params["request"]["url"] for method, params in events if method == "Network.requestWillBeSent"}
    asked = next(i for i, (method, params) in enumerate(events) if method == "Network.requestWillBeSent" and "/api/v1/jobs?" in params["request"]["url"])
    ends = [i for i, (method, params) in enumerate(events) if method == "Network.loadingFinished" and urls.get(params["requestId"], "").endswith(".js")]
    assert len(ends) == 2 and asked < ends[1]
