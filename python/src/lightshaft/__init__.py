"""Client of a Lightshaft render farm.

farm = lightshaft.Farm("http://localhost:8080", token=...)
job = farm.submit("scene.xml", spp=64).wait(progress=True)
pixels = job.image()
"""

from . import models
from .aio import AsyncFarm, AsyncJob
from .errors import (
    BadAnswer,
    Conflict,
    Diagnostic,
    FarmBusy,
    FarmUnreachable,
    FileRefused,
    Forbidden,
    JobCancelled,
    JobFailed,
    LightshaftError,
    MissingPackage,
    NotFound,
    RequestRejected,
    SceneDictError,
    SceneRejected,
    SceneWarning,
    StageRejected,
    Unauthorised,
    WaitTimeout,
)
from .farm import Farm, Job
from .job import Verdict
from .light_groups import mix
from .scene_dict import scene_of_dict
from .snapshot import Snapshot

__all__ = [
    "AsyncFarm",
    "AsyncJob",
    "BadAnswer",
    "Conflict",
    "Diagnostic",
    "Farm",
    "FarmBusy",
    "FarmUnreachable",
    "FileRefused",
    "Forbidden",
    "Job",
    "JobCancelled",
    "JobFailed",
    "LightshaftError",
    "MissingPackage",
    "NotFound",
    "RequestRejected",
    "SceneDictError",
    "SceneRejected",
    "SceneWarning",
    "Snapshot",
    "StageRejected",
    "Unauthorised",
    "Verdict",
    "WaitTimeout",
    "mix",
    "models",
    "scene_of_dict",
]
