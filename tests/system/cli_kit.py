"""What the tests of the command share: running it, and a small scene with a grid."""

import json
import math
import os
import re
import struct
import subprocess

from local_farm import PATIENCE, ROOT, bin_dir

FOG = """<scene version="3.0.0">
  <default name="density" value="2"/>
  <integrator type="volpath"/>
  <sensor type="perspective">
    <float name="fov" value="45"/>
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
    <film type="hdrfilm"><integer name="width" value="72"/><integer name="height" value="40"/><rfilter type="gaussian"/></film>
  </sensor>
  <shape type="cube">
    <bsdf type="null"/>
    <medium name="interior" type="heterogeneous">
      <volume name="sigma_t" type="gridvolume">
        <string name="filename" value="fog.vol"/>
        <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform>
      </volume>
      <rgb name="albedo" value="0.9, 0.8, 0.6"/>
      <float name="scale" value="$density"/>
      <phase type="hg"><float name="g" value="0.4"/></phase>
    </medium>
  </shape>
  <shape type="rectangle">
    <transform name="to_world"><rotate x="1" angle="90"/><scale value="0.5"/><translate y="1.6"/></transform>
    <emitter type="area"><rgb name="radiance" value="9, 8, 7"/></emitter>
    <bsdf type="diffuse"/>
  </shape>
  <emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>
</scene>
"""


def vol_bytes(values, nx, ny, nz):
    """Mitsuba's grid format, version 3: one float channel in the box [0,1]^3."""
    head = b"VOL\x03" + struct.pack("<5i6f", 1, nx, ny, nz, 1, 0, 0, 0, 1, 1, 1)
    return head + struct.pack(f"<{nx * ny * nz}f", *values)


def fog_values(n):
    """Two soft blobs and a wisp: no plane of symmetry that could hide a mix-up."""
    def at(x, y, z):
        first = math.exp(-8 * ((x - .3) ** 2 + (y - .4) ** 2 + (z - .5) ** 2))
        second = math.exp(-20 * ((x - .7) ** 2 + (y - .7) ** 2 + (z - .4) ** 2))
        return 1.5 * first + 3 * second + .1 * x
    cells = [(i + .5) / n for i in range(n)]
    return [at(x, y, z) for z in cells for y in cells for x in cells]


def write_fog(folder, n=12):
    """fog.xml with its grid; its path."""
    (folder / "fog.vol").write_bytes(vol_bytes(fog_values(n), n, n, n))
    (folder / "fog.xml").write_text(FOG)
    return folder / "fog.xml"


def lightshaft(*arguments, cwd=None, env=None, code=0, patience=PATIENCE):
    """Runs the command; it must return `code`, and come back before `patience` (seconds) is over."""
    done = subprocess.run([os.environ.get("LIGHTSHAFT_CLI", bin_dir() / "lightshaft"), *map(str, arguments)], cwd=cwd, env=env, text=True,
                          capture_output=True, timeout=patience)
    assert done.returncode == code, f"exit code {done.returncode}, not {code}\n{done.stdout}\n{done.stderr}"
    return done


def png_size(data):
    """Width and height."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def digest(done):
    """The pixels_sha256 that a command has printed."""
    lines = [line for line in done.stdout.splitlines() if line.startswith("pixels_sha256 ")]
    assert len(lines) == 1, done.stdout
    return lines[0].split()[1]


def load(path):
    return json.loads(path.read_text())


def rate_of(family):
    """What a family of statistical tests may spend of the suite's one rate of false alarms."""
    table = (ROOT / "tests" / "support" / "significance.h").read_text()
    return float(re.search(rf"Rate{{Family::{family}, ([0-9.e-]+)}}", table)[1])
