"""What a notebook shows: picture, figures and curve, anew while a job renders, by IPython's own display."""

import re
import sys

import pytest
from local_farm import SCENE

import lightshaft

pytest.importorskip("IPython", reason="tests/venv.sh python installs it")


@pytest.fixture
def shown(monkeypatch):
    """What is displayed: [(data, is it an update?)]."""
    from IPython.core.interactiveshell import InteractiveShell

    shell = InteractiveShell.instance()
    outputs = []

    def publish(data, metadata=None, *, transient=None, update=False, **_):
        outputs.append((data, transient, update))

    monkeypatch.setattr(shell.display_pub, "publish", publish)
    shell.display_formatter.active_types = ["text/plain", "text/html", "image/png"]
    yield outputs
    InteractiveShell.clear_instance()


def test_live_shows_picture_and_curve_in_one_place_until_the_end(farm, shown):
    job = farm.submit(SCENE, spp=256)

    assert job.live(interval=0.05).state == "done"

    first, *updates = shown
    assert first[2] is False and updates and all(update for _, _, update in updates)
    assert len({transient["display_id"] for _, transient, _ in shown}) == 1
    last = shown[-1][0]
    assert 'src="data:image/png;base64,' in last["text/html"] and "<polyline" in last["text/html"]
    assert "done 100 %" in last["text/html"] and "image/png" in last and job.id in last["text/plain"]


def test_a_job_shows_what_there_is(farm):
    job = farm.submit(SCENE, spp=64).wait()
    html = job._repr_html_()
    points = re.search(r'points="([^"]*)"', html)[1].split()
    assert len(points) == len(job.convergence()["spp"]) and job._repr_png_().startswith(b"\x89PNG")


def test_a_job_that_waits_says_what_for(farm):
    waiting = farm.submit(SCENE, spp=4, tags=["nobody"])
    html = waiting._repr_html_()
    assert "queued 0 %" in html and "lacks a tag" in html and "<polyline" not in html
    waiting.remove()


def test_live_says_how_a_job_ended(farm, shown):
    job = farm.submit(SCENE, spp=4, tags=["nobody"])
    job.cancel()
    with pytest.raises(lightshaft.JobCancelled):
        job.live()
    assert "cancelled" in shown[-1][0]["text/html"]


def test_without_ipython_live_says_what_to_do(farm, monkeypatch):
    monkeypatch.setitem(sys.modules, "IPython.display", None)
    with pytest.raises(lightshaft.MissingPackage, match=r"pip install 'lightshaft\[notebook\]'"):
        farm.submit(SCENE, spp=2).live()
