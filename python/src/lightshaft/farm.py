"""Farm and Job: the client that blocks until each response."""

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
from .light_groups import Mix
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
        """Closes the connections. `with Farm() as farm` does this automatically."""
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
        """Submits a scene with the files that it names.

        `scene`: the path of an XML file, a USD stage or an archive (.zip, .tar, .tar.gz); or a string of XML; or a
        dictionary as for Mitsuba's load_dict, which may contain arrays. Files are searched in `folder` (default: the
        folder of the scene's file, else the working directory). Files outside of it are sent only if they are in one
        of the folders `allow`. `assets`: {name in the scene: path or bytes}; they override files on the disk.
        `camera`: the path of the camera, for a stage with several. All other arguments are settings of the job
        (models.JobSpec): spp, target_error, time, size, denoise, aov, ... `reference` may be a path.
        """
        answer = self._transport.run(
            submission.submit(scene, spec, submission.Options(name, folder, allow, assets, camera))
        )
        for text in submission.warnings_of(answer):
            warnings.warn(text, SceneWarning, stacklevel=2)
        return self.job(answer["id"])

    def job(self, id: str) -> Job:
        """Returns the job, sequence or frame with this id."""
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
        """Lists the jobs of the farm in order of submission; a sequence is one job.

        `state`: only jobs in this state, or in one of these states, such as 'running'; 'held' jobs wait for others. `search`: only jobs with this
        text in their name or id. `owner`: only jobs of this user. `sort`: 'submitted', 'name', 'progress', 'relmse',
        ...; '-submitted' puts the newest first. `limit` and `offset`: return at most `limit` jobs and skip the first
        `offset`.
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

    def announced(self) -> list[models.AnnouncedJob]:
        """Lists jobs that `lightshaft submit --after-file` will submit once files on its machine are complete."""
        return self._transport.run(steps.listed("/api/v1/announced", "announced"))

    def workers(self) -> list[models.Worker]:
        """Lists the workers of the farm and their present work."""
        return self._transport.run(steps.listed("/api/v1/workers", "workers"))

    def worker_log(self, worker: str) -> str:
        """Returns the latest events of a worker, a line each: when it came and left, what failed on it. `worker`
        is its id. For tokens with the role admin or read."""
        return self._transport.run(
            steps.text_at(steps.worker_path(worker) + "/log")
        )

    def restart_worker(self, worker: str) -> None:
        """Lets a worker finish its units and then restart its program: after an upgrade, or to get memory back.
        `worker` is its id; it joins again with the same name and another id. For admins. A worker whose program
        cannot be run continues, and says so in its log."""
        self._transport.run(steps.change_worker(worker, "restarting"))

    def views(self) -> list[str]:
        """Lists the views in which the farm can show colours, those of its OpenColorIO configuration."""
        return self._transport.run(steps.listed("/api/v1/views", "views", str))


class Job(JobState):
    """A job of a farm. In a notebook it shows its picture, its figures and the curve of its error."""

    def __init__(self, transport: SyncTransport, view: models.Job) -> None:
        super().__init__(view)
        self._transport = transport

    def refresh(self) -> models.Job:
        """Fetches the job's state from the farm again, and updates state, progress and view."""
        return self._keep(self._transport.run(steps.get_job(self.id)))

    def wait(self, progress: Progress = None, timeout: float | None = None) -> Job:
        """Returns when the job is done; raises JobFailed if it ends otherwise, and WaitTimeout after
        `timeout` seconds. `progress`: True prints a line, a function is called with each view
        (models.Job)."""
        self._keep(self._transport.run(watching.wait(self.id, progress, timeout)))
        return self

    def live(self, interval: float = watching.LIVE_SECONDS) -> Job:
        """Shows picture and curve in a notebook, updates them, and returns when the job is done."""
        self._keep(self._transport.run(watching.live(self.id, interval)))
        return self

    def image(self, layer: str = "color", mix: Mix | None = None) -> Array:
        """Returns the image, or another layer ('denoised'), as an array (height, width, 3) of linear RGB in
        float32. Works while the job renders. `mix`: {light group: factor}, of the image in which the light of the
        groups is multiplied by these factors."""
        return self._transport.run(jobs_of.image(self.id, layer, mix))

    def layers(self) -> dict[str, Array]:
        """Returns all layers of the image by name: 'color', 'stderr', 'spp', the layers requested by `aov`, and
        'denoised'."""
        return self._transport.run(jobs_of.layers(self.id))

    def png(
        self, exposure: float = 0, denoised: bool = False, mix: Mix | None = None, view: str | None = None
    ) -> bytes:
        """Returns the image as a PNG file, brightened by `exposure` stops. `denoised`: use the denoised layers.
        `mix`: as of image(). `view`: how its colours are shown, one of Farm.views(); without it as sRGB."""
        return self._transport.run(jobs_of.png(self.id, exposure, denoised, mix, view))

    def save(self, path: str | os.PathLike[str], mix: Mix | None = None) -> None:
        """Writes the image as OpenEXR, with all layers and with a header that describes its origin. `mix`: as of
        image(); the file has no layers of light groups then."""
        self._transport.run(jobs_of.save(self.id, path, mix))

    def save_deep(self, path: str | os.PathLike[str]) -> None:
        """Writes the deep image of a job with `deep` that has ended as OpenEXR."""
        self._transport.run(jobs_of.save_deep(self.id, path))

    def mix(self, factors: Mix) -> models.MixError:
        """Returns the error of a mix of the image's light groups: relmse with its interval relmse_ci95, rmse, and
        whether they can be trusted. image(mix=factors) is the mixed image."""
        return self._transport.run(jobs_of.mix(self.id, factors))

    def report(self) -> models.Report:
        """Returns the report: how the image was made, what it cost and how large its error is. Verdict.of(report)
        is its verdict."""
        return self._transport.run(jobs_of.report(self.id))

    def meters(self) -> list[models.Meter]:
        """Lists what the meters of the scene have measured so far, each with its interval. Empty for a job that
        makes an image."""
        return self._transport.run(jobs_of.meters(self.id))

    def convergence(self) -> Curve:
        """Returns {column: values at each checkpoint}: seconds, core_seconds, spp, relmse, ... NaN marks missing
        values."""
        return self._transport.run(snapshot.get_curve(self.id))

    def tiles(self) -> list[models.Tile]:
        """Lists the tiles of the image with their position, samples, error and workers."""
        return self._transport.run(jobs_of.tiles(self.id))

    def log(self) -> str:
        """Returns the job's log, one line for each event."""
        return self._transport.run(jobs_of.log(self.id))

    def snapshot(self) -> Snapshot:
        """Returns the present picture, figures and curve, as a notebook shows them."""
        return self._transport.run(snapshot.take(self.id))

    def frames(self) -> list[Job]:
        """Lists the frames of a sequence. Each frame is a job."""
        return [
            Job(self._transport, self._transport.run(steps.get_job(id)))
            for id in jobs_of.frame_ids(self.refresh())
        ]

    def pause(self) -> Job:
        """Pauses the job. Workers finish the units that they have started."""
        return self._change({"state": "paused"})

    def resume(self) -> Job:
        """Continues a paused job."""
        return self._change({"state": "running"})

    def cancel(self) -> Job:
        """Cancels the job for good. Its image so far is kept."""
        return self._change({"state": "cancelled"})

    def prioritise(self, priority: int) -> Job:
        """Sets the priority. Jobs of higher priority are rendered first; the default is 0."""
        return self._change({"priority": priority})

    def wait_for(self, *jobs: str | JobState) -> Job:
        """Makes the job wait until these jobs are done, given by their ids or as Job objects. Without arguments
        the job stops waiting. `submit(after=[...])` does the same from the beginning."""
        return self._change(
            {"after": [job.id if isinstance(job, JobState) else job for job in jobs]}
        )

    def extend(self, *, spp: int | None = None, target_error: float | None = None) -> Job:
        """Extends the job to a total of `spp` samples per pixel, or to a smaller target error. The pixels are
        those of a job that was submitted with this setting."""
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
