"""A render by the program `lightshaft` on this machine, with the same interface as a job on a farm."""

import pathlib
import shutil
import subprocess

from .problems import ExportError


def find_program(preferred):
    found = shutil.which(preferred or "lightshaft")
    if not found:
        raise ExportError(
            f"The program {preferred or 'lightshaft'} does not exist. "
            "Set Preferences > Add-ons > Lightshaft > Program to its path, or render on a farm"
        )
    return found


class LocalJob:
    def __init__(self, program, scene, spec, threads):
        self.program, self.folder = program, scene.parent
        self.partials, self.output = self.folder / "partials", self.folder / "image.exr"
        self.ended, self.units, self.progress, self.words = False, 0, 0.0, "starts"
        arguments = [
            program,
            "render",
            scene,
            "-o",
            self.output,
            "--partial-dir",
            self.partials,
            "--float",
            "--spp",
            spec["spp"],
        ]
        arguments += ["--seed", spec["seed"]]
        if spec.get("target_error"):
            arguments += ["--target-error", spec["target_error"]]
        if spec.get("aov"):
            arguments += ["--aov", ",".join(spec["aov"])]
        if spec.get("denoise"):
            arguments.append("--denoise")
        if threads:
            arguments += ["--threads", threads]
        self.log = self.folder / "log.txt"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [str(a) for a in arguments], stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )

    def look(self):
        code = self.process.poll()
        self.units = sum(1 for _ in self.partials.glob("*.exr")) if self.partials.is_dir() else 0
        self.words = f"{self.units} partial images"
        if code is None:
            return
        if code != 0:
            raise ExportError(f"lightshaft render: {self.log.read_text(errors='replace').strip()[-2000:]}")
        self.ended, self.progress = True, 1.0

    def image(self):
        """Returns the finished image, or the combination of the partial ones so far."""
        if self.ended:
            return self.output.read_bytes()
        preview = self.folder / "preview.exr"
        done = subprocess.run(
            [self.program, "merge", self.partials, "-o", preview, "--float"], capture_output=True
        )
        return preview.read_bytes() if done.returncode == 0 else None

    def cancel(self):
        self.process.terminate()
        self.process.wait()


def warnings_of(job):
    return [
        line for line in pathlib.Path(job.log).read_text(errors="replace").splitlines() if "warning:" in line
    ]
