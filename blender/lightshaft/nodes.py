"""Follows node trees: finds the node from which a socket's value comes, through reroutes and groups."""

from .constants import as_type, computed


class Place:
    """A node, and the groups that were entered to reach it."""

    def __init__(self, node, groups=()):
        self.node, self.groups = node, groups

    def input(self, name):
        """Finds an input by its identifier, or else by its name."""
        by_identifier = next((socket for socket in self.node.inputs if socket.identifier == name), None)
        return by_identifier or next((socket for socket in self.node.inputs if socket.name == name), None)

    def source(self, socket):
        """Returns what is linked to an input as (Place, output socket). If nothing is linked, returns (None, the
        socket with the value)."""
        groups = self.groups
        while True:
            if (
                socket is None
                or not socket.is_linked
                or not socket.links[0].is_valid
                or socket.links[0].is_muted
            ):
                return None, socket
            output = socket.links[0].from_socket
            node = output.node
            if node.type == "REROUTE" or node.mute:
                socket = next((s for s in node.inputs if s.type == output.type), None)
            elif node.type == "GROUP" and node.node_tree:
                inner = output_node(node.node_tree, "GROUP_OUTPUT")
                groups = (*groups, node)
                socket = inner and next((s for s in inner.inputs if s.identifier == output.identifier), None)
            elif node.type == "GROUP_INPUT" and groups:
                socket = next((s for s in groups[-1].inputs if s.identifier == output.identifier), None)
                groups = groups[:-1]
            else:
                return Place(node, groups), output

    @property
    def title(self):
        return self.node.label or self.node.name


def output_node(tree, kind):
    """Returns the active output of a tree. For materials and worlds it ignores outputs that are only for EEVEE."""
    found = [
        node
        for node in tree.nodes
        if node.type == kind and getattr(node, "target", "ALL") in ("ALL", "CYCLES")
    ]
    return next((node for node in found if node.is_active_output), found[0] if found else None)


def plain(socket):
    """Returns the value of an unlinked input: a number, or three numbers."""
    value = socket.default_value
    return [float(v) for v in value][:3] if hasattr(value, "__len__") else float(value)


def constant(place, socket):
    """Returns the value of an input if it is constant, else None. Colours and vectors have three numbers."""
    source, output = place.source(socket)
    if source is None:
        value = plain(output) if output is not None and hasattr(output, "default_value") else None
    elif source.node.type in ("RGB", "VALUE"):
        value = plain(output)
    else:
        value = computed(source.node, output, lambda name: constant(source, source.input(name)))
    return as_type(value, getattr(socket, "type", None), getattr(output, "type", None))


def is_animated(tree):
    """Returns whether values of a node tree change over time, so that what was baked is that of one frame."""
    data = tree.animation_data
    return data is not None and (data.action is not None or len(data.drivers) > 0)


BAKED_ONCE = "is animated; all frames have what was baked at one"
