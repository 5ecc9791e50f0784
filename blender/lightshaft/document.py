"""The scene as it is sent: an XML document and the files that it names."""

import hashlib
import pathlib
import xml.etree.ElementTree as ElementTree

from .problems import ExportError


def element(kind, plugin, name=None, *children, **values):
    """Makes an object such as <bsdf type="diffuse" name="..."> with its parameters. Parameters that are None are
    left out."""
    result = ElementTree.Element(kind, {"type": plugin, **({"name": name} if name else {})})
    for key, value in values.items():
        if value is not None:
            result.append(parameter(key, value))
    result.extend(child for child in children if child is not None)
    return result


def parameter(name, value):
    """Makes a parameter of the type of its value: three numbers become a colour, 4 x 4 numbers a transform, such
    numbers by times an animation, and an element stays as it is."""
    if isinstance(value, ElementTree.Element):
        # Another element: a texture can be a parameter of several objects, under another name in each.
        named = ElementTree.Element(value.tag, {**value.attrib, "name": name})
        named.extend(value)
        return named
    if isinstance(value, bool):
        return ElementTree.Element("boolean", name=name, value=str(value).lower())
    if isinstance(value, int):
        return ElementTree.Element("integer", name=name, value=str(value))
    if isinstance(value, float):
        return ElementTree.Element("float", name=name, value=repr(value))
    if isinstance(value, str):
        return ElementTree.Element("string", name=name, value=value)
    if isinstance(value, dict):
        animation = ElementTree.Element("animation", name=name)
        for time, matrix in sorted(value.items()):
            animation.append(transform(matrix, time=repr(float(time))))
        return animation
    rows = [list(row) if hasattr(row, "__len__") else row for row in value]
    if len(rows) == 4:
        return transform(rows, name=name)
    return ElementTree.Element("rgb", name=name, value=numbers(rows))


def vector(name, values, kind="vector"):
    return ElementTree.Element(
        kind, {"name": name, **{axis: repr(float(v)) for axis, v in zip("xyz", values)}}
    )


def transform(rows, **attributes):
    result = ElementTree.Element("transform", **attributes)
    result.append(ElementTree.Element("matrix", value=numbers(x for row in rows for x in row)))
    return result


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def reference(identifier, name=None):
    return ElementTree.Element("ref", {"id": identifier, **({"name": name} if name else {})})


class Document:
    """A list of top-level elements of the scene, and a folder with the files that they name."""

    def __init__(self, folder):
        self.folder, self.files = pathlib.Path(folder), {}
        self.root = ElementTree.Element("scene", version="3.0.0")
        self.ids = set()

    def add(self, child):
        self.root.append(child)

    def define(self, wanted, child):
        """Adds an object under an unused id like `wanted` and returns the id."""
        base = "".join(c if c.isalnum() or c in "._-" else "_" for c in wanted) or "unnamed"
        identifier, count = base, 1
        while identifier in self.ids:
            count += 1
            identifier = f"{base}_{count}"
        self.ids.add(identifier)
        child.set("id", identifier)
        self.root.append(child)
        return identifier

    def write(self, content, suffix):
        """Writes a file that is named by its content, so that equal files are stored and sent once. Returns its
        name."""
        name = hashlib.sha256(content).hexdigest()[:32] + suffix
        if name not in self.files:
            self.files[name] = self.folder / name
            self.files[name].write_bytes(content)
        return name

    def take(self, path, owner):
        """Adds a file of the user without moving it. Returns its name in the scene."""
        path = pathlib.Path(path)
        if not path.is_file():
            raise ExportError(
                f"{owner}: the file {path} does not exist. Find it by File > External Data > Find Missing Files"
            )
        with path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        name = digest[:32] + path.suffix.lower()
        self.files.setdefault(name, path)
        return name

    def save(self):
        """Writes scene.xml and, beside it, links to files in other folders. Returns its path."""
        for name, path in self.files.items():
            if path.parent != self.folder and not (self.folder / name).exists():
                (self.folder / name).symlink_to(path.resolve())
        ElementTree.indent(self.root)
        scene = self.folder / "scene.xml"
        scene.write_bytes(ElementTree.tostring(self.root, encoding="utf-8"))
        return scene
