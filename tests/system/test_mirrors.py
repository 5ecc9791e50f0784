"""A scene whose files hold its mirror image under transforms that mirror them back looks like the scene itself: glTF, XML and pbrt."""

import base64
import itertools
import json
import math
import struct
import zlib

import numpy as np
import pytest
from cli_kit import lightshaft
from exr_layers import read

X, ALL = (-1, 1, 1), (-1, -1, -1)  # what the transforms mirror
LEANING = (0.9, 0.6)  # red and green of a normal map: to the right and up
SIZE = 32


def sphere(steps=6):
    """(positions and normals, triangles) of a ball of radius 1 by latitude and longitude, its front outside."""
    rows = []
    for i, k in itertools.product(range(steps + 1), range(2 * steps)):
        a, b = math.pi * i / steps, math.pi * k / steps
        rows.append((math.sin(a) * math.cos(b), math.cos(a), -math.sin(a) * math.sin(b)))
    faces = []
    for i, k in itertools.product(range(steps), range(2 * steps)):
        a, b = i * 2 * steps + k, i * 2 * steps + (k + 1) % (2 * steps)
        c, d = a + 2 * steps, b + 2 * steps
        if i < steps - 1:  # else the other two corners are one pole
            faces.append((a, c, d))
        if i > 0:
            faces.append((a, d, b))
    return np.array(rows), np.array(faces)


def png(colour):
    """A PNG of one pixel."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    pixel = b"\0" + bytes(round(255 * x) for x in colour)
    header = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixel)) + chunk(b"IEND", b"")


class Room:
    """A lamp, a ball of glass, a ball of coloured glass and a sheet with a normal map before a white sky, as glTF.

    `mirror`: the files hold what this mirrors, in nodes that mirror it back. `twice`: each stands twice, so that what gives no light is
    an instance. `flipped`: axes of the sheet's texture coordinates along which the image is mirrored on it; the map is drawn for that."""

    def __init__(self, mirror=(1, 1, 1), normals=True, twice=False, flipped=()):
        self.mirror, self.normals, self.bytes = np.array(mirror), normals, b""
        map_of = [1 - c if axis in flipped else c for axis, c in zip("uv", LEANING)]
        clear = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.5}}
        absorbing = {"thicknessFactor": 1, "attenuationColor": [0.9, 0.3, 0.1], "attenuationDistance": 1}
        smooth = {"metallicFactor": 0, "roughnessFactor": 0}
        self.json = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "aspectRatio": 1, "znear": 0.1}}],
            "images": [{"uri": "data:image/png;base64," + base64.b64encode(png([*map_of, 0.85])).decode()}],
            "textures": [{"source": 0}],
            "materials": [
                {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "emissiveFactor": [1, 0.5, 0.2]},
                {"pbrMetallicRoughness": smooth, "extensions": {**clear, "KHR_materials_volume": {"thicknessFactor": 1}}},
                {"pbrMetallicRoughness": smooth, "extensions": {**clear, "KHR_materials_volume": absorbing}},
                {"pbrMetallicRoughness": {"metallicFactor": 0}, "normalTexture": {"index": 0}},
            ],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3}]}},
        }
        ball, faces = sphere()
        square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
        st = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], float)
        for axis in flipped:
            st[:, "uv".index(axis)] = 1 - st[:, "uv".index(axis)]
        for i, x in enumerate((-1.3, 1.3, -1.3)):
            self.mesh(ball, ball, faces, i, (x, 1.3 if i < 2 else -1.3, 0), twice)
        self.mesh(square, np.array([(0, 0, 1.0)] * 4), np.array([(0, 1, 2), (0, 2, 3)]), 3, (1.3, -1.3, 0), twice, st)
        tilt = math.radians(35)
        self.node({"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [-math.sin(tilt), 0, 0, math.cos(tilt)]})
        self.node({"camera": 0, "translation": [0, 0, 6]})

    def node(self, node):
        self.json["nodes"].append(node)
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)
        return node

    def accessor(self, values, kind, component, code):
        data = np.ascontiguousarray(values).astype(code).tobytes()
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data + b"\0" * (-len(data) % 4)
        self.json["accessors"].append(
            {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component, "type": kind, "count": len(values)}
        )
        return len(self.json["accessors"]) - 1

    def mesh(self, positions, normals, faces, material, place, twice, st=None):
        if self.mirror.prod() < 0:
            faces = faces[:, ::-1]
        attributes = {"POSITION": self.accessor(positions * self.mirror, "VEC3", 5126, "<f4")}
        if self.normals:
            attributes["NORMAL"] = self.accessor(normals * self.mirror, "VEC3", 5126, "<f4")
        if st is not None:
            attributes["TEXCOORD_0"] = self.accessor(st, "VEC2", 5126, "<f4")
        indices = self.accessor(faces.reshape(-1, 1), "SCALAR", 5125, "<u4")
        for accessor in attributes.values():
            self.json["accessors"][accessor]["count"] = len(positions)
        self.json["meshes"].append({"primitives": [{"attributes": attributes, "indices": indices, "material": material}]})
        for step in range(2 if twice else 1):
            node = {"mesh": len(self.json["meshes"]) - 1, "scale": [float(s) for s in self.mirror]}
            self.node({**node, "translation": [place[0] + step * 0.5, place[1], place[2] - 3.0 * step]})

    def write(self, path):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.bytes).decode()
        self.json["buffers"] = [{"byteLength": len(self.bytes), "uri": uri}]
        path.write_text(json.dumps(self.json))
        return path


def picture(scene, out, *more):
    lightshaft("render", scene, "-o", out, "--spp", 4, "--size", f"{SIZE}x{SIZE}", "--float", "--quiet", *more)
    channels = read(out)[0]
    return np.stack([np.array(channels[c], float) for c in "RGB"], axis=2)


def agree(one, two):
    """The geometry is the same to the last bit, and so are the random numbers; only the winding of triangles differs, and with it the
    rounding of hits. Where a path passes an edge by less, it takes another way: of 1024 pixels at most four."""
    apart = np.abs(one - two).max(axis=2) > 1e-4 * (1 + np.abs(one).max(axis=2))
    assert apart.sum() <= 4, f"{apart.sum()} pixels differ, by up to {np.abs(one - two).max()}"


@pytest.mark.parametrize("normals, twice", itertools.product((True, False), (False, True)))
def test_gltf_looks_the_same_in_nodes_that_mirror(tmp_path, normals, twice):
    expected = picture(Room(normals=normals, twice=twice).write(tmp_path / "a.gltf"), tmp_path / "a.exr", "-D", "environment=0.5")

    for mirror in (X, ALL):
        scene = Room(mirror, normals, twice).write(tmp_path / "b.gltf")
        agree(expected, picture(scene, tmp_path / "b.exr", "-D", "environment=0.5"))


@pytest.mark.parametrize("flipped", ["u", "v", "uv"])
def test_a_normal_map_of_gltf_follows_its_image_where_that_is_mirrored(tmp_path, flipped):
    expected = picture(Room().write(tmp_path / "a.gltf"), tmp_path / "a.exr")

    agree(expected, picture(Room(flipped=flipped).write(tmp_path / "b.gltf"), tmp_path / "b.exr"))


def test_a_normal_map_of_gltf_leans_by_its_image(tmp_path):
    """What the others compare is not the same picture with any map."""
    expected = picture(Room().write(tmp_path / "a.gltf"), tmp_path / "a.exr")

    with pytest.raises(AssertionError):
        wrong = Room(flipped="u")
        wrong.json["images"] = Room().json["images"]
        agree(expected, picture(wrong.write(tmp_path / "b.gltf"), tmp_path / "b.exr"))


@pytest.mark.parametrize("scale", [X, (1, -1, 1), ALL])
def test_a_camera_of_gltf_looks_along_its_axis_in_a_node_that_mirrors(tmp_path, scale):
    """A node that mirrors z turns the camera round, and the room with it; the picture is never mirrored."""
    expected = picture(Room().write(tmp_path / "a.gltf"), tmp_path / "a.exr")
    room = Room()
    if scale[2] < 0:  # a mirror of all axes is half a turn about z and a mirror of z
        scale = (-1, -1, 1)
    room.json["nodes"][-1]["scale"] = list(scale)

    seen = picture(room.write(tmp_path / "b.gltf"), tmp_path / "b.exr")

    upright = expected[::-1, ::-1] if scale[1] < 0 else expected
    # Pixels take their samples elsewhere: where nothing is seen but the lamp and the dark, they agree.
    lamp = (upright[:, :, 0] == 1) & (seen[:, :, 0] == 1)
    assert lamp.sum() > 0.8 * (upright[:, :, 0] == 1).sum() > 20


CUBES = """<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><float name="fov" value="50"/><transform name="to_world"><lookat origin="0,0,6" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><rfilter type="box"/></film></sensor>
<emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
<medium type="homogeneous" id="dye"><rgb name="sigma_t" value="0.1, 0.7, 1.5"/><rgb name="albedo" value="0"/></medium>
<bsdf type="dielectric" id="glass"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>
{shapes}</scene>"""


def cubes(mirror, twice):
    """A lamp that is a rectangle, and a cube of glass full of dye: shapes that mirroring leaves as they are."""
    def to_world(x, y):
        scale = " ".join(f'{axis}="{s}"' for axis, s in zip("xyz", mirror))
        turn = '<rotate y="1" angle="30"/><rotate x="1" angle="20"/>'
        return f'<transform name="to_world"><scale {scale}/>{turn}<translate x="{x}" y="{y}" z="0"/></transform>'

    lamp = f'<shape type="rectangle">{to_world(-1.3, 0)}<bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="1, 0.5, 0.2"/></emitter></shape>'
    parts = '<ref id="glass"/><ref name="interior" id="dye"/>'
    if not twice:
        return lamp + f'<shape type="cube">{to_world(1.3, 0)}{parts}</shape>'
    group = f'<shape type="shapegroup" id="g"><shape type="cube">{parts}</shape></shape>'
    return lamp + group + "".join(f'<shape type="instance"><ref id="g"/>{to_world(1.3, y)}</shape>' for y in (-1.3, 1.3))


@pytest.mark.parametrize("twice", [False, True])
def test_rectangles_and_cubes_of_xml_look_the_same_if_mirrored(tmp_path, twice):
    def seen(mirror):
        (tmp_path / "a.xml").write_text(CUBES.format(shapes=cubes(mirror, twice)))
        return picture(tmp_path / "a.xml", tmp_path / "a.exr")

    expected = seen((1, 1, 1))
    for mirror in (X, (-1, -1, 1)):
        agree(expected, seen(mirror))


def pbrt_room(folder, camera="", world="", ball=""):
    """A lamp, a ball of glass full of dye, a sheet with a normal map and an instance of a ball, before a grey sky, as pbrt-v4 has it. `camera`
    stands before its LookAt, `world` before all shapes and `ball` before the ball of glass."""
    (folder / "map.png").write_bytes(png([*LEANING, 0.85]))
    (folder / "room.pbrt").write_text(f"""Film "rgb" "integer xresolution" {SIZE} "integer yresolution" {SIZE}
PixelFilter "box"
Integrator "volpath"
{camera}
LookAt 0 0 6  0 0 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "infinite" "rgb L" [0.3 0.3 0.3]
{world}
MakeNamedMedium "dye" "string type" "homogeneous" "rgb sigma_a" [0.1 0.7 1.5] "rgb sigma_s" [0 0 0]
Texture "lean" "spectrum" "imagemap" "string filename" "map.png"
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [1 0.5 0.2]
  Translate -1.3 1.3 0 Rotate 20 0 1 0
  Shape "trianglemesh" "point3 P" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] "integer indices" [0 1 2 0 2 3]
AttributeEnd
AttributeBegin
  Translate 1.3 1.3 0
  Material "dielectric"
  MediumInterface "dye" "" {ball}
  Shape "sphere"
AttributeEnd
AttributeBegin
  Translate 1.3 -1.3 0
  Material "diffuse" "string normalmap" "map.png"
  Shape "trianglemesh" "point3 P" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] "point2 uv" [0 0 1 0 1 1 0 1] "integer indices" [0 1 2 0 2 3]
AttributeEnd
ObjectBegin "ball" Material "diffuse" "rgb reflectance" [0.2 0.6 0.9] Shape "sphere" "float radius" 0.5 ObjectEnd
AttributeBegin Translate -1.3 -1.3 0 Rotate 30 0 0 1 Scale 1 2 1 ObjectInstance "ball" AttributeEnd
""")
    return folder / "room.pbrt"


def blocks(folder, *room):
    """Means of 8 x 8 pixels, and their standard errors."""
    scene, out = pbrt_room(folder, *room), folder / "room.exr"
    lightshaft("render", scene, "-o", out, "--spp", 64, "--size", f"{SIZE}x{SIZE}", "--float", "--quiet")
    channels = read(out)[0]

    def of(names, combine):
        planes = np.stack([np.array(channels[c], float) for c in names], axis=2)
        return combine(planes.reshape(SIZE // 8, 8, SIZE // 8, 8, 3))

    mean = of("RGB", lambda p: p.mean(axis=(1, 3)))
    error = of(["stderr.R", "stderr.G", "stderr.B"], lambda p: np.sqrt((p**2).sum(axis=(1, 3))) / 64)
    return mean, error


def alike(one, two):
    """Of 48 figures each within five standard errors, and 0.2 % for pixels whose two halves are equal by chance."""
    apart = np.abs(one[0] - two[0]) - 5 * np.hypot(one[1], two[1]) - 2e-3 * one[0]
    assert apart.max() < 0, apart.max(axis=2)


@pytest.mark.parametrize("mirror", ["Scale -1 1 1", "Scale 1 -1 1"])
def test_a_mirrored_world_of_pbrt_before_a_mirrored_camera_looks_the_same(tmp_path, mirror):
    """As in pbrt, a quadric that is mirrored has its inside outside, so that exporters reverse it."""
    expected = blocks(tmp_path)
    assert expected[0][0, 3, 0] > 0.5, "the lamp shines at the camera"

    alike(expected, blocks(tmp_path, mirror, mirror, "ReverseOrientation"))
    with pytest.raises(AssertionError):
        alike(expected, blocks(tmp_path, mirror, mirror))


@pytest.mark.parametrize("mirror, turn", [("Scale -1 1 1", np.s_[:, ::-1]), ("Scale 1 -1 1", np.s_[::-1])])
def test_a_mirrored_camera_of_pbrt_shows_the_mirrored_picture(tmp_path, mirror, turn):
    expected, seen = blocks(tmp_path), blocks(tmp_path, mirror)

    alike(expected, (seen[0][turn], seen[1][turn]))
    with pytest.raises(AssertionError):
        alike(expected, seen)
