import pytest
from devtools import Browser, chromium_path
from local_farm import bin_dir
from stub_farm import StubFarm, TOKEN


@pytest.fixture(scope="session")
def browser():
    if chromium_path() is None:
        pytest.skip("Chromium is not installed (apt-get install chromium)")
    with Browser() as browser:
        yield browser


@pytest.fixture
def programs():
    """The folder of the programs, for a real farm."""
    try:
        return bin_dir()
    except FileNotFoundError as missing:
        pytest.skip(str(missing))


@pytest.fixture
def farm():
    with StubFarm() as farm:
        yield farm


@pytest.fixture
def open_page(browser):
    """Opens pages that must end without a complaint of the browser."""
    pages = []

    def open(url, **more):
        page = browser.open(url, **more)
        pages.append(page)
        return page

    yield open
    complaints = [complaint for page in pages for complaint in page.complaints()]
    for page in pages:
        page.close()
    assert complaints == []


@pytest.fixture
def dashboard(farm, open_page):
    """Signs in and shows a route: dashboard("#/jobs")."""
    def show(route="#/jobs", **more):
        page = open_page(f"{farm.url}/#token={TOKEN}", **more)
        page.wait("document.querySelector('.link.live')")
        if route != "#/jobs":
            page.evaluate(f"void (location.hash = {route!r})")
        return page
    return show
