"""How a job shows itself in notebooks and terminals, without a farm."""

import inspect
import re
import sys
import types

import numpy as np
import pytest

import lightshaft
from lightshaft import snapshot, watching

VIEW = {
    "id": "j-1",
    "name": "ball.xml",
    "state": "done",
    "progress": 1,
    "spp_done": 64,
    "relmse": 0.0123,
    "relmse_ci95": [0.011, 0.014],
}
ADVICE = "still noisy: a few bright pixels carry the error; render on: lightshaft extend j-1 --spp 256"
DOUBTFUL = VIEW | {
    "verdict": {
        "kind": "heavy_tail",
        "words": "don't trust yet: few pixels carry the error",
        "trusted": False,
        "advice": ADVICE,
    }
}
CURVE = {
    "core_seconds": np.array([0.001, 0.1, 10.0]),
    "relmse": np.array([0.5, 0.0123, 0.00047]),
}


def test_an_interval_is_shown_of_a_trusted_error_only():
    assert "relMSE 0.0123 (0.011 to 0.014)" in snapshot.summary(VIEW)
    assert "relMSE 0.0123 (don't trust yet)" in snapshot.summary(DOUBTFUL)
    assert "0.011" not in snapshot.summary(DOUBTFUL)


def test_the_error_of_the_denoised_layers_comes_first():
    text = snapshot.summary(VIEW | {"denoised": {"relmse": 0.001, "relmse_ci95": [0.0009, 0.0011]}})
    assert text.index("denoised relMSE 0.001 (0.0009 to 0.0011)") < text.index("relMSE 0.0123")
    assert "denoised relMSE 0.001," in snapshot.summary(
        VIEW | {"denoised": {"relmse": 0.001, "relmse_ci95": None}}
    )


def test_a_job_of_doubtful_error_says_what_to_do():
    shown = lightshaft.Snapshot(DOUBTFUL, b"", {})._repr_html_()
    assert ADVICE in shown and "few pixels carry the error" in shown


def test_a_job_that_waits_for_another_says_so_once():
    waits = "waits for job j-0, which is running"
    for view in (VIEW | {"waits_for": waits}, VIEW | {"waits_for": waits, "error": waits}):
        assert lightshaft.Snapshot(view, b"", {})._repr_html_().count(waits) == 1


def test_a_low_picture_keeps_its_proportions():
    shown = lightshaft.Snapshot(VIEW, b"\x89PNG", CURVE)._repr_html_()
    row = re.search(r'<div style="(display:flex[^"]*)"', shown)[1]
    assert "align-items:flex-start" in row.split(";"), "else it is stretched to the height of the curve"


def test_the_labels_of_the_axes_are_inside_of_the_picture():
    svg = lightshaft.Snapshot(VIEW, b"", CURVE)._curve_svg()
    labels = re.findall(r'<text x="(\d+)" y="\d+" text-anchor="end"[^>]*font-size="(\d+)">([^<]*)<', svg)
    assert [text for _, _, text in labels] == ["5.0e-01", "4.7e-04", "10"]
    for x, size, text in labels:
        # 0.65 of the size: the widest digit of DejaVu Sans, the widest of the fonts that notebooks use
        assert int(x) >= 0.65 * int(size) * len(text), text


def test_an_address_may_leave_out_its_scheme():
    assert repr(lightshaft.Farm("farm:8080/", "token")) == "<Farm https://farm:8080>"
    with pytest.raises(lightshaft.RequestRejected, match="must begin with http"):
        lightshaft.Farm("ftp://farm", "token")


def test_a_job_names_itself():
    job = lightshaft.Job(None, VIEW)
    assert repr(job) == "<Job j-1 'ball.xml': done, 100 %>" and job.name == "ball.xml"


def test_the_verdicts_of_a_job_and_of_its_report_are_of_one_type():
    report = {
        "verdict": DOUBTFUL["verdict"]["words"],
        "verdict_kind": "heavy_tail",
        "trusted": False,
        "advice": ADVICE,
    }
    verdict = lightshaft.Job(None, DOUBTFUL).verdict
    assert verdict == lightshaft.Verdict.of(report) == lightshaft.Verdict.of(DOUBTFUL)
    assert verdict.advice == ADVICE and not verdict.trusted and verdict.kind == "heavy_tail"
    assert lightshaft.Job(None, VIEW).verdict is None


@pytest.mark.parametrize(
    "kind", [lightshaft.Farm, lightshaft.AsyncFarm, lightshaft.Job, lightshaft.AsyncJob]
)
def test_every_public_method_says_what_it_does(kind):
    without = [
        name
        for name, member in inspect.getmembers(kind)
        if not name.startswith("_") and not (inspect.getdoc(member) or name in ("id",))
    ]
    assert without == []


def test_in_a_notebook_progress_is_a_bar_in_one_place_and_not_an_error(monkeypatch, capsys):
    shown, updates = [], []
    handle = types.SimpleNamespace(update=updates.append)
    display = types.ModuleType("IPython.display")
    display.display = lambda one, display_id: shown.append(one) or handle
    python = types.ModuleType("IPython")
    python.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", python)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    show = watching._printer()

    show(VIEW | {"progress": 0.5, "state": "running"})
    show(VIEW)

    assert len(shown) == len(updates) == 1 and capsys.readouterr().err == ""
    assert 'value="0.500"' in shown[0]._repr_html_() and "running 50 %" in shown[0]._repr_html_()
    assert 'value="1.000"' in updates[0]._repr_html_() and repr(updates[0]).startswith("done 100 %")
