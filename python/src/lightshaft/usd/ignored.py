"""Reports the parts of a stage that have no effect here but would change its image in other renderers."""

from __future__ import annotations

from pxr import Usd, UsdGeom, UsdShade

from .problems import Problems

# Types of prims that show nothing by themselves, or that others read on their way.
SILENT = {
    *("Xform", "Scope", "Camera", "Material", "Shader", "NodeGraph", "GeomSubset"),
    *("SkelRoot", "Skeleton", "SkelAnimation", "BlendShape", "OpenVDBAsset"),
    *("RenderSettings", "RenderProduct", "RenderVar", "RenderPass", "Backdrop", "Collection"),
}
MOTION = "points that move in a mesh are not blurred"
NO_EFFECT = {
    "velocities": MOTION,
    "accelerations": MOTION,
    "angularVelocities": MOTION,
    "exposure:time": "images are linear, and --exposure shows them brighter",
    "exposure:iso": "images are linear, and --exposure shows them brighter",
    "exposure:fStop": "images are linear, and --exposure shows them brighter",
    "exposure:responsivity": "images are linear, and --exposure shows them brighter",
    "treatAsLine": "a cylinder light always has its own radius",
    "fieldIndex": "the first grid of the name is read",
}
LIGHT_INPUTS = {
    *("intensity", "exposure", "color", "colorTemperature", "enableColorTemperature", "normalize"),
    *("radius", "width", "height", "length", "angle", "texture:file", "texture:format", "treatAsPoint"),
    # Told by themselves where they have no effect.
    *("diffuse", "specular", "shadow:enable", "shaping:cone:angle", "shaping:cone:softness"),
    *("shaping:focus", "shaping:focusTint", "shaping:ies:file"),
}
SHADER_INPUTS = {
    "UsdPreviewSurface": {
        *("diffuseColor", "emissiveColor", "useSpecularWorkflow", "specularColor", "metallic"),
        *("roughness", "clearcoat", "clearcoatRoughness", "opacity", "opacityMode", "opacityThreshold"),
        *("ior", "normal", "displacement", "occlusion"),
        "specular",  # of Blender's exporter alone: ior says the same
    },
    "UsdUVTexture": {
        *("file", "st", "wrapS", "wrapT", "fallback", "scale", "bias", "sourceColorSpace"),
    },
    "UsdTransform2d": {"in", "rotation", "scale", "translation"},
}


def tell_prim(prim: Usd.Prim, problems: Problems) -> None:
    """Reports the type and the attributes of a prim that have no effect."""
    kind = str(prim.GetTypeName())
    if kind and kind not in SILENT and not prim.IsA(UsdGeom.Imageable):
        problems.warn(prim, f"a {kind} has no effect")
    for attribute in prim.GetAuthoredAttributes():
        name = attribute.GetName()
        if NO_EFFECT.get(name) is MOTION and prim.IsA(UsdGeom.PointInstancer):
            continue  # USD moves the instances by them
        if name in NO_EFFECT and _says_something(attribute):
            problems.warn(prim, f"{name} has no effect: {NO_EFFECT[name]}")
    mode = UsdGeom.ModelAPI(prim).GetModelDrawModeAttr()
    if mode and mode.HasAuthoredValue() and str(mode.Get()) not in ("default", "inherited"):
        problems.warn(prim, f"model:drawMode {mode.Get()} has no effect: the model itself is rendered")


def tell_light(prim: Usd.Prim, problems: Problems) -> None:
    """Reports inputs of a light that have no effect."""
    for attribute in prim.GetAuthoredAttributes():
        name = attribute.GetName()
        if name.startswith("inputs:") and name[7:] not in LIGHT_INPUTS and _says_something(attribute):
            problems.warn(prim, f"{name} of a light has no effect")


def tell_material(material: UsdShade.Material, problems: Problems) -> None:
    """Reports outputs of a material other than its surface."""
    for name, output in (
        ("displacement", material.GetDisplacementOutput()),
        ("volume", material.GetVolumeOutput()),
    ):
        if output and output.HasConnectedSource():
            problems.warn(material, f"outputs:{name} of a material has no effect")


def tell_shader(shader: UsdShade.Shader, problems: Problems) -> None:
    """Reports inputs that this kind of shader does not have; most are misspelt."""
    kind = shader.GetIdAttr().Get()
    known = SHADER_INPUTS.get(kind)
    if known is None:
        return
    for given in shader.GetInputs():
        if given.GetBaseName() not in known:
            problems.warn(shader, f"inputs:{given.GetBaseName()} has no effect: no {kind} has it")


def _says_something(attribute: Usd.Attribute) -> bool:
    """Returns True if the attribute has a value that differs from its schema's default."""
    if attribute.HasAuthoredConnections():
        return True
    value = attribute.Get(Usd.TimeCode.EarliestTime())
    if value is None or (hasattr(value, "__len__") and not len(value)):
        return False
    definition = attribute.GetPrim().GetPrimDefinition()
    return bool(value != definition.GetAttributeFallbackValue(attribute.GetName()))
