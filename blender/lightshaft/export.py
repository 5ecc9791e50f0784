"""Exports the evaluated scene of a dependency graph, and lists what Lightshaft cannot render."""

import bpy
from mathutils import Matrix
from mathutils.bvhtree import BVHTree

from . import meshes
from .camera import add_camera, may_see
from .document import Document, element, reference
from .light_groups import LightGroups
from .lights import add_light, only_if_hidden
from .materials import Materials, Owner
from .problems import Problems
from .textures import Textures
from .volumes import Volumes
from .world import add_world

MESHES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
UNSEEN = {"EMPTY", "CAMERA", "ARMATURE", "SPEAKER", "LATTICE", "LIGHT_PROBE"}
SHEET = 1e-5  # the back of a sheet that gives off light stands this share of its size behind the front


class Shape:
    """A part of a mesh that can be placed in the scene."""

    def __init__(self, filenames, bsdf, emission, medium, flags, group):
        self.filenames, self.bsdf, self.emission, self.medium = filenames, bsdf, emission, medium
        self.group = group  # light group of the emission, or None
        self.flags = flags  # parameters about what the camera sees
        self.tree = None


def export(depsgraph, folder, size):
    """Returns (path of scene.xml, its Document, warnings). Raises ExportError, which lists all errors."""
    return Exporter(depsgraph, folder, size).run()


class Exporter:
    def __init__(self, depsgraph, folder, size):
        self.depsgraph, self.size, self.scene = depsgraph, size, depsgraph.scene_eval
        self.problems = Problems(self.scene.lightshaft.unsupported == "LEAVE_OUT")
        self.document = Document(folder)
        textures = Textures(self.document, self.problems)
        self.textures, self.volumes = textures, Volumes(self.document, self.problems)
        self.materials = Materials(self.document, self.problems, textures)
        self.layer = depsgraph.view_layer_eval
        self.override = self.layer.material_override
        self.groups = LightGroups(self.problems)
        self.known, self.places, self.bodies = {}, {}, []

    def run(self):
        camera = self.scene.camera
        if camera is None:
            self.problems.error("The scene has no camera. Add one (Shift A > Camera)")
            self.problems.raise_errors()
        self.check_collections(self.layer.layer_collection)
        for group in self.layer.lightgroups:
            self.groups.add(group.name)
        for instance in self.depsgraph.object_instances:
            if instance.show_self:
                self.add(instance.object, instance.matrix_world.copy())
        self.place_meshes()
        world = self.layer.world_override or self.scene.world
        add_world(self.document, self.problems, self.textures, world, self.groups)
        camera = camera.evaluated_get(self.depsgraph)
        eye = camera.matrix_world.translation
        around = next((medium for medium, contains in self.bodies if contains(eye)), None)
        add_camera(self.document, self.problems, camera, self.scene, self.size, around, Matrix)
        self.problems.raise_errors()
        return self.document.save(), self.document, self.problems.warnings

    def add(self, item, matrix):
        name = item.name
        if item.type in UNSEEN:
            return
        self.check_visibility(item)
        if item.type == "LIGHT":
            group = self.groups.of(item)
            add_light(self.document, self.problems, item, matrix, Matrix, self.may_see, group)
        elif item.type == "VOLUME":
            self.add_grid(item, matrix)
        elif item.type in MESHES:
            if any(
                system.settings.type == "HAIR" and system.settings.render_type == "PATH"
                for system in item.particle_systems
            ):
                self.problems.unsupported(
                    f"object '{name}': hair particles. Convert them to a mesh (Modifiers > Convert), or remove them"
                )
            if any(
                m.type == "FLUID" and m.fluid_type == "DOMAIN" and m.domain_settings.domain_type == "GAS"
                for m in item.modifiers
                if m.show_render
            ):
                self.problems.error(
                    f"object '{name}': a smoke domain. Import its OpenVDB cache as a volume object (Add > Volume > Import OpenVDB)"
                )
                return
            key = (
                item.original.data.as_pointer(),
                len(item.modifiers) and item.original.as_pointer(),
                tuple(material_name(s) for s in item.material_slots),
                item.visible_camera,
                item.is_holdout,
                item.lightgroup,
            )
            if key not in self.known:
                self.known[key] = self.shapes_of(item)
            self.places.setdefault(key, []).append((name, matrix))
        else:
            self.problems.unsupported(
                f"object '{name}': Lightshaft renders no {item.type.replace('_', ' ').title()}. Convert it to a mesh (Object > Convert)"
            )

    def may_see(self, centre, radius):
        camera = self.scene.camera.evaluated_get(self.depsgraph)
        return may_see(camera, self.scene, self.size, centre, radius, Matrix)

    def check_collections(self, layer):
        """Reports Holdout and Indirect Only of collections, since the objects inside do not have these flags
        themselves."""
        if layer.exclude:
            return
        for name, on in (("Holdout", layer.holdout), ("Indirect Only", layer.indirect_only)):
            if on and len(layer.collection.all_objects):
                self.problems.unsupported(
                    f"collection '{layer.collection.name}': {name}. Switch it off in the Outliner (Filter > Restriction Toggles)"
                )
        for child in layer.children:
            self.check_collections(child)

    def check_visibility(self, item):
        kind = "light" if item.type == "LIGHT" else "object"
        where = "Object properties > Visibility"
        # Of a light the second says that it lights shadow catchers, of which there are none here.
        # Meshes and lights can be hidden from the camera, and meshes can be held out.
        mesh = item.type in MESHES
        if (item.is_holdout and not mesh) or (item.is_shadow_catcher and kind == "object"):
            self.problems.unsupported(
                f"{kind} '{item.name}': Holdout or Shadow Catcher. Switch it off in {where}"
            )
        if item.is_holdout and mesh and not self.scene.render.film_transparent:
            self.problems.warning(
                f"object '{item.name}': Holdout leaves black where it is seen. Set Render Properties > Film > Transparent for alpha"
            )
        rays = ["diffuse", "glossy", "transmission", "volume_scatter"]
        if kind == "object":
            rays += ["shadow"] if mesh else ["camera", "shadow"]
        hidden = [ray for ray in rays if not getattr(item, f"visible_{ray}")]
        if hidden:
            self.problems.unsupported(
                f"{kind} '{item.name}': hidden from rays ({', '.join(hidden)}). Switch all on in {where}"
            )
        linking = item.light_linking
        if linking and (linking.receiver_collection or linking.blocker_collection):
            self.problems.unsupported(
                f"{kind} '{item.name}': Light Linking or Shadow Linking. Clear it in Object properties > Shading"
            )

    def shapes_of(self, item):
        mesh = item.to_mesh()
        if mesh is None:
            return []
        try:
            extent = max((v for corner in item.bound_box for v in (abs(c) for c in corner)), default=1) or 1
            shapes = [self.shape(item, part, extent) for part in meshes.parts(mesh)]
            if any(shape.medium for shape in shapes):
                tree = BVHTree.FromPolygons(
                    [v.co for v in mesh.vertices], [p.vertices for p in mesh.polygons]
                )
                for shape in shapes:
                    shape.tree = tree
            return shapes
        finally:
            item.to_mesh_clear()

    def shape(self, item, part, extent):
        slots = item.material_slots
        material = self.override
        if material is None and len(slots):
            material = slots[min(part.slot, len(slots) - 1)].material
        bsdf, emission = self.materials.surface(item.name, material)
        owner = Owner(item.name, material)
        found = self.volumes.coefficients(owner, of_grid=False) if material else None
        medium, group = None, None
        if emission is not None or (found is not None and any(found.emission)):
            group = self.groups.of(item)
        if found is not None:
            if not part.closed:
                self.problems.error(
                    f"{owner}: a volume needs a closed mesh. Fill its holes and merge its doubles (Edit Mode, M > By Distance)"
                )
            if not item.visible_camera:  # Blender's camera then does not see the volume, and Lightshaft's does
                self.problems.unsupported(
                    f"{owner}: hidden from rays (camera) with a volume in it. Switch Camera on in Object properties > Visibility"
                )
            medium = self.volumes.homogeneous(f"{item.name}-{material.name}", found, group)
        sides = [part.front()]
        if emission is not None and not part.closed:  # Blender's sheets give off light on both sides
            sides.append(part.back(SHEET * extent))
        flags = {"visible_camera": only_if_hidden(item), "holdout": True if item.is_holdout else None}
        return Shape([self.document.write(side, ".ply") for side in sides], bsdf, emission, medium, flags, group)

    def place_meshes(self):
        for key, places in self.places.items():
            shapes = self.known[key]
            plain = [shape for shape in shapes if shape.emission is None and shape.medium is None]
            if len(places) > 1 and plain:
                group = element(
                    "shape",
                    "shapegroup",
                    None,
                    *(self.placed(shape, shape.filenames[0], None) for shape in plain),
                )
                identifier = self.document.define(places[0][0], group)
                for _, matrix in places:
                    self.document.add(
                        element("shape", "instance", None, reference(identifier), to_world=matrix)
                    )
                shapes = [shape for shape in shapes if shape not in plain]
            for shape in shapes:
                for name, matrix in places:
                    for filename in shape.filenames:
                        self.document.define(name, self.placed(shape, filename, matrix))
                    if shape.medium:
                        self.bodies.append((shape.medium, inside_mesh(shape.tree, matrix.inverted_safe())))

    def placed(self, shape, filename, matrix):
        inside_medium = reference(shape.medium, "interior") if shape.medium else None
        emitter = None
        if shape.emission is not None:
            emitter = element(
                "emitter", "area", None, radiance=shape.emission, light_group=shape.group
            )
        return element(
            "shape",
            "ply",
            None,
            reference(shape.bsdf),
            inside_medium,
            emitter,
            filename=filename,
            to_world=matrix,
            **shape.flags,
        )

    def add_grid(self, item, matrix):
        data = item.data
        own = item.material_slots[0].material if len(item.material_slots) else None
        owner = Owner(item.name, self.override or own)
        if not data.grids.load():
            self.problems.error(
                f"{owner}: {data.grids.error_message or 'its file cannot be read'}. Set it in Volume properties"
            )
            return
        found = self.volumes.coefficients(owner, of_grid=True)
        if found is None:
            return
        if found.grid is not None and found.grid not in [grid.name for grid in data.grids]:
            names = ", ".join(f"'{grid.name}'" for grid in data.grids)
            self.problems.error(
                f"{owner}: its file has no grid '{found.grid}'; it has {names}. Set Density Attribute"
            )
            return
        if not data.grids.frame_filepath:
            self.problems.error(
                f"{owner}: a volume made by modifiers. Save it as an OpenVDB file and import that"
            )
            return
        path = bpy.path.abspath(data.grids.frame_filepath, library=data.library)
        added = self.volumes.grid(
            item, owner, found, path, matrix, [tuple(corner) for corner in item.bound_box]
        )
        if added is not None:
            medium, box = added
            to_box = box.inverted_safe()
            self.bodies.append((medium, lambda point: all(abs(x) < 1 for x in to_box @ point)))


def material_name(slot):
    return slot.material.name_full if slot.material else None


def inside_mesh(tree, to_local):
    """Returns True if the point is inside a closed mesh. It decides by the sides of the first faces that three
    rays hit."""

    def contains(point):
        start, votes = to_local @ point, 0
        for direction in ((0.36, 0.48, 0.8), (-0.8, 0.36, 0.48), (0.48, -0.8, 0.36)):
            _, normal, _, _ = tree.ray_cast(start, direction)
            votes += normal is not None and normal.dot(direction) > 0
        return votes >= 2

    return contains
