"""Bakes procedural textures into images with Cycles, so that they can be exported."""

import bpy

from .nodes import Place, constant, output_node
from .textures import bake_key, exported_as_it_is

INPUTS = {
    "Base Color", "Color", "Roughness", "Metallic", "Alpha", "Transmission Weight", "Emission Color", "Fac", "Factor",
}  # fmt: skip
SHADERS = {"BSDF_PRINCIPLED", "BSDF_DIFFUSE", "BSDF_GLOSSY", "EMISSION", "MIX_SHADER"}


def procedural_inputs(material):
    """The (node, input) pairs of shaders whose value cannot be exported directly. Nodes in groups cannot be baked
    separately."""
    for node in material.node_tree.nodes if material.node_tree else ():
        if node.type in SHADERS:
            place = Place(node)
            for socket in node.inputs:
                if socket.name in INPUTS and socket.is_linked and constant(place, socket) is None:
                    source, output = place.source(socket)
                    if source is not None and not exported_as_it_is(source, output):
                        yield node, socket


class LIGHTSHAFT_OT_bake(bpy.types.Operator):
    """Bakes what feeds the shaders of all materials and is no image into images; press again after a change"""

    bl_idname = "lightshaft.bake"
    bl_label = "Bake Procedural Textures"

    size: bpy.props.IntProperty(name="Size", default=1024, min=16, max=8192)

    def execute(self, context):
        scene, baked = context.scene, 0
        engine, samples, active, selected = (
            scene.render.engine,
            scene.cycles.samples,
            context.view_layer.objects.active,
            context.selected_objects,
        )
        scene.render.engine, scene.cycles.samples = "CYCLES", 1
        done, failed = set(), {}
        try:
            for item in [o for o in context.view_layer.objects if o.type == "MESH" and not o.hide_render]:
                for material in dict.fromkeys(slot.material for slot in item.material_slots if slot.material):
                    if material in done:
                        continue
                    try:
                        for node, socket in list(procedural_inputs(material)):
                            self.bake(context, item, material, node, socket)
                            baked += 1
                        done.add(material)
                    except RuntimeError as error:  # another object that has it may do
                        why = str(error).strip().removeprefix("Error: ")
                        failed.setdefault(material, f"object '{item.name}', material '{material.name}': {why}")
        finally:
            scene.render.engine, scene.cycles.samples = engine, samples
            select(context, active, selected)
        for material in [m for m in failed if m not in done]:
            self.report(
                {"WARNING"},
                f"{failed[material]}. What is hidden in the viewport or linked cannot be baked: show it, or make it local",
            )
        self.report({"INFO"}, f"{baked} inputs baked")
        return {"FINISHED"}

    def bake(self, context, item, material, node, socket):
        users = [
            o.name
            for o in context.view_layer.objects
            if o.type == "MESH" and material.name in o.data.materials
        ]
        if len({o.data for o in context.view_layer.objects if o.name in users}) > 1:
            self.report(
                {"WARNING"},
                f"material '{material.name}': objects {', '.join(users)} share it; it is baked as it is on '{item.name}'",
            )
        select(context, item, [item])
        if not item.data.uv_layers:
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.smart_project(island_margin=0.02)
            bpy.ops.object.mode_set(mode="OBJECT")
        image = bpy.data.images.new(
            f"{material.name} {socket.name}", self.size, self.size, float_buffer=True, is_data=True
        )
        tree = material.node_tree
        output = output_node(tree, "OUTPUT_MATERIAL")
        before = output.inputs["Surface"].links[0].from_socket
        target, glow = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeEmission")
        try:
            target.image, tree.nodes.active = image, target
            tree.links.new(socket.links[0].from_socket, glow.inputs["Color"])
            tree.links.new(glow.outputs[0], output.inputs["Surface"])
            bpy.ops.object.bake(type="EMIT", margin=8)
        finally:
            tree.links.new(before, output.inputs["Surface"])
            tree.nodes.remove(target)
            tree.nodes.remove(glow)
        image.pack()
        material[bake_key(node, socket)] = image.name


def select(context, active, selected):
    for item in context.view_layer.objects:
        item.select_set(item in selected)
    context.view_layer.objects.active = active


def register():
    bpy.utils.register_class(LIGHTSHAFT_OT_bake)


def unregister():
    bpy.utils.unregister_class(LIGHTSHAFT_OT_bake)
