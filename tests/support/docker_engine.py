"""Docker's engine for tests."""

import shutil
import subprocess

from local_farm import bin_dir

IMAGE = "lightshaft-worker:local"
def docker(*words, check=True):
    return subprocess.run(["docker", *map(str, words)], capture_output=True, text=True, check=check)


def of_this_build():
    """Options of farm-up: the image has the libraries, the programs are those of this build. On the machine's network, where the farm is."""
    return ["--worker", "/programs/lightshaft-worker", "--docker=--network=host", f"--docker=--volume={bin_dir()}:/programs:ro"]


def missing():
    """Why no worker can run in Docker here; empty: it can."""
    if not shutil.which("docker"):
        return "there is no docker (apt-get install docker.io)"
    if docker("info", check=False).returncode != 0:
        return "Docker's engine does not answer (docker info says why)"
    if docker("image", "inspect", IMAGE, check=False).returncode != 0:
        return f"Docker has no image {IMAGE} (deploy/images.sh --prebuilt)"
    return ""


def containers(farm="farm", *flags):
    """Of the workers of a farm-up."""
    return docker("ps", "--quiet", "--filter", f"label=lightshaft.farm={farm}", *flags).stdout.split()
