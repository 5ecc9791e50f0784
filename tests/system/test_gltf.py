"""Scenes of glTF: the same pixels as their translation to XML, here and in a farm, and known radiances."""

import json
import math
import os
import struct

import pytest
from cli_kit import digest, lightshaft, load
from local_farm import LocalFarm
from test_convert import convert, identity

FLOAT, BYTE = 5126, 5121
SHEET = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


class Glb:
    """A .glb with a white sheet of side 2 in z = 0, a camera before it that sees its middle, and what tests add."""

    def __init__(self):
        self.bytes = b""
        self.json = {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 4]}],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.2, "aspectRatio": 1, "znear": 0.1}}],
            "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}]}],
            "accessors": [],
            "bufferViews": [],
        }
        self.accessor("VEC3", FLOAT, struct.pack("<12f", *(x for corner in SHEET for x in corner)), 4)
        self.accessor("VEC3", FLOAT, struct.pack("<12f", *(0, 0, 1) * 4), 4)
        self.accessor("VEC2", FLOAT, struct.pack("<8f", 0, 1, 1, 1, 1, 0, 0, 0), 4)
        self.accessor("SCALAR", BYTE, bytes([0, 1, 2, 0, 2, 3]), 6)

    def view(self, data):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, kind, component, data, count):
        view = self.view(data)
        self.json["accessors"].append({"bufferView": view, "componentType": component, "type": kind, "count": count})

    def light(self, light, **node):
        extension = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})
        extension["lights"].append(light)
        self.json["nodes"].append({"extensions": {"KHR_lights_punctual": {"light": len(extension["lights"]) - 1}}, **node})
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        data = self.bytes + b"\0" * (-len(self.bytes) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


def rendered(scene, out, *more):
    return digest(lightshaft("render", scene, "-o", out, "--size", "24x16", "--spp", 4, *more))


def middle(scene, *more):
    """The value of one sample of the pixel in the middle."""
    said = lightshaft("render", scene, "--size", "9x9", "--pixel", "4,4", "--sample", 0, *more).stdout
    return [float(x) for x in said.split()[-3:]]


@pytest.fixture
def room(tmp_path):
    glb = Glb()
    glb.json["images"] = [{"bufferView": glb.view(checks()), "mimeType": "image/png"}]
    glb.json["textures"] = [{"source": 0}]
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    glb.json["nodes"].append({"mesh": 0, "translation": [0.5, 0, -1]})
    glb.json["scenes"][0]["nodes"].append(2)
    glb.light({"type": "point", "intensity": 30}, translation=[1, 2, 3])
    return glb.write(tmp_path / "room.glb")


def checks():
    """A PNG of 2 x 2 pixels."""
    import zlib

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    pixels = b"\0\xff\x40\x40\x40\xff\x40" + b"\0\x40\x40\xff\xff\xff\xff"
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(pixels))
        + chunk(b"IEND", b"")
    )


def test_a_scene_of_gltf_and_its_translation_render_the_same_pixels(room, tmp_path):
    out = tmp_path / "there" / "room.xml"
    out.parent.mkdir()
    assert convert(room, out) == identity(room) == convert(room, tmp_path / "beside.xml")
    assert sorted(p.suffix for p in out.parent.iterdir()) == [".ply", ".png", ".xml"]

    of_gltf = rendered(room, tmp_path / "a.exr")

    assert of_gltf == rendered(out, tmp_path / "b.exr") == rendered(tmp_path / "beside.xml", tmp_path / "c.exr")


def test_submit_sends_a_glb_with_its_meshes_and_images(room, tmp_path):
    alone = rendered(room, tmp_path / "alone.exr")
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        environment = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}

        lightshaft("submit", room, "--size", "24x16", "--spp", 4, "--wait", "-o", tmp_path / "farm.exr", "--report",
                   tmp_path / "farm.json", env=environment)

    assert load(tmp_path / "farm.json")["pixels_sha256"] == alone


def test_inspect_names_the_path_of_what_is_wrong(tmp_path):
    glb = Glb()
    glb.json["materials"][0]["alphaMode"] = "FADE"
    scene = glb.write(tmp_path / "wrong.glb")

    failed = lightshaft("inspect", scene, code=2)

    assert "wrong.glb:1:" in failed.stderr and "materials[0].alphaMode: alphaMode is OPAQUE" in failed.stderr


@pytest.mark.parametrize("ending", (".gltf", ".glb"))
def test_a_scene_of_two_gigabytes_is_told_how_to_export_it(tmp_path, ending):
    scene = tmp_path / f"city{ending}"
    scene.touch()
    os.truncate(scene, 2 << 30)  # takes no room on the disk

    told = lightshaft("render", scene, "-o", tmp_path / "city.exr", code=2).stderr

    assert f"city{ending}: error: the file has 2147483648 bytes" in told and "export it as a .gltf with buffers" in told
    assert not (tmp_path / "city.exr").exists()


def test_a_buffer_of_two_gigabytes_is_refused_with_its_place(tmp_path):
    scene, glb = tmp_path / "city.gltf", Glb()
    glb.json["buffers"] = [{"byteLength": 2 << 30, "uri": "city.bin"}]
    scene.write_text(json.dumps(glb.json))
    (tmp_path / "city.bin").touch()
    os.truncate(tmp_path / "city.bin", 2 << 30)

    told = lightshaft("render", scene, "-o", tmp_path / "city.exr", code=2).stderr

    assert 'city.gltf:1:' in told and 'buffers[0].uri: "city.bin" is larger than the 32 MiB' in told


def test_a_surface_of_emission_one_has_radiance_one(tmp_path):
    glb = Glb()
    glb.json["materials"][0] = {
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        "emissiveFactor": [1, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_specular": {"specularFactor": 0}},
    }

    assert middle(glb.write(tmp_path / "lamp.glb")) == pytest.approx([4, 2, 1], rel=1e-6)


@pytest.mark.parametrize(
    "light, node, irradiance",
    [
        ({"type": "directional", "intensity": 10}, {}, 10),
        ({"type": "point", "intensity": 90}, {"translation": [0, 0, 3]}, 10),
        ({"type": "spot", "intensity": 90, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.4}}, {"translation": [0, 0, 3]}, 10),
    ],
)
def test_lux_and_candela_on_a_white_sheet(tmp_path, light, node, irradiance):
    glb = Glb()
    glb.json["materials"][0]["extensions"] = {"KHR_materials_specular": {"specularFactor": 0}}
    glb.light(light, **node)

    # Straight on the sheet is diffuse, but for a coat of index 1.001, which keeps a share of light below 2 (1.001 - 1) in. The middle
    # pixel sees points to 0.005 rad beside the axis, where squares of the angle change the light by 1e-4.
    assert middle(glb.write(tmp_path / "lit.glb")) == pytest.approx([irradiance / math.pi] * 3, rel=3e-3)


def test_an_image_stands_upright(tmp_path):
    glb = Glb()
    glb.json["images"] = [{"bufferView": glb.view(checks()), "mimeType": "image/png"}]
    glb.json["textures"] = [{"source": 0, "sampler": 0}]
    glb.json["samplers"] = [{"magFilter": 9728}]
    glb.json["materials"][0]["emissiveTexture"] = {"index": 0}
    glb.json["materials"][0]["emissiveFactor"] = [1, 1, 1]
    glb.json["cameras"][0]["perspective"]["yfov"] = 0.45
    scene = glb.write(tmp_path / "image.glb")

    def at(x, y):
        said = lightshaft("render", scene, "--size", "9x9", "--pixel", f"{x},{y}", "--sample", 0).stdout
        return [float(v) > 0.5 for v in said.split()[-3:]]

    assert at(1, 1) == [True, False, False]  # red above on the left
    assert at(7, 1) == [False, True, False]
    assert at(1, 7) == [False, False, True]
    assert at(7, 7) == [True, True, True]


def test_temporary_files_go(room, tmp_path):
    kept = tmp_path / "kept"
    kept.mkdir()

    lightshaft("render", room, "-o", tmp_path / "x.exr", "--spp", 1, "--size", "8x8", env={**os.environ, "TMPDIR": str(kept)})

    assert not list(kept.iterdir())
