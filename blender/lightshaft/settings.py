"""The settings of a scene and of this installation."""

import os
import types

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty


class LightshaftSettings(bpy.types.PropertyGroup):
    where: EnumProperty(
        name="Render On",
        items=[
            ("FARM", "Farm", "Send the scene to the farm of the preferences"),
            ("LOCAL", "This Machine", "Run the program lightshaft on this machine"),
        ],
    )
    samples: IntProperty(
        name="Samples",
        description="Samples per pixel; with a target error, the limit for each pixel",
        default=64,
        min=1,
        max=1 << 20,
    )
    use_target_error: BoolProperty(
        name="Stop at Error", description="End the render when the image's relMSE is below the target"
    )
    target_error: FloatProperty(
        name="Target", description="relMSE of the whole image", default=1e-3, min=1e-8, max=1.0, precision=6
    )
    max_depth: IntProperty(
        name="Max Depth",
        description="Largest number of segments of a path: 2 is direct light, -1 has no limit",
        default=-1,
        min=-1,
        max=1 << 20,
    )
    seed: IntProperty(name="Seed", min=0)
    animate_seed: BoolProperty(name="Other Noise Each Frame", default=True)
    priority: IntProperty(name="Priority", description="Jobs of higher priority are rendered first on a farm")
    denoise: BoolProperty(
        name="Denoised Pass",
        description="Adds the pass Denoised; needs Open Image Denoise on the farm or this machine",
    )
    pass_noise: BoolProperty(name="Noise", description="Standard error of each pixel")
    pass_volume: BoolProperty(name="Volume Light", description="Light that a volume scattered to the camera")
    pass_surface: BoolProperty(
        name="Surface Light", description="Light that a surface scattered to the camera"
    )
    unsupported: EnumProperty(
        name="Not in Lightshaft",
        items=[
            ("REFUSE", "Refuse", "End the render with a list of unsupported features"),
            ("LEAVE_OUT", "Leave Out", "Render without unsupported features, and report each as a warning"),
        ],
    )


class LightshaftPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    url: StringProperty(name="Farm", description="Address of the coordinator, such as http://farm:8080")
    token: StringProperty(
        name="Token", description="Token, as `lightshaft token add --role submit` prints it", subtype="PASSWORD"
    )
    program: StringProperty(
        name="Program",
        description="Path of `lightshaft`; empty: search the PATH",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        for name in ("url", "token", "program"):
            self.layout.prop(self, name)


def preferences():
    """Returns the preferences. Empty ones come from the environment, like in Lightshaft's other clients."""
    addon = bpy.context.preferences.addons.get(__package__)
    chosen = addon.preferences if addon else None
    return types.SimpleNamespace(
        url=getattr(chosen, "url", "") or os.environ.get("LIGHTSHAFT_URL", "http://127.0.0.1:8080"),
        token=getattr(chosen, "token", "") or os.environ.get("LIGHTSHAFT_TOKEN", ""),
        program=bpy.path.abspath(getattr(chosen, "program", "")) or os.environ.get("LIGHTSHAFT_PROGRAM", ""),
    )


def register():
    bpy.utils.register_class(LightshaftSettings)
    bpy.utils.register_class(LightshaftPreferences)
    bpy.types.Scene.lightshaft = PointerProperty(type=LightshaftSettings)


def unregister():
    del bpy.types.Scene.lightshaft
    bpy.utils.unregister_class(LightshaftPreferences)
    bpy.utils.unregister_class(LightshaftSettings)
