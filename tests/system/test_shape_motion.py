"""Shapes that move together with the camera are seen as if nothing moved."""

import numpy
import pytest
from cli_kit import lightshaft
from exr_layers import read

ALONG = ('<animation name="to_world"><transform time="0">{0}</transform><transform time="1">{0}<translate x="10"/></transform></animation>', '<transform name="to_world">{0}</transform>')

SCENE = """<scene version="3.0.0"><integrator type="volpath"/>
  <medium id="thin" type="homogeneous"><float name="sigma_t" value="0.3"/><rgb name="albedo" value="0"/></medium>
  <medium id="thick" type="homogeneous"><float name="sigma_t" value="2"/><rgb name="albedo" value="0"/></medium>
  <sensor type="perspective"><float name="shutter_close" value="1"/><float name="fov" value="40"/>{camera}<ref id="thin"/>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/><rfilter type="box"/></film></sensor>
  <shape type="cube">{room}<bsdf type="null"/><ref name="interior" id="thin"/></shape>
  <shape type="cube">{cloud}<bsdf type="null"/><ref name="interior" id="thick"/></shape>
  <emitter type="constant"><rgb name="radiance" value="1"/></emitter></scene>"""

# A cloud around the camera, and one that the camera would pass if the cloud had not gone away before.
CLOUDS = {
    "around the camera": (ALONG[0].format('<scale value="0.5"/>'), ALONG[1].format('<scale value="0.5"/>')),
    "gone before": ('<animation name="to_world"><transform time="0"><scale value="0.5"/><translate x="5"/></transform>'
                    '<transform time="0.2"><scale value="0.5"/><translate x="5" y="50"/></transform></animation>',
                    ALONG[1].format('<scale value="0.5"/><translate x="5" y="50"/>')),
}


@pytest.mark.parametrize("cloud", CLOUDS)
def test_a_camera_in_fog_keeps_its_media_while_all_moves(tmp_path, cloud):
    images = []
    for kind in (0, 1):
        scene = tmp_path / f"{kind}.xml"
        scene.write_text(SCENE.format(camera=ALONG[kind].format(""), room=ALONG[kind].format(""), cloud=CLOUDS[cloud][kind]))
        lightshaft("render", scene, "-o", tmp_path / f"{kind}.exr", "--spp", 16, "--float")
        images.append(numpy.array([read(tmp_path / f"{kind}.exr")[0][c] for c in "RGB"]))

    # The media absorb only, so a ray's value is its transmittance: the same but for the rounding of places near 10.
    numpy.testing.assert_allclose(images[0], images[1], rtol=1e-3)
