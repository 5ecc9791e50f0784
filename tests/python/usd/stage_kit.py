"""Stages built by script, and what is seen of them through a real farm."""

import math
import pathlib

import numpy as np
import OpenEXR
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel, UsdUtils

SIZE = (24, 24)
NARROW = 0.5  # degrees: a view of one point, over which nothing varies


def new_stage(folder, up="Y", name="scene.usda"):
    stage = Usd.Stage.CreateNew(str(pathlib.Path(folder) / name))
    UsdGeom.SetStageUpAxis(stage, up)
    return stage


def path_of(stage):
    """Of the stage's file, saved."""
    stage.Save()
    return pathlib.Path(stage.GetRootLayer().realPath)


def camera(stage, eye, target, fov=40.0, up=(0, 1, 0), path="/camera"):
    made = UsdGeom.Camera.Define(stage, path)
    place(made, Gf.Matrix4d().SetLookAt(Gf.Vec3d(*eye), Gf.Vec3d(*target), Gf.Vec3d(*up)).GetInverse())
    made.CreateHorizontalApertureAttr(20.0)
    made.CreateVerticalApertureAttr(20.0)
    made.CreateFocalLengthAttr(10.0 / math.tan(math.radians(fov / 2)))
    return made


def place(prim, matrix):
    UsdGeom.Xformable(prim).ClearXformOpOrder()
    UsdGeom.Xformable(prim).AddTransformOp().Set(matrix)


def moved(x, y, z):
    return Gf.Matrix4d().SetTranslate(Gf.Vec3d(x, y, z))


def turned(axis, degrees):
    return Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(*axis), degrees))


def scaled(*factors):
    return Gf.Matrix4d().SetScale(Gf.Vec3d(*factors))


def mesh(stage, path, points, faces, **attributes):
    made = UsdGeom.Mesh.Define(stage, path)
    made.CreatePointsAttr([Gf.Vec3f(*p) for p in points])
    made.CreateFaceVertexCountsAttr([len(face) for face in faces])
    made.CreateFaceVertexIndicesAttr([i for face in faces for i in face])
    made.CreateSubdivisionSchemeAttr(attributes.pop("subdivisionScheme", "none"))
    for name, value in attributes.items():
        made.GetPrim().GetAttribute(name).Set(value)
    return made


SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def square(stage, path="/world/m"):
    """The square from -1 to 1 in the plane z = 0, with coordinates from 0 to 1."""
    made = mesh(stage, path, SQUARE, [(0, 1, 2, 3)])
    coordinates(made, [(0, 0), (1, 0), (1, 1), (0, 1)])
    return made


def stage_from_front(folder):
    """A stage under a white sky, seen by a camera that looks along -z at the origin."""
    made = new_stage(folder)
    sky(made)
    camera(made, (0, 0, 10), (0, 0, 0), 15.0)
    return made


def floor(stage, albedo=1.0, size=100.0, path="/floor"):
    """A diffuse square in the plane y = 0, seen from above."""
    half = size / 2
    made = mesh(
        stage, path, [(-half, 0, half), (half, 0, half), (half, 0, -half), (-half, 0, -half)], [(0, 1, 2, 3)]
    )
    made.CreateDisplayColorAttr([Gf.Vec3f(albedo)])
    return made


def colours(prim, values, interpolation="vertex"):
    primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation
    )
    primvar.Set([Gf.Vec3f(*v) for v in values])


def coordinates(prim, values, interpolation="vertex", name="st"):
    primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(name, Sdf.ValueTypeNames.TexCoord2fArray, interpolation)
    primvar.Set([Gf.Vec2f(*v) for v in values])
    return primvar


def sky(stage, value=1.0, path="/sky"):
    made = UsdLux.DomeLight.Define(stage, path)
    made.CreateIntensityAttr(value)
    return made


KINDS = {float: "Float", int: "Int", tuple: "Color3f", str: "Token"}


def preview(stage, path="/look", **inputs):
    """A material of UsdPreviewSurface; inputs that are outputs of shaders are connected."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    for name, value in inputs.items():
        if isinstance(value, UsdShade.Output):
            kind = Sdf.ValueTypeNames.Normal3f if name == "normal" else value.GetTypeName()
            shader.CreateInput(name, kind).ConnectToSource(value)
        else:
            shader.CreateInput(name, getattr(Sdf.ValueTypeNames, KINDS[type(value)])).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material


def bind(prim, material):
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)


def texture(stage, path, file, output="rgb", varname="st", transform=None, **inputs):
    """The output of a UsdUVTexture; `transform`: inputs of a UsdTransform2d before it."""
    reader = UsdShade.Shader.Define(stage, f"{path}_reader")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(varname)
    st = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    if transform is not None:
        node = UsdShade.Shader.Define(stage, f"{path}_transform")
        node.CreateIdAttr("UsdTransform2d")
        node.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
        for name, value in transform.items():
            kind = Sdf.ValueTypeNames.Float if name == "rotation" else Sdf.ValueTypeNames.Float2
            node.CreateInput(name, kind).Set(value)
        st = node.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    shader = UsdShade.Shader.Define(stage, path)
    shader.CreateIdAttr("UsdUVTexture")
    shader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(str(file))
    shader.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
    for name, value in inputs.items():
        kind = Sdf.ValueTypeNames.Token if isinstance(value, str) else Sdf.ValueTypeNames.Float4
        shader.CreateInput(name, kind).Set(value)
    kind = Sdf.ValueTypeNames.Float3 if output == "rgb" else Sdf.ValueTypeNames.Float
    return shader.CreateOutput(output, kind)


def png(path, values):
    """An 8-bit image of rows from the top; values from 0 to 1 as they are stored."""
    array = np.round(np.asarray(values, float) * 255).astype(np.uint8)
    Image.fromarray(array.squeeze()).save(path)
    return path


def exr(path, values):
    pixels = np.ascontiguousarray(np.asarray(values, np.float32))
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": pixels}) as file:
        file.write(str(path))
    return path


def seen(farm, stage, spp=64, size=SIZE, **options):
    """The picture's mean by channel, and its standard error, of one view."""
    job = farm.submit(path_of(stage), spp=spp, size=size, **options).wait()
    layers = job.layers()
    pixels = layers["color"].shape[0] * layers["color"].shape[1]
    mean = layers["color"].mean(axis=(0, 1), dtype=np.float64)
    error = np.sqrt(np.square(layers["stderr"], dtype=np.float64).sum(axis=(0, 1))) / pixels
    return mean, error


def image(farm, stage, spp=16, size=SIZE, **options):
    return farm.submit(path_of(stage), spp=spp, size=size, **options).wait().image()


def agree(measured, expected, relative=2e-3):
    """Within five standard errors, and `relative`: what single precision, the pixels' filter and half-float
    images leave, and the view's width of half a degree."""
    mean, error = measured
    expected = np.broadcast_to(np.asarray(expected, float), mean.shape)
    assert np.all(np.abs(mean - expected) <= 5 * error + relative * np.abs(expected) + 1e-6), (
        mean,
        expected,
        error,
    )


__all__ = ["Gf", "Sdf", "Usd", "UsdGeom", "UsdLux", "UsdShade", "UsdSkel", "UsdUtils"]
