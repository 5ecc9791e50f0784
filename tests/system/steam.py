"""A cube of steam whose density is a file, steam.vol: the smallest scene that needs an asset."""

import struct


def scene(samples):
    return f"""<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective">
    <sampler type="independent"><integer name="sample_count" value="{samples}"/></sampler>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film>
  </sensor>
  <shape type="cube">
    <bsdf type="null"/>
    <medium type="heterogeneous" name="interior">
      <volume type="gridvolume" name="sigma_t"><string name="filename" value="steam.vol"/></volume>
    </medium>
  </shape>
  <emitter type="constant"/>
</scene>
"""


def grid(values):
    """The bytes of steam.vol; as many densities as a cube has voxels."""
    side = round(len(values) ** (1 / 3))
    assert side ** 3 == len(values)
    return b"VOL\x03" + struct.pack("<iiiii6f", 1, side, side, side, 1, 0, 0, 0, 1, 1, 1) + struct.pack(f"<{len(values)}f", *values)
