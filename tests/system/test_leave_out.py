"""What a scene does not need is not sent, not loaded, not mapped, and changes no bit."""

import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

import pytest
from cli_kit import FOG, lightshaft, vol_bytes, write_fog
from local_farm import ROOT, LocalFarm
from processes import family

UNUSED_BYTES = 5 << 20
GRID = re.compile(r'<medium name="interior".*?</medium>', re.S)


def inspect(scene, *flags):
    return json.loads(lightshaft("inspect", scene, "--json", *flags).stdout)


# ---- every instantiation that covers a scene gives the same bits ----

HOMOGENEOUS = '<medium name="interior" type="homogeneous"><rgb name="sigma_t" value="{}"/><rgb name="albedo" value="0.9, 0.8, 0.6"/></medium>'
GLOWING = HOMOGENEOUS.format("1").replace("</medium>", '<rgb name="emission" value="0.3, 0.2, 0"/></medium>')
FALLING = '<medium name="interior" type="heterogeneous"><volume name="sigma_t" type="heightfog"/><float name="albedo" value="0.9"/></medium>'
LAMP = re.compile(r'  <shape type="rectangle">.*?</shape>\n', re.S)
SPOT = ('<emitter type="spot"><transform name="to_world"><lookat origin="1, 2, 1" target="0, 0, 0" up="0, 1, 0"/></transform>'
        '<rgb name="intensity" value="30, 28, 24"/></emitter>\n')
SUN = '<emitter type="directional"><vector name="direction" x="0.5" y="-0.7" z="-0.5"/><rgb name="irradiance" value="8, 7.4, 6.4"/></emitter>\n'
SKY = '<emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>'
PLAIN = '<integrator type="volpath"/>'
DEEP = '<integrator type="volpathmis"><integer name="max_depth" value="64"/><integer name="rr_depth" value="5"/></integrator>'
AROUND = ('<medium type="heterogeneous" id="around"><volume name="sigma_t" type="gridvolume"><string name="filename" value="fog.vol"/>'
          '<transform name="to_world"><scale value="9"/><translate x="-4.5" y="-4.5" z="-4.5"/></transform></volume><float name="scale" value="0.5"/></medium>')
STILL_LIFE = """<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
  <bsdf type="twosided"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf></bsdf></shape>
<shape type="sphere"><float name="radius" value="0.6"/><bsdf type="roughconductor"><float name="alpha" value="0.1"/></bsdf></shape>
<shape type="sphere"><float name="radius" value="0.4"/><point name="center" x="1" y="-0.5" z="0.5"/><bsdf type="roughplastic"/></shape>
<shape type="sphere"><float name="radius" value="0.4"/><point name="center" x="-1" y="-0.5" z="0.5"/><bsdf type="dielectric"/></shape>
"""
VARIED = {
    "grid": (FOG, 2),
    "homogeneous": (GRID.sub(HOMOGENEOUS.format("1.5"), FOG), 3),
    "chromatic": (GRID.sub(HOMOGENEOUS.format("0.5, 1.5, 3"), FOG), 2),
    "glowing": (GRID.sub(GLOWING, FOG), 1),
    "vacuum": (GRID.sub("", FOG), 5),
    "fog that falls with height": (GRID.sub(FALLING, FOG), 2),
    "noise": (GRID.sub(FALLING.replace("heightfog", "noise"), FOG), 3),
    # What the scenes are like that are used to compare renderers.
    "spot in fog": (LAMP.sub(SPOT, GRID.sub(HOMOGENEOUS.format("0.25"), FOG)).replace(SKY, ""), 4),
    "extinctions of 1 to 16": (GRID.sub(HOMOGENEOUS.format("0.3, 1.2, 4.8"), FOG.replace('<shape type="cube">', '<shape type="sphere">')), 2),
    "cloud under sun and sky": (LAMP.sub(SUN, FOG.replace(PLAIN, DEEP)), 3),
    "sunlit room of steam": (LAMP.sub(SUN + STILL_LIFE, GRID.sub('<ref name="interior" id="around"/>', FOG).replace(PLAIN, PLAIN + AROUND))
                             .replace('<float name="fov"', '<ref name="medium" id="around"/><float name="fov"')
                             .replace('<shape type="cube">', '<shape type="cube"><transform name="to_world"><scale value="4.5"/></transform>'), 3),
    "still life through a lens": (re.sub(r'  <shape type="cube">.*?</shape>\n', STILL_LIFE, FOG, flags=re.S)
                                  .replace('<sensor type="perspective">', '<sensor type="thinlens"><float name="aperture_radius" value="0.1"/>'
                                           '<float name="focus_distance" value="4"/>'), 4),
    "chosen by distance": (FOG.replace('<integrator type="volpath"/>', '<integrator type="volpath_distant_mis"/>'), 2),
}


def agree(scene, at_least):
    told = inspect(scene, "--variants")
    assert told["variants_agree"], told["variant_bits"]
    assert len({v["variant"] for v in told["variant_bits"]}) == len(told["variant_bits"]) >= at_least, told["variant_bits"]
    assert told["variant_bits"][0]["variant"] == told["variant"]
    counted = [v["instructions_per_path"] for v in told["variant_bits"]]
    if "uncounted" in told:  # most virtual machines have no counter
        assert told["uncounted"] and counted == [None] * len(counted)
    else:
        assert counted[0] > 500 and max(counted) >= counted[0]
    return told


@pytest.mark.parametrize("kind", VARIED)
def test_every_instantiation_gives_the_same_bits(kind, tmp_path):
    scene = write_fog(tmp_path)
    text, at_least = VARIED[kind]
    scene.write_text(text.replace('<default name="density" value="2"/>', "") if "$density" not in text else text)
    agree(scene, at_least)


def test_every_instantiation_gives_the_same_bits_of_the_demo_scenes(tmp_path):
    pytest.importorskip("numpy")
    room = ROOT / "scenes" / "steam_room"
    subprocess.run([sys.executable, "-B", room / "make_steam.py", tmp_path / "steam.vol", "--voxel", "0.25"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([sys.executable, "-B", room / "make_scene.py", tmp_path / "steam_room.xml"], check=True)
    agree(tmp_path / "steam_room.xml", 2)
    bath = tmp_path / "bath"
    subprocess.run([sys.executable, "-B", ROOT / "scenes" / "bath" / "make_bath.py", bath, "--setting", "sketch"], check=True)
    agree(bath / "bath.xml", 2)
    agree(ROOT / "scenes" / "mirror_focus" / "scene.xml", 2)


def test_every_instantiation_gives_the_same_bits_of_the_validation_scenes(tmp_path):
    subprocess.run([sys.executable, "-B", ROOT / "scenes" / "validate" / "make_tests.py", tmp_path], check=True)
    scenes = 0
    for tests in sorted(tmp_path.glob("*.xml")):
        for scene in re.findall(r"<scene>.*?</scene>", tests.read_text(), re.S):
            one = tmp_path / f"scene-{scenes}.xml"
            one.write_text(scene)
            agree(one, 1)
            scenes += 1
    assert scenes >= 5


# ---- what nothing needed names ----

def large_grid(path, more=b""):
    n = round((UNUSED_BYTES / 4) ** (1 / 3)) + 1
    path.write_bytes(vol_bytes([0.5] * n ** 3, n, n, n) + more)
    assert path.stat().st_size > UNUSED_BYTES


def with_unused(scene, folder):
    """The scene with two large files that no pixel depends on: a grid in no surface, an image in a branch of weight 0."""
    large_grid(folder / "unused.vol", os.urandom(4096))  # another digest at each run
    (folder / "nothing.png").write_bytes(os.urandom(UNUSED_BYTES + 1))
    medium = ('<medium type="heterogeneous" id="unused"><volume name="sigma_t" type="gridvolume"><string name="filename" value="unused.vol"/></volume>'
              '</medium>')
    plain = '<bsdf type="diffuse"/>'
    image = '<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="nothing.png"/></texture></bsdf>'
    blend = f'<bsdf type="blendbsdf"><float name="weight" value="0"/>{plain}{image}</bsdf>'
    ball = '<shape type="sphere"><float name="radius" value="0.3"/>{}</shape>'
    fat, lean = folder / "fat.xml", folder / "lean.xml"
    lean.write_text(scene.read_text().replace("</scene>", ball.format(plain) + "</scene>"))
    fat.write_text(scene.read_text().replace("</scene>", medium + ball.format(blend) + "</scene>"))
    return fat, lean


def bytes_under(folder):
    return sum(p.stat().st_size for p in pathlib.Path(folder).rglob("*") if p.is_file())


def test_bytes_that_nothing_needs_are_neither_sent_nor_loaded(tmp_path):
    fat, lean = with_unused(write_fog(tmp_path), tmp_path)
    told = inspect(fat)
    assert [a["name"] for a in told["assets"]] == ["fog.vol"]
    assert {f["name"] for f in told["files_left_out"]} == {"unused.vol", "nothing.png"}
    assert told["structures"] == inspect(lean)["structures"]
    assert told["scene_bytes"] == inspect(lean)["scene_bytes"]
    assert sum(part["bytes"] for part in told["parts"]) == (tmp_path / "fog.vol").stat().st_size

    pixels = {}
    (tmp_path / "farm").mkdir()
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        for scene in (fat, lean):
            said = lightshaft("submit", scene, "--spp", 2, env=env)
            job = said.stdout.split()[0]
            pixels[scene] = farm.pixels(job)
            assert "unused.vol" not in said.stderr and "nothing.png" not in said.stderr
            report = farm.report(job)
            assert report["needs"]["grids"] and "volume grids" in report["features_used"]
        analysis = report["analysis"]
        assert {"part": "volume grids", "used": True, "why": "grid of fog.vol", "bytes": (tmp_path / "fog.vol").stat().st_size} in analysis["parts"]
        assert all(part["bytes"] == 0 for part in analysis["parts"] if part["part"] != "volume grids")
        assert bytes_under(farm.data) < UNUSED_BYTES and bytes_under(tmp_path / "farm" / "cache") < UNUSED_BYTES
    assert pixels[fat] == pixels[lean]


def with_hidden_media(scene, folder):
    """The scene with a large grid in an opaque box and coloured fog in an opaque ball, and the same without either."""
    large_grid(folder / "fog.vol")
    opaque = '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>'
    ball = '<shape type="sphere"><float name="radius" value="0.4"/><point name="center" x="1.6" y="0" z="0"/>{}{}</shape></scene>'
    hidden, bare = folder / "hidden.xml", folder / "bare.xml"
    text = scene.read_text().replace('<bsdf type="null"/>', opaque, 1)
    hidden.write_text(text.replace("</scene>", ball.format(opaque, HOMOGENEOUS.format("1, 2, 4"))))
    bare.write_text(GRID.sub("", text).replace('<default name="density" value="2"/>', "").replace("</scene>", ball.format(opaque, "")))
    return hidden, bare


def test_media_that_no_light_gets_into_are_neither_sent_nor_loaded(tmp_path):
    hidden, bare = with_hidden_media(write_fog(tmp_path), tmp_path)
    told = inspect(hidden)
    out_of_reach = {"what": "medium", "why": "no light gets into what it fills", "count": 2, "bytes": 0}
    assert out_of_reach in told["pruned"]
    assert told["assets"] == [] and [f["name"] for f in told["files_left_out"]] == ["fog.vol"]
    assert told["variant"] == inspect(bare)["variant"] == "surfaces"
    assert told["scene_sha256"] == inspect(bare)["scene_sha256"]
    glass = tmp_path / "glass.xml"
    glass.write_text(hidden.read_text().replace('<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>', '<bsdf type="dielectric"/>', 1))
    told = inspect(glass)
    assert [a["name"] for a in told["assets"]] == ["fog.vol"] and told["variant"] == "grey grids"
    assert {**out_of_reach, "count": 1} in told["pruned"]

    (tmp_path / "farm").mkdir()
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        jobs = [lightshaft("submit", scene, "--spp", 2, env=env).stdout.split()[0] for scene in (hidden, bare)]
        pixels = [farm.pixels(job) for job in jobs]
        report = farm.report(jobs[0])
        assert out_of_reach in report["analysis"]["left_out"]
        assert {"volume grids", "chromatic extinction", "participating media"} <= set(report["features_left_out"])
        assert bytes_under(farm.data) < UNUSED_BYTES and bytes_under(tmp_path / "farm" / "cache") < UNUSED_BYTES
    assert pixels[0] == pixels[1]


def test_a_scene_may_be_sent_whole_and_nothing_beyond_its_needs_goes_to_workers(tmp_path):
    """By hand, as a browser does it: everything uploaded; the worker still fetches what is needed alone."""
    fat, _ = with_unused(write_fog(tmp_path), tmp_path)
    (tmp_path / "farm").mkdir()
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        digests = {}
        for path in (fat, *tmp_path.glob("*.vol"), *tmp_path.glob("*.png")):
            digests[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
            farm.request("PUT", f"/api/v1/blobs/{digests[path.name]}", path.read_bytes(), "application/octet-stream")
        scene = digests.pop("fat.xml")
        body = {"scene": scene, "assets": digests, "name": "fat.xml", "spec": {"spp": 2}}
        job = json.loads(farm.request("POST", "/api/v1/jobs", json.dumps(body).encode()))["id"]
        farm.wait_for_job(job)
        assert bytes_under(farm.data) > UNUSED_BYTES > bytes_under(tmp_path / "farm" / "cache")


# ---- libraries ----

def mapped(worker):
    return "".join(pathlib.Path(f"/proc/{pid}/maps").read_text() for pid in family(worker.popen.pid))


def test_a_worker_never_maps_openvdb_though_it_renders_a_vdb(tmp_path):
    pytest.importorskip("numpy")
    bath = tmp_path / "bath"
    subprocess.run([sys.executable, "-B", ROOT / "scenes" / "bath" / "make_bath.py", bath, "--setting", "sketch"], check=True)
    (tmp_path / "farm").mkdir()
    with LocalFarm(tmp_path / "farm") as farm:
        worker = farm.add_worker(fake=False)
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        farm.pixels(lightshaft("submit", write_fog(tmp_path), "--spp", 2, env=env).stdout.split()[0])
        libraries = mapped(worker)
        assert "libembree" in libraries and "openvdb" not in libraries
        farm.pixels(lightshaft("submit", bath / "bath.xml", "--spp", 2, "--size", "16x12", env=env).stdout.split()[0])
        libraries = mapped(worker)
        assert "libembree" in libraries and "openvdb" not in libraries
