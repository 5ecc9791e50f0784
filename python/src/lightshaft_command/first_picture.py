"""Renders one picture when a farm starts for the first time, so that there is something to see."""

import json
import os
import pathlib
import ssl
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator

from lightshaft_command.children import Children, how_it_ended, say, start
from lightshaft_command.programs import BUNDLED, PACKAGE, find

BUNDLED_SCENE = PACKAGE / "bath" / "bath.xml"  # in a wheel
BATH = ["--spp", "16"]  # some 25 s of one core; with the denoiser it looks finished
BATH_EXPOSURE = 0.8
HOW_TO_DENOISE = f"{sys.executable} -m pip install pyoidn==2.5.1.0" if BUNDLED.exists() else "deploy/install-denoiser.sh"
PATIENCE = 60.0  # seconds for one answer of the coordinator


class FirstPicture:
    """Runs the steps of the first picture, one program after the other, beside the farm. `home` stores how far
    they came."""

    def __init__(self, children: Children, home: pathlib.Path, scene: pathlib.Path | None, farm: dict[str, str]):
        self.children, self.home, self.scene, self.farm = children, home, scene, farm
        self.picture, self.errors = home / "picture.png", home / "submit.errors"
        self._began = time.monotonic()
        self._steps = iter(()) if self.picture.exists() else self.steps()

    def go_on(self) -> None:
        """Starts the next step if the last one has ended."""
        running = self.children.extra
        if running is not None and running.poll() is None:
            return
        self.children.extra = None
        if running is not None and running.returncode != 0:
            why = self.errors.read_text(errors="replace").strip() if self.errors.exists() else ""
            say(f"the first picture failed: a step ended {how_it_ended(running.returncode)}" + (f"\n{why}" if why else ""))
            self._steps = iter(())
            (self.home / "job").unlink(missing_ok=True)  # the next start tries again
        try:
            self.children.extra = next(self._steps, None)
        except OSError as error:  # a full disk; the farm goes on, so that jobs can be removed
            say(f"the first picture failed: {error.filename or self.home}: {error.strerror or error}")
            self._steps = iter(())

    def steps(self) -> Iterator[subprocess.Popen[bytes]]:
        self.home.mkdir(exist_ok=True)
        job = self.home / "job"
        lightshaft = find("lightshaft")
        environment = {**os.environ, **self.farm}
        self.errors.unlink(missing_ok=True)
        if not job.exists():
            scene, options = self.scene or BUNDLED_SCENE, [] if self.scene else BATH
            if not scene.exists():
                maker = PACKAGE.parents[2] / "scenes" / "bath" / "make_bath.py"  # in a checkout
                if not maker.exists():
                    say("this installation has no scene for a first picture: submit your own")
                    return
                say("making the scene of the first picture")
                with self.errors.open("wb") as errors:
                    yield start([sys.executable, "-B", str(maker), str(self.home / "bath")], subprocess.DEVNULL, None, errors)
                scene = self.home / "bath" / "bath.xml"
            found = self.home / "doctor.json"
            with found.open("wb") as output:
                # It may end with 1, for what has nothing to do with the picture.
                yield start(["/bin/sh", "-c", '"$0" doctor --json; true', lightshaft], output, environment)
            denoise = ["--denoise"] if _has_denoiser(found) else []
            if not denoise:
                say(f"Open Image Denoise is missing, so noise will be visible in the first picture; to install it: {HOW_TO_DENOISE}")
            unfinished = self.home / "job.unfinished"
            # Warnings of the scene, or why it is refused.
            with unfinished.open("wb") as output, self.errors.open("wb") as errors:
                yield start([lightshaft, "submit", str(scene), *options, *denoise, "--quiet"], output, environment, errors)
            unfinished.replace(job)
            self.errors.unlink()
        identity = job.read_text().split()[0]
        say("rendering the first picture; the dashboard shows its progress")
        yield start([lightshaft, "watch", identity], None, environment)
        self.fetch(identity)

    def fetch(self, identity: str) -> None:
        address = f"{self.farm['LIGHTSHAFT_URL']}/api/v1/jobs/{identity}"
        try:
            layer = "&layer=denoised" if json.loads(self.get(address)).get("denoise") else ""
            exposure = 0 if self.scene else BATH_EXPOSURE
            unfinished = self.home / "picture.unfinished"
            unfinished.write_bytes(self.get(f"{address}/image.png?exposure={exposure}{layer}"))
            unfinished.replace(self.picture)
        except (OSError, ValueError) as error:
            say(f"the first picture could not be fetched ({error}); it is on the dashboard")
        else:
            say(f"first picture, {time.monotonic() - self._began:.0f} s after the start: {self.picture}")

    def get(self, address: str) -> bytes:
        request = urllib.request.Request(address, headers={"Authorization": f"Bearer {self.farm['LIGHTSHAFT_TOKEN']}"})
        authority = self.farm.get("LIGHTSHAFT_CA")
        # Not through a proxy: the farm is on this machine.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), urllib.request.HTTPSHandler(context=ssl.create_default_context(cafile=authority)))
        with opener.open(request, timeout=PATIENCE) as answer:
            body: bytes = answer.read()
        return body


def _has_denoiser(found: pathlib.Path) -> bool:
    try:
        checks = json.loads(found.read_text())["checks"]
    except (OSError, ValueError, KeyError):
        return False
    return any(check["name"] == "denoiser" and check["status"] == "ok" for check in checks)
