"""The objects of the farm's HTTP interface, as they are sent. Made by python/generate.py; do not edit."""

from typing import Any, Literal, NotRequired, TypedDict, Union


class Layers(TypedDict):
    size: list[int]
    """Width and height of level 0."""
    max_level: int
    max_side: int
    """Pixels on a side of one request."""
    max_pixels: int
    """Pixels of level 0 that one request may stand for."""
    layers: list["LayersLayers"]


class LayersLayers(TypedDict):
    name: str
    """`rgb`; `stderr`, the standard error of each value of it; `error`, the relative standard error of a
    pixel; `spp`, its samples; AOVs."""
    channels: list[str]
    """Of a cryptomatte `id0`, `coverage0` and so on: the three identifiers with the largest coverage."""
    format: Literal["half", "float"]
    blocks: Literal["mean", "error_of_mean", "root_mean_square", "first"]
    """How the pixels of a block become one in levels above 0."""
    names: NotRequired[Union[dict[str, str], None]]
    """Of a cryptomatte: name -> identifier, eight hexadecimal digits of the float's bits. null: not
    known."""


class Problem(TypedDict):
    """RFC 9457."""
    type: str
    title: str
    status: int
    detail: str
    diagnostics: NotRequired[list["ProblemDiagnostics"]]
    """Of a scene that was refused."""


class ProblemDiagnostics(TypedDict):
    severity: Literal["error", "warning"]
    file: str
    line: int
    column: int
    text: str
    source_line: NotRequired[str]
    """The line itself; empty if there is none."""
    length: NotRequired[int]
    """Characters to underline from the column on."""


class Token(TypedDict):
    id: str
    """The first 16 digits of the token's SHA-256."""
    role: Literal["admin", "submit", "read", "join"]
    user: str
    of_file: bool
    """The file `token` or `join-token` of the data folder: replaced by deleting it, not revoked."""
    token: NotRequired[str]
    """In the answer that made it only."""


class JobSpec(TypedDict):
    spp: NotRequired[int]
    target_error: NotRequired[float]
    """relMSE"""
    target_layer: NotRequired[Literal["raw", "denoised"]]
    """Whose relMSE target_error means: that of the image as rendered (raw, the default), or that of its
    denoised layers, which are then made. 409 if the coordinator has no Open Image Denoise."""
    time: NotRequired[float]
    """seconds"""
    seed: NotRequired[int]
    size: NotRequired[Union[tuple[int, int], list[int]]]
    """[width, height]"""
    integrator: NotRequired[str]
    aov: NotRequired[list[str]]
    """Further layers of the image (docs/reference/aovs.md)."""
    defines: NotRequired[dict[str, str]]
    priority: NotRequired[int]
    float: NotRequired[bool]
    denoise: NotRequired[bool]
    """Also write the layers denoised.R, G, B, with their own error in the report. 409 if the coordinator
    has no Open Image Denoise."""
    tags: NotRequired[list[str]]
    max_workers: NotRequired[int]
    """At most so many workers hold units of it at once."""
    max_units: NotRequired[int]
    """At most so many units of it are lent at once."""
    memory: NotRequired[int]
    """Bytes of memory that a worker must have; without it, as many as the job's files have."""
    numeric_class: NotRequired[str]
    """Only workers of this numeric class render it, by the beginning of its digits or of its platform:
    armv8-a, say."""
    after: NotRequired[list[str]]
    """Ids of jobs that must be done before this one begins. A frame waits for the frame of its number in a
    sequence of the same frames, and for all frames of another. Unknown jobs are refused with 400, those
    that have failed or were cancelled with 409."""
    frames: NotRequired[str]
    """A sequence: FIRST-LAST, or FIRST-LASTxSTEP; at most 10000 frames. In the names of files a run of #
    stands for the frame's number, zero-padded to its length, and $frame is defined to be it. Frame N has
    the seed `seed` + N. `time` and `target_error` hold for each frame. All frames are read, and all files
    checked, before the job is taken."""
    reference: NotRequired[str]
    """SHA-256 of a blob: the right image, an EXR of the job's size, which every checkpoint is compared
    with. The square of its layers stderr.R, stderr.G, stderr.B, where it has them, is subtracted from the
    squared difference. It must be independent of the job: of another seed."""


class Video(TypedDict):
    state: Literal["none", "waiting", "making", "ready", "failed"]
    fps: Union[float, None]
    """Asked; null: there is no video."""
    exposure: Union[float, None]
    """Asked, in stops."""
    layer: Union[str, None]
    """Asked: rgb or denoised."""
    frames: int
    """That it has."""
    frames_done: int
    """That are in it so far."""
    bytes: Union[int, None]
    """Of a video that is ready."""
    error: Union[str, None]
    """Why it failed."""


class JobChange(TypedDict):
    state: NotRequired[Literal["paused", "running", "cancelled"]]
    priority: NotRequired[int]
    spp: NotRequired[int]
    """The new total. A job whose end is decided gets it in all its tiles, and has no target error or time
    any more."""
    target_error: NotRequired[float]
    """Of a job that has one. A smaller one goes on where a larger one ended, to the same pixels as with the
    smaller one from the first. Not together with `spp`."""
    after: NotRequired[list[str]]
    """The jobs that it waits for from now on, instead of those before; []: for none. A job that would wait
    for itself, directly or by way of others, is refused with 400. One that has begun is refused with 409:
    pause it instead. Of a sequence, the frames that have begun go on, and the others wait."""
    focus: NotRequired[Union[list[int], None]]
    """[x0, y0, x1, y1] in pixels, x1 and y1 excluded: the tiles that these pixels lie in get the next
    samples before all others. null: all tiles are treated alike again. It changes the order of the work
    alone; an image by spp or target_error has the same bits with and without it. Kept with the job. Of a
    sequence: of all its frames."""


class Job(TypedDict):
    id: str
    name: NotRequired[str]
    """Scene file."""
    owner: NotRequired[str]
    """User whose token handed it in; empty: the admin, or a version before there were users."""
    state: Literal["queued", "running", "paused", "done", "failed", "cancelled"]
    stopped: NotRequired[Union[str, None]]
    """Why it went no further: spp, error, time; user: cancelled."""
    progress: float
    spp: int
    """Asked."""
    spp_asked: NotRequired[Union[int, None]]
    """null: its target error or its time ends it, and spp is only the most that any pixel gets."""
    target_error: NotRequired[Union[float, None]]
    """relMSE, asked."""
    target_layer: NotRequired[Union[str, None]]
    """Whose relMSE target_error means: raw or denoised; null: there is no target."""
    denoised_check: NotRequired[Union["JobDenoisedCheck", None]]
    """When the error of the denoised layers was last compared with the target."""
    denoise: NotRequired[bool]
    """The image also gets the layers denoised.R, G, B."""
    spp_done: NotRequired[float]
    """Mean over pixels."""
    rmse: NotRequired[Union[float, None]]
    """Estimated."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """[low, high] for the error of this very image; null also for jobs of earlier versions."""
    relmse: Union[float, None]
    """Estimated."""
    relmse_ci95: Union[list[float], None]
    """[low, high] for the error of this very image."""
    reference: NotRequired[Union["JobReference", None]]
    """True error against the reference at the last checkpoint."""
    reference_same_seed: NotRequired[bool]
    """The reference was rendered of this scene with this seed: its noise is the image's own, the true
    figures say nothing, and no verdict is drawn from them."""
    verdict: NotRequired[Union["JobVerdict", None]]
    """What to think of the figures; null: none yet."""
    few_hits: NotRequired[Union[int, None]]
    """Pixels that too few samples have brought light to."""
    pixels_without_samples: NotRequired[Union[int, None]]
    """Pixels of tiles that nothing has come of yet; null: not known."""
    slope: NotRequired[Union[float, None]]
    """Of log relMSE over log core seconds, about -1; null: too few checkpoints."""
    slope_ci95: NotRequired[Union[list[float], None]]
    """[low, high] for slope."""
    efficiency_per_core: NotRequired[Union[float, None]]
    """1 / (relmse x core seconds) at the last checkpoint."""
    eta_seconds: Union[float, None]
    """Predicted time left."""
    eta_ci95: NotRequired[Union[list[float], None]]
    """[low, high] for eta_seconds, where it is the target error that ends the job."""
    eta_with_more: NotRequired[Union["JobEtaWithMore", None]]
    """Predicted time left with more workers like those there are; null where they would not help."""
    eta_with_8_more: NotRequired[Union[float, None]]
    """seconds of eta_with_more; goes with the next version."""
    eta_with_8_more_ci95: NotRequired[Union[list[float], None]]
    """ci95 of eta_with_more; goes with the next version."""
    error: Union[str, None]
    """Why it failed, or stands still."""
    after: NotRequired[list["JobAfter"]]
    """The jobs that it waits for and that are not done yet; it is `queued` and gets no worker before they
    are. Of a sequence: those of its first frame that waits."""
    waits_for: NotRequired[Union[str, None]]
    """The same in a sentence. If one of them has failed, was cancelled or removed, the sentence says what
    to do, and is in `error`, too."""
    denoised: NotRequired[Union["JobDenoised", None]]
    """Error of the denoised layers of a job that is done; null: it has none, or is a sequence."""
    warnings: NotRequired[list[str]]
    fake: NotRequired[bool]
    """Fake workers (--fake) make its pixels up: it is no picture of the scene."""
    size: NotRequired[list[int]]
    """[width, height]"""
    tile: NotRequired[int]
    priority: NotRequired[int]
    focus: NotRequired[Union[list[int], None]]
    """[x0, y0, x1, y1]: the pixels whose tiles get the next samples first; null: all tiles are treated
    alike. Of a sequence: that of all frames, if they have the same."""
    max_workers: NotRequired[Union[int, None]]
    """Asked."""
    max_units: NotRequired[Union[int, None]]
    """Asked."""
    memory_bytes: NotRequired[int]
    """That a worker must have, at least."""
    numeric_class: NotRequired[Union[str, None]]
    """The class that it is pinned to; null: none yet."""
    platform: NotRequired[Union[str, None]]
    """Processor, compiler and Embree of that class."""
    class_share: NotRequired[Union["JobClassShare", None]]
    """How much of the farm can take it: the workers of the class that it is pinned to, and their threads,
    of all that are connected; share is that of the threads, null if nobody is connected. Null of a job that
    is pinned to no class yet or has ended, and of a sequence."""
    units_done: NotRequired[int]
    units_total: NotRequired[int]
    elapsed_seconds: NotRequired[float]
    core_seconds: NotRequired[float]
    """CPU time of workers for its units."""
    queued_core_seconds: NotRequired[float]
    """Predicted CPU time of its units that no worker holds; 0 also if nothing was measured yet."""
    time: NotRequired["TimeSplit"]
    submitted_unix: NotRequired[float]
    sequence: NotRequired[Union[str, None]]
    """Of a frame: the job that it belongs to."""
    frame: NotRequired[Union[int, None]]
    """Of a frame: its number."""
    frames: NotRequired[Union["Frames", None]]
    """Of a sequence. Its other figures are of all frames together: sums, means over pixels (errors: over
    the frames that have some), and elapsed_seconds from the first ray of any frame to the last fold."""
    health: NotRequired["Health"]


class JobDenoisedCheck(TypedDict):
    """When the error of the denoised layers was last compared with the target."""
    spp: NotRequired[float]
    """Mean over pixels, then."""
    relmse: NotRequired[float]
    """Estimated."""
    at_most: NotRequired[Union[float, None]]
    """Upper end of the 95 % interval, which is compared; null: it is not known."""


class JobReference(TypedDict):
    """True error against the reference at the last checkpoint."""
    rmse: NotRequired[float]
    relmse: NotRequired[float]
    flip: NotRequired[Union[float, None]]
    below_noise: NotRequired[bool]
    """relmse is less than three standard errors of the reference's own noise: less than can be told, not
    0."""
    rmse_below_noise: NotRequired[bool]
    """The same of rmse."""


class JobVerdict(TypedDict):
    """What to think of the figures; null: none yet."""
    kind: NotRequired[Literal["early", "converging", "fast", "heavy_tail", "bias_floor"]]
    words: NotRequired[str]
    trusted: NotRequired[bool]
    """false: don't trust yet, the words say why; the intervals mean little."""
    advice: NotRequired[Union[str, None]]
    """What a user can do where the figures are not trusted, with the command; null: nothing is needed."""


class JobEtaWithMore(TypedDict):
    """Predicted time left with more workers like those there are; null where they would not help."""
    workers: NotRequired[int]
    """How many more."""
    seconds: NotRequired[float]
    ci95: NotRequired[Union[list[float], None]]
    """[low, high] for seconds, as eta_ci95."""


class JobAfter(TypedDict):
    id: NotRequired[str]
    state: NotRequired[Union[str, None]]
    """null: there is no such job any more."""


class JobDenoised(TypedDict):
    """Error of the denoised layers of a job that is done; null: it has none, or is a sequence."""
    relmse: NotRequired[float]
    relmse_ci95: NotRequired[Union[list[float], None]]


class JobClassShare(TypedDict):
    """How much of the farm can take it: the workers of the class that it is pinned to, and their threads,
    of all that are connected; share is that of the threads, null if nobody is connected. Null of a job that
    is pinned to no class yet or has ended, and of a sequence."""
    workers: NotRequired[int]
    of_workers: NotRequired[int]
    threads: NotRequired[int]
    of_threads: NotRequired[int]
    share: NotRequired[Union[float, None]]


class TimeSplit(TypedDict):
    """Where the time went, in core seconds: of the workers, but for merge. After a kill of the coordinator
    all but render may lack what was counted since the job's record was last stored."""
    load: float
    """Getting the job's files."""
    build: float
    """Reading them and making worlds of them."""
    render: float
    """CPU time of units: core_seconds."""
    transfer: float
    """Packing results."""
    merge: float
    """Of the coordinator: checking and folding results."""
    idle: float
    """Render threads standing still between two units of the job."""


class Health(TypedDict):
    """Of what is in the image. All zero and without causes on a healthy job."""
    clean: bool
    nonfinite: int
    """Rejected samples: counted, contributing zero, staying in the count of samples."""
    negative: int
    """Samples below zero; they are kept."""
    majorant_violations: int
    """Densities met above their bound."""
    causes: list["HealthCauses"]


class HealthCauses(TypedDict):
    cause: str
    """not_a_number, infinite, too_large, negative_density, ..."""
    effect: Literal["rejected", "kept", "input"]
    """input: the scene's, changed before rendering; it has no pixel."""
    count: int
    text: str
    """A sentence for a person."""
    frame: Union[int, None]
    """Of a sequence: the first frame that has it; first and replay are of that one."""
    first: list["HealthCausesFirst"]
    """The first eight, row by row, then by sample."""
    replay: Union[str, None]
    """The command that renders the first of them again."""


class HealthCausesFirst(TypedDict):
    pixel: NotRequired[list[int]]
    sample: NotRequired[int]


class Frames(TypedDict):
    range: str
    """As asked: 1-10, 1-10x2."""
    total: int
    done: int
    running: int
    failed: int
    cancelled: int
    current: int
    """The frame to look at: the first that is being rendered, else the last that there is something of."""
    list: NotRequired[list["FramesList"]]
    """Ascending; in GET /api/v1/jobs/{id} only."""


class FramesList(TypedDict):
    frame: NotRequired[int]
    id: NotRequired[str]
    """The frame is a job of this id, and has its own events."""
    state: NotRequired[Literal["queued", "running", "paused", "done", "failed", "cancelled"]]
    progress: NotRequired[float]
    spp_done: NotRequired[float]
    relmse: NotRequired[Union[float, None]]
    error: NotRequired[Union[str, None]]


class Tile(TypedDict):
    tile: NotRequired[int]
    rect: NotRequired[list[int]]
    """[x0, y0, x1, y1], the end outside."""
    rounds: NotRequired[int]
    spp: NotRequired[int]
    relmse: NotRequired[Union[float, None]]
    """Estimated, of the tile; null before its first sample."""
    workers: NotRequired[list[str]]


class TileEvent(TypedDict):
    job: NotRequired[str]
    tile: NotRequired[int]
    rect: NotRequired[list[int]]
    state: NotRequired[Literal["leased", "folded", "free"]]
    spp: NotRequired[int]
    worker: NotRequired[Union[str, None]]


class Worker(TypedDict):
    id: NotRequired[str]
    name: NotRequired[str]
    build: NotRequired[str]
    numeric_class: NotRequired[str]
    platform: NotRequired[Union[str, None]]
    """Processor, compiler and Embree of that class; null: not told."""
    fake: NotRequired[bool]
    """It makes pixels up (--fake) instead of rendering, for tests of the farm."""
    threads: NotRequired[int]
    tags: NotRequired[list[str]]
    state: NotRequired[Literal["connected", "draining", "lost", "sick", "gone"]]
    activity: NotRequired[str]
    job: NotRequired[Union[str, None]]
    units_done: NotRequired[int]
    cpu_seconds: NotRequired[float]
    rss_bytes: NotRequired[int]
    memory_bytes: NotRequired[int]
    """That it may use; 0: not told."""
    last_seen_seconds: NotRequired[float]


class Report(TypedDict):
    job: NotRequired[str]
    name: NotRequired[str]
    """Scene file."""
    state: NotRequired[Literal["queued", "running", "paused", "done", "failed", "cancelled"]]
    error: NotRequired[Union[str, None]]
    """Why it failed."""
    scene: NotRequired[str]
    """SHA-256 of the scene as workers get it."""
    size: NotRequired[list[int]]
    """[width, height]"""
    seed: NotRequired[int]
    integrator: NotRequired[str]
    max_depth: NotRequired[int]
    """Path segments at most; -1: unlimited."""
    rr_depth: NotRequired[int]
    """First depth at which Russian roulette may act."""
    spp_asked: NotRequired[Union[int, None]]
    """Samples per pixel that were asked for, by the job or by its scene; null: its target error or its time
    ends it."""
    time_asked: NotRequired[Union[float, None]]
    """Seconds since the first ray that were asked for."""
    build: NotRequired[str]
    """Of the worker that the job was pinned with."""
    platform: NotRequired[Union[str, None]]
    """Processor, compiler and Embree of the numeric class."""
    fake: NotRequired[bool]
    """Fake workers (--fake) made its pixels up: it is no picture of the scene."""
    warnings: NotRequired[list[str]]
    submitted_unix: NotRequired[float]
    target_error: NotRequired[Union[float, None]]
    """relMSE that was asked for."""
    target_layer: NotRequired[Union[str, None]]
    """Whose relMSE that is: raw or denoised; null: there is no target."""
    denoised_checks: NotRequired[list["ReportDenoisedChecks"]]
    """Of a job whose target is that of the denoised layers: each comparison with it. The job ends when the
    upper end is at most the target twice in succession."""
    forecast: NotRequired[Union["ReportForecast", None]]
    """What it costs to come down to the target (asked: true) or, where that is reached or there is none, to
    half of relmse."""
    spp: float
    samples: int
    load_seconds: float
    render_seconds: float
    """First ray to last fold."""
    core_seconds: float
    time: NotRequired["TimeSplit"]
    denoised: NotRequired[Union["ReportDenoised", None]]
    """Of a job with `denoise` that has ended: the denoised image."""
    adaptive: NotRequired[bool]
    """It had a target error: tiles have as many samples as their errors asked for, spp is the mean over
    pixels."""
    note: NotRequired[str]
    """What to know of an image that was stopped by its error (a small bias) or by time."""
    peak_rss_bytes: int
    rmse: Union[float, None]
    """Estimated."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """[low, high] for the error of this very image."""
    relmse: Union[float, None]
    """Estimated."""
    relmse_ci95: Union[list[float], None]
    mean: NotRequired[Union[list[float], None]]
    """Mean of the image in R, G and B."""
    mean_ci95: NotRequired[Union[list[list[float]], None]]
    """95 % interval [low, high] of the right mean in R, G and B; null while the error is not trusted, and
    where rare bright light may be missing."""
    relmse_16: NotRequired[Union[float, None]]
    """relMSE of the means over squares of 16 x 16 pixels."""
    relmse_16_ci95: NotRequired[Union[list[float], None]]
    """[low, high] for the error of this very image; null where mean_ci95 is, and where few squares carry
    the error."""
    pixels_without_samples: NotRequired[int]
    """The figures of the error are of the other pixels."""
    slope: NotRequired[Union[float, None]]
    """Of log relMSE over log core seconds, about -1; null: too few checkpoints."""
    slope_ci95: NotRequired[Union[list[float], None]]
    """[low, high] for slope."""
    trend: NotRequired[str]
    """The slope in words."""
    efficiency: NotRequired[Union[float, None]]
    """1 / (relmse x render_seconds), on `threads` threads."""
    efficiency_per_core: NotRequired[Union[float, None]]
    """1 / (relmse x core_seconds)."""
    threads: NotRequired[Union[float, None]]
    """That rendered, in the mean: core_seconds / render_seconds."""
    nonfinite_samples: int
    negative_samples: NotRequired[int]
    majorant_violations: NotRequired[int]
    clamped_values: NotRequired[int]
    """Above 65504, the largest half; 0 with float."""
    health: NotRequired["Health"]
    pixels_sha256: Union[str, None]
    """Of a sequence: SHA-256 over the 32 bytes of each frame's, in order, once all are done."""
    features_used: list[str]
    features_left_out: list[str]
    techniques: NotRequired[list["ReportTechniques"]]
    """What the workers' integrator did besides directions and next-event estimation at vertices to find
    light. What each costs and brings: tests/bench/techniques.py."""
    needs: NotRequired[Union[dict[str, Any], None]]
    """What the scene needs of the renderer, as flags and counts; null for jobs of earlier versions."""
    analysis: NotRequired[Union[dict[str, Any], None]]
    """parts: [{part, used, why, bytes}] of the renderer, bytes being those of the files that the part
    reads; left_out: [{what, why, count, bytes}], what no pixel depends on and was therefore neither stored
    nor sent."""
    numeric_class: Union[str, None]
    stopped: Union[str, None]
    verdict: NotRequired[str]
    """What to think of the figures, in words."""
    verdict_kind: NotRequired[Literal["early", "converging", "fast", "heavy_tail", "bias_floor"]]
    trusted: NotRequired[bool]
    """false: don't trust yet, the verdict says why; the intervals mean little."""
    advice: NotRequired[Union[str, None]]
    """What a user can do where the figures are not trusted, with the command; null: nothing is needed."""
    few_hits_pixels: NotRequired[Union[int, None]]
    """Pixels that too few samples have brought light to; magenta in error.png."""
    true_rmse: NotRequired[float]
    """With a reference, its own noise subtracted. Of the last checkpoint, as true_relmse and true_flip."""
    true_relmse: NotRequired[float]
    true_flip: NotRequired[Union[float, None]]
    """Mean HDR-FLIP."""
    true_rmse_below_noise: NotRequired[bool]
    """As reference.rmse_below_noise."""
    true_relmse_below_noise: NotRequired[bool]
    """As reference.below_noise."""
    reference: NotRequired[Union[dict[str, Any], None]]
    """digest, the figures above as rmse, relmse and flip, and the reference's own noise_rmse and
    noise_relmse, null where it brings no layers of errors. below_noise: the image differs from it by no
    more than its own noise (relmse is less than three standard errors, relmse_stderr, above 0), so that the
    true error is less than can be told; rmse_below_noise: the same of rmse, by mse_stderr, the standard
    error of its square. Both standard errors are null where noise_relmse is. same_seed: it was rendered of
    this scene with this seed, so that its noise is the image's own: the true figures say nothing, and no
    verdict is drawn from them."""
    frames: NotRequired[list[dict[str, Any]]]
    """Of a sequence: frame, job, state, and these figures of each. Its convergence is empty: every frame
    has its own."""
    convergence: list["ReportConvergence"]


class ReportDenoisedChecks(TypedDict):
    spp: NotRequired[float]
    """Mean over pixels, then."""
    relmse: NotRequired[float]
    """Estimated."""
    at_most: NotRequired[Union[float, None]]
    """Upper end of the 95 % interval; null: it is not known."""


class ReportForecast(TypedDict):
    """What it costs to come down to the target (asked: true) or, where that is reached or there is none, to
    half of relmse."""
    target: NotRequired[float]
    asked: NotRequired[bool]
    spp: NotRequired[float]
    """Mean samples per pixel there."""
    core_seconds: NotRequired[float]
    """Still to spend."""
    core_seconds_ci95: NotRequired[list[float]]


class ReportDenoised(TypedDict):
    """Of a job with `denoise` that has ended: the denoised image."""
    by: NotRequired[str]
    """Name and version of the denoiser."""
    seconds: NotRequired[float]
    """that denoising took"""
    rmse: NotRequired[float]
    """Estimated from the two halves of the samples, see docs/design/denoising.md."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """95 % interval; null where so few pixels carry the noise that it is not known"""
    relmse: NotRequired[float]
    relmse_ci95: NotRequired[Union[list[float], None]]
    """95 % interval; null where so few pixels carry the noise that it is not known"""
    true_rmse: NotRequired[float]
    """Against the job's reference, if it has one."""
    true_relmse: NotRequired[float]
    true_relmse_stderr: NotRequired[float]
    """from the reference's own noise"""
    error: NotRequired[str]
    """Why there is no denoised image; then nothing else stands here."""


class ReportTechniques(TypedDict):
    name: NotRequired[str]
    what: NotRequired[str]
    off: NotRequired["ReportTechniquesOff"]
    """Parameter of the scene's integrator that switches it off."""


class ReportTechniquesOff(TypedDict):
    """Parameter of the scene's integrator that switches it off."""
    parameter: NotRequired[str]
    value: NotRequired[str]


class ReportConvergence(TypedDict):
    seconds: NotRequired[float]
    core_seconds: NotRequired[float]
    spp: NotRequired[float]
    rmse: NotRequired[Union[float, None]]
    """Estimated."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """Of this checkpoint; missing in jobs of earlier versions."""
    relmse: NotRequired[Union[float, None]]
    """Estimated."""
    relmse_ci95: NotRequired[Union[list[float], None]]
    true_rmse: NotRequired[float]
    """With a reference."""
    true_relmse: NotRequired[float]
    true_flip: NotRequired[Union[float, None]]
    """At doubling samples and at the end."""
    true_rmse_below_noise: NotRequired[bool]
    """With a reference: less than its own noise lets one tell."""
    true_relmse_below_noise: NotRequired[bool]
    forecast: NotRequired[dict[str, Any]]
    """With a target error, at doubling samples: what was predicted there. core_seconds still to spend,
    core_seconds_ci95 [low, high], and the spp at the target."""


class WhoAmIAnswer(TypedDict):
    role: Literal["admin", "submit", "read"]
    user: str
    version: str
    """Of the coordinator's program."""


class ListJobsAnswer(TypedDict):
    jobs: list["Job"]
    total: int
    """Jobs that were asked for, on all pages."""
    states: dict[str, int]
    """How many jobs this token may see in each state, whatever was asked for."""
    owners: list[str]
    """Of all jobs that this token may see."""


class SubmitJobAnswer(TypedDict):
    id: str
    url: str
    warnings: list[str]
    reference_same_seed: NotRequired[bool]
    """The reference was rendered of this scene with this seed: the true figures will say nothing."""


class SubmitAgainAnswer(TypedDict):
    id: str
    url: str
    warnings: list[str]
    reference_same_seed: NotRequired[bool]
    """The reference was rendered of this scene with this seed: the true figures will say nothing."""


class GetTilesAnswer(TypedDict):
    tiles: list["Tile"]


class ListTokensAnswer(TypedDict):
    tokens: list["Token"]


class ListWorkersAnswer(TypedDict):
    workers: list["Worker"]
    join: NotRequired["ListWorkersAnswerJoin"]
    """How further workers join."""


class ListWorkersAnswerJoin(TypedDict):
    """How further workers join."""
    address: NotRequired[str]
    """HOST:PORT of the workers' port: as the coordinator listens, or as its operator says."""
    tls: NotRequired[bool]
    """Workers need the authority's certificate, and a certificate of their own with its key."""
    token_file: NotRequired[str]
    """On the coordinator's machine; for admins."""


class MissingBlobsAnswer(TypedDict):
    missing: list[str]
