"""`openjd run` of a template of deploy/openjd, as a process; the command is that of tests/venv.sh openjd."""

import os
import pathlib
import re
import signal
import subprocess

from local_farm import ROOT, Process

OPENJD = ROOT / "build/openjd/venv/bin/openjd"


def template_file(template):
    return ROOT / f"deploy/openjd/{template}/template.yaml"


def version():
    """Such as "openjd-cli 0.8.0"."""
    return "openjd-cli " + subprocess.run([OPENJD, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]


class OpenjdJob(Process):
    """One session: its tasks run one after the other. `options`: of `openjd run`; `parameters`: of the template."""

    def __init__(self, template, log, *options, **parameters):
        words = [word for name, value in parameters.items() for word in ("-p", f"{name}={value}")]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("LIGHTSHAFT_")}
        super().__init__("openjd", [OPENJD, "run", template_file(template), *words, *options], log, environment)

    def cancel(self):
        """What a person who cancels the job does: the task gets its notification. Returns the exit code."""
        self.signal(signal.SIGINT)
        return self.wait()

    def said(self, kind):
        """The messages of openjd_KIND that the tasks have printed."""
        return re.findall(rf"\topenjd_{kind}: (.*)", self.output())

    def abandon(self):
        """Ends it and its task, which is in a group of its own."""
        if not self.alive():
            return
        children = pathlib.Path(f"/proc/{self.popen.pid}/task/{self.popen.pid}/children")
        tasks = [int(child) for child in children.read_text().split()]
        self.kill()
        for task in tasks:
            try:
                os.killpg(task, signal.SIGKILL)
            except ProcessLookupError:
                pass
