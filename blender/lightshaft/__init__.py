"""Lightshaft for Blender: a render engine that sends scenes to a Lightshaft farm or renders on this machine."""


def register():
    for module in modules():
        module.register()


def unregister():
    for module in reversed(modules()):
        module.unregister()


def modules():
    from . import bake, engine, panels, settings  # Blender's modules are there only within Blender

    return settings, engine, bake, panels
