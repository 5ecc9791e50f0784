"""Panels in Render and View Layer properties."""

import bpy


class LightshaftPanel(bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    rows = ()

    @classmethod
    def poll(cls, context):
        return context.engine == "LIGHTSHAFT"

    def draw(self, context):
        self.layout.use_property_split = True
        for name in self.rows:
            self.layout.prop(context.scene.lightshaft, name)


class LIGHTSHAFT_PT_render(LightshaftPanel):
    bl_label = "Lightshaft"
    bl_context = "render"
    rows = (
        "where",
        "samples",
        "use_target_error",
        "target_error",
        "max_depth",
        "seed",
        "animate_seed",
        "priority",
        "unsupported",
    )

    def draw(self, context):
        super().draw(context)
        self.layout.operator("lightshaft.bake")


class LIGHTSHAFT_PT_passes(LightshaftPanel):
    bl_label = "Passes"
    bl_context = "view_layer"
    rows = ("denoise", "pass_noise", "pass_volume", "pass_surface")

    def draw(self, context):
        self.layout.use_property_split = True
        for name in ("use_pass_z", "use_pass_normal", "use_pass_position"):
            self.layout.prop(context.view_layer, name)
        super().draw(context)


CLASSES = (LIGHTSHAFT_PT_render, LIGHTSHAFT_PT_passes)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
