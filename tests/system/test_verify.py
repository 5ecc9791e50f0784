"""`lightshaft verify`: a finished image against its scene, tile by tile."""

import json
import os
import signal
import subprocess
from pathlib import Path

import pytest
from cli_kit import PATIENCE, bin_dir, lightshaft, write_fog
from local_farm import wait_until

SPP = 70  # full rounds and a cut one


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A scene and its image."""
    folder = tmp_path_factory.mktemp("finished")
    scene = write_fog(folder)
    lightshaft("render", scene, "-o", folder / "out.exr", "--spp", SPP, "--seed", 3, "--float")
    return scene, folder / "out.exr"


def test_an_image_is_as_sealed(finished):
    scene, image = finished

    done = lightshaft("verify", image, "--scene", scene, "--tiles", 2, "--seed", 5)

    assert "2 of 2 tiles are as sealed (6 in the image" in done.stdout
    again = json.loads(lightshaft("verify", image, "--scene", scene, "--tiles", 2, "--seed", 5, "--json").stdout)
    assert again["verdict"] == "pass" and [t["spp"] for t in again["tiles"]] == [SPP, SPP]
    assert all(f"tile {t['tile']} [" in done.stdout for t in again["tiles"])  # the same choice
    everything = json.loads(lightshaft("verify", image, "--scene", scene, "--tiles", 99, "--json").stdout)
    assert [t["tile"] for t in everything["tiles"]] == list(range(6))


def test_a_seal_that_is_another_is_found(finished, tmp_path):
    scene, image = finished
    data = image.read_bytes()
    at = data.index(b"lightshaft:tiles\0string\0") + len(b"lightshaft:tiles\0string\0") + 4 + 65 * 3
    forged = bytearray(data)
    forged[at] = ord("0") if forged[at] != ord("0") else ord("1")  # a digit of tile 3's digest
    (tmp_path / "forged.exr").write_bytes(forged)

    done = lightshaft("verify", tmp_path / "forged.exr", "--scene", scene, "--tiles", 6, code=1)

    assert "5 of 6 tiles are as sealed" in done.stdout
    wrong = [line for line in done.stdout.splitlines() if "the image seals" in line]
    assert len(wrong) == 1 and wrong[0].startswith("tile 3 [0,32 to 32,40)")


def test_another_scene_is_not_what_the_image_was_rendered_from(finished):
    scene, image = finished

    done = lightshaft("verify", image, "--scene", scene, "-D", "density=3", code=2)

    assert "give the same scene file, with the same -D" in done.stderr


def test_a_picture_without_a_seal_is_refused(finished, tmp_path):
    scene, image = finished
    partials = tmp_path / "partials"
    lightshaft("render", scene, "-o", tmp_path / "out.exr", "--spp", 2, "--partial-dir", partials)
    lightshaft("merge", partials, "-o", tmp_path / "merged.exr")

    refused = lightshaft("verify", tmp_path / "merged.exr", "--scene", scene, code=2)
    assert "by their digest only" in refused.stderr
    assert "cannot" in lightshaft("verify", scene, "--scene", scene, code=2).stderr
    lightshaft("verify", tmp_path / "missing.exr", "--scene", scene, code=1)


def test_tiles_that_an_interrupt_left_out_are_not_called_wrong(tmp_path):
    scene = write_fog(tmp_path)
    lightshaft("render", scene, "-o", tmp_path / "long.exr", "--spp", 800)
    verify = subprocess.Popen([str(bin_dir() / "lightshaft"), "verify", tmp_path / "long.exr", "--scene", scene, "--tiles", "6", "--threads", "1"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    first = verify.stdout.readline()
    verify.send_signal(signal.SIGINT)  # five tiles are still to come
    rest, _ = verify.communicate(timeout=PATIENCE)

    assert "as sealed" in first
    assert verify.returncode == 1
    told = [line for line in [first, *rest.splitlines()] if line.startswith("tile ")]
    assert all("800 samples: as sealed" in line for line in told)  # those that were rendered, and no others
    assert f"{len(told)} of 6 tiles are as sealed, {6 - len(told)} were not rendered: stopped" in rest


def test_an_interrupt_is_heard_before_there_is_anything_to_render(finished, tmp_path):
    scene, _ = finished
    image = tmp_path / "slow.exr"  # comes when we let it
    os.mkfifo(image)
    said = tmp_path / "said.txt"
    with said.open("w") as out:
        verify = subprocess.Popen([str(bin_dir() / "lightshaft"), "verify", image, "--scene", scene], stderr=out)
    try:
        wait_until(lambda: takes_signals_itself(verify.pid, signal.SIGINT), "verify to take its signals itself")
        verify.send_signal(signal.SIGINT)
        wait_until(lambda: "stopping; once more ends at once" in said.read_text(), "the first signal to be heard")
        verify.send_signal(signal.SIGINT)
        assert verify.wait(PATIENCE) == -signal.SIGINT
    finally:
        verify.kill()


def takes_signals_itself(pid, sig):
    """Its main thread blocks the signal, for another one to wait for."""
    status = (Path("/proc") / str(pid) / "status").read_text()
    blocked = next(line.split()[1] for line in status.splitlines() if line.startswith("SigBlk:"))
    return bool(int(blocked, 16) >> (sig - 1) & 1)
