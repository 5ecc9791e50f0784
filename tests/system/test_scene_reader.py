"""Scenes are read by a process of a real coordinator that may crash: the submission is refused, and the farm goes on."""

import json
import os
import pathlib
import signal
import threading

import pytest
from local_farm import SCENE, HttpError, LocalFarm, wait_until

BALLS = '<shape type="sphere"><transform name="to_world"><translate x="{}"/></transform></shape>\n'


@pytest.fixture(scope="module")
def farm():
    with LocalFarm() as farm:
        yield farm


def large(megabytes):
    """A scene that takes seconds to read."""
    line = BALLS.format(1)
    return SCENE.replace("</scene>", line * (megabytes * 1_000_000 // len(line)) + "</scene>").encode()


def readers(farm):
    """The processes in which the coordinator reads scenes now."""
    parent, found = str(farm.coordinator.popen.pid), []
    for status in pathlib.Path("/proc").glob("[0-9]*/status"):
        try:
            facts = dict(line.split(":\t", 1) for line in status.read_text().splitlines())
        except (OSError, ValueError):
            continue  # it has ended
        if facts["PPid"] == parent and facts["Name"].startswith("lightshaft-scen"):
            found.append(int(facts["Pid"]))
    return found


def reading(farm):
    """True if one of them has a scene: it takes more memory than one that waits."""
    def resident(process):
        try:
            return int(pathlib.Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")
        except (OSError, IndexError):
            return 0

    return any(resident(process) > 20_000_000 for process in readers(farm))


class Submission(threading.Thread):
    def __init__(self, farm, scene, token):
        super().__init__()
        self.farm, self.scene, self.token = farm, scene, token
        self.answer = None
        self.start()

    def run(self):
        try:
            self.answer = self.farm.request("POST", "/api/v1/jobs?spp=2", self.scene, "application/xml", self.token)
        except (HttpError, OSError) as error:
            self.answer = error


def test_a_reader_that_is_killed_costs_its_submission(farm):
    mallory, bob = farm.token_of("mallory"), farm.token_of("bob")
    submission = Submission(farm, large(8), mallory)
    wait_until(lambda: reading(farm), "the scene is being read")
    for process in readers(farm):
        os.kill(process, signal.SIGSEGV)
    submission.join()

    assert isinstance(submission.answer, HttpError) and submission.answer.status == 400
    assert "its reader crashed" in submission.answer.body
    assert json.loads(farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode(), "application/xml", bob))["id"]
    wait_until(lambda: len(readers(farm)) == 1, "one process waits for the next scene")


def test_a_coordinator_that_stops_does_not_wait_for_a_scene(tmp_path):
    with LocalFarm(tmp_path) as farm:
        submission = Submission(farm, large(8), farm.token)
        wait_until(lambda: reading(farm), "the scene is being read")
        farm.coordinator.terminate()
        submission.join()
        assert not isinstance(submission.answer, bytes), "the scene was read to its end"


def test_large_scenes_of_one_user_keep_nobody_waiting(farm):
    mallory, bob = farm.token_of("mallory"), farm.token_of("bob")
    scene = large(8)
    submissions = [Submission(farm, scene, mallory) for _ in range(4)]
    wait_until(lambda: reading(farm), "the first scene is being read")
    for _ in range(10):
        assert json.loads(farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode(), "application/xml", bob))["id"]
    assert any(submission.is_alive() for submission in submissions), "bob waited for all scenes of mallory"
    for submission in submissions:
        submission.join()
        assert not isinstance(submission.answer, HttpError), submission.answer.body
    wait_until(lambda: len(readers(farm)) == 1, "one process waits for the next scene")
