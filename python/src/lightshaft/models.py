"""The objects of the farm's HTTP interface, as they are sent. Made by python/generate.py; do not edit."""

from typing import Any, Literal, NotRequired, TypedDict, Union


class MixError(TypedDict):
    mix: dict[str, Any]
    """The mix as it was read."""
    groups: list[str]
    """The names of the image's light groups."""
    relmse: Union[float, None]
    """The estimated relMSE of the mixed image. null: there are no samples yet."""
    relmse_ci95: Union[list[float], None]
    """[low, high]: the 95 % interval of relmse."""
    rmse: Union[float, None]
    """The estimated root mean squared error."""
    trusted: bool
    """Whether the figures can be trusted."""
    verdict: str
    """"trusted", or why the figures cannot be trusted."""


class Layers(TypedDict):
    size: list[int]
    """Width and height of level 0."""
    max_level: int
    max_side: int
    """Largest width and height of one request, in pixels."""
    max_pixels: int
    """Largest number of level 0 pixels that one request may cover."""
    layers: list["LayersLayers"]


class LayersLayers(TypedDict):
    name: str
    """Name of the layer. `rgb` is the image, `stderr` the standard error of each of its values, `error` the
    relative standard error of each pixel, `spp` the number of samples; the others are AOVs."""
    channels: list[str]
    """Names of the channels. A cryptomatte has `id0`, `coverage0` and so on: the three identifiers with the
    largest coverage."""
    format: Literal["half", "float"]
    blocks: Literal["mean", "error_of_mean", "root_mean_square", "first"]
    """How the pixels of a block are combined into one pixel in levels above 0."""
    names: NotRequired[Union[dict[str, str], None]]
    """Names of a cryptomatte, each with its identifier: the float's bits as eight hexadecimal digits. null:
    unknown."""


class Problem(TypedDict):
    """An error as in RFC 9457."""
    type: str
    title: str
    status: int
    detail: str
    diagnostics: NotRequired[list["ProblemDiagnostics"]]
    """The errors in a refused scene."""


class ProblemDiagnostics(TypedDict):
    severity: Literal["error", "warning"]
    file: str
    line: int
    column: int
    text: str
    source_line: NotRequired[str]
    """The line of the scene file. Empty if there is none."""
    length: NotRequired[int]
    """Number of characters to underline, from the column on."""


class Token(TypedDict):
    id: str
    """The first 16 digits of the token's SHA-256."""
    role: Literal["admin", "submit", "read", "join"]
    user: str
    of_file: bool
    """True for the tokens in the files `token` and `join-token` of the data folder. They are replaced by
    deleting the file, and cannot be revoked."""
    token: NotRequired[str]
    """The token itself. Present only in the answer that creates it."""


class JobSpec(TypedDict):
    spp: NotRequired[int]
    """Samples per pixel; the scene's number if spp, a target error and a time are all missing. With a
    target error, no pixel gets more samples than this."""
    target_error: NotRequired[float]
    """The job ends when the estimated relMSE of its image is at most this. Tiles that need more samples for
    it get more."""
    target_layer: NotRequired[Literal["raw", "denoised"]]
    """The image whose error is compared with the target error: the image as rendered (raw) or its denoised
    layers (denoised). With "denoised" the image is denoised. 409 if the coordinator has no Open Image
    Denoise."""
    time: NotRequired[float]
    """The job ends this many seconds after its first ray."""
    seed: NotRequired[int]
    """Number from which all random numbers follow; another seed gives other noise. Without it, the seed is
    0."""
    frames: NotRequired[str]
    """The frames of a sequence, such as 1-10 or, for every second frame, 1-10x2; # in the names of files
    and $frame in the scene stand for the frame's number. Each frame is an image of its own; a sequence has
    at most 10000 frames. A run of # is replaced by the number with as many digits. Frame N has the seed
    `seed` + N. `time` and `target_error` apply to each frame. All frames are read, and all files checked,
    before the job is accepted."""
    fps: NotRequired[float]
    """Frames of the sequence per second, for the attribute framesPerSecond of the image."""
    size: NotRequired[Union[tuple[int, int], list[int]]]
    """Size of the image in pixels, instead of the size in the scene."""
    integrator: NotRequired[str]
    """Integrator, instead of the one in the scene. Possible are volpath, volpath_distant_mis, path,
    whitted."""
    techniques: NotRequired[str]
    """Sampling techniques that are used (+NAME) or not used (-NAME), for debugging. Possible are
    equiangular, exponential, camera_points, lamp_directions, lamp_flights, light_vertices, light_tree,
    path_reuse, shadow_roulette, sky_samples, path_splitting, sky_portals, local_lights, emissive_grids.
    Without it, they are chosen for the scene. Every image is right with any of them; only its noise
    differs."""
    aov: NotRequired[list[str]]
    """Further layers of the image (docs/reference/aovs.md). Possible are albedo, alpha, coverage,
    denoising_albedo, denoising_normal, depth, direct, emission, geo_normal, indirect, light_groups,
    material_id, multiple, normal, opacity, position, shadow_catcher, shape_id, single, surface, uv, volume,
    volume_light_groups, volume_opacity."""
    deep: NotRequired[int]
    """The image also has a deep image, with at most this many slices in each pixel, and one behind them for
    the environment; 0: none (docs/guide/compositing.md). Each slice takes 20 bytes a pixel in every unit's
    result and 40 in the coordinator's memory."""
    deep_alpha: NotRequired[bool]
    """The deep image has alpha and depths, but no colours, as holdouts need it. Each slice then takes 8
    bytes a pixel in every unit's result and 16 in the coordinator's memory. Needs `deep`."""
    mix: NotRequired[str]
    """Multiplies the light of the scene's light groups (docs/guide/light-groups.md): key=2,fill=0.5:0.4:0.3
    (R:G:B). The groups are those of `light_group` in the scene; `other` is the light without one."""
    defines: NotRequired[dict[str, str]]
    """Values of the scene's $NAME parameters."""
    priority: NotRequired[int]
    """Jobs with a higher priority are rendered first. With a token of the role `submit`, at most the value
    of the coordinator's option `--user-priority`."""
    float: NotRequired[bool]
    """The image has 32-bit numbers instead of 16-bit numbers."""
    color_space: NotRequired[Literal["rec709", "rec2020", "p3-d65", "acescg", "aces2065-1", "xyz"]]
    """Colour space of the image, to which its colours are converted when it is written. Possible are
    rec709, rec2020, p3-d65, acescg, aces2065-1, xyz. The scene is rendered in Rec. 709 in any case, and
    PNGs, videos and the dashboard stay sRGB (docs/reference/image-file.md)."""
    exr_compression: NotRequired[Literal["zip", "zips", "piz", "rle", "none", "dwaa", "dwab"]]
    """How the image is packed. Possible are zip, zips, piz, rle, none, dwaa, dwab. dwaa and dwab change the
    colours (lossy). They need exr_parts "layers", which keeps them away from the other layers, and such an
    image has no seal: `lightshaft verify` refuses it."""
    exr_parts: NotRequired[Literal["one", "layers"]]
    """Parts of the image: one for all layers, or one for each of the layers."""
    denoise: NotRequired[bool]
    """The image also has the layers denoised.R, denoised.G and denoised.B, whose error is in the report.
    Needs Open Image Denoise (deploy/install-denoiser.sh); 409 if the coordinator does not have it."""
    tags: NotRequired[list[str]]
    """Only workers that have all of these tags render the job."""
    max_workers: NotRequired[int]
    """At most this many workers render the job at the same time."""
    max_units: NotRequired[int]
    """At most this many units of the job are assigned to workers at the same time."""
    memory: NotRequired[int]
    """Only workers with at least this many bytes of memory render the job. Without it, or if the job's
    files are larger, the workers need as much memory as the files have bytes."""
    numeric_class: NotRequired[str]
    """Only workers of this numeric class render the job: the beginning of its digest or of its platform,
    such as armv8-a. `lightshaft workers` shows the classes."""
    after: NotRequired[list[str]]
    """Ids of jobs that must be done before this job begins. A frame of a sequence waits only for the frame
    with the same number if the other job is a sequence of the same frames; otherwise it waits for the whole
    job. A job that does not exist is an error (400), and so is one that has failed or was cancelled
    (409)."""
    reference: NotRequired[str]
    """SHA-256 of the blob of a reference image, with which every checkpoint is compared. The reference is
    an EXR of the job's size. If it has the layers stderr.R, stderr.G and stderr.B, their square is
    subtracted from the squared difference. It must be independent of the job, so it must have another seed.
    On the command line, `--reference FILE` uploads the file."""


class Video(TypedDict):
    state: Literal["none", "waiting", "making", "ready", "failed"]
    fps: Union[float, None]
    """Frames per second. null: there is no video."""
    exposure: Union[float, None]
    """Exposure in stops."""
    layer: Union[str, None]
    """The layer that the video shows: rgb or denoised."""
    view: NotRequired[Union[str, None]]
    """The view of its colours (GET /api/v1/views)."""
    frames: int
    """Number of frames in the finished video."""
    frames_done: int
    """Number of frames that are encoded so far."""
    bytes: Union[int, None]
    """Size of the finished video."""
    error: Union[str, None]
    """Why the video failed."""


class JobChange(TypedDict):
    name: NotRequired[str]
    """The job's name in lists."""
    state: NotRequired[Literal["paused", "running", "cancelled"]]
    """The job pauses, is rendered further, or ends for good."""
    priority: NotRequired[int]
    """Jobs with a higher priority are rendered first. With a token of the role `submit`, at most the value
    of the coordinator's option `--user-priority`."""
    spp: NotRequired[int]
    """The new total of samples per pixel. If the job has reached its end, all its tiles get this many
    samples, and it has no target error or time any more."""
    target_error: NotRequired[float]
    """The new target error of a job that has one. A smaller target continues a job that has reached a
    larger one; the pixels are the same as with the smaller target from the beginning. Not together with
    `spp`."""
    after: NotRequired[list[str]]
    """Ids of the jobs that must be done before this job begins; [] for none. They replace the earlier ones.
    A job that would wait for itself, directly or through other jobs, is an error (400), and so is a job
    that has begun (409): pause it instead. Frames of a sequence that have begun continue, and the others
    wait."""
    focus: NotRequired[Union[list[int], None]]
    """Rectangle [x0, y0, x1, y1] in pixels, without x1 and y1, whose tiles get the next samples before all
    others; null for none. It changes only the order of the work: an image that ends by `spp` or
    `target_error` has the same bits with and without it. It is stored with the job, and applies to all
    frames of a sequence."""


class Job(TypedDict):
    id: str
    name: NotRequired[str]
    """File name of the scene, or the name given at submission."""
    owner: NotRequired[str]
    """User whose token submitted the job. Empty: the admin."""
    state: Literal["queued", "running", "paused", "done", "failed", "cancelled"]
    stopped: NotRequired[Union[str, None]]
    """Why the job ended: spp, error, time, or user (it was cancelled)."""
    progress: float
    """From 0 to 1."""
    spp: int
    """Samples per pixel that the job asks for."""
    spp_asked: NotRequired[Union[int, None]]
    """Samples per pixel that the submission asked for. null: a target error or time limit ends the job, and
    spp is only an upper limit for each pixel."""
    target_error: NotRequired[Union[float, None]]
    """Target error, as relMSE."""
    target_layer: NotRequired[Union[str, None]]
    """The layer that must reach target_error: raw or denoised. null: the job has no target."""
    denoised_check: NotRequired[Union["JobDenoisedCheck", None]]
    """The last comparison of the denoised layers' error with the target."""
    denoise: NotRequired[bool]
    """True if the image also gets the layers denoised.R, denoised.G and denoised.B."""
    deep: NotRequired[int]
    """The most slices in a pixel of the deep image. 0: the job has none."""
    spp_done: NotRequired[float]
    """Samples per pixel so far, averaged over the pixels."""
    rmse: NotRequired[Union[float, None]]
    """Estimated from the image itself."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of the error of this image. null: unknown."""
    relmse: Union[float, None]
    """Estimated from the image itself."""
    relmse_ci95: Union[list[float], None]
    """[low, high]: the 95 % interval of the error of this image."""
    reference: NotRequired[Union["JobReference", None]]
    """True error: the difference from the reference at the last checkpoint."""
    reference_same_seed: NotRequired[bool]
    """True if the reference was rendered from this scene with this seed. It then has the same noise as the
    image, so its error figures mean nothing. No verdict is drawn from them."""
    verdict: NotRequired[Union["JobVerdict", None]]
    """How far the error figures can be trusted, in words. null: there are none yet."""
    few_hits: NotRequired[Union[int, None]]
    """Number of pixels where too few samples found light."""
    pixels_without_samples: NotRequired[Union[int, None]]
    """Number of pixels in tiles without results. null: unknown."""
    slope: NotRequired[Union[float, None]]
    """Slope of log relMSE over log core seconds, normally about -1. null: there are too few checkpoints."""
    slope_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of slope."""
    efficiency_per_core: NotRequired[Union[float, None]]
    """1 / (relmse x core seconds) at the last checkpoint."""
    eta_seconds: Union[float, None]
    """Predicted seconds until the job ends."""
    eta_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of eta_seconds, for a job that ends at a target error."""
    eta_with_more: NotRequired[Union["JobEtaWithMore", None]]
    """Predicted time left with more workers like the present ones. null: more workers would not help."""
    error: Union[str, None]
    """Why the job failed or does not progress."""
    failure: NotRequired[Union["JobFailure", None]]
    """Why the job failed, as data. null: it has not failed, or not because of a unit that could not be
    rendered; then `error` says why. Always null in lists."""
    after: NotRequired[list["JobAfter"]]
    """The jobs that this job waits for and that are not done yet. Until they are done it is `queued` and
    gets no worker. For a sequence: those of its first waiting frame."""
    waits_for: NotRequired[Union[str, None]]
    """The same as `after`, in a sentence. If one of those jobs failed, was cancelled or was removed, the
    sentence says what to do, and is also in `error`."""
    denoised: NotRequired[Union["JobDenoised", None]]
    """Error of the denoised layers of a job that is done. null: the job has no denoised layers, or is a
    sequence."""
    warnings: NotRequired[list[str]]
    """Warnings about the scene."""
    fake: NotRequired[bool]
    """True if fake workers (--fake) computed the pixels. The image does not show the scene."""
    size: NotRequired[list[int]]
    """[width, height] in pixels."""
    tile: NotRequired[int]
    """Side of a tile in pixels."""
    meters: NotRequired[int]
    """Number of values that the job measures (GET /api/v1/jobs/{id}/meters). Each has a square of 16 x 16
    pixels of the image. 0: the job makes an image."""
    priority: NotRequired[int]
    focus: NotRequired[Union[list[int], None]]
    """[x0, y0, x1, y1]: tiles in this rectangle get the next samples first. null: all tiles are treated
    alike. For a sequence: the rectangle of all frames, if it is the same."""
    max_workers: NotRequired[Union[int, None]]
    """Largest number of workers that may render the job at once."""
    max_units: NotRequired[Union[int, None]]
    """Largest number of units of the job that may be leased at once."""
    memory_bytes: NotRequired[int]
    """Memory that a worker must at least have to get units of the job."""
    numeric_class: NotRequired[Union[str, None]]
    """The numeric class whose workers render the job. null: not decided yet."""
    platform: NotRequired[Union[str, None]]
    """Processor, compiler and Embree version of that class."""
    class_share: NotRequired[Union["JobClassShare", None]]
    """How much of the farm can render the job: the connected workers of its numeric class and their
    threads, beside those of all classes. `share` is the class's share of all threads, null if no worker is
    connected. null for a job without a class, for one that has ended, and for a sequence."""
    units_done: NotRequired[int]
    units_total: NotRequired[int]
    elapsed_seconds: NotRequired[float]
    """Seconds since the job's first ray."""
    core_seconds: NotRequired[float]
    """CPU seconds that workers spent on the job's units."""
    queued_core_seconds: NotRequired[float]
    """Predicted CPU seconds of the units that no worker holds. 0 also if nothing was measured yet."""
    time: NotRequired["TimeSplit"]
    submitted_unix: NotRequired[float]
    """Time of submission in seconds since 1970."""
    sequence: NotRequired[Union[str, None]]
    """For a frame: the id of its sequence."""
    frame: NotRequired[Union[int, None]]
    """For a frame: its number."""
    frames: NotRequired[Union["Frames", None]]
    """For a sequence: its frames. The other figures of a sequence combine all frames: sums, and means over
    pixels (errors: over the frames that have them). elapsed_seconds runs from the first ray of any frame to
    the last result."""
    health: NotRequired["Health"]


class JobDenoisedCheck(TypedDict):
    """The last comparison of the denoised layers' error with the target."""
    spp: NotRequired[float]
    """Samples per pixel at that time, averaged over the pixels."""
    relmse: NotRequired[float]
    """Estimated from the image itself."""
    at_most: NotRequired[Union[float, None]]
    """Upper end of the 95 % interval, which is compared with the target. null: unknown."""


class JobReference(TypedDict):
    """True error: the difference from the reference at the last checkpoint."""
    rmse: NotRequired[float]
    relmse: NotRequired[float]
    flip: NotRequired[Union[float, None]]
    """Mean HDR-FLIP, the visible difference from 0 to 1. null: not computed."""
    below_noise: NotRequired[bool]
    """True if relmse is less than three standard errors of the reference's own noise. The true error is
    then too small to measure, not 0."""
    rmse_below_noise: NotRequired[bool]
    """True if the true RMSE is hidden by the reference's own noise."""


class JobVerdict(TypedDict):
    """How far the error figures can be trusted, in words. null: there are none yet."""
    kind: NotRequired[Literal["early", "converging", "fast", "heavy_tail", "bias_floor"]]
    words: NotRequired[str]
    trusted: NotRequired[bool]
    """False if the error figures cannot be trusted yet. The words say why, and the intervals mean
    little."""
    advice: NotRequired[Union[str, None]]
    """What a user can do if the figures are not trusted, with the command. null: nothing needs to be
    done."""


class JobEtaWithMore(TypedDict):
    """Predicted time left with more workers like the present ones. null: more workers would not help."""
    workers: NotRequired[int]
    """Number of additional workers."""
    seconds: NotRequired[float]
    ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of seconds."""


class JobFailure(TypedDict):
    """Why the job failed, as data. null: it has not failed, or not because of a unit that could not be
    rendered; then `error` says why. Always null in lists."""
    kind: NotRequired[Literal["unit", "scene", "no_worker"]]
    """unit: a unit failed on several workers. scene: the last worker said that the scene is at fault.
    no_worker: every worker has failed too many units of the job."""
    tile: NotRequired[int]
    rect: NotRequired[list[int]]
    """[x0, y0, x1, y1] of the tile, in pixels; x1 and y1 are exclusive."""
    round: NotRequired[int]
    samples: NotRequired[list[int]]
    """[first, end]: the samples of the round; end is exclusive."""
    frame: NotRequired[Union[int, None]]
    """The frame that failed, of a sequence."""
    attempts: NotRequired[list["JobFailureAttempts"]]
    """What the workers reported, the latest attempt last."""
    replay: NotRequired[Union[str, None]]
    """Command that renders the failed pixel again. null: the pixel is not known."""


class JobFailureAttempts(TypedDict):
    worker: NotRequired[str]
    """Name of the worker."""
    reason: NotRequired[Union[str, None]]
    signal: NotRequired[Union[int, None]]
    """Signal that ended the render process."""
    pixel: NotRequired[Union[list[int], None]]
    """[x, y] of the pixel that was being rendered."""
    sample: NotRequired[Union[int, None]]


class JobAfter(TypedDict):
    id: NotRequired[str]
    state: NotRequired[Union[str, None]]
    """State of that job. null: it has been removed."""


class JobDenoised(TypedDict):
    """Error of the denoised layers of a job that is done. null: the job has no denoised layers, or is a
    sequence."""
    relmse: NotRequired[float]
    relmse_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of relmse. null: unknown."""


class JobClassShare(TypedDict):
    """How much of the farm can render the job: the connected workers of its numeric class and their
    threads, beside those of all classes. `share` is the class's share of all threads, null if no worker is
    connected. null for a job without a class, for one that has ended, and for a sequence."""
    workers: NotRequired[int]
    of_workers: NotRequired[int]
    threads: NotRequired[int]
    of_threads: NotRequired[int]
    share: NotRequired[Union[float, None]]


class TimeSplit(TypedDict):
    """How the time was spent, in core seconds. All of it is workers' time except `merge`. If the
    coordinator was killed, times other than `render` may lack what was not stored before."""
    load: float
    """Fetching the job's files."""
    build: float
    """Reading the files and building worlds from them."""
    render: float
    """Rendering: CPU time of units, the same as core_seconds."""
    transfer: float
    """Encoding results."""
    merge: float
    """Checking results and adding them to the image, on the coordinator."""
    idle: float
    """Idle time of render threads between two units of the job."""


class Health(TypedDict):
    """Problems with numbers in the samples of the image. All counts are zero and there are no causes if the
    job is healthy."""
    clean: bool
    nonfinite: int
    """Samples that were not finite. They are rejected: they add zero to the image but count as samples."""
    negative: int
    """Samples below zero. They are kept."""
    majorant_violations: int
    """Places where a medium's density exceeded its upper bound."""
    causes: list["HealthCauses"]


class HealthCauses(TypedDict):
    cause: str
    """not_a_number, infinite, too_large, negative_density and others."""
    effect: Literal["rejected", "kept", "input"]
    """What happened to the sample. `input` means that the scene was changed before rendering; it has no
    pixel."""
    count: int
    text: str
    """The cause in a sentence."""
    frame: Union[int, None]
    """For a sequence: the first frame with this problem. `first` and `replay` refer to it."""
    first: list["HealthCausesFirst"]
    """The first eight places, ordered by row and then by sample."""
    replay: Union[str, None]
    """Command that renders the first of these samples again."""


class HealthCausesFirst(TypedDict):
    pixel: NotRequired[list[int]]
    sample: NotRequired[int]


class Frames(TypedDict):
    range: str
    """The frames as submitted, such as 1-10 or 1-10x2."""
    total: int
    done: int
    running: int
    failed: int
    cancelled: int
    current: int
    """The frame that is most interesting now: the first that is being rendered, or else the last that has
    an image."""
    list: NotRequired[list["FramesList"]]
    """All frames in ascending order. Only in GET /api/v1/jobs/{id}."""


class FramesList(TypedDict):
    frame: NotRequired[int]
    id: NotRequired[str]
    """Id of the frame, which is a job with its own events."""
    state: NotRequired[Literal["queued", "running", "paused", "done", "failed", "cancelled"]]
    progress: NotRequired[float]
    spp_done: NotRequired[float]
    relmse: NotRequired[Union[float, None]]
    error: NotRequired[Union[str, None]]


class Tile(TypedDict):
    tile: NotRequired[int]
    rect: NotRequired[list[int]]
    """[x0, y0, x1, y1] in pixels; x1 and y1 are exclusive."""
    rounds: NotRequired[int]
    """Rounds that are part of the image."""
    spp: NotRequired[int]
    relmse: NotRequired[Union[float, None]]
    """Estimated error of the tile. null until it has samples."""
    workers: NotRequired[list[str]]
    """Names of the workers that render the tile now."""


class TileEvent(TypedDict):
    job: NotRequired[str]
    tile: NotRequired[int]
    rect: NotRequired[list[int]]
    state: NotRequired[Literal["leased", "folded", "free"]]
    spp: NotRequired[int]
    worker: NotRequired[Union[str, None]]


class AnnouncedJob(TypedDict):
    id: NotRequired[str]
    """Id of the announcement."""
    name: NotRequired[str]
    """Name of the scene's file."""
    owner: NotRequired[str]
    """The user whose job it will be; empty for tokens of no user."""
    machine: NotRequired[str]
    """Name of the machine that waits for the files; may be empty."""
    frames: NotRequired[Union[str, None]]
    """The frames of a sequence, such as 1-10; null for a single image."""
    files: NotRequired[list[str]]
    """The first of the files that are not complete."""
    count: NotRequired[int]
    """Number of all files that are not complete."""
    since_unix: NotRequired[float]
    """When it was announced first, in seconds since 1970."""


class Worker(TypedDict):
    id: NotRequired[str]
    name: NotRequired[str]
    build: NotRequired[str]
    numeric_class: NotRequired[str]
    platform: NotRequired[Union[str, None]]
    """Processor, compiler and Embree version of the worker's numeric class. null: the worker did not send
    it."""
    fake: NotRequired[bool]
    """True for a fake worker (--fake): it invents pixels instead of rendering, for tests of a farm."""
    threads: NotRequired[int]
    tags: NotRequired[list[str]]
    state: NotRequired[Literal["connected", "draining", "restarting", "lost", "sick", "gone"]]
    activity: NotRequired[str]
    """What the worker does now, or what is wrong with it."""
    job: NotRequired[Union[str, None]]
    """Id of the job that it works on."""
    units_done: NotRequired[int]
    cpu_seconds: NotRequired[float]
    rss_bytes: NotRequired[int]
    memory_bytes: NotRequired[int]
    """Memory that the worker may use. 0: the worker did not send it."""
    last_seen_seconds: NotRequired[float]
    """Seconds since the worker's last message."""


class Meter(TypedDict):
    """What one meter has measured."""
    name: NotRequired[str]
    """Id of the sensor; in a list of points with the point's number, as in hall[17]."""
    type: NotRequired[Literal["radiancemeter", "irradiancemeter", "fluxmeter", "fluencemeter"]]
    unit: NotRequired[str]
    """If lengths of the scene are in metres."""
    value: NotRequired[list[float]]
    """[R, G, B]"""
    ci95: NotRequired[Union[list[list[float]], None]]
    """[[low, high], ...]: the 95 % interval of each channel. null: no sample has found light."""
    luminance: NotRequired[float]
    luminance_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of luminance."""
    samples: NotRequired[int]
    """Number of paths."""
    trusted: NotRequired[bool]
    """False if few paths carry the value: the interval may be too narrow."""


class Report(TypedDict):
    job: NotRequired[str]
    name: NotRequired[str]
    """File name of the scene, or the name given at submission."""
    state: NotRequired[Literal["queued", "running", "paused", "done", "failed", "cancelled"]]
    error: NotRequired[Union[str, None]]
    """Why the job failed."""
    scene: NotRequired[str]
    """SHA-256 of the scene as workers receive it."""
    size: NotRequired[list[int]]
    """[width, height] in pixels."""
    seed: NotRequired[int]
    integrator: NotRequired[str]
    max_depth: NotRequired[int]
    """Largest number of segments of a path. -1: unlimited."""
    rr_depth: NotRequired[int]
    """The first depth at which Russian roulette may end a path."""
    spp_asked: NotRequired[Union[int, None]]
    """Samples per pixel that the job or its scene asks for. null: a target error or a time limit ends the
    job."""
    time_asked: NotRequired[Union[float, None]]
    """Time limit that the job asks for, in seconds since the first ray."""
    build: NotRequired[str]
    """Build of the worker that decided the job's numeric class."""
    platform: NotRequired[Union[str, None]]
    """Processor, compiler and Embree version of the numeric class."""
    fake: NotRequired[bool]
    """True if fake workers (--fake) computed the pixels. The image does not show the scene."""
    warnings: NotRequired[list[str]]
    submitted_unix: NotRequired[float]
    target_error: NotRequired[Union[float, None]]
    """Target error that the job asks for, as relMSE."""
    target_layer: NotRequired[Union[str, None]]
    """The layer that must reach target_error: raw or denoised. null: the job has no target."""
    denoised_checks: NotRequired[list["ReportDenoisedChecks"]]
    """For a target of the denoised layers: all comparisons with it. The job ends when `at_most` is not
    above the target twice in a row."""
    forecast: NotRequired[Union["ReportForecast", None]]
    """Predicted cost of reaching the target (`asked` is true) or, if the target is reached or there is
    none, of halving relmse."""
    meters: NotRequired[list["Meter"]]
    """What the meters of the scene have measured; empty if the job makes an image."""
    spp: float
    samples: int
    load_seconds: float
    render_seconds: float
    """Seconds from the first ray until the last result was added to the image."""
    core_seconds: float
    time: NotRequired["TimeSplit"]
    denoised: NotRequired[Union["ReportDenoised", None]]
    """The denoised image of a job with `denoise` that has ended."""
    adaptive: NotRequired[bool]
    """True if the job had a target error. Each tile then has as many samples as its error required, and spp
    is the mean over the pixels."""
    note: NotRequired[str]
    """What a reader should know about an image that was stopped by its error (it has a small bias) or by
    time."""
    peak_rss_bytes: int
    rmse: Union[float, None]
    """Estimated from the image itself."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of the error of this image."""
    relmse: Union[float, None]
    """Estimated from the image itself."""
    relmse_ci95: Union[list[float], None]
    mean: NotRequired[Union[list[float], None]]
    """Mean of the image in R, G and B."""
    mean_ci95: NotRequired[Union[list[list[float]], None]]
    """95 % interval [low, high] of the true mean in R, G and B. null while the error is not trusted, and if
    rare bright light may be missing."""
    relmse_16: NotRequired[Union[float, None]]
    """relMSE of the means over squares of 16 x 16 pixels."""
    relmse_16_ci95: NotRequired[Union[list[float], None]]
    """95 % interval [low, high] of relmse_16; null if mean_ci95 is null or if most of the error is in a few
    of the 16 x 16 squares."""
    pixels_without_samples: NotRequired[int]
    """Number of pixels without samples. The error figures are those of the other pixels."""
    slope: NotRequired[Union[float, None]]
    """Slope of log relMSE over log core seconds, normally about -1. null: there are too few checkpoints."""
    slope_ci95: NotRequired[Union[list[float], None]]
    """[low, high]: the 95 % interval of slope."""
    trend: NotRequired[str]
    """The slope in words."""
    efficiency: NotRequired[Union[float, None]]
    """1 / (relmse x render_seconds), with as many threads as `threads` says."""
    efficiency_per_core: NotRequired[Union[float, None]]
    """1 / (relmse x core_seconds)."""
    threads: NotRequired[Union[float, None]]
    """Mean number of threads that rendered: core_seconds / render_seconds."""
    nonfinite_samples: int
    negative_samples: NotRequired[int]
    majorant_violations: NotRequired[int]
    clamped_values: NotRequired[int]
    """Number of values above 65504, the largest half, which were clamped. 0 for images in float."""
    health: NotRequired["Health"]
    pixels_sha256: Union[str, None]
    """SHA-256 of the pixels. For a sequence: SHA-256 over the digests (32 bytes each) of all frames in
    order, once all are done."""
    features_used: list[str]
    features_left_out: list[str]
    techniques: NotRequired[list["ReportTechniques"]]
    """The techniques by which the workers' integrator looked for light, besides sampling directions and
    next-event estimation at vertices. bench/techniques.py measures each."""
    needs: NotRequired[Union[dict[str, Any], None]]
    """What the scene needs of the renderer, as flags and counts. null for jobs of earlier versions."""
    analysis: NotRequired[Union[dict[str, Any], None]]
    """`parts`: the parts of the renderer, each with `part`, `used`, `why` and `bytes`, the size of the
    files that it reads. `left_out`: what no pixel depends on and was therefore neither stored nor sent,
    each with `what`, `why`, `count` and `bytes`."""
    numeric_class: Union[str, None]
    stopped: Union[str, None]
    verdict: NotRequired[str]
    """How far the error figures can be trusted, in words."""
    verdict_kind: NotRequired[Literal["early", "converging", "fast", "heavy_tail", "bias_floor"]]
    trusted: NotRequired[bool]
    """False if the error figures cannot be trusted yet. The verdict says why, and the intervals mean
    little."""
    advice: NotRequired[Union[str, None]]
    """What a user can do if the figures are not trusted, with the command. null: nothing needs to be
    done."""
    few_hits_pixels: NotRequired[Union[int, None]]
    """Number of pixels where too few samples found light. They are magenta in error.png."""
    true_rmse: NotRequired[float]
    """With a reference: the difference from it at the last checkpoint, with the reference's own noise
    subtracted. true_relmse and true_flip are of the same checkpoint."""
    true_relmse: NotRequired[float]
    true_flip: NotRequired[Union[float, None]]
    """Mean HDR-FLIP."""
    true_rmse_below_noise: NotRequired[bool]
    """True if the true RMSE is hidden by the reference's own noise."""
    true_relmse_below_noise: NotRequired[bool]
    """As reference.below_noise."""
    reference: NotRequired[Union[dict[str, Any], None]]
    """The reference image: its digest, the true errors rmse, relmse and flip, and its own noise as
    noise_rmse and noise_relmse (null if it has no layers of errors). below_noise: relmse is less than three
    standard errors (relmse_stderr) above 0, so the image differs from the reference by no more than the
    reference's noise, and the true error is too small to measure. rmse_below_noise: the same for rmse, by
    mse_stderr, the standard error of its square. Both standard errors are null if noise_relmse is.
    same_seed: the reference was rendered from this scene with this seed, so it has the same noise as the
    image; the true errors then mean nothing, and no verdict is drawn from them."""
    frames: NotRequired[list[dict[str, Any]]]
    """For a sequence: each frame with its job, its state and the figures above. `convergence` of a sequence
    is empty, since every frame has its own."""
    convergence: list["ReportConvergence"]


class ReportDenoisedChecks(TypedDict):
    spp: NotRequired[float]
    """Samples per pixel at that time, averaged over the pixels."""
    relmse: NotRequired[float]
    """Estimated from the image itself."""
    at_most: NotRequired[Union[float, None]]
    """Upper end of the 95 % interval. null: unknown."""


class ReportForecast(TypedDict):
    """Predicted cost of reaching the target (`asked` is true) or, if the target is reached or there is
    none, of halving relmse."""
    target: NotRequired[float]
    asked: NotRequired[bool]
    spp: NotRequired[float]
    """Samples per pixel at that point, averaged over the pixels."""
    core_seconds: NotRequired[float]
    """Core seconds still to spend."""
    core_seconds_ci95: NotRequired[list[float]]


class ReportDenoised(TypedDict):
    """The denoised image of a job with `denoise` that has ended."""
    by: NotRequired[str]
    """Name and version of the denoiser."""
    seconds: NotRequired[float]
    """Seconds that denoising took."""
    rmse: NotRequired[float]
    """Estimated from the two halves of the samples; see docs/design/denoising.md."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """95 % interval. null: so few pixels carry the noise that it is unknown."""
    relmse: NotRequired[float]
    relmse_ci95: NotRequired[Union[list[float], None]]
    """95 % interval. null: so few pixels carry the noise that it is unknown."""
    true_rmse: NotRequired[float]
    """Difference from the job's reference, if it has one."""
    true_relmse: NotRequired[float]
    true_relmse_stderr: NotRequired[float]
    """Standard error of true_relmse that the reference's own noise causes."""
    error: NotRequired[str]
    """Why there is no denoised image. The other members are then missing."""


class ReportTechniques(TypedDict):
    name: NotRequired[str]
    what: NotRequired[str]
    off: NotRequired["ReportTechniquesOff"]
    """Parameter of the scene's integrator that switches the technique off."""


class ReportTechniquesOff(TypedDict):
    """Parameter of the scene's integrator that switches the technique off."""
    parameter: NotRequired[str]
    value: NotRequired[str]


class ReportConvergence(TypedDict):
    seconds: NotRequired[float]
    core_seconds: NotRequired[float]
    spp: NotRequired[float]
    rmse: NotRequired[Union[float, None]]
    """Estimated from the image itself."""
    rmse_ci95: NotRequired[Union[list[float], None]]
    """95 % interval at this checkpoint. Missing in jobs of earlier versions."""
    relmse: NotRequired[Union[float, None]]
    """Estimated from the image itself."""
    relmse_ci95: NotRequired[Union[list[float], None]]
    true_rmse: NotRequired[float]
    """Difference from the reference, if the job has one."""
    true_relmse: NotRequired[float]
    true_flip: NotRequired[Union[float, None]]
    """Computed each time the samples have doubled, and at the end."""
    true_rmse_below_noise: NotRequired[bool]
    """True if the difference from the reference is too small to be distinguished from the reference's own
    noise."""
    true_relmse_below_noise: NotRequired[bool]
    forecast: NotRequired[dict[str, Any]]
    """For a job with a target error, each time the samples have doubled: the prediction at that time.
    core_seconds still to spend, their interval core_seconds_ci95 [low, high], and spp at the target."""


class WhoAmIAnswer(TypedDict):
    role: Literal["admin", "submit", "read"]
    user: str
    version: str
    """Version of the coordinator."""


class ListJobsAnswer(TypedDict):
    jobs: list["Job"]
    total: int
    """Number of selected jobs on all pages together."""
    states: dict[str, int]
    """Number of jobs in each state that this token may see, whether selected or not. `held`: how many of
    the queued ones wait for other jobs."""
    owners: list[str]
    """Owners of all jobs that this token may see."""


class SubmitJobAnswer(TypedDict):
    id: str
    url: str
    warnings: list[str]
    reference_same_seed: NotRequired[bool]
    """True if the reference was rendered from this scene with this seed. It then has the same noise as the
    image, so its error figures mean nothing."""


class SubmitAgainAnswer(TypedDict):
    id: str
    url: str
    warnings: list[str]
    reference_same_seed: NotRequired[bool]
    """True if the reference was rendered from this scene with this seed. It then has the same noise as the
    image, so its error figures mean nothing."""


class GetMetersAnswer(TypedDict):
    meters: list["Meter"]


class GetTilesAnswer(TypedDict):
    tiles: list["Tile"]


class ListViewsAnswer(TypedDict):
    default: str
    """The view that the configuration shows first; sRGB without a configuration."""
    views: list[str]
    """Names, `DISPLAY/VIEW` but for sRGB."""


class ListTokensAnswer(TypedDict):
    tokens: list["Token"]


class ListWorkersAnswer(TypedDict):
    workers: list["Worker"]
    join: NotRequired["ListWorkersAnswerJoin"]
    """How another worker can join."""


class ListWorkersAnswerJoin(TypedDict):
    """How another worker can join."""
    address: NotRequired[str]
    """HOST:PORT of the workers' port: the address on which the coordinator listens, or the one that its
    operator configured."""
    tls: NotRequired[bool]
    """True if workers connect over TLS. They then need the certificate of the farm's authority, and a
    certificate and key of their own."""
    token_file: NotRequired[str]
    """Path of the file with the join token, on the coordinator's machine. Shown to admins only."""


class ListAnnouncedAnswer(TypedDict):
    announced: list["AnnouncedJob"]


class MissingBlobsAnswer(TypedDict):
    missing: list[str]
