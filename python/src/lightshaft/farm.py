"""Farm and Job: the client that waits for each answer."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping
from types import TracebackType
from typing import Self, Unpack

from . import job as jobs_of
from . import models, snapshot, steps, submission, watching
from .errors import SceneWarning
from .images import Array
from .job import JobState
from .scene_files import PathLike
from .snapshot import Curve, Snapshot
from .submission import Scene
from .transport import Address, SyncTransport
from .watching import Progress


class Farm:
    """A render farm. `url` and `token` default to LIGHTSHAFT_URL and LIGHTSHAFT_TOKEN; `ca` is a file of
    certificates to trust instead of the system's (LIGHTSHAFT_CA)."""

    def __init__(
        self,
        url: str | None = None,
        token: str | None = None,
        *,
        ca: str | os.PathLike[str] | None = None,
    ) -> None:
        self._address = Address(url, token, ca)
        self._transport = SyncTransport(self._address)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Farm {self._address.url}>"

    def close(self) -> None:
        """Closes the connections; `with Farm() as farm` does so by itself."""
        self._transport.close()

    def submit(
        self,
        scene: Scene,
        *,
        name: str | None = None,
        folder: PathLike | None = None,
        allow: Iterable[PathLike] = (),
        assets: Mapping[str, PathLike | bytes] | None = None,
        camera: str | None = None,
        **spec: Unpack[models.JobSpec],
    ) -> Job:
        """Hands in a scene with the files that it names.

        `scene`: the path of an XML file, of a stage of USD or of an archive (.zip, .tar, .tar.gz), a string
        of XML, or a dictionary as for Mitsuba's load_dict, which may hold arrays. Files are looked for in
        `folder` (default: that of the scene's file, else the working directory); files outside of it are
        sent only if they lie in one of the folders `allow`. `assets`: {name in the scene: path or bytes},
        which go first. `camera`: of a stage that has several, the path of one. The rest are the job's
        settings (models.JobSpec): spp, target_error, time, size, denoise, aov, ... `reference` may be a path.
        """
        answer = self._transport.run(
            submission.submit(scene, spec, submission.Options(name, folder, allow, assets, camera))
        )
        for text in submission.warnings_of(answer):
            warnings.warn(text, SceneWarning, stacklevel=2)
        return self.job(answer["id"])

    def job(self, id: str) -> Job:
        """The job, sequence or frame with this id."""
        return Job(self._transport, self._transport.run(steps.get_job(id)))

    def jobs(
        self,
        *,
        state: str | Iterable[str] | None = None,
        search: str | None = None,
        owner: str | None = None,
        sort: str | None = None,
        limit: int | None = None,
        offset: int | None = None,
    ) -> list[Job]:
        """The jobs of the farm, in order of submission; a sequence is one job.

        `state`: only those in this state or these, such as 'running'. `search`: only those with this text in
        their name or id. `owner`: only those of this user. `sort`: 'submitted', 'name', 'progress', 'relmse',
        ...; '-submitted' is the newest first. `limit`, `offset`: at most so many, without the first ones.
        """
        filters = {
            "state": state,
            "search": search,
            "owner": owner,
            "sort": sort,
            "limit": limit,
            "offset": offset,
        }
        return [
            Job(self._transport, view) for view in self._transport.run(jobs_of.matching(filters))
        ]

    def workers(self) -> list[models.Worker]:
        """The workers of the farm, and what each does."""
        return self._transport.run(steps.listed("/api/v1/workers", "workers"))


class Job(JobState):
    """A job of a farm. In a notebook it shows its picture, its figures and the curve of its error."""

    def __init__(self, transport: SyncTransport, view: models.Job) -> None:
        super().__init__(view)
        self._transport = transport

    def refresh(self) -> models.Job:
        """Asks the farm again; state, progress and view are then those of now."""
        return self._keep(self._transport.run(steps.get_job(self.id)))

    def wait(self, progress: Progress = None, timeout: float | None = None) -> Job:
        """Returns when the job is done; raises JobFailed if it ends otherwise, and WaitTimeout after
        `timeout` seconds. `progress`: True prints a line, a function is called with each view
        (models.Job)."""
        self._keep(self._transport.run(watching.wait(self.id, progress, timeout)))
        return self

    def live(self, interval: float = watching.LIVE_SECONDS) -> Job:
        """In a notebook: shows picture and curve, anew while they change, and returns when the job is
        done."""
        self._keep(self._transport.run(watching.live(self.id, interval)))
        return self

    def image(self, layer: str = "color") -> Array:
        """(height, width, 3), linear RGB as float32: the image, or another layer ('denoised'), as far as it
        has come."""
        return self._transport.run(jobs_of.image(self.id, layer))

    def layers(self) -> dict[str, Array]:
        """All layers of the image by name: 'color', 'stderr', 'spp', those asked for by `aov`, and
        'denoised'."""
        return self._transport.run(jobs_of.layers(self.id))

    def png(self, exposure: float = 0, denoised: bool = False) -> bytes:
        """The image as a PNG file, brightened by `exposure` stops; `denoised`: its denoised layers."""
        return self._transport.run(jobs_of.png(self.id, exposure, denoised))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the image as OpenEXR, with all layers and the header that tells how it was made."""
        self._transport.run(jobs_of.save(self.id, path))

    def report(self) -> models.Report:
        """How the image was made, what it cost and how large its error is. Verdict.of(report) is the verdict
        in it."""
        return self._transport.run(jobs_of.report(self.id))

    def convergence(self) -> Curve:
        """{column: values at each checkpoint}: seconds, core_seconds, spp, relmse, ... NaN where there is
        no value."""
        return self._transport.run(snapshot.get_curve(self.id))

    def tiles(self) -> list[models.Tile]:
        """The tiles of the image: where they lie, their samples, error and workers."""
        return self._transport.run(jobs_of.tiles(self.id))

    def log(self) -> str:
        """What happened to the job, a line for each event."""
        return self._transport.run(jobs_of.log(self.id))

    def snapshot(self) -> Snapshot:
        """Picture, figures and curve as they are now, which a notebook shows."""
        return self._transport.run(snapshot.take(self.id))

    def frames(self) -> list[Job]:
        """Of a sequence: its frames, which are jobs."""
        return [
            Job(self._transport, self._transport.run(steps.get_job(id)))
            for id in jobs_of.frame_ids(self.refresh())
        ]

    def pause(self) -> Job:
        """Hands out no more of the job; workers finish what they have begun."""
        return self._change({"state": "paused"})

    def resume(self) -> Job:
        """Goes on with a paused job."""
        return self._change({"state": "running"})

    def cancel(self) -> Job:
        """Ends the job for good; its image stays as far as it has come."""
        return self._change({"state": "cancelled"})

    def prioritise(self, priority: int) -> Job:
        """Puts the job before all of a lower priority; 0 is the default."""
        return self._change({"priority": priority})

    def wait_for(self, *jobs: str | JobState) -> Job:
        """Lets the job begin when these jobs are done, by their ids or as Job objects; without any, it waits
        no more. `submit(after=[...])` says so from the first."""
        return self._change(
            {"after": [job.id if isinstance(job, JobState) else job for job in jobs]}
        )

    def extend(self, *, spp: int | None = None, target_error: float | None = None) -> Job:
        """Goes on to `spp` samples per pixel in all, or to a smaller error: the pixels of a job that had it
        from the first."""
        self._keep(self._transport.run(jobs_of.extend(self.id, spp, target_error)))
        return self

    def remove(self) -> None:
        """Cancels the job if it has not ended, and removes it with its images."""
        self._transport.run(jobs_of.remove(self.id))

    def _change(self, change: models.JobChange) -> Job:
        self._keep(self._transport.run(steps.change_job(self.id, change)))
        return self

    def _keep(self, view: models.Job) -> models.Job:
        self._view = view
        return view

    def _repr_html_(self) -> str:
        return self.snapshot()._repr_html_()

    def _repr_png_(self) -> bytes | None:
        return self.snapshot()._repr_png_()
