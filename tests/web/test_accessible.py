"""What a reader of the page without eyes, without colours or with a finger needs."""
import pytest

NAMES = """[...document.querySelectorAll("a[href], button, input, select, summary")].filter((e) => e.getClientRects().length).map((e) => ({
  tag: e.localName, text: (e.innerText ?? "").trim(), href: e.getAttribute("href"),
  name: (e.getAttribute("aria-label") || (e.labels?.length ? [...e.labels].map((l) => l.textContent).join(" ") : "") || e.innerText || e.title || "").trim(),
}))"""


@pytest.mark.parametrize("view", ["jobs", "jobs-page", "job", "job-done", "job-sequence", "job-log", "viewer", "viewer-compare", "viewer-mix", "workers", "submit-ready"])
def test_every_control_has_a_name_that_holds_its_text(open_page, farm, view):
    page = open_page(f"{farm.url}/demo.html?view={view}")
    page.wait("document.querySelector('main *')")

    controls = page.evaluate(NAMES)

    assert len(controls) > 3 and [c for c in controls if not c["name"]] == []
    words = [c for c in controls if any(letter.isalnum() for letter in c["text"])]
    assert [c for c in words if c["tag"] == "button" and c["text"].rstrip(" ↑↓").lower() not in c["name"].lower()] == [], "who speaks what is seen must hit it"


def test_no_two_buttons_or_boxes_of_a_list_have_the_same_name(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=jobs-page")
    names = [c["name"] for c in page.evaluate(NAMES) if c["tag"] in ("button", "input")]
    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize("view", ["job", "viewer", "workers"])
def test_links_in_text_are_told_by_more_than_their_colour(open_page, farm, view):
    page = open_page(f"{farm.url}/demo.html?view={view}")
    page.wait("document.querySelector('main *')")
    plain = page.evaluate("[...document.querySelectorAll('main p a:not(.button), main td.doing a, .viewer-head a')].filter(a => !getComputedStyle(a).textDecorationLine.includes('underline')).map(a => a.innerText)")
    assert plain == []


def test_boxes_are_large_enough_for_a_finger(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=jobs-page", width=375, height=800, phone=True)
    page.wait("document.querySelector('td.pick input')")
    sizes = page.evaluate("[...document.querySelectorAll('td.pick input')].map(e => Math.min(e.getBoundingClientRect().width, e.getBoundingClientRect().height))")
    assert min(sizes) >= 24, "WCAG 2.2, 2.5.8"
