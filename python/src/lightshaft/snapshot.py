"""The state of a job at one moment, as notebooks show it: its figures, its picture and the curve of its error."""

from __future__ import annotations

import base64
import csv
import dataclasses
import html
import io
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from . import models
from .errors import BadAnswer, Conflict, FarmBusy, NotFound
from .job import Verdict
from .steps import Call, Steps, fetch, get_job, job_path, succeed

Curve = dict[str, npt.NDArray[np.float64]]
ENDED = ("done", "failed", "cancelled")
# Sizes of the curve, in CSS pixels. A label of 7 characters, such as 1.2e-03, fits into MARGIN: a character is at
# most 0.65 FONT wide in the fonts that notebooks use.
WIDTH, HEIGHT, MARGIN, FONT = 420, 180, 58, 11
MAX_ROWS = 1_000_000


def get_curve(job: str) -> Steps[Curve]:
    reply = yield from succeed(Call("GET", job_path(job, "/convergence.csv")))
    return parse_curve(reply.body.decode("utf-8", "replace"))


def parse_curve(text: str) -> Curve:
    """Returns {column: values}. NaN marks missing values."""
    try:
        rows = list(csv.reader(io.StringIO(text)))
    except csv.Error:
        raise BadAnswer("the farm's table of errors is malformed") from None
    names = rows[0] if rows else []
    if len(rows) > MAX_ROWS or any(len(row) != len(names) for row in rows if row):
        raise BadAnswer("the farm's table of errors is malformed")
    try:
        return {
            name: np.array([float(row[i] or "nan") for row in rows[1:] if row])
            for i, name in enumerate(names)
        }
    except ValueError:
        raise BadAnswer("the farm's table of errors has an entry that is not a number") from None


def take(job: str) -> Steps[Snapshot]:
    view = yield from get_job(job)
    return (yield from of_view(view))


def of_view(view: models.Job) -> Steps[Snapshot]:
    shown, state = view["id"], str(view["state"])
    frames = view.get("frames")
    if frames:  # of a sequence: the frame to look at
        shown, state = next(
            (
                (frame["id"], str(frame.get("state")))
                for frame in frames.get("list", [])
                if frame.get("frame") == frames.get("current")
            ),
            (shown, state),
        )
    try:
        # While it renders the image itself is shown: denoising it each time would take seconds.
        png, denoised = yield from _picture(shown, view.get("denoise") is True and state in ENDED)
        curve = yield from get_curve(shown)
    except (NotFound, Conflict):  # nothing is rendered yet
        png, denoised, curve = b"", False, {}
    return Snapshot(view, png if png.startswith(b"\x89PNG") else b"", curve, denoised)


def _picture(job: str, denoised: bool) -> Steps[tuple[bytes, bool]]:
    """Returns a PNG, and whether it is the denoised image: if it cannot be had, it is the image itself."""
    path = job_path(job, "/image.png")
    if denoised:
        try:
            return (yield from fetch(path + "?layer=denoised")), True
        except (Conflict, FarmBusy):  # it was not made, or its library is gone
            pass
    return (yield from fetch(path)), False


def summary(view: models.Job) -> str:
    """Returns one line for people, like the progress of wait()."""
    parts = [
        f"{view['state']} {100 * _figure(view.get('progress')):.0f} %",
        f"{_figure(view.get('spp_done')):.4g} samples per pixel",
    ]
    left = view.get("eta_seconds")
    denoised = view.get("denoised")
    if isinstance(denoised, dict):
        parts.append("denoised " + _error(denoised.get("relmse"), denoised.get("relmse_ci95")))
    if view.get("relmse") is not None:
        verdict = Verdict.of(view)
        parts.append(
            _error(view["relmse"], view.get("relmse_ci95"))
            if verdict is None or verdict.trusted
            else f"relMSE {_figure(view['relmse']):.3g} (don't trust yet)"
        )
    if left is not None and view["state"] not in ENDED:
        parts.append(f"{_figure(left):.0f} s left")
    return ", ".join(parts)


def _error(relmse: Any, interval: Any) -> str:
    text = f"relMSE {_figure(relmse):.3g}"
    if not isinstance(interval, list) or len(interval) != 2:
        return text
    return f"{text} ({_figure(interval[0]):.3g} to {_figure(interval[1]):.3g})"


def _figure(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) else math.nan


@dataclasses.dataclass(frozen=True)
class Snapshot:
    view: models.Job
    png: bytes
    """Empty while there is no picture."""
    curve: Curve
    denoised: bool = False
    """True if `png` is the denoised image."""

    def __repr__(self) -> str:
        return f"<job {self.view['id']}: {summary(self.view)}>"

    def _repr_png_(self) -> bytes | None:
        return self.png or None

    def _repr_html_(self) -> str:
        view = self.view
        lines = [
            f"<b>{html.escape(str(view.get('name') or 'job'))}</b> {html.escape(view['id'])}",
            html.escape(summary(view)),
        ]
        verdict = Verdict.of(view)
        error, waits = view.get("error"), view.get("waits_for")
        doubt = (verdict.words, verdict.advice) if verdict else ()
        for text in (error, waits if waits != error else None, *doubt):
            if text:
                lines.append(html.escape(str(text)))
        picture = (
            f'<figure style="margin:0"><img alt="the image{", denoised" if self.denoised else " so far"}" '
            'style="max-width:480px" src="data:image/png;base64,'
            f'{base64.b64encode(self.png).decode()}">'
            f"<figcaption>{'denoised' if self.denoised else 'as rendered'}</figcaption></figure>"
            if self.png
            else "<i>no picture yet</i>"
        )
        return (
            f'<div>{"<br>".join(lines)}<div style="display:flex;flex-wrap:wrap;gap:12px;align-items:flex-start">'
            f"{picture}{self._curve_svg()}</div></div>"
        )

    def _curve_svg(self) -> str:
        """Draws relMSE over core seconds, both on logarithmic axes."""
        x, y = (
            np.asarray(self.curve.get(name, []), dtype=float) for name in ("core_seconds", "relmse")
        )
        good = (
            np.isfinite(x) & np.isfinite(y) & (x > 0) & (y > 0)
            if x.shape == y.shape
            else np.zeros(0, bool)
        )
        if np.count_nonzero(good) < 2:
            return ""
        x, y = x[good], y[good]
        u, v = (_spread(np.log10(values)) for values in (x, y))
        points = " ".join(
            f"{MARGIN + a * (WIDTH - MARGIN - 8):.1f},{8 + (1 - b) * (HEIGHT - 40):.1f}"
            for a, b in zip(u, v)
        )
        style = f'fill="currentColor" font-size="{FONT}"'
        bottom = HEIGHT - 32
        return (
            f'<svg width="{WIDTH}" height="{HEIGHT}" role="img" aria-label="relMSE over core seconds">'
            f'<path d="M{MARGIN} 8V{bottom}H{WIDTH - 8}" fill="none" stroke="currentColor" opacity=".5"/>'
            f'<polyline points="{points}" fill="none" stroke="#d97706" stroke-width="2"/>'
            f'<text x="{MARGIN - 4}" y="16" text-anchor="end" {style}>{y.max():.1e}</text>'
            f'<text x="{MARGIN - 4}" y="{bottom}" text-anchor="end" {style}>{y.min():.1e}</text>'
            f'<text x="{MARGIN}" y="{bottom + 14}" {style}>{x.min():.3g}</text>'
            f'<text x="{WIDTH - 8}" y="{bottom + 14}" text-anchor="end" {style}>{x.max():.3g}</text>'
            f'<text x="{(MARGIN + WIDTH) // 2}" y="{bottom + 28}" text-anchor="middle" {style}>'
            "relMSE over core seconds</text></svg>"
        )


def _spread(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Scales values to the range from 0 to 1."""
    low, width = values.min(), np.ptp(values)
    return (values - low) / width if width > 0 else np.full(values.shape, 0.5)
