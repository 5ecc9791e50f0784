"""OpenVDB files through the whole command: right, placed by their own transform, and refused by name when they are bad.

The files are written here with OpenVDB's own Python module (Debian: python3-openvdb).
"""

import math
import subprocess
import sys

import pytest
from cli_kit import FOG, digest, fog_values, lightshaft, load, write_fog
from local_farm import PATIENCE, ROOT, bin_dir

vdb = pytest.importorskip("pyopenvdb", reason="python3-openvdb is not installed")
numpy = pytest.importorskip("numpy")

N = 12
PLACED = """<transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform>"""


def grid(values, name="density", voxel=2 / N):
    """Cell centres of the box [-1, 1]^3, as write_fog's grid."""
    made = vdb.FloatGrid()
    made.copyFromArray(values, tolerance=-1)
    made.transform = vdb.createLinearTransform(voxelSize=voxel)
    made.transform.translate([-1 + voxel / 2] * 3)
    made.name = name
    made.gridClass = vdb.GridClass.FOG_VOLUME
    return made


def fog_array():
    return numpy.array(fog_values(N), dtype=numpy.float32).reshape(N, N, N).transpose(2, 1, 0).copy()


def write_scene(folder, named=""):
    extra = f'<string name="grid_name" value="{named}"/>' if named else ""
    text = FOG.replace("fog.vol", "fog.vdb").replace(PLACED, extra)
    assert text.count("fog.vdb") == 1 and PLACED not in text
    (folder / "fog.xml").write_text(text)
    return folder / "fog.xml"


def render(scene, folder, code=0, **options):
    return lightshaft("render", scene, "-o", folder / "out.exr", "--spp", 64, "--report", folder / "r.json", "--threads", 2, code=code, **options)


def test_a_vdb_is_read_and_is_no_other_grid_than_the_vol(tmp_path):
    vdb.write(str(tmp_path / "fog.vdb"), grids=[grid(fog_array())])
    render(write_scene(tmp_path), tmp_path)
    one = [lightshaft("render", tmp_path / "fog.xml", "-o", tmp_path / "a.exr", "--spp", 4, "--threads", t) for t in (1, 2)]

    assert digest(one[0]) == digest(one[1])
    assert load(tmp_path / "r.json")["nonfinite_samples"] == 0

    other = tmp_path / "vol"
    other.mkdir()
    lightshaft("render", tmp_path / "fog.xml", "-o", tmp_path / "vdb.exr", "--spp", 256, "--float", "--threads", 2)
    compared = lightshaft("render", write_fog(other, n=N), "-o", other / "vol.exr", "--spp", 256, "--seed", 1, "--threads", 2,
                          "--reference", tmp_path / "vdb.exr", "--report", other / "r.json")

    # Beyond the outermost cell centres the .vol is clamped and the .vdb falls to 0 within a voxel: both scenes differ there a
    # little, elsewhere by noise alone. Noise of both is twice the estimate's square; the edges add less than as much again.
    report = load(other / "r.json")
    assert compared.returncode == 0
    assert report["convergence"][-1]["true_relmse"] < 4 * report["relmse"]


@pytest.mark.parametrize("kind, text", [
    ("truncated", "fog.vdb"), ("garbage", "fog.vdb"), ("empty file", "fog.vdb"),
    ("empty grid", "no active voxel"), ("level set", "level set"), ("two grids", "smoke"), ("flow", "staggered"), ("yes and no", "type bool"), ("nan", "not a finite number"),
])
def test_a_bad_vdb_is_refused_by_name(tmp_path, kind, text):
    path = tmp_path / "fog.vdb"
    if kind == "level set":
        sphere = vdb.createLevelSetSphere(radius=5)
        sphere.name = "density"
        vdb.write(str(path), grids=[sphere])
    elif kind == "two grids":
        vdb.write(str(path), grids=[grid(fog_array(), "smoke"), grid(fog_array(), "heat")])
    elif kind == "flow":
        flow = vdb.Vec3SGrid()
        flow.fill((0, 0, 0), (3, 3, 3), (1, 2, 3))
        flow.name = "density"
        flow.gridClass = vdb.GridClass.STAGGERED
        vdb.write(str(path), grids=[flow])
    elif kind == "yes and no":
        where = vdb.BoolGrid()
        where.fill((0, 0, 0), (3, 3, 3), True)
        where.name = "density"
        vdb.write(str(path), grids=[where])
    elif kind == "empty grid":
        nothing = vdb.FloatGrid()
        nothing.name = "density"
        vdb.write(str(path), grids=[nothing])
    else:
        fog = grid(fog_array())
        if kind == "nan":
            fog.getAccessor().setValueOn((3, 4, 5), float("nan"))
        vdb.write(str(path), grids=[fog])
        whole = path.read_bytes()
        cut = {"truncated": whole[: len(whole) * 2 // 3], "garbage": b"\x07" * 4000, "empty file": b""}
        path.write_bytes(cut.get(kind, whole))

    said = render(write_scene(tmp_path), tmp_path, code=2).stderr

    assert "fog.vdb" in said and text in said


def test_every_truncation_of_a_vdb_is_an_error_and_no_crash(tmp_path):
    path = tmp_path / "fog.vdb"
    vdb.write(str(path), grids=[grid(fog_array())])
    whole = path.read_bytes()
    scene = write_scene(tmp_path)
    for part in range(1, 16):
        path.write_bytes(whole[: len(whole) * part // 16])
        ended = subprocess.run([bin_dir() / "lightshaft", "inspect", scene], capture_output=True, text=True, timeout=PATIENCE)
        assert ended.returncode == 2 and "fog.vdb" in ended.stderr, (part, ended.stderr)


def test_a_vdb_without_a_codec_that_ends_early_is_refused(tmp_path):
    sys.path.insert(0, str(ROOT / "scenes" / "bath"))
    try:
        from vdb import write_vdb
    finally:
        sys.path.pop(0)
    scene = write_scene(tmp_path)
    for half in (False, True):
        write_vdb(tmp_path / "fog.vdb", fog_array(), "density", (-1, -1, -1), 2 / N, half=half)
        lightshaft("inspect", scene)
        whole = (tmp_path / "fog.vdb").read_bytes()
        (tmp_path / "fog.vdb").write_bytes(whole[: len(whole) // 6])

        assert "fog.vdb: not a readable OpenVDB or NanoVDB file: damaged, or cut short" in lightshaft("inspect", scene, code=2).stderr


def test_a_grid_of_too_many_voxels_is_a_fault_of_the_scene(tmp_path):
    stray = grid(fog_array())
    stray.getAccessor().setValueOn((20000, 0, 0), 1.0)
    vdb.write(str(tmp_path / "fog.vdb"), grids=[stray])

    said = render(write_scene(tmp_path), tmp_path, code=2).stderr

    assert "fog.vdb: grid 'density' spans 20003 voxels along an axis; the limit is 16384" in said and "tile" not in said


def test_a_negative_density_counts_as_nothing_and_is_counted(tmp_path):
    values = fog_array()
    values[0, 0, 0] = -3
    vdb.write(str(tmp_path / "fog.vdb"), grids=[grid(values)])

    said = lightshaft("inspect", write_scene(tmp_path), "--json")

    assert '"clamped_inputs": 1' in said.stdout.replace("\n", " ")


def test_a_grid_is_found_by_name(tmp_path):
    vdb.write(str(tmp_path / "fog.vdb"), grids=[grid(fog_array(), "smoke"), grid(fog_array() * 0 + 1e-3, "heat")])
    smoke = digest(lightshaft("render", write_scene(tmp_path, "smoke"), "-o", tmp_path / "a.exr", "--spp", 2))
    heat = digest(lightshaft("render", write_scene(tmp_path, "heat"), "-o", tmp_path / "a.exr", "--spp", 2))

    assert smoke != heat


@pytest.mark.parametrize("kind", ["without a name", "of another name", "of no class"])
def test_what_is_unusual_about_the_only_grid_changes_nothing(tmp_path, kind):
    def seen(grids):
        vdb.write(str(tmp_path / "fog.vdb"), grids=grids)
        return digest(lightshaft("render", write_scene(tmp_path), "-o", tmp_path / "a.exr", "--spp", 2))

    usual = seen([grid(fog_array())])
    unusual = grid(fog_array(), {"without a name": "", "of another name": "smoke"}.get(kind, "density"))
    if kind == "of no class":
        unusual.gridClass = vdb.GridClass.UNKNOWN

    assert seen([unusual]) == usual


def test_of_grids_of_one_name_one_must_be_meant(tmp_path):
    vdb.write(str(tmp_path / "fog.vdb"), grids=[grid(fog_array()), grid(fog_array() * 0 + 1e-3)])
    said = render(write_scene(tmp_path), tmp_path, code=2).stderr
    seen = [digest(lightshaft("render", write_scene(tmp_path, f"density[{i}]"), "-o", tmp_path / "a.exr", "--spp", 2)) for i in (0, 1)]

    assert "'density[0]', 'density[1]'" in said
    assert seen[0] != seen[1]


def coloured(*factors):
    """The fog in three channels, each times its factor."""
    one = grid(fog_array())
    made = vdb.Vec3SGrid()
    made.copyFromArray(numpy.stack([fog_array() * f for f in factors], axis=-1), tolerance=(-1, -1, -1))
    made.transform = one.transform
    made.name = "density"
    made.gridClass = vdb.GridClass.FOG_VOLUME
    return made


def test_three_equal_channels_are_one_and_others_are_red_green_and_blue(tmp_path):
    def seen(made):
        vdb.write(str(tmp_path / "fog.vdb"), grids=[made])
        return digest(lightshaft("render", write_scene(tmp_path), "-o", tmp_path / "a.exr", "--spp", 2))

    grey, equal, tinted = seen(grid(fog_array())), seen(coloured(1, 1, 1)), seen(coloured(0, 1, 4))

    assert equal == grey
    assert tinted != grey


def test_a_grid_lies_where_its_affine_map_puts_it(tmp_path):
    # Rotated by a right angle about z as it is in the file, and the values turned back: the same fog.
    turned = grid(fog_array())
    voxel = 2 / N
    turned.transform = vdb.createLinearTransform([[0, voxel, 0, 0], [-voxel, 0, 0, 0], [0, 0, voxel, 0],
                                                  [1 - voxel / 2, -1 + voxel / 2, -1 + voxel / 2, 1]])
    turned.copyFromArray(fog_array().transpose(1, 0, 2)[:, ::-1].copy(), tolerance=-1)
    reports = []
    for name, made in (("straight", grid(fog_array())), ("turned", turned)):
        vdb.write(str(tmp_path / "fog.vdb"), grids=[made])
        scene = write_scene(tmp_path)
        reference = ["--reference", tmp_path / "straight.exr"] if reports else []
        lightshaft("render", scene, "-o", tmp_path / f"{name}.exr", "--spp", 64, "--float", "--seed", len(reports), "--threads", 2,
                   "--report", tmp_path / "r.json", *reference)
        reports.append(load(tmp_path / "r.json"))

    # Both renders' noise, which is twice the estimate's square; a fog in another place differs by more than itself.
    assert reports[1]["convergence"][-1]["true_relmse"] < 4 * reports[1]["relmse"]


def test_a_scene_without_a_vdb_never_maps_openvdb(tmp_path):
    scene = write_fog(tmp_path)
    mapped = subprocess.run(["sh", "-c", 'LD_DEBUG=files exec "$0" render "$1" -o "$2" --spp 2 --quiet', bin_dir() / "lightshaft", scene, tmp_path / "o.exr"],
                            capture_output=True, text=True, check=True).stderr

    assert "libopenvdb" not in mapped and "libembree" in mapped


def test_a_flame_is_two_grids_of_one_file(tmp_path):
    ones = numpy.ones((16, 16, 16), dtype=numpy.float32)
    vdb.write(str(tmp_path / "flame.vdb"), grids=[grid(ones, "density", .1), grid(ones * 1500, "temperature", .1)])
    volume = '<volume type="gridvolume" name="{}"><string name="filename" value="flame.vdb"/><string name="grid_name" value="{}"/></volume>'
    scene = tmp_path / "flame.xml"
    # One unit of absorption .8, within the grids; they begin at -.95.
    scene.write_text(f"""<scene version="3.0.0"><integrator type="volpath"/>
      <medium type="heterogeneous" id="m">{volume.format("sigma_t", "density")}{volume.format("temperature", "temperature")}
        <float name="albedo" value="0"/><float name="scale" value="0.8"/></medium>
      <shape type="cube"><transform name="to_world"><scale value="0.5"/><translate value="-0.2 -0.2 -0.2"/></transform>
        <bsdf type="null"/><ref name="interior" id="m"/></shape>
      <sensor type="perspective"><float name="fov" value="0.01"/>
        <transform name="to_world"><lookat origin="-0.2 -0.2 -5" target="-0.2 -0.2 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor></scene>""")

    said = lightshaft("render", scene, "--pixel", "3,4", "--sample", 0).stdout

    red, green, blue = (float(x) for x in said.split(":")[1].split()[:3])
    absorbed = 1 - math.exp(-.8)
    assert red == pytest.approx(.346325 * absorbed, rel=1e-4)  # of a black body of 1500 K in linear sRGB
    assert green == pytest.approx(.0460885 * absorbed, rel=1e-4)
    assert blue == 0
