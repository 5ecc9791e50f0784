"""Names of light groups: those of Blender, as Lightshaft takes them."""

import re

OTHER = "other"  # Lightshaft's group of the lights that are in none


def known_name(name):
    """Returns the name of a light group of Blender as Lightshaft takes it: of ASCII letters, digits, _ and -."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name) + ("_" if name == OTHER else "")


class LightGroups:
    """The light groups of a scene. Reports names that are changed, and names that become the same."""

    def __init__(self, problems):
        self.problems, self.used = problems, {}

    def of(self, owner):
        """Returns the value of `light_group` of an object's or a world's light, or None."""
        return self.add(owner.lightgroup) if owner.lightgroup else None

    def add(self, name):
        known = known_name(name)
        first = self.used.setdefault(known, name)
        if first != name:
            self.problems.unsupported(
                f"light groups '{first}' and '{name}': both are called '{known}' in Lightshaft. "
                "Rename one in View Layer properties > Light Groups"
            )
        elif known != name:
            self.problems.warning(f"light group '{name}' is called '{known}' in Lightshaft")
        return known
