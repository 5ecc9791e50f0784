"""The render engine: exports the scene, starts a job, and shows its image while it renders."""

import pathlib
import tempfile
import time
import traceback

import bpy
import numpy as np

from . import exr
from .export import export
from .farm import Farm
from .light_groups import known_name
from .local import LocalJob, find_program
from .motion import exposure_of
from .problems import ExportError
from .settings import preferences

LOOK = 0.25  # seconds between two looks at a job, and the longest that Esc waits
SHOW = 2.0  # seconds at least between two images while it renders
FAR = 1e10  # Blender's depth where there is nothing

# Pass of Blender: (setting of the view layer or of the scene, its channels, Blender's kind, layer of Lightshaft, its channels)
PASSES = {
    "Depth": ("use_pass_z", "Z", "VALUE", "depth", "Z"),
    "Normal": ("use_pass_normal", "XYZ", "VECTOR", "normal", "XYZ"),
    "Position": ("use_pass_position", "XYZ", "VECTOR", "position", "XYZ"),
    "Volume Light": ("pass_volume", "RGB", "COLOR", "volume", "RGB"),
    "Surface Light": ("pass_surface", "RGB", "COLOR", "surface", "RGB"),
    "Noise": ("pass_noise", "RGB", "COLOR", "stderr", "RGB"),
    "Denoised": ("denoise", "RGBA", "COLOR", "denoised", "RGB"),
}


GROUP = "Combined_"  # with the name of a light group
WITHOUT_AOV = ("Noise", "Denoised")


def wanted_passes(scene, view_layer):
    wanted = {
        name: row
        for name, row in PASSES.items()
        if getattr(view_layer, row[0], getattr(scene.lightshaft, row[0], False))
    }
    for group in view_layer.lightgroups:
        wanted[GROUP + group.name] = (None, "RGB", "COLOR", f"RGB_{known_name(group.name)}", "RGB")
    return wanted


class LightshaftEngine(bpy.types.RenderEngine):
    bl_idname = "LIGHTSHAFT"
    bl_label = "Lightshaft"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    def update_render_passes(self, scene=None, renderlayer=None):
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for name, row in wanted_passes(scene, renderlayer).items():
            self.register_pass(scene, renderlayer, name, len(row[1]), row[1], row[2])

    def render(self, depsgraph):
        try:
            with tempfile.TemporaryDirectory(prefix="lightshaft-") as folder:
                self.render_in(depsgraph, pathlib.Path(folder))
        except ExportError as error:
            # Not error_set: Blender 5.0 would go on to save the image that is not there, and crash.
            self.report({"ERROR"}, str(error))
        except Exception as error:  # a fault of the add-on; Blender 5.0 would crash where it saves the image
            traceback.print_exc()
            self.report({"ERROR"}, f"The Lightshaft add-on has a bug, see the system console: {error!r}")

    def render_in(self, depsgraph, folder):
        scene = depsgraph.scene
        self.passes = wanted_passes(scene, depsgraph.view_layer)
        self.update_stats("", "Lightshaft: exports the scene")
        size = (self.resolution_x, self.resolution_y)
        path, document, warnings = export(depsgraph, folder, size, exposure_of(self, depsgraph))
        # Blender 5.0 crashes where it saves a render that was cancelled before it had a result.
        self.end_result(self.begin_result(0, 0, *size))
        job, more = self.start(scene, path, document)
        try:
            for warning in warnings + more:
                self.report({"WARNING"}, warning)
            self.follow(job, scene, size)
        finally:
            if not job.ended:
                job.cancel()

    def start(self, scene, path, document):
        settings, chosen = scene.lightshaft, preferences()
        spec = {
            "spp": settings.samples,
            # Frames can be negative; a seed can't.
            "seed": (settings.seed + (scene.frame_current if settings.animate_seed else 0)) % (1 << 32),
        }
        aov = sorted(
            {
                "light_groups" if name.startswith(GROUP) else row[3]
                for name, row in self.passes.items()
                if name not in WITHOUT_AOV
            }
        )
        if aov:
            spec["aov"] = aov
        if settings.use_target_error:
            spec["target_error"] = settings.target_error
        if settings.denoise:
            spec["denoise"] = True
        if settings.where == "FARM":
            return Farm(chosen.url, chosen.token).submit(
                path, document.files, spec | {"float": True, "priority": settings.priority}
            )
        threads = scene.render.threads if scene.render.threads_mode == "FIXED" else 0
        return LocalJob(find_program(chosen.program), path, spec, threads), []

    def follow(self, job, scene, size):
        shown_units, next_show = 0, time.monotonic() + SHOW
        while True:
            job.look()
            if job.ended:
                break
            if self.escaped():
                self.update_stats("", "Lightshaft: cancelled")
                return
            self.update_stats("", f"Lightshaft: {job.words}")
            self.update_progress(job.progress)
            if job.units > shown_units and time.monotonic() >= next_show:
                begins, shown_units = time.monotonic(), job.units
                self.show(job.image(), scene, size)
                # An image that is slow to come is asked for less often: four fifths of the time are the render's.
                next_show = time.monotonic() + max(SHOW, 4 * (time.monotonic() - begins))
            time.sleep(LOOK)
        self.show(job.image(), scene, size)
        self.update_progress(1.0)

    def escaped(self):
        """Returns True if the user pressed Esc. Tests replace this function, because they have no keyboard."""
        return self.test_break()

    def show(self, data, scene, size):
        """Copies the pixels received so far into Blender's image."""
        if not data:
            return
        try:
            layers = exr.read(data)
        except ValueError as error:
            raise ExportError(f"Lightshaft's image cannot be read: {error}") from error
        width, height = size
        result = self.begin_result(0, 0, width, height)
        for render_pass in result.layers[0].passes:
            if render_pass.name == "Combined":
                alpha = layers.get("A", (layers["spp"] > 0).astype(np.float32))
                planes = [layers[c] for c in "RGB"] + [alpha]
            elif render_pass.name in self.passes:
                planes = self.planes(render_pass.name, layers, scene)
            else:
                continue
            if planes:
                pixels = np.stack(planes[: render_pass.channels], axis=2)[::-1]
                render_pass.rect.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
        self.end_result(result)

    def planes(self, name, layers, scene):
        _, _, _, layer, channels = self.passes[name]
        planes = [layers.get(f"{layer}.{c}") for c in channels]
        if name.startswith(GROUP) and planes[0] is None:  # no light is in this group
            return [np.zeros_like(layers["R"])] * 3
        if any(plane is None for plane in planes):  # a denoised layer comes with the finished image
            return None
        if name == "Depth":
            depth = planes[0]
            return [np.where(depth > 0, depth * along_axis(scene, depth.shape), FAR)]
        return planes + [layers.get("A", np.ones_like(planes[0]))]


def along_axis(scene, shape):
    """Returns the cosine between each pixel's ray and the view axis, because Blender measures depth along the
    axis."""
    data = scene.camera.data
    if data.type != "PERSP":
        return 1.0
    height, width = shape
    fit = data.sensor_fit if data.sensor_fit != "AUTO" else ("HORIZONTAL" if width >= height else "VERTICAL")
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    frame = width if fit == "HORIZONTAL" else height
    step = sensor / data.lens / frame
    x = (np.arange(width) + 0.5 - width / 2 + data.shift_x * frame) * step
    y = (height / 2 - np.arange(height) - 0.5 + data.shift_y * frame) * step
    return 1 / np.sqrt(1 + x[None, :] ** 2 + y[:, None] ** 2)


def compatible_panels():
    """Returns Blender's panels for what this engine exports: camera, lights, worlds, materials and passes."""
    without = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_freestyle"}
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is not None and "BLENDER_RENDER" in engines and panel.__name__ not in without:
            yield panel


def register():
    bpy.utils.register_class(LightshaftEngine)
    for panel in compatible_panels():
        panel.COMPAT_ENGINES.add(LightshaftEngine.bl_idname)


def unregister():
    for panel in compatible_panels():
        panel.COMPAT_ENGINES.discard(LightshaftEngine.bl_idname)
    bpy.utils.unregister_class(LightshaftEngine)
