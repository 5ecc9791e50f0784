"""A job on a farm, over its HTTP API."""

import hashlib
import json
import urllib.error
import urllib.parse
import urllib.request

from .problems import ExportError

PATIENCE = 30.0  # seconds for one answer; uploads have no limit


class Farm:
    def __init__(self, url, token):
        self.url, self.token = url.rstrip("/"), token
        parts = urllib.parse.urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ExportError(
                f"Preferences > Add-ons > Lightshaft > Farm: '{url}' is not an address. Write it like http://farm:8080"
            )

    def submit(self, scene, files, spec):
        """Sends the scene and the files that the farm does not have. Returns (job, warnings of the farm)."""
        paths = {name: path for name, path in files.items()}
        digests = {name: digest(path) for name, path in paths.items()}
        by_digest = {digests[name]: path for name, path in paths.items()}
        own = digest(scene)
        by_digest[own] = scene
        missing = self.ask("POST", "/api/v1/blobs/missing", {"digests": sorted(by_digest)})["missing"]
        for name in missing:
            with by_digest[name].open("rb") as stream:
                self.request(
                    "PUT", f"/api/v1/blobs/{name}", stream, by_digest[name].stat().st_size, patience=None
                )
        body = {"scene": own, "assets": digests, "spec": spec, "name": scene.name}
        answer = self.ask("POST", "/api/v1/jobs", body, patience=None)
        return FarmJob(self, answer["id"]), answer.get("warnings", [])

    def ask(self, method, path, body=None, patience=PATIENCE):
        content = None if body is None else json.dumps(body).encode()
        return json.loads(self.request(method, path, content, patience=patience) or b"null")

    def request(self, method, path, body=None, size=None, patience=PATIENCE):
        headers = {"Authorization": f"Bearer {self.token}"} if self.token else {}
        if size is not None:
            headers |= {"Content-Length": str(size), "Content-Type": "application/octet-stream"}
        elif body is not None:
            headers["Content-Type"] = "application/json"
        request = urllib.request.Request(self.url + path, data=body, headers=headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=patience) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            raise ExportError(refusal(error)) from error
        except (OSError, urllib.error.URLError) as error:
            raise Unreachable(
                f"The farm at {self.url} does not respond: {getattr(error, 'reason', error)}"
            ) from error


class Unreachable(ExportError):
    """The farm cannot be reached. This may be temporary: a coordinator that restarts continues its jobs."""


def digest(path):
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def refusal(error):
    """Returns the farm's error as a sentence that says where to correct it."""
    if error.code == 401:
        return "The farm does not accept this token. Set it in Preferences > Add-ons > Lightshaft > Token"
    try:
        problem = json.loads(error.read())
    except ValueError:
        return f"The farm answered {error.code} {error.reason}. Is its address right?"
    lines = [problem.get("detail") or problem.get("title") or f"HTTP {error.code}"]
    lines += [item.get("message", "") for item in problem.get("diagnostics", [])]
    return "The farm refused the scene: " + "\n".join(dict.fromkeys(line for line in lines if line))


class FarmJob:
    """A job that is polled until `ended`. If the farm is unreachable for a while, it waits."""

    def __init__(self, farm, identifier):
        self.farm, self.identifier = farm, identifier
        self.path = f"/api/v1/jobs/{identifier}"
        self.ended, self.units, self.progress, self.words = False, 0, 0.0, "queued"

    def look(self):
        try:
            job = self.farm.ask("GET", self.path)
        except Unreachable as error:
            self.words = str(error)
            return
        self.units, self.progress = job.get("units_done", 0), job["progress"]
        error = "" if job["relmse"] is None else f", relMSE {job['relmse']:.2g}"
        self.words = f"{job['state']}, {job.get('spp_done') or 0:.0f} samples{error}"
        if job["state"] == "failed":
            raise ExportError(f"The farm could not render it: {job['error']}")
        if job["state"] == "cancelled":
            raise ExportError(f"Job {self.identifier} was cancelled on the farm")
        self.ended = job["state"] == "done"

    def image(self):
        """Fetches the EXR of what is rendered so far."""
        return self.farm.request("GET", f"{self.path}/image.exr", patience=None)

    def cancel(self):
        self.farm.request("DELETE", self.path)
