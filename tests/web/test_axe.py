"""No view has what axe-core finds, in light and in dark: missing names and roles, low contrast, and the rest of its rules.

axe-core comes from the package index (tests/web/requirements.txt; tests/venv.sh web makes an environment that has it).
"""
import importlib.util
import pathlib

import pytest
from stub_farm import job, worker
from test_storybook import FACTS

# The rules of all levels of WCAG 2.2 that axe-core knows, and those that it calls best practice.
RUN = """axe.run(document, { resultTypes: ["violations"] }).then(({ violations }) =>
  violations.map((v) => `${v.id}: ${v.help}: ` + v.nodes.map((n) => `${n.target} (${n.failureSummary})`).join("; ")))"""


@pytest.fixture(scope="module")
def axe():
    package = importlib.util.find_spec("axe_playwright_python")
    if package is None:
        pytest.skip("axe-core is not installed: run this with the Python of `tests/venv.sh web`")
    return (pathlib.Path(package.submodule_search_locations[0]) / "axe.min.js").read_text()


def violations(page, axe):
    page.wait("!document.querySelector('.stage live-image') || document.querySelector('.stage live-image').dataset.painted || document.querySelector('.stage-text')")
    page.evaluate(axe + "; void 0")
    return page.evaluate(RUN)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("view", FACTS)
def test_axe_finds_nothing_in_a_story(open_page, farm, axe, view, scheme):
    page = open_page(f"{farm.url}/demo.html?view={view}", scheme=scheme)
    page.wait("document.querySelector('#app *')")

    assert violations(page, axe) == []


@pytest.mark.parametrize("view", FACTS)
def test_axe_finds_nothing_in_a_story_on_a_phone(open_page, farm, axe, view):
    page = open_page(f"{farm.url}/demo.html?view={view}", width=375, height=800, phone=True)
    page.wait("document.querySelector('#app *')")

    assert violations(page, axe) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("route, there", [("#/jobs", "[data-job]"), ("#/jobs/j-1", ".job-facts"), ("#/jobs/j-1/log", ".log-page pre"), ("#/view/j-1", "float-view"), ("#/workers", "[data-worker]"), ("#/submit", "#files")])
def test_axe_finds_nothing_on_a_page_of_a_farm(farm, dashboard, axe, route, there, scheme):
    farm.jobs = {"j-1": job(size=farm.size), "j-2": job("j-2", state="done")}
    farm.workers = {"w-1": worker()}
    page = dashboard(route, scheme=scheme)
    page.wait(f"document.querySelector({there!r})")

    assert violations(page, axe) == []
