"""The scenes of pbrt_small.py. Needs numpy and Pillow for their images."""
import collections

import numpy as np
from PIL import Image

# The lines before WorldBegin. A scene may replace each of them.
FILM = 'Film "rgb" "integer xresolution" {size} "integer yresolution" {size} "string filename" "small.exr" {film}'
CAMERA = 'LookAt 1 1.5 -4  0.1 0.2 0  0 1 0\nCamera "perspective" "float fov" 40'
INTEGRATOR = 'Integrator "volpath" "integer maxdepth" 6'
FILTER = 'PixelFilter "box"'
SAMPLER = 'Sampler "independent"'

Scene = collections.namedtuple("Scene", "name world before camera film integrator filter note",
                               defaults=("", CAMERA, "", INTEGRATOR, FILTER, ""))

LIGHTS = """
LightSource "infinite" "rgb L" [.3 .4 .5]
LightSource "distant" "point3 from" [2 3 -1] "point3 to" [0 0 0] "rgb L" [2 1.8 1.5]
"""
SUN = 'LightSource "distant" "point3 from" [2 3 -4] "point3 to" [0 0 0] "rgb L" [2 1.8 1.5]\n'
SKY = 'LightSource "infinite" "rgb L" [.6 .6 .6]\n'
FLOOR = """
AttributeBegin
  Texture "squares" "spectrum" "checkerboard" "rgb tex1" [.7 .7 .7] "rgb tex2" [.2 .2 .2] "float uscale" 8 "float vscale" 8
  Material "diffuse" "texture reflectance" "squares"
  Shape "trianglemesh" "point3 P" [-6 -1 -6  6 -1 -6  6 -1 6  -6 -1 6] "point2 uv" [0 0  1 0  1 1  0 1] "integer indices" [0 2 1 0 3 2]
AttributeEnd
"""
BALL = 'Shape "sphere" "float radius" 1'
ROOM = LIGHTS + FLOOR
CUBE = """Shape "trianglemesh" "point3 P" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1]
 "integer indices" [0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  3 7 6 3 6 2  0 4 7 0 7 3  1 2 6 1 6 5]
"""
# A patch that shines towards -z, where the camera stands.
SQUARE = 'Shape "trianglemesh" "point3 P" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] "integer indices" [0 2 1 0 3 2]'


def of(kind, parameters="", shape=BALL, lights=ROOM):
    return f'{lights}\nMaterial "{kind}" {parameters}\n{shape}\n'


def within(world):
    return f"AttributeBegin\n{world}\nAttributeEnd\n"


def shining(shape, before="", light='"rgb L" [4 3 2]'):
    """A floor under a shape that gives light."""
    return FLOOR + within(f'{before}\nAreaLightSource "diffuse" {light}\nMaterial "diffuse" "rgb reflectance" [.1 .1 .1]\n{shape}')


def fog(kind, shape=BALL, before="", lights=ROOM):
    """A body of a medium that has no surface."""
    return lights + within(f'{before}\nMakeNamedMedium "fog" {kind}\nMediumInterface "fog" ""\nMaterial "interface"\n{shape}')


HOMOGENEOUS = '"string type" "homogeneous"'
GRID = ('"string type" "uniformgrid" "integer nx" 3 "integer ny" 2 "integer nz" 2 "float density" [.2 1 3  0 2 .5  1 0 2  4 .3 1]'
        ' "point3 p0" [-1 -1 -1] "point3 p1" [1 1 1]')
RGB_GRID = ('"string type" "rgbgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "point3 p0" [-1 -1 -1] "point3 p1" [1 1 1]'
            ' "rgb sigma_s" [1 2 3  2 1 .5]')
PAIRS = "[400 {} 500 {} 600 {} 700 {}]"
SPECTRAL = "spectra are red, green and blue here"
COATED = "light within the coat is averaged here, and counted without an end"
MASKED = "alpha does not mask light here, which is a warning"
LEAKS = "bent normals let no light through from behind here"
BEYOND = "a grid fades out over half a voxel more here, where its boundary leaves room for that"
THIN = "light without extent shines through here, in pbrt not"
STRETCHED = "spheres that are stretched are refused"

MATERIALS = [
    Scene("diffuse", of("diffuse")),
    Scene("diffuse rgb", of("diffuse", '"rgb reflectance" [.7 .3 .1]')),
    Scene("diffuse float spectrum", of("diffuse", '"spectrum reflectance" [200 .3 900 .3]')),
    Scene("diffuse spectrum", of("diffuse", f'"spectrum reflectance" {PAIRS.format(.1, .3, .6, .8)}')),
    Scene("conductor", of("conductor"), note=SPECTRAL),
    Scene("conductor Au, rough", of("conductor", '"spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" .2'), note=SPECTRAL),
    Scene("conductor of flat spectra", of("conductor", '"spectrum eta" [200 .2 900 .2] "spectrum k" [200 3 900 3] "float roughness" .1')),
    Scene("conductor Al, not remapped", of("conductor", '"spectrum eta" "metal-Al-eta" "spectrum k" "metal-Al-k" "float roughness" .3 '
                                                        '"bool remaproughness" false')),
    Scene("conductor Ag, two roughnesses", of("conductor", '"spectrum eta" "metal-Ag-eta" "spectrum k" "metal-Ag-k" '
                                                           '"float uroughness" .02 "float vroughness" .3')),
    Scene("conductor by reflectance", of("conductor", '"rgb reflectance" [.8 .5 .3] "float roughness" .1')),
    Scene("conductor by rgb", of("conductor", '"rgb eta" [.2 .5 1.2] "rgb k" [4 3 2]'), note=SPECTRAL),
    Scene("dielectric", of("dielectric")),
    Scene("dielectric 1.33, rough", of("dielectric", '"float eta" 1.33 "float roughness" .1')),
    Scene("dielectric, not remapped", of("dielectric", '"float roughness" .2 "bool remaproughness" false')),
    Scene("dielectric, two roughnesses", of("dielectric", '"float uroughness" .01 "float vroughness" .2')),
    Scene("dielectric BK7", of("dielectric", '"spectrum eta" "glass-BK7"')),
    Scene("dielectric cube", of("dielectric", shape="Rotate 30 0 1 0 Scale .7 .7 .7 " + CUBE)),
    Scene("dielectric, reversed", of("dielectric", shape="ReverseOrientation " + BALL)),
    Scene("thindielectric", of("thindielectric", '"float eta" 1.8', lights=SKY + FLOOR)),
    Scene("thindielectric before a delta light", of("thindielectric", '"float eta" 1.8'), note=THIN),
    Scene("coateddiffuse", of("coateddiffuse", '"rgb reflectance" [.5 .5 .5]'), note=COATED),
    Scene("coateddiffuse, rough", of("coateddiffuse", '"rgb reflectance" [.5 .5 .5] "float roughness" .3'), note=COATED),
    Scene("mix", ROOM + 'MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [.8 .1 .1]\n'
          'MakeNamedMaterial "b" "string type" "conductor" "float roughness" .2\n'
          'Material "mix" "string materials" ["a" "b"] "float amount" .3\n' + BALL),
    Scene("interface", of("interface")),
    Scene("alpha", of("diffuse", shape=BALL + ' "float alpha" .4')),
    Scene("alpha of an image", ROOM + 'Texture "mask" "float" "imagemap" "string filename" "grey.png" "string encoding" "linear"\n'
          'Material "diffuse" "rgb reflectance" [.7 .3 .1]\n' + BALL + ' "texture alpha" "mask"'),
]

IMAGE = 'Texture "image" "spectrum" "imagemap" "string filename" "colours.png" {}\nMaterial "diffuse" "texture reflectance" "image"\n'


def pictured(shape, parameters=""):
    return SKY + IMAGE.format(parameters) + shape


WALL = SQUARE + ' "point2 uv" [0 0  1 0  1 1  0 1]'
TEXTURES = [
    Scene("image on a sphere", pictured("Rotate 30 1 0 0 " + BALL)),
    Scene("image on a disk", pictured('Shape "disk" "float radius" 1.2')),
    Scene("image on a cylinder", pictured('Rotate 60 1 0 0 Shape "cylinder" "float radius" .8 "float zmin" -.5 "float zmax" 1')),
    Scene("image on a mesh with uv", pictured(WALL)),
    Scene("image on a mesh without uv", pictured(SQUARE)),
    Scene("image on a patch", pictured('Shape "bilinearmesh" "point3 P" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]')),
    Scene("image, scaled and moved", pictured(WALL, '"float uscale" 2 "float vscale" 3 "float udelta" .2 "float vdelta" .1')),
    Scene("image, clamped", pictured(WALL, '"float uscale" 2 "float udelta" -.5 "string wrap" "clamp"')),
    Scene("image, linear", pictured(WALL, '"string encoding" "linear"')),
    Scene("image, point", pictured(WALL, '"string filter" "point"')),
    Scene("image, turned by 90 degrees", pictured("Rotate 90 0 0 1 " + WALL)),
    Scene("image scaled by a texture", SKY + IMAGE.format("") + 'Texture "half" "spectrum" "scale" "texture tex" "image" "float scale" .5\n'
          'Material "diffuse" "texture reflectance" "half"\n' + WALL, note="a factor on an image is refused"),
    Scene("constant texture", SKY + 'Texture "c" "spectrum" "constant" "rgb value" [.2 .5 .7]\n'
          'Material "diffuse" "texture reflectance" "c"\n' + BALL),
    Scene("checkerboard on a sphere", SKY + 'Texture "c" "spectrum" "checkerboard" "float uscale" 6 "float vscale" 3 '
          '"rgb tex1" [.8 .2 .2] "rgb tex2" [.2 .2 .8]\nMaterial "diffuse" "texture reflectance" "c"\n' + BALL),
    Scene("displacement", SUN + 'Texture "bumps" "float" "imagemap" "string filename" "bumps.png" "string encoding" "linear"\n'
          'Texture "low" "float" "scale" "texture tex" "bumps" "float scale" 1\n'
          'Material "diffuse" "texture displacement" "low"\n' + WALL),
    Scene("normal map under a sky", SKY + 'Material "diffuse" "string normalmap" "normals.png"\n' + WALL, note=LEAKS),
    Scene("normal map", SUN + 'Material "diffuse" "string normalmap" "normals.png"\n' + WALL),
]

# pbrt's default sampler of lights never chooses a spot whose edge is sharp.
BY_POWER = INTEGRATOR + ' "string lightsampler" "power"'
LAMPS = [
    Scene("point", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "rgb I" [9 6 3]'),
    Scene("point, moved and scaled", FLOOR + within('Translate .5 0 0 Scale 2 2 2 LightSource "point" "point3 from" [0 .5 0] "rgb I" [9 6 3] '
                                                    '"float scale" .5')),
    Scene("point by power", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "rgb I" [3 2 1] "float power" 60'),
    Scene("point by power 0", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "rgb I" [3 2 1] "float power" 0'),
    Scene("spot, sharp", FLOOR + 'LightSource "spot" "point3 from" [1 2 -1] "point3 to" [0 -1 0] "rgb I" [9 6 3] "float coneangle" 25 '
          '"float conedeltaangle" 0', integrator=BY_POWER),
    Scene("spot", FLOOR + 'LightSource "spot" "point3 from" [1 2 -1] "point3 to" [0 -1 0] "rgb I" [9 6 3] "float coneangle" 40 '
          '"float conedeltaangle" 20', note="the edge is linear in the angle here"),
    Scene("spot by power, turned", FLOOR + within('Rotate 20 0 0 1 LightSource "spot" "point3 from" [1 2 -1] "point3 to" [0 -1 0] '
                                                  '"float coneangle" 25 "float conedeltaangle" 0 "float power" 20'),
          integrator=BY_POWER),
    Scene("distant", FLOOR + 'LightSource "distant" "point3 from" [1 2 -1] "point3 to" [0 0 1] "rgb L" [3 2 1] "float scale" .7'),
    Scene("distant by illuminance", FLOOR + within('Rotate 30 0 0 1 Scale 2 1 1 LightSource "distant" "point3 from" [1 2 -1] '
                                                   '"float illuminance" 3')),
    Scene("infinite by illuminance", FLOOR + 'LightSource "infinite" "rgb L" [3 2 1] "float illuminance" 3'),
    Scene("infinite, scaled", FLOOR + 'LightSource "infinite" "rgb L" [.3 .2 .1] "float scale" 2'),
    Scene("black body 3000 K", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "blackbody I" 3000 "float scale" 5', note=SPECTRAL),
    Scene("black body 6500 K", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "blackbody I" 6500 "float scale" 5', note=SPECTRAL),
    Scene("spectrum of light", FLOOR + f'LightSource "point" "point3 from" [1 2 -1] "spectrum I" {PAIRS.format(.1, .3, .6, .8)} '
          '"float scale" 5', note=SPECTRAL),
    Scene("flat spectrum of light", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "spectrum I" [300 1 900 1] "float scale" 5',
          note=SPECTRAL),
    Scene("illuminant D65", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "spectrum I" "stdillum-D65" "float scale" 5'),
    Scene("area sphere", shining('Shape "sphere" "float radius" .4', "Translate 0 .5 0")),
    Scene("area sphere, scaled by 2", shining('Shape "sphere" "float radius" .2', "Translate 0 .5 0 Scale 2 2 2"),
          note="pbrt samples its light as that of the unscaled sphere"),
    Scene("area sphere, reversed, around all", shining('ReverseOrientation Shape "sphere" "float radius" 9')),
    Scene("area disk", shining('Shape "disk" "float radius" .8 "float height" .3', "Translate 0 1 0 Rotate 120 1 0 0")),
    Scene("area disk, reversed", shining('Shape "disk" "float radius" .8', "ReverseOrientation Translate 0 1 0 Rotate 120 1 0 0")),
    Scene("area cylinder", shining('Shape "cylinder" "float radius" .3 "float zmin" -.5 "float zmax" .8', "Translate 0 1 0 Rotate 60 1 0 0")),
    Scene("area cylinder, reversed", shining('Shape "cylinder" "float radius" .8 "float zmin" -.5 "float zmax" .8',
                                             "ReverseOrientation Translate 0 1 0 Rotate 60 1 0 0")),
    Scene("area mesh", shining(SQUARE, "Translate 0 .8 0 Rotate 30 1 0 0 Scale .5 .7 1")),
    Scene("area mesh, reversed", shining(SQUARE, "ReverseOrientation Translate 0 .8 0 Rotate 150 1 0 0")),
    Scene("area mesh, mirrored", shining(SQUARE, "Translate 0 .8 0 Rotate 30 1 0 0 Scale -.5 .7 1")),
    Scene("area mesh with normals", shining(SQUARE + ' "normal N" [0 0 -1  0 0 -1  0 0 -1  0 0 -1]', "Translate 0 .8 0 Rotate 30 1 0 0")),
    Scene("area mesh with normals the other way", shining(SQUARE + ' "normal N" [0 0 1  0 0 1  0 0 1  0 0 1]',
                                                          "Translate 0 .8 0 Rotate 30 1 0 0")),
    Scene("area patch", shining('Shape "bilinearmesh" "point3 P" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]', "Translate 0 .8 0 Rotate 210 1 0 0")),
    Scene("area patch, reversed", shining('ReverseOrientation Shape "bilinearmesh" "point3 P" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]',
                                          "Translate 0 .8 0 Rotate 30 1 0 0")),
    Scene("area light of alpha 0", shining('Shape "sphere" "float radius" .4 "float alpha" 0', "Translate 0 .5 0"), note=MASKED),
    Scene("area light behind alpha", shining('Shape "sphere" "float radius" .4 "float alpha" .5', "Translate 0 .5 0"), note=MASKED),
    Scene("area light, black body", shining('Shape "sphere" "float radius" .4', "Translate 0 .5 0", '"blackbody L" 4000 "float scale" 3'),
          note=SPECTRAL),
    Scene("area light, twosided", shining(SQUARE, "Translate 0 1 0 Rotate 150 1 0 0", '"rgb L" [4 3 2] "bool twosided" true'),
          note="refused: it says how to write it"),
    Scene("area light by power", shining(SQUARE, "Translate 0 1 0 Rotate 30 1 0 0", '"rgb L" [4 3 2] "float power" 30'),
          note="refused: it says how to write it"),
]

CLAY = 'Material "diffuse" "rgb reflectance" [.5 .5 .5]\n'
SHAPES = [
    Scene("sphere, an ellipsoid", ROOM + CLAY + "Rotate 30 0 0 1 Scale 1.3 .6 1 " + BALL, note=STRETCHED),
    Scene("disk, turned", ROOM + CLAY + 'Rotate 40 0 1 0 Scale 1 .5 1 Shape "disk" "float radius" 1.2 "float height" .4'),
    Scene("cylinder", ROOM + CLAY + 'Translate 0 -.3 0 Rotate 70 1 0 0 Scale 1 1 1.5 Shape "cylinder" "float radius" .5 "float zmin" -.5 '
          '"float zmax" .6'),
    Scene("mesh", ROOM + CLAY + "Rotate 30 0 1 0 Scale .6 .8 .5 " + CUBE),
    Scene("mesh with normals", SUN + FLOOR + CLAY + SQUARE + ' "normal N" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1]'),
    Scene("mesh with normals, mirrored", SUN + FLOOR + CLAY + "Scale -1 1 1 " + SQUARE + ' "normal N" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1]'),
    Scene("mesh with normals, reversed", SUN + FLOOR + CLAY + "ReverseOrientation " + SQUARE + ' "normal N" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1]'),
    Scene("patch", ROOM + CLAY + 'Shape "bilinearmesh" "point3 P" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]'),
    Scene("two patches", ROOM + CLAY + 'Shape "bilinearmesh" "point3 P" [-1 -1 0  0 -1 0  -1 1 0  0 1 0  1 -1 .5  1 1 .5] '
          '"integer indices" [0 1 2 3  1 4 3 5]'),
    Scene("transforms", ROOM + CLAY + within("Transform [1 0 0 0  0 .7 .7 0  0 -.7 .7 0  .3 .2 0 1] Scale .5 .5 .5 " + CUBE) +
          within("ConcatTransform [.5 0 0 0  .2 .5 0 0  0 0 .5 0  -.8 0 0 1] " + CUBE)),
    Scene("coordinate systems", ROOM + CLAY + 'Translate 0 .5 0 CoordinateSystem "here" Identity ' +
          within('CoordSysTransform "here" Scale .5 .5 .5 ' + BALL) + within('CoordSysTransform "camera" Translate .6 0 4 Scale .3 .3 .3 ' + BALL)),
    Scene("instances", ROOM + 'ObjectBegin "o"\n' + CLAY + "Translate 0 .2 0 Scale .4 .4 .4 " + CUBE + "ObjectEnd\n" +
          within('Translate -.8 0 0 Rotate 30 0 1 0 ObjectInstance "o"') + within('Translate .6 0 0 Scale 1 1.5 1 ObjectInstance "o"') +
          within('Translate 0 1 0 Scale -.5 .5 .5 ObjectInstance "o"')),
    Scene("instances of an object with a transform of its own", ROOM + within(
        'Translate .4 0 0\nObjectBegin "o"\n' + CLAY + "Scale .4 .4 .4 " + BALL + "\nObjectEnd\n") + within(
            'Translate -.8 0 0 ObjectInstance "o"')),
    Scene("instances of glass", ROOM + 'ObjectBegin "o"\nMaterial "dielectric"\nScale .5 .5 .5 ' + BALL + "\nObjectEnd\n" +
          within('Translate -.6 0 0 ObjectInstance "o"') + within('Translate .6 0 0 Scale 1 1.5 1 ObjectInstance "o"')),
    Scene("attributes and transforms are kept", ROOM + within(
        CLAY + 'Scale .5 .5 .5 TransformBegin Translate 1 0 0 Material "conductor" ' + BALL + " TransformEnd Translate -1 0 0 " + BALL) +
          "Translate 0 1 0 Scale .2 .2 .2 " + BALL),
]

CAMERAS = [
    Scene("orthographic", ROOM + CLAY + BALL, camera='LookAt 1 1.5 -4  0 0 0  0 1 0\nScale .6 .6 1\nCamera "orthographic"'),
    Scene("thin lens", ROOM + CLAY + BALL, camera=CAMERA + ' "float lensradius" .3 "float focaldistance" 3'),
    Scene("thin lens, scaled camera", ROOM + CLAY + BALL, camera="Scale 2 2 2\n" + CAMERA + ' "float lensradius" .3 "float focaldistance" 6'),
    Scene("mirrored camera", ROOM + CLAY + "Translate .5 0 0 " + BALL, camera="Scale -1 1 1\n" + CAMERA),
    Scene("rolled camera", ROOM + CLAY + "Translate .5 0 0 " + BALL, camera="Rotate 30 0 0 1\n" + CAMERA),
    Scene("tall frame", ROOM + CLAY + BALL, film='"integer yresolution" 56'),
    Scene("wide frame", ROOM + CLAY + BALL, film='"integer xresolution" 56'),
    Scene("crop window", ROOM + CLAY + BALL, film='"float cropwindow" [.25 .75 .25 .5]'),
    Scene("pixel bounds", ROOM + CLAY + BALL, film='"integer pixelbounds" [8 24 4 28]'),
    Scene("iso", ROOM + CLAY + BALL, film='"float iso" 40'),
    Scene("shutter", ROOM + CLAY + BALL, camera=CAMERA + ' "float shutteropen" .25 "float shutterclose" .75'),
    Scene("exposure of glowing media", fog(HOMOGENEOUS + ' "rgb sigma_a" [.3 .3 .3] "rgb sigma_s" [0 0 0] "rgb Le" [2 1 .5]'),
          film='"float iso" 50'),
    Scene("sensor of a camera", ROOM + CLAY + BALL, film='"string sensor" "canon_eos_100d"', note="colours stay those of the CIE observer"),
    Scene("gaussian filter", ROOM + CLAY + BALL, filter='PixelFilter "gaussian"', note="pbrt cuts its filter off at radius 1.5"),
    Scene("triangle filter", ROOM + CLAY + BALL, filter='PixelFilter "triangle" "float xradius" 1.5 "float yradius" 1.5'),
    Scene("no filter named", ROOM + CLAY + BALL, filter="", note="pbrt cuts its filter off at radius 1.5"),
]

BRIGHT = LIGHTS + FLOOR + 'Material "diffuse" "rgb reflectance" [.8 .8 .8]\n' + BALL
INTEGRATORS = [
    Scene(f"maxdepth {n}", BRIGHT, integrator=f'Integrator "volpath" "integer maxdepth" {n}') for n in (0, 1, 2)
] + [
    Scene("path, maxdepth 3", BRIGHT, integrator='Integrator "path" "integer maxdepth" 3'),
    Scene("no integrator named", BRIGHT, integrator=""),
    Scene("simplepath", BRIGHT, integrator='Integrator "simplepath" "integer maxdepth" 3'),
    Scene("glass, maxdepth 2", of("dielectric"), integrator='Integrator "volpath" "integer maxdepth" 2'),
    Scene("thin glass, maxdepth 1", of("thindielectric"), integrator='Integrator "volpath" "integer maxdepth" 1',
          note="passing thindielectric is no scattering here"),
    Scene("fog, maxdepth 1", fog(HOMOGENEOUS), integrator='Integrator "volpath" "integer maxdepth" 1'),
    Scene("fog, maxdepth 2", fog(HOMOGENEOUS), integrator='Integrator "volpath" "integer maxdepth" 2'),
    Scene("interface, maxdepth 1", of("interface"), integrator='Integrator "volpath" "integer maxdepth" 1'),
]

AIR = 'MakeNamedMedium "air" "string type" "homogeneous" "rgb sigma_a" [.05 .05 .05] "rgb sigma_s" [.1 .1 .1]\nMediumInterface "" "air"\n'
MEDIA = [
    Scene("homogeneous by default", fog(HOMOGENEOUS)),
    Scene("homogeneous, absorbing", fog(HOMOGENEOUS + ' "rgb sigma_a" [1 1 1] "rgb sigma_s" [0 0 0]')),
    Scene("homogeneous, absorbing in colours", fog(HOMOGENEOUS + ' "rgb sigma_a" [.2 .5 1] "rgb sigma_s" [0 0 0]')),
    Scene("homogeneous, scattering in colours", fog(HOMOGENEOUS + ' "rgb sigma_a" [.1 .1 .1] "rgb sigma_s" [.5 1 2]')),
    Scene("homogeneous, scale", fog(HOMOGENEOUS + ' "rgb sigma_a" [.1 .1 .1] "rgb sigma_s" [1 1 1] "float scale" 2')),
    Scene("homogeneous, flat spectra", fog(HOMOGENEOUS + ' "spectrum sigma_a" [200 .1 900 .1] "spectrum sigma_s" [200 1 900 1]')),
    Scene("homogeneous, g .7", fog(HOMOGENEOUS + ' "rgb sigma_s" [1 1 1] "rgb sigma_a" [0 0 0] "float g" .7')),
    Scene("homogeneous, g -.7", fog(HOMOGENEOUS + ' "rgb sigma_s" [1 1 1] "rgb sigma_a" [0 0 0] "float g" -.7')),
    Scene("homogeneous, Le", fog(HOMOGENEOUS + ' "rgb sigma_a" [.3 .3 .3] "rgb sigma_s" [.2 .2 .2] "rgb Le" [2 1 .5]')),
    Scene("homogeneous, Lescale", fog(HOMOGENEOUS + ' "rgb sigma_a" [.3 .3 .3] "rgb sigma_s" [0 0 0] "rgb Le" [2 1 .5] "float Lescale" .3 '
                                      '"float scale" 2')),
    Scene("homogeneous, black body Le", fog(HOMOGENEOUS + ' "rgb sigma_a" [.3 .3 .3] "rgb sigma_s" [0 0 0] "blackbody Le" 3000'), note=SPECTRAL),
    Scene("medium in a scaled sphere", fog(HOMOGENEOUS, before="Scale 1.2 .7 .7"), note=STRETCHED),
    Scene("medium in a cube", fog(HOMOGENEOUS, shape="Rotate 30 0 1 0 Scale .7 .7 .7 " + CUBE)),
    Scene("medium in a reversed sphere", LIGHTS + FLOOR + within(f'MakeNamedMedium "fog" {HOMOGENEOUS}\nMediumInterface "" "fog"\n'
                                                                 f'Material "interface"\nReverseOrientation {BALL}')),
    Scene("medium in a mirrored cube", fog(HOMOGENEOUS, shape="Scale -.7 .7 .7 " + CUBE)),
    Scene("medium in glass", ROOM + within(f'MakeNamedMedium "fog" {HOMOGENEOUS}\nMediumInterface "fog" ""\nMaterial "dielectric"\n{BALL}')),
    Scene("medium in thin glass", ROOM + within(f'MakeNamedMedium "fog" {HOMOGENEOUS}\nMediumInterface "fog" ""\nMaterial "thindielectric"\n{BALL}'), note=THIN),
    Scene("two spheres of media", ROOM + 'MakeNamedMedium "a" "string type" "homogeneous" "rgb sigma_s" [.5 .5 .5]\n'
          'MakeNamedMedium "b" "string type" "homogeneous" "rgb sigma_a" [0 0 0] "rgb sigma_s" [4 4 4]\n' +
          within(f'MediumInterface "a" ""\nMaterial "interface"\n{BALL}') +
          within('MediumInterface "b" "a"\nMaterial "interface"\nTranslate .2 .1 0 Shape "sphere" "float radius" .5')),
    Scene("ball within a medium", fog(HOMOGENEOUS + ' "float scale" .4') + within(
        'MediumInterface "fog" "fog"\nMaterial "diffuse"\nShape "sphere" "float radius" .5')),
    Scene("lamp within a medium", fog(HOMOGENEOUS + ' "float scale" .4', lights=FLOOR) + within(
        'MediumInterface "" "fog"\nAreaLightSource "diffuse" "rgb L" [4 3 2]\nShape "sphere" "float radius" .3')),
    Scene("point within a medium", fog(HOMOGENEOUS + ' "float scale" .4', lights=FLOOR) + within(
        'MediumInterface "" "fog"\nLightSource "point" "rgb I" [4 3 2]')),
    Scene("camera within a medium", FLOOR + 'LightSource "point" "point3 from" [1 2 -1] "rgb I" [9 6 3]\n' + CLAY + BALL, before=AIR),
    Scene("camera within a medium, lamp", shining('Shape "sphere" "float radius" .4', "Translate 0 .5 0"), before=AIR),
    Scene("camera within a medium, no wall behind", 'LightSource "point" "point3 from" [1 2 -1] "rgb I" [9 6 3]\n' + CLAY + BALL, before=AIR),
    Scene("medium named after the camera's", 'MediumInterface "" "air"\n' + FLOOR + SKY + CLAY + BALL,
          before='MakeNamedMedium "air" "string type" "homogeneous" "rgb sigma_a" [.05 .05 .05] "rgb sigma_s" [.1 .1 .1]\n'),
    Scene("uniformgrid", fog(GRID, shape=CUBE, lights=LIGHTS)),
    Scene("uniformgrid in a sphere", fog(GRID)),
    Scene("uniformgrid, turned and scaled", fog(GRID, shape=CUBE, before="Rotate 30 0 1 0 Scale .9 .5 .7")),
    Scene("uniformgrid in a larger cube", fog(GRID + ' "float scale" .7', shape="Scale 1.6 1.6 1.6 " + CUBE, lights=LIGHTS), note=BEYOND),
    Scene("uniformgrid of one voxel in a larger cube", fog('"string type" "uniformgrid" "float density" 2 "point3 p0" [-1 -1 -1] "point3 p1" [1 1 1]',
                                                           shape="Scale 1.6 1.6 1.6 " + CUBE, lights=LIGHTS), note=BEYOND),
    Scene("uniformgrid, colours", fog(GRID + ' "rgb sigma_a" [.1 .2 .3] "rgb sigma_s" [1 .6 .3]', shape=CUBE, lights=LIGHTS)),
    Scene("uniformgrid, g", fog(GRID + ' "rgb sigma_a" [0 0 0] "float g" .6', shape=CUBE, lights=LIGHTS)),
    Scene("rgbgrid", fog(RGB_GRID + ' "rgb sigma_a" [.1 .2 .3  .3 .2 .1]', shape=CUBE, lights=LIGHTS), note="extinction and albedo are interpolated here"),
    Scene("rgbgrid without sigma_a", fog(RGB_GRID, shape=CUBE, lights=LIGHTS)),
    Scene("rgbgrid, absorbing", fog('"string type" "rgbgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "point3 p0" [-1 -1 -1] "point3 p1" [1 1 1]'
                                    ' "rgb sigma_a" [1 2 3  2 1 .5] "rgb sigma_s" [0 0 0  0 0 0] "float scale" .5', shape=CUBE, lights=LIGHTS)),
]

SCENES = MATERIALS + TEXTURES + LAMPS + SHAPES + CAMERAS + INTEGRATORS + MEDIA


def text_of(scene, size):
    """The file. A parameter of `film` takes the place of one before it."""
    film = FILM.format(size=size, film="")
    for parameter in ("xresolution", "yresolution"):
        if parameter in scene.film:
            film = film.replace(f'"integer {parameter}" {size}', "")
    return "\n".join([film + scene.film, scene.filter, SAMPLER, scene.integrator, scene.before, scene.camera, "WorldBegin", scene.world, ""])


def write_images(folder):
    """The images that the scenes name: nothing in them is the same after a mirror or a turn."""
    y, x = np.mgrid[0:8, 0:8]
    colours = np.stack([32 * x + 16, 32 * y + 16, 200 * ((x + 2 * y) % 3 == 0) + 20], -1).astype(np.uint8)
    Image.fromarray(colours).save(folder / "colours.png")
    Image.fromarray(colours[..., 0]).save(folder / "grey.png")
    v, u = np.mgrid[0:64, 0:64] / 64.0
    height = 0.05 * np.sin(6.283 * (2 * u + v)) + 0.5
    Image.fromarray(np.rint(255 * height).astype(np.uint8)).save(folder / "bumps.png")
    normals = np.stack([0.3 * np.sin(6.283 * u), 0.3 * np.cos(6.283 * 2 * v), np.full_like(u, 0.9)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    Image.fromarray(np.rint(127.5 * (normals + 1)).astype(np.uint8)).save(folder / "normals.png")
