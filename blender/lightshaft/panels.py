"""Panels in Render and View Layer properties."""

import bpy


class LightshaftPanel(bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    rows = ()

    @staticmethod
    def owner(context):
        """Returns what has the properties of `rows`, or None."""
        return context.scene.lightshaft

    @classmethod
    def poll(cls, context):
        return context.engine == "LIGHTSHAFT" and cls.owner(context) is not None

    def draw(self, context):
        self.layout.use_property_split = True
        for name in self.rows:
            self.layout.prop(self.owner(context), name)


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


class LIGHTSHAFT_PT_film(LightshaftPanel):
    bl_label = "Film"
    bl_context = "render"
    rows = ("film_transparent",)

    @staticmethod
    def owner(context):
        return context.scene.render


class LIGHTSHAFT_PT_object(LightshaftPanel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"  # which has Holdout
    rows = ("visible_camera",)

    @staticmethod
    def owner(context):
        return context.object


class LIGHTSHAFT_PT_world(LightshaftPanel):
    bl_label = "Ray Visibility"
    bl_context = "world"
    rows = ("camera",)

    @staticmethod
    def owner(context):
        return context.scene.world.cycles_visibility if context.scene.world else None


class LIGHTSHAFT_PT_passes(LightshaftPanel):
    bl_label = "Passes"
    bl_context = "view_layer"
    rows = ("denoise", "pass_noise", "pass_volume", "pass_surface")

    def draw(self, context):
        self.layout.use_property_split = True
        for name in ("use_pass_z", "use_pass_normal", "use_pass_position"):
            self.layout.prop(context.view_layer, name)
        super().draw(context)


CLASSES = (
    LIGHTSHAFT_PT_render,
    LIGHTSHAFT_PT_film,
    LIGHTSHAFT_PT_object,
    LIGHTSHAFT_PT_world,
    LIGHTSHAFT_PT_passes,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
