"""Which rays meet objects, lights and the world: Blender's switches as Lightshaft's parameters."""

# Blender has a switch for each of these rays, Lightshaft one for all of them.
SURFACE_RAYS = ("diffuse", "glossy", "transmission")


class Visibility:
    """The parameters visible_..., holdout and shadow_catcher of one object, light or world: False or True if it is to be
    written, else None."""

    def __init__(self, camera=True, shadow=True, reflection=True, volume=True, holdout=False, catcher=False):
        self.camera, self.shadow = only_if_off(camera), only_if_off(shadow)
        self.receivers = {
            "visible_reflection": only_if_off(reflection),
            "visible_volume": only_if_off(volume),
        }
        self.holdout = True if holdout else None
        # Blender shows no shadow on a held-out object, either.
        self.catcher = True if catcher and not holdout else None

    def of_shape(self):
        return {
            "visible_camera": self.camera,
            "visible_shadow": self.shadow,
            "holdout": self.holdout,
            "shadow_catcher": self.catcher,
            **self.receivers,
        }

    def key(self):
        """Objects whose keys are equal can be instances of each other."""
        return tuple(self.of_shape().items())

    def hidden(self):
        """Returns names of the rays that do not meet the object."""
        flags = self.of_shape()
        return [name.removeprefix("visible_") for name, on in flags.items() if on is False]


def only_if_off(on):
    """Returns the value of a parameter that is true unless given."""
    return None if on else False


def sees_surfaces(problems, what, where, sees):
    """Returns `visible_reflection`. sees(ray): whether rays of this kind meet `what`."""
    off = [ray for ray in SURFACE_RAYS if not sees(ray)]
    if 0 < len(off) < len(SURFACE_RAYS):
        problems.unsupported(
            f"{what}: hidden from rays ({', '.join(off)}) alone. Lightshaft has one switch for {', '.join(SURFACE_RAYS[:2])} and {SURFACE_RAYS[2]} rays: switch all on or all off in {where}"
        )
        return True
    return not off


def visibility_of_world(problems, owner, world):
    rays = world.cycles_visibility
    where = "World properties > Settings > Ray Visibility"
    reflection = sees_surfaces(problems, owner, where, lambda ray: getattr(rays, ray))
    return Visibility(camera=rays.camera, reflection=reflection, volume=rays.scatter)


def visibility_of(problems, item, parent, layer):
    """Returns the visibility of an object or a light of a view layer. An instance is also hidden from what its parent,
    which may be None, is hidden from. As in Cycles, Holdout and Indirect Only of an instance are those of its parent,
    what is held out is not hidden from the camera, and lights are not held out."""
    owner = (parent or item).original
    holdout = owner.holdout_get(view_layer=layer)
    indirect_only = owner.indirect_only_get(view_layer=layer)
    kind = "light" if item.type == "LIGHT" else "object"
    family = [item] if parent is None else [item, parent]

    def sees(ray):
        return all(getattr(one, f"visible_{ray}") for one in family)

    reflection = sees_surfaces(
        problems, f"{kind} '{item.name}'", "Object properties > Visibility > Ray Visibility", sees
    )
    return Visibility(
        camera=sees("camera") and (holdout or not indirect_only),
        shadow=kind == "light" or sees("shadow"),
        reflection=reflection,
        volume=sees("volume_scatter"),
        holdout=kind == "object" and holdout,
        catcher=kind == "object" and any(one.is_shadow_catcher for one in family),
    )
