"""Light and shadow linking: the collections of lights, as link sets of what is in them."""

import re

INCLUDE = "INCLUDE"
NONE = "none"  # the link set that nothing is in
LISTS = ("receivers", "blockers")


class Linked:
    """A collection to which lights are linked. Its link set has the objects that it includes or, if it only excludes
    objects, those that it excludes."""

    def __init__(self, name, collection):
        included, excluded = set(), set()
        for objects, state in states(collection):
            (included if state == INCLUDE else excluded).update(objects)
        self.list = name if included else f"-{name}"
        self.named = included | excluded
        self.name, self.members = name, included - excluded if included else excluded

    def __contains__(self, item):
        return (item in self.members) != self.list.startswith("-")


def states(collection):
    """Returns (objects, state) of what is linked into the collection. All of a collection in it has its state."""
    inner = zip(collection.children, collection.collection_children)
    own = zip(collection.objects, collection.collection_objects)
    found = [(list(child.all_objects), link.light_linking.link_state) for child, link in inner]
    return found + [([item], link.light_linking.link_state) for item, link in own]


class Linking:
    """The link sets of an evaluated scene."""

    def __init__(self, depsgraph):
        self.sets = {}  # by the full name of the collection
        self.blockers = {}  # by the names of lights
        for instance in depsgraph.object_instances:
            light = instance.object.original
            linking = light.light_linking
            for collection in (linking.receiver_collection, linking.blocker_collection):
                if collection is not None and collection.name_full not in self.sets:
                    self.sets[collection.name_full] = Linked(self.fresh_name(collection.name), collection)
            if light.type == "LIGHT" and not light.data.use_shadow:
                self.blockers[light.name] = ()
            elif linking.blocker_collection is not None:
                self.blockers[light.name] = self.sets[linking.blocker_collection.name_full]

    def fresh_name(self, wanted):
        base = re.sub(r"[^A-Za-z0-9_-]", "_", wanted)[:50].lstrip("-") or "set"
        names = {linked.name for linked in self.sets.values()} | {NONE}
        return next(name for name in numbered(base) if name not in names)

    def of_light(self, item):
        """Returns the parameters `receivers` and `blockers` of what an object emits."""
        light = item.original
        linking = light.light_linking
        collections = (linking.receiver_collection, linking.blocker_collection)
        lists = [self.sets[c.name_full].list if c is not None else None for c in collections]
        if light.type == "LIGHT" and not light.data.use_shadow:
            lists[1] = NONE
        return dict(zip(LISTS, lists))

    def owner_of(self, item, parent):
        """Returns the object whose link sets an object has. As in Cycles it is what instances the object, if the
        collection of some light names that."""
        if parent is not None and any(parent.original in linked.named for linked in self.sets.values()):
            return parent.original
        return item.original

    def sets_of(self, owner):
        """Returns the value of `link_sets` of an object, or None."""
        names = [linked.name for linked in self.sets.values() if owner in linked.members]
        return ", ".join(names) or None

    def lights_past(self, owner):
        """Returns the names of the lights of which the object is no blocker."""
        return [name for name, linked in self.blockers.items() if owner not in linked]


def numbered(base):
    yield base
    count = 2
    while True:
        yield f"{base}_{count}"
        count += 1


def drop_empty_sets(root):
    """Replaces the link sets that nothing in the document is in."""
    used = set()
    for text in root.iter("string"):
        if text.get("name") == "link_sets":
            used.update(name.strip() for name in text.get("value").split(","))
    for parent in list(root.iter()):
        for text in [child for child in parent if child.tag == "string" and child.get("name") in LISTS]:
            name = text.get("value")
            if name.lstrip("-") in used:
                continue
            if name.startswith("-"):
                parent.remove(text)
            else:
                text.set("value", NONE)
