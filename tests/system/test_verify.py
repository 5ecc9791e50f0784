"""`lightshaft verify`: a finished image against its scene, tile by tile."""

import json
import os
import signal
import subprocess
from pathlib import Path

import pytest
from cli_kit import PATIENCE, bin_dir, lightshaft, write_fog
from exr_layers import read, read_header, seal, write
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

    assert "2 of 2 tiles match the seal (6 in the image" in done.stdout
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

    assert "5 of 6 tiles match the seal" in done.stdout
    wrong = [line for line in done.stdout.splitlines() if "the image's seal has" in line]
    assert len(wrong) == 1 and wrong[0].startswith("tile 3 [0,32 to 32,40)")


# ---- an image that was changed afterwards ----

AOVS = ("albedo,coverage,depth,direct,emission,geo_normal,indirect,material_id,multiple,normal,position,shape_id,single,"
        "surface,uv,volume")
STORAGE = {"compression", "lineOrder"}  # how the pixels are packed
X, Y = 3, 5  # the pixel that is changed


@pytest.fixture(scope="module")
def layered(tmp_path_factory):
    """A scene and its image with every layer there is, of six small tiles: (scene, attributes, rows)."""
    folder = tmp_path_factory.mktemp("layered")
    scene = write_fog(folder)
    lightshaft("render", scene, "-o", folder / "out.exr", "--spp", 4, "--seed", 3, "--size", "72x40", "--aov", AOVS)
    return scene, read_header((folder / "out.exr").read_bytes())[0], read(folder / "out.exr")[0]


def verify(scene, path, header, rows, *flags):
    """(exit code, all that is said) of the image with these attributes and layers."""
    write(path, header, rows)
    done = subprocess.run([str(bin_dir() / "lightshaft"), "verify", path, "--scene", scene, "--seed", "1", *flags],
                          capture_output=True, text=True, timeout=PATIENCE)
    return done.returncode, done.stdout + done.stderr


def with_layer_changed(rows, layer):
    """One value of it, to one that the layer's type holds exactly."""
    changed = {name: list(lines) for name, lines in rows.items()}
    line = list(changed[layer][Y])
    line[X] = line[X] + 2 if layer == "spp" else -line[X] or 1.0
    changed[layer][Y] = tuple(line)
    return changed


def resealed(header, rows):
    """Whoever changes an image may seal it anew."""
    return {**header, "lightshaft:seal": ("string", seal(header, rows).encode())}


def test_the_seal_is_what_its_description_says(layered):
    _, header, rows = layered

    assert header["lightshaft:seal"][1].decode() == seal(header, rows)


def test_an_image_that_was_only_packed_anew_is_as_sealed(layered, tmp_path):
    scene, header, rows = layered

    code, said = verify(scene, tmp_path / "same.exr", header, rows, "--tiles", "99")

    assert code == 0 and "6 of 6 tiles match the seal" in said and "all layers and headers match the seal" in said


def test_a_change_of_any_layer_is_found(layered, tmp_path):
    scene, header, rows = layered
    assert len(rows) == 68
    for layer in rows:
        code, said = verify(scene, tmp_path / "changed.exr", header, with_layer_changed(rows, layer), "--tiles", "1")

        assert code == 1 and f"differs from the seal: layer {layer}\n" in said, f"{layer}: {code}, {said}"


def test_a_change_of_any_header_is_found(layered, tmp_path):
    scene, header, rows = layered
    assert {"lightshaft:relmse", "lightshaft:seconds", "lightshaft:verdict", "lightshaft:health", "dataWindow"} < set(header)
    for name, (kind, value) in header.items():
        if name in STORAGE or name in ("channels", "dataWindow", "lightshaft:seal"):
            continue  # those first two make another file; of the last below
        other = bytes([value[0] ^ 1]) + value[1:]
        code, said = verify(scene, tmp_path / "changed.exr", {**header, name: (kind, other)}, rows, "--tiles", "1")

        assert code != 0, f"{name}: {said}"
        assert f"header {name}" in said or name == "displayWindow" and "windows" in said, f"{name}: {said}"

        without = {key: attribute for key, attribute in header.items() if key != name}
        if name.startswith(("lightshaft:", "cryptomatte/")):
            code, said = verify(scene, tmp_path / "changed.exr", without, rows, "--tiles", "1")
            assert code != 0 and f"header {name}" in said, f"without {name}: {said}"
    code, said = verify(scene, tmp_path / "changed.exr", {**header, "owner": ("string", b"me")}, rows, "--tiles", "1")
    assert code == 1 and "differs from the seal: header owner" in said


def test_an_image_without_its_seal_is_not_called_as_sealed(layered, tmp_path):
    scene, header, rows = layered
    bare = {name: attribute for name, attribute in header.items() if name != "lightshaft:seal"}

    code, said = verify(scene, tmp_path / "bare.exr", bare, rows, "--tiles", "1")
    told = json.loads(verify(scene, tmp_path / "bare.exr", bare, rows, "--tiles", "1", "--json")[1])

    assert code == 1 and "the image has no seal of its layers and headers" in said and "1 of 1 tiles match the seal" in said
    assert told["verdict"] == "unsealed" and told["contents"] == {"verdict": "unsealed", "changed": []}


def test_a_seal_made_anew_does_not_hide_a_pixel(layered, tmp_path):
    scene, header, rows = layered
    for layer in ("R", "stderr.G", "depth.Z", "crypto_object00.R", "albedo.B"):
        changed = with_layer_changed(rows, layer)

        code, said = verify(scene, tmp_path / "forged.exr", resealed(header, changed), changed, "--tiles", "99")

        assert code == 1 and "all layers and headers match the seal" in said and "5 of 6 tiles match the seal" in said
        assert f"pixel {X},{Y} has another value in layer {layer} than its samples" in said


def test_a_seal_made_anew_does_not_hide_an_error_once_all_tiles_are_rendered(layered, tmp_path):
    scene, header, rows = layered
    for name in ("relmse", "relmse_ci95", "rmse", "rmse_ci95", "few_hits", "seed"):
        forged = resealed({**header, f"lightshaft:{name}": ("string", b"1e-09")}, rows)

        code, said = verify(scene, tmp_path / "forged.exr", forged, rows, "--tiles", "99")

        assert code == 1 and f"differs from the seal: header lightshaft:{name}\n" in said and "6 of 6 tiles match the seal" in said
    # What no rendering can tell again is no safer than the seal: docs/guide/verify.md says so.
    forged = resealed({**header, "lightshaft:seconds": ("string", b"0.001")}, rows)
    assert verify(scene, tmp_path / "forged.exr", forged, rows, "--tiles", "99")[0] == 0


def test_every_way_to_an_image_seals_it(tmp_path):
    scene = write_fog(tmp_path)
    lightshaft("render", scene, "-o", tmp_path / "one.exr", "--spp", 2, "--partial-dir", tmp_path / "partials")
    lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "merged.exr")
    lightshaft("render", scene, "--frames", "1-2", "-o", tmp_path / "frame_#.exr", "--spp", 2)
    for name in ("one", "merged", "frame_1", "frame_2"):
        image = tmp_path / f"{name}.exr"
        header, rows = read_header(image.read_bytes())[0], read(image)[0]

        assert header["lightshaft:seal"][1].decode() == seal(header, rows), name


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
    assert f"{len(told)} of 6 tiles match the seal, {6 - len(told)} were not rendered because the run was stopped" in rest


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
