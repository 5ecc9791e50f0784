"""Grids that are mostly empty: boxes that no array could hold, in memory for what is in them, and the same pictures.

The files are written here with OpenVDB's own Python module (Debian: python3-openvdb).
"""

import json

import pytest
from cli_kit import digest, lightshaft, load

vdb = pytest.importorskip("pyopenvdb", reason="python3-openvdb is not installed")
numpy = pytest.importorskip("numpy")

SIDE = 2000  # voxels of the box along each axis
RADIUS = 124  # of a ball of 8 million voxels, a thousandth of them
DENSE = 4 * SIDE**3  # bytes

SCENE = """<scene version="3.0.0"><integrator type="volpath"/>
  <medium type="heterogeneous" id="m"><volume type="gridvolume" name="sigma_t"><string name="filename" value="smoke.vdb"/></volume>
    <float name="albedo" value="0.8"/><float name="scale" value="{scale}"/></medium>
  <shape type="cube"><transform name="to_world"><scale value="0.999"/></transform><bsdf type="null"/><ref name="interior" id="m"/></shape>
  <emitter type="constant"><rgb name="radiance" value="1, .9, .8"/></emitter>
  <sensor type="perspective"><float name="fov" value="{fov}"/>
    <transform name="to_world"><lookat origin="0.1 0.2 -4" target="0 0 0" up="0 1 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor></scene>"""


def smoke(radius, corners=None):
    """A ball about the origin, whose voxels are 1/1000 wide. With `corners`, the box reaches to them by voxels without smoke."""
    made = vdb.FloatGrid()
    n = numpy.arange(-radius, radius + 1, dtype=numpy.float32)
    for z in range(-radius, radius + 1):
        inside = (n[:, None] ** 2 + n[None, :] ** 2 + z * z <= radius * radius).astype(numpy.float32)
        wave = 1 + .5 * numpy.sin(n[:, None] / 9.1 + z / 23) * numpy.cos(n[None, :] / 7.3 - z / 17)
        made.copyFromArray((inside * wave).astype(numpy.float32)[:, :, None], ijk=(-radius, -radius, z))
    access = made.getAccessor()
    for corner in corners or ():
        access.setValueOn((corner,) * 3, 0.0)
    made.transform = vdb.createLinearTransform(voxelSize=1e-3)
    made.name = "density"
    made.gridClass = vdb.GridClass.FOG_VOLUME
    return made


def scene_with(folder, made, scale=20, fov=4):
    vdb.write(str(folder / "smoke.vdb"), grids=[made])
    (folder / "smoke.xml").write_text(SCENE.format(scale=scale, fov=fov))
    return folder / "smoke.xml"


def structures(scene):
    said = json.loads(lightshaft("inspect", scene, "--json").stdout)
    return {s["name"]: s["bytes"] for s in said["structures"]}


def test_a_grid_takes_memory_for_what_is_in_it(tmp_path):
    scene = scene_with(tmp_path, smoke(RADIUS, (-SIDE // 2 + 1, SIDE // 2 - 2)))
    lightshaft("render", scene, "-o", tmp_path / "a.exr", "--spp", 4, "--report", tmp_path / "r.json")

    stored = structures(scene)
    # A thousandth is stored as bricks, with layers about them: about twice the voxels.
    assert DENSE / 2000 < stored["grid values"] < DENSE / 400
    assert stored["majorant cells"] < DENSE / 400
    assert load(tmp_path / "r.json")["peak_rss_bytes"] < DENSE / 50
    assert load(tmp_path / "r.json")["nonfinite_samples"] == 0


def test_the_picture_is_that_of_a_small_box(tmp_path):
    reports = []
    for name, corners in (("small", None), ("large", (-SIDE // 2 + 1, SIDE // 2 - 2))):
        folder = tmp_path / name
        folder.mkdir()
        reference = ["--reference", tmp_path / "small.exr"] if reports else []
        lightshaft("render", scene_with(folder, smoke(60, corners), fov=2), "-o", tmp_path / f"{name}.exr", "--spp", 256, "--float",
                   "--seed", len(reports), "--report", folder / "r.json", *reference)
        reports.append(load(folder / "r.json"))

    # Both renders' noise, which is twice the estimate's square; smoke in another place differs by more than itself.
    assert reports[1]["convergence"][-1]["true_relmse"] < 4 * reports[1]["relmse"]
    assert structures(tmp_path / "large" / "smoke.xml")["grid values"] < DENSE / 1000


def test_pixels_of_a_large_box_depend_on_no_threads(tmp_path):
    scene = scene_with(tmp_path, smoke(60, (-SIDE // 2, SIDE // 2)), fov=2)

    assert digest(lightshaft("render", scene, "-o", tmp_path / "a.exr", "--spp", 8, "--threads", 1)) == \
        digest(lightshaft("render", scene, "-o", tmp_path / "b.exr", "--spp", 8, "--threads", 2))


def test_a_large_tile_takes_next_to_no_memory(tmp_path):
    made = vdb.FloatGrid()
    made.fill((-2048, -2048, -2048), (2047, 2047, 2047), 1.0)
    made.transform = vdb.createLinearTransform(voxelSize=1 / 2048)
    made.name = "density"
    made.gridClass = vdb.GridClass.FOG_VOLUME
    scene = scene_with(tmp_path, made, scale=1, fov=30)
    lightshaft("render", scene, "-o", tmp_path / "a.exr", "--spp", 4, "--report", tmp_path / "r.json")

    assert structures(scene)["grid values"] < 2 << 20  # bytes
    assert load(tmp_path / "r.json")["nonfinite_samples"] == 0
