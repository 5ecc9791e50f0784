"""Exports the evaluated scene of a dependency graph, and lists what Lightshaft cannot render."""

import bpy
from mathutils import Matrix
from mathutils.bvhtree import BVHTree

from . import meshes
from .camera import add_camera, may_see
from .document import Document, element, reference
from .light_groups import LightGroups
from .lights import add_light
from .linking import Linking, drop_empty_sets
from .materials import Materials, Owner
from .motion import Exposure
from .problems import Problems
from .textures import Textures
from .visibility import visibility_of
from .volumes import Volumes, present
from .voxels import is_baked
from .world import add_world

MESHES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
UNSEEN = {"EMPTY", "CAMERA", "ARMATURE", "SPEAKER", "LATTICE", "LIGHT_PROBE"}
SHEET = 1e-5  # the back of a sheet that gives off light stands this share of its size behind the front


class Shape:
    """A part of a mesh that can be placed in the scene."""

    def __init__(self, filenames, bsdf, emission, fog, flags, marks):
        self.filenames, self.bsdf, self.emission, self.fog = filenames, bsdf, emission, fog
        self.marks = marks  # light group and links of the emission
        self.flags = flags  # parameters about what rays meet the shape
        self.tree = None


class Fog:
    """What fills a mesh: one medium for all its places, or voxels, which are a medium of their own at each."""

    def __init__(self, volumes, name, found, group, sets):
        self.volumes, self.name, self.found, self.marks = volumes, name, found, (group, sets)
        self.everywhere = None if found.voxels else volumes.homogeneous(name, found, *self.marks)

    def at(self, placement, problems):
        if self.everywhere is not None:
            return self.everywhere
        placement.stands(problems, "a volume of voxels")
        return self.volumes.of_voxels(self.name, self.found, placement.still, *self.marks)


def export(depsgraph, folder, size, exposure=None):
    """Returns (path of scene.xml, its Document, warnings). Raises ExportError, which lists all errors. `exposure`:
    see exposure_of(); without it nothing moves."""
    return Exporter(depsgraph, folder, size, exposure or Exposure()).run()


class Exporter:
    def __init__(self, depsgraph, folder, size, exposure):
        self.exposure = exposure
        self.depsgraph, self.size, self.scene = depsgraph, size, depsgraph.scene_eval
        self.problems = Problems(self.scene.lightshaft.unsupported == "LEAVE_OUT")
        self.document = Document(folder)
        textures = Textures(self.document, self.problems)
        self.textures, self.volumes = textures, Volumes(self.document, self.problems)
        self.materials = Materials(self.document, self.problems, textures)
        self.layer = depsgraph.view_layer_eval
        self.override = self.layer.material_override
        self.groups, self.links = LightGroups(self.problems), Linking(depsgraph)
        self.known, self.places, self.bodies = {}, {}, []
        self.catchers, self.dim = False, []  # whether objects catch shadows; lights that do not light those

    def run(self):
        camera = self.scene.camera
        if camera is None:
            self.problems.error("The scene has no camera. Add one (Shift A > Camera)")
            self.problems.raise_errors()
        for group in self.layer.lightgroups:
            self.groups.add(group.name)
        for instance in self.depsgraph.object_instances:
            if instance.show_self:
                parent = instance.parent if instance.is_instance else None
                self.add(instance.object, parent, instance)
        for name in self.dim if self.catchers else ():
            self.problems.unsupported(
                f"light '{name}': Shadow Catcher off. All lights light shadow catchers: switch it on in Object properties > Visibility"
            )
        self.place_meshes()
        world = self.layer.world_override or self.scene.world
        fog = add_world(self.document, self.problems, self.textures, self.volumes, world, self.groups)
        camera = camera.evaluated_get(self.depsgraph)
        eye = camera.matrix_world.translation
        around = next((medium for medium, contains in self.bodies if contains(eye)), None)
        if around is not None and fog is not None:
            self.problems.error(
                f"camera '{camera.name}': it stands in the volume of an object and in that of the world. Lightshaft's camera is in one: move it out of the object, or unlink the world's Volume"
            )
        around = around or fog
        add_camera(self.document, self.problems, camera, self.scene, self.size, around, Matrix, self.exposure)
        self.problems.raise_errors()
        drop_empty_sets(self.document.root)
        return self.document.save(), self.document, self.problems.warnings

    def add(self, item, parent, instance):
        name = item.name
        if item.type in UNSEEN:
            return
        placement = self.exposure.placement(self.problems, instance)
        visible = visibility_of(self.problems, item, parent, self.depsgraph.view_layer)
        self.check_visibility(item, visible)
        links, owner = self.links.of_light(item), self.links.owner_of(item, parent)
        if item.type == "LIGHT":
            marks = {"light_group": self.groups.of(item), **links}
            add_light(
                self.document, self.problems, item, placement, Matrix, self.may_see, marks, visible
            )
        elif item.type == "VOLUME":
            placement.stands(self.problems, "a volume")
            self.add_grid(item, placement.still, self.links.sets_of(owner))
            self.warn_of_shade(name, owner)
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
                visible.key(),
                item.lightgroup,
                sets := self.links.sets_of(owner),
                tuple(links.values()),
                item.name_full if is_baked(item) else None,
            )
            if key not in self.known:
                self.known[key] = self.shapes_of(item, visible, links, sets)
            self.places.setdefault(key, []).append((name, placement))
            if any(shape.fog for shape in self.known[key]):
                self.warn_of_shade(name, owner)
        else:
            self.problems.unsupported(
                f"object '{name}': Lightshaft renders no {item.type.replace('_', ' ').title()}. Convert it to a mesh (Object > Convert)"
            )

    def may_see(self, centre, radius):
        if self.exposure.camera:
            return True  # what a camera that moves passes is not looked at
        camera = self.scene.camera.evaluated_get(self.depsgraph)
        return may_see(camera, self.scene, self.size, centre, radius, Matrix)

    def check_visibility(self, item, visible):
        kind = "light" if item.type == "LIGHT" else "object"
        where = "Object properties > Visibility"
        # Meshes and lights can be hidden from rays, and meshes can be held out or catch shadows.
        mesh = item.type in MESHES
        if (visible.holdout or visible.catcher) and not mesh:
            self.problems.unsupported(
                f"{kind} '{item.name}': Holdout or Shadow Catcher. Switch it off in {where}, and Holdout of its collections and of what instances it"
            )
        if visible.holdout and mesh and not self.scene.render.film_transparent:
            self.problems.warning(
                f"object '{item.name}': Holdout leaves black where it is seen. Set Render Properties > Film > Transparent for alpha"
            )
        if visible.catcher and not self.scene.render.film_transparent:
            self.problems.warning(
                f"object '{item.name}': Shadow Catcher has no effect. Set Render Properties > Film > Transparent"
            )
        elif visible.catcher:
            self.catchers = True
        if kind == "light" and not item.is_shadow_catcher:
            self.dim.append(item.name)
        if kind == "object" and not mesh and visible.hidden():
            self.problems.unsupported(
                f"{kind} '{item.name}': hidden from rays ({', '.join(visible.hidden())}). Media are seen by all rays: switch all on in {where}"
            )

    def warn_of_shade(self, name, owner):
        for light in self.links.lights_past(owner):
            self.problems.warning(
                f"object '{name}': the volume in it shades light '{light}', of which it is no blocker"
            )

    def shapes_of(self, item, visible, links, sets):
        mesh = item.to_mesh()
        if mesh is None:
            return []
        try:
            extent = max((v for corner in item.bound_box for v in (abs(c) for c in corner)), default=1) or 1
            shapes = [self.shape(item, visible, links, sets, part, extent) for part in meshes.parts(mesh)]
            if any(shape.fog for shape in shapes):
                tree = BVHTree.FromPolygons(
                    [v.co for v in mesh.vertices], [p.vertices for p in mesh.polygons]
                )
                for shape in shapes:
                    shape.tree = tree
            return shapes
        finally:
            item.to_mesh_clear()

    def shape(self, item, visible, links, sets, part, extent):
        slots = item.material_slots
        material = self.override
        if material is None and len(slots):
            material = slots[min(part.slot, len(slots) - 1)].material
        bsdf, emission = self.materials.surface(item.name, material)
        owner = Owner(item.name, material, item)
        found = self.volumes.coefficients(owner, of_grid=False) if material else None
        fog, group = None, None
        if emission is not None or (found is not None and present(found.emission)):
            group = self.groups.of(item)
        if found is not None:
            if not part.closed:
                self.problems.error(
                    f"{owner}: a volume needs a closed mesh. Fill its holes and merge its doubles (Edit Mode, M > By Distance)"
                )
            if visible.hidden():  # Blender's rays then do not see the volume, and Lightshaft's do
                self.problems.unsupported(
                    f"{owner}: hidden from rays ({', '.join(visible.hidden())}) with a volume in it. Switch all on in Object properties > Visibility"
                )
            fog = Fog(self.volumes, f"{item.name}-{material.name}", found, group, sets)
        sides = [part.front()]
        if emission is not None and not part.closed:  # Blender's sheets give off light on both sides
            sides.append(part.back(SHEET * extent))
        files = [self.document.write(side, ".ply") for side in sides]
        flags = {**visible.of_shape(), "link_sets": sets}
        if bsdf in self.materials.passing and emission is None:
            names = ("visible_camera", "holdout", "shadow_catcher")
            flags = {name: flags[name] for name in names}
        return Shape(files, bsdf, emission, fog, flags, {"light_group": group, **links})

    def place_meshes(self):
        for key, places in self.places.items():
            shapes = self.known[key]
            plain = [shape for shape in shapes if shape.emission is None and shape.fog is None]
            if len(places) > 1 and plain:
                group = element(
                    "shape",
                    "shapegroup",
                    None,
                    *(self.placed(shape, shape.filenames[0], None) for shape in plain),
                )
                identifier = self.document.define(places[0][0], group)
                for _, placement in places:
                    to_world = placement.to_world(self.problems)
                    self.document.add(
                        element("shape", "instance", None, reference(identifier), to_world=to_world)
                    )
                shapes = [shape for shape in shapes if shape not in plain]
            for shape in shapes:
                for name, placement in places:
                    to_world = placement.to_world(self.problems, shape.emission is not None)
                    medium = shape.fog.at(placement, self.problems) if shape.fog else None
                    for filename in shape.filenames:
                        self.document.define(name, self.placed(shape, filename, to_world, medium))
                    if medium:
                        to_local = placement.still.inverted_safe()
                        self.bodies.append((medium, inside_mesh(shape.tree, to_local)))

    def placed(self, shape, filename, to_world, medium=None):
        inside_medium = reference(medium, "interior") if medium else None
        emitter = None
        if shape.emission is not None:
            emitter = element("emitter", "area", None, radiance=shape.emission, **shape.marks)
        return element(
            "shape",
            "ply",
            None,
            reference(shape.bsdf),
            inside_medium,
            emitter,
            filename=filename,
            to_world=to_world,
            **shape.flags,
        )

    def add_grid(self, item, matrix, sets):
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
            item, owner, found, path, matrix, [tuple(corner) for corner in item.bound_box], sets
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
