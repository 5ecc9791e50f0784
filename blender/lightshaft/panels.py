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


class LIGHTSHAFT_PT_motion_blur(LightshaftPanel):
    bl_label = "Motion Blur"
    bl_context = "render"
    rows = ("use_motion_blur", "motion_blur_position", "motion_blur_shutter")

    @staticmethod
    def owner(context):
        return context.scene.render


class LIGHTSHAFT_PT_object(LightshaftPanel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"  # which has Holdout
    rows = (
        "visible_camera",
        "visible_diffuse",
        "visible_glossy",
        "visible_transmission",
        "visible_volume_scatter",
        "visible_shadow",
    )

    @staticmethod
    def owner(context):
        return context.object


class LightGroupPanel(LightshaftPanel):
    bl_label = "Light Group"
    rows = ("lightgroup",)

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop_search(
            self.owner(context), "lightgroup", context.view_layer, "lightgroups", text="Light Group"
        )


class LIGHTSHAFT_PT_object_light_group(LightGroupPanel):
    bl_context = "object"

    @staticmethod
    def owner(context):
        return context.object


class LIGHTSHAFT_PT_world_light_group(LightGroupPanel):
    bl_context = "world"

    @staticmethod
    def owner(context):
        return context.scene.world


class LIGHTSHAFT_PT_light_groups(LightshaftPanel):
    bl_label = "Light Groups"
    bl_context = "view_layer"
    rows = ("lightgroups",)

    @staticmethod
    def owner(context):
        return context.view_layer

    def draw(self, context):
        layer = context.view_layer
        row = self.layout.row()
        row.template_list(
            "UI_UL_list", "lightgroups", layer, "lightgroups", layer, "active_lightgroup_index", rows=3
        )
        buttons = row.column(align=True)
        buttons.operator("scene.view_layer_add_lightgroup", icon="ADD", text="")
        buttons.operator("scene.view_layer_remove_lightgroup", icon="REMOVE", text="")
        self.layout.operator("scene.view_layer_add_used_lightgroups")


class LIGHTSHAFT_PT_world(LightshaftPanel):
    bl_label = "Ray Visibility"
    bl_context = "world"
    rows = ("camera", "diffuse", "glossy", "transmission", "scatter")

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
    LIGHTSHAFT_PT_motion_blur,
    LIGHTSHAFT_PT_object,
    LIGHTSHAFT_PT_object_light_group,
    LIGHTSHAFT_PT_world,
    LIGHTSHAFT_PT_world_light_group,
    LIGHTSHAFT_PT_passes,
    LIGHTSHAFT_PT_light_groups,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
