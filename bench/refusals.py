"""Judges refusals of scene files: is what the message says true of the file at the place that it names, and whose fault is it?

Each Rule has the form of a message, the verdict on it, a proof and a reason. The proof reads the file at the place, without the program's
own readers, and holds if the file is as the message says. The reason names the line of docs/reference, or the rule of the
format, by which it is refused; that a page has the line is checked, too.
"""
import dataclasses
import functools
import json
import math
import pathlib
import re
import struct
from typing import Callable

OUTSIDE, WRONG, INCOMPLETE, INSIDE = "outside the features", "the file is wrong", "incomplete", "inside the features"
VERDICTS = (OUTSIDE, WRONG, INCOMPLETE, INSIDE)
REFERENCE = pathlib.Path(__file__).resolve().parents[1] / "docs/reference"
PLACE = re.compile(r"^(?P<file>.*):(?P<line>\d+):(?P<column>\d+)$")
TAG = re.compile(r"<!--.*?-->|<(?P<close>/?)(?P<tag>\w+)(?P<attributes>(?:\s+[\w:]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*)\s*(?P<empty>/?)>", re.S)
ATTRIBUTE = re.compile(r"([\w:]+)\s*=\s*[\"']([^\"']*)")


@dataclasses.dataclass
class Case:
    """One error of a scene, and the text of the file that it names. `rest` is what stands at its place and after it."""
    scene: pathlib.Path
    where: str
    text: str = ""
    before: str = ""
    rest: str = ""

    def __post_init__(self):
        place = PLACE.match(self.where)
        if not place:
            return
        file = self.scene.parent / place["file"]
        self.text = text_of(file)
        lines = self.text.split("\n")
        if int(place["line"]) > len(lines):
            return
        at = sum(len(line) + 1 for line in lines[: int(place["line"]) - 1]) + int(place["column"]) - 1
        self.before, self.rest = self.text[:at], self.text[at:]

    def meant(self, value):
        """The value of an attribute of XML: that of the parameter, by <default>, if it names one."""
        default = re.search(rf'<default\s+name="{re.escape(value[1:])}"\s+value="([^"]*)"', self.text) if value.startswith("$") else None
        return default[1] if default else value

    def begins(self, word):
        return self.rest.startswith(word)

    @functools.cached_property
    def around(self):
        """The objects of XML that are open at the place, as (tag, type)."""
        found = []
        for match in TAG.finditer(self.before):
            if match["close"]:
                found and found.pop()
            elif match["tag"] and not match["empty"]:
                found.append((match["tag"], dict(ATTRIBUTE.findall(match["attributes"])).get("type", "")))
        return found

    @functools.cached_property
    def element(self):
        """The tag and the attributes of the element of XML in which the place lies."""
        begin = self.before.rfind("<") if not self.begins("<") else len(self.before)
        match = TAG.match(self.text, begin)
        return (match["tag"], dict(ATTRIBUTE.findall(match["attributes"]))) if match and match["tag"] else ("", {})

    def member(self, path):
        """The value of that path of a JSON file; None if there is none."""
        value = json.loads(self.text)
        for name, index in re.findall(r"\.?(\w+)|\[(\d+)\]", path):
            try:
                value = value[name] if name else value[int(index)]
            except (KeyError, IndexError, TypeError):
                return None
        return value


def text_of(file):
    data = file.read_bytes()
    if data[:4] == b"glTF" and struct.unpack_from("<I", data, 4) == (2,):
        data = data[20 : 20 + struct.unpack_from("<I", data, 12)[0]]
    return data.decode("utf-8", "replace").removeprefix("\ufeff")


@functools.cache
def lines_of(page):
    return (REFERENCE / page).read_text().splitlines()


def told_in(page, beginning):
    """The page and the beginning of its line. AssertionError if the page has none."""
    assert any(line.startswith(beginning) for line in lines_of(page)), f"{page} has no line that begins with {beginning}"
    return f"{page}: {beginning}"


def is_told(page, beginning):
    return any(line.startswith(beginning) for line in lines_of(page))


@dataclasses.dataclass
class Rule:
    kind: str
    message: str
    verdict: Callable[[Case, re.Match], str] | str
    proof: Callable[[Case, re.Match], bool]
    reason: Callable[[Case, re.Match], str] | str

    def judge(self, case, text):
        """None if the message is another; else the verdict, the kind and the reason. ValueError: the message is false."""
        match = re.match(self.message, text)
        if not match:
            return None
        if not self.proof(case, match):
            raise ValueError(f"{self.kind}: {case.where}: {text}")
        verdict = self.verdict if isinstance(self.verdict, str) else self.verdict(case, match)
        return verdict, self.kind.format(*match.groups(), **match.groupdict()), self.reason if isinstance(self.reason, str) else self.reason(case, match)


def is_count(text):
    """How many more errors there are, which is none itself."""
    return re.fullmatch(r"\d+ more errors are not shown", text) is not None


def judge(case, text):
    """The verdict, the kind and the reason. ValueError: the message is false, or of no known form."""
    for rule in RULES:
        if found := rule.judge(case, text):
            return found
    raise ValueError(f"no rule: {case.where}: {text}")


# Proofs that something is missing.

def file_is_absent(case, match):
    name = match[1].replace("\\", "/")
    return not (case.scene.parent / name).exists() and pathlib.PurePath(name).stem in case.text + case.scene.read_text(errors="replace")


def file_is_pointer(case, match):
    return (case.scene.parent / match[1]).read_bytes().startswith(b"version https://git-lfs")


# Refused objects of XML.

def names_type(case, match):
    tag, attributes = case.element
    given = case.meant(attributes.get("type", ""))
    return given == match[2] and tag in (match[1], "shape") and case.begins(attributes["type"])


def row_of_refused(case, match):
    tag, kind = match[1], match[2]
    line = f"| {tag} `{kind}` |"
    if is_told("scene-format.md", line):
        return f"scene-format.md: {line}"
    line = next((row for row in lines_of("mitsuba.md") if row.startswith(f"| {tag} | `{kind}` |") and "| refused |" in row), None)
    assert line, f"neither mitsuba.md nor scene-format.md refuses the {tag} {kind}"
    return f"mitsuba.md: {line.split(' | refused')[0]} | refused"


def lacks_nori_row(case, match):
    tag, kind = match[1], match[2]
    row = f"| `{kind}` | `" if tag == "integrator" else f"| {tag} `{kind}` |"
    return names_type(case, match) and not is_told("scene-format.md", row)


def lacks_parameter(case, match):
    tag, kind, name = match[1], match[2], match[3]
    given = case.element[1].get("name") == name and case.begins(name)
    return given and case.around[-1:] and case.around[-1][1] == kind and case.around[-1][0] in (tag, "shape")


def parameter_of(case):
    """The name of the parameter in the element of XML at the place, if it is given there."""
    return case.element[1].get("name")


def given_at_object(case, match):
    """The parameter of XML that the message names stands in the object that it names, at the place or below it."""
    name, tag, kind = match.groups()[:3]
    objects = [*case.around, (case.element[0], case.element[1].get("type", ""))]
    return (tag, kind) in objects and (parameter_of(case) == name or f'name="{name}"' in case.rest.split(f"</{tag}>")[0])


def lacks_needed(case, match):
    """The object at the place has no child of that name, which it may have deeper."""
    tag, kind, name = match.groups()
    if not case.begins(tag) or case.element[1].get("type") != kind:
        return False
    depth, begin = 0, case.text.rfind("<", 0, len(case.before) + 1)
    for child in TAG.finditer(case.text, begin):
        if not child["tag"]:
            continue
        depth -= bool(child["close"])
        if depth == 0 and child.start() > begin:
            return True
        if depth == 1 and not child["close"] and dict(ATTRIBUTE.findall(child["attributes"])).get("name") == name:
            return False
        if child["empty"] and child.start() == begin:
            return True
        depth += not child["close"] and not child["empty"]
    return False


def names_idle_object(case, match):
    """An object at the place stands in the object that the message names, and has the name that it says, or none."""
    outer, kind, tag, name = match.groups()
    return case.begins(tag) and case.around[-1:] in ([(outer, kind)], [("shape", kind)]) and case.element[1].get("name") == name


def wants_other_tag(case, match):
    name, tag, kind, wanted, given = match.groups()
    element, attributes = case.element
    inside = case.around[-1:] == [(tag, kind)]
    return inside and element == given and attributes.get("name") == name and f"<{given}>" not in wanted


# pbrt.

DIRECTIVE = re.compile(r"^\s*[A-Z][A-Za-z]+\b", re.M)


def statement(case):
    """The directive at the place and its parameters, without what follows."""
    begin = max((m.start() for m in DIRECTIVE.finditer(case.before)), default=0)
    end = DIRECTIVE.search(case.rest)
    return case.before[begin:] + (case.rest[: end.start()] if end else case.rest)


def names_pbrt_type(case, match):
    directive, kind = match.groups()[:2]
    text = statement(case)
    return f'"{kind}"' in text and (directive in text or directive == "Material" and "MakeNamedMaterial" in text)


def gives(name, value=""):
    """A proof that the directive at the place has the parameter, and if a pattern is given, that value."""
    return lambda case, match: re.search(rf'"\w+ {name}"\s*\[?\s*"?{value}', statement(case)) is not None


def pbrt_row(case, match):
    return told_in("pbrt.md", f'| `{match[1]} "{match[2]}"` |')


def pbrt_word(case, match):
    line = next((row for row in lines_of("pbrt.md") if row.startswith(f"| `{match[1]}` |") and "| refused" in row), None)
    assert line, f"pbrt.md does not refuse the parameter {match[1]}"
    return f"pbrt.md: {line.rpartition(' | ')[0] if line.endswith('|') else line}"[:120]


def is_stretched(case):
    """The last matrix before the shape scales its axes otherwise, or leaves no right angle between them."""
    found = re.findall(r"(?:Concat)?Transform\s*\[([^\]]+)\]|Scale\s+(\S+)\s+(\S+)\s+(\S+)", re.sub(r"#.*", "", case.before))
    for matrix, *scale in found[-4:]:
        axes = [[float(x) for x in matrix.split()][4 * k : 4 * k + 3] for k in range(3)] if matrix else [[float(x)] for x in scale]
        lengths = [math.hypot(*axis) for axis in axes]
        dots = [sum(a * b for a, b in zip(axes[i], axes[j])) for i, j in ((0, 1), (0, 2), (1, 2))] if matrix else [0]
        if max(lengths) > 1.001 * min(lengths) or max(map(abs, dots)) > 1e-3 * max(lengths) ** 2:
            return True
    return False


def number(case, name, default):
    match = re.search(rf'"\w+ {name}"\s*\[?\s*([-+.\deE]+)', statement(case))
    return float(match[1]) if match else default


def is_unclosed(case, match):
    code = re.sub(r"#.*", "", case.text)
    begun, ended = (len(re.findall(rf"\b(?:Attribute|Transform){word}\b", code)) for word in ("Begin", "End"))
    return begun > ended and re.match(r"(?:Attribute|Transform)Begin", case.rest) is not None


def includes_many(case, match):
    """Counts the files that Include brings, as deep as they go, up to one more than are read."""
    def count(file, depth):
        total = 0
        for name in re.findall(r'^\s*(?:Include|Import)\s+"([^"]+)"', text_of(file), re.M):
            total += 1
            if total <= 256 and depth < 15:
                total += count(case.scene.parent / name, depth + 1)
        return total
    return count(case.scene, 0) > int(match[2])


def version_of_nvdb(case, match):
    data = (case.scene.parent / match[1]).read_bytes()
    return data[:7] == b"NanoVDB" and struct.unpack_from("<I", data, 8)[0] >> 21 != 32


def finer_than_a_file_may_be(case, match):
    """The grid of a cloud: 2 nodes in each cell of the finest noise, of which there are frequency times 15.7 or, with wispiness, 19.9."""
    corners = [re.search(rf'"point3 {name}"\s*\[([^\]]+)', statement(case)) for name in ("p0", "p1")]
    low, high = ([float(x) for x in c[1].split()] if c else [default] * 3 for c, default in zip(corners, (0, 1)))
    rate = 2 * number(case, "frequency", 5) * (19.9 if number(case, "wispiness", 1) > 0 else 15.7)
    return math.prod((b - a) * rate + 1 for a, b in zip(low, high)) > 2**24


# USD.

READ_IN_USD = ("Mesh", "Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane", "PointInstancer")


@functools.lru_cache(1)
def opened(stage):
    from pxr import Tf, Usd

    with Tf.DiagnosticTrap() as told:  # of what a stage lacks USD prints a line each
        found = Usd.Stage.Open(stage)
        told.Clear()
    return found


def stage_of(case):
    return opened(str(case.scene))


def shows_nothing(case, match):
    """No prim that docs/guide/usd.md lists has a shape, a size and a purpose that is rendered."""
    from pxr import UsdGeom

    for prim in stage_of(case).Traverse():
        image = UsdGeom.Imageable(prim)
        if prim.GetTypeName() in READ_IN_USD and image.ComputeVisibility() != "invisible" and image.ComputePurpose() in ("default", "render"):
            points = UsdGeom.Mesh(prim).GetPointsAttr().Get(0) if prim.IsA(UsdGeom.Mesh) else [0]
            if points and len(points):
                return False
    return True


def has_other_shapes(case, match):
    from pxr import UsdGeom

    return OUTSIDE if any(prim.IsA(UsdGeom.Gprim) and prim.GetTypeName() not in READ_IN_USD for prim in stage_of(case).Traverse()) else INCOMPLETE


def does_not_open(case, match):
    from pxr import Tf

    try:
        return not stage_of(case)
    except Tf.ErrorException:
        return True


def has_other_type(case, match):
    """An attribute of the prim, which the place names, is of another type than its schema says."""
    prim = stage_of(case).GetPrimAtPath(case.where)
    schema = prim.GetPrimDefinition()
    for attribute in prim.GetAuthoredAttributes():
        told = schema.GetSchemaAttributeSpec(attribute.GetName())
        if told and any(spec.typeName != told.typeName for spec in attribute.GetPropertyStack()):
            return True
    return False


def local_transform(case):
    from pxr import UsdGeom

    return UsdGeom.Xformable(stage_of(case).GetPrimAtPath(case.where)).GetLocalTransformation()


def is_composed_wrongly(case, match):
    return any(match[1] in str(error) for error in stage_of(case).GetCompositionErrors())


def asset_is_absent(case, match):
    """The asset lies neither beside the stage nor, by that path, beside any of its layers."""
    name = match[1].replace("\\", "/")
    folders = {case.scene.parent} | {pathlib.Path(layer.realPath).parent for layer in stage_of(case).GetUsedLayers() if layer.realPath}
    return not any((folder / name).exists() for folder in folders)


# glTF.

def json_value(case, match):
    return case.member(match["path"])


def is_no(kind):
    """A proof that the value at the message's path is not of this kind."""
    return lambda case, match: not isinstance(json_value(case, match), kind)


def requires(case, match):
    return json_value(case, match) == match["name"] and case.begins(f'"{match["name"]}"')


def is_no_whole_number(case, match):
    value = json_value(case, match)
    return isinstance(value, bool) or not isinstance(value, int) or not int(match["least"]) <= value <= int(match["most"])


def has_two_parents(case, match):
    children = [child for node in case.member("nodes") for child in node.get("children", [])] + [
        root for scene in case.member("scenes") for root in scene["nodes"]]
    return children.count(json_value(case, match)) > 1 or json_value(case, match) in reachable(case, json_value(case, match))


def reachable(case, node, seen=()):
    found = set()
    for child in case.member("nodes")[node].get("children", []):
        if child not in seen:
            found |= {child} | reachable(case, child, (*seen, child))
    return found


def values_of(case, index):
    """The numbers of an accessor of glTF that is not sparse, as they stand."""
    import base64

    accessor = case.member("accessors")[index]
    view = case.member("bufferViews")[accessor["bufferView"]]
    uri = case.member("buffers")[view["buffer"]].get("uri", "")
    if uri.startswith("data:"):
        data = base64.b64decode(uri.partition(",")[2])
    elif uri:
        data = (case.scene.parent / uri).read_bytes()
    else:
        whole = case.scene.read_bytes()
        data = whole[20 + struct.unpack_from("<I", whole, 12)[0] + 8 :]
    code = {5121: "B", 5123: "H", 5125: "I", 5126: "f"}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    step = view.get("byteStride", struct.calcsize(code) * width)
    begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    return [x for i in range(accessor["count"]) for x in struct.unpack_from(f"<{width}{code}", data, begin + i * step)]


def has_no_such_corner(case, match):
    mesh = case.member(match["path"].rpartition(".")[0])
    count = case.member("accessors")[mesh["attributes"]["POSITION"]]["count"]
    return count == int(match["count"]) <= int(match["corner"]) in values_of(case, mesh["indices"])


def is_not_finite(case, match):
    return any(not math.isfinite(x) for x in values_of(case, int(match["index"])))


def is_nori(case):
    return re.search(r"<(camera|mesh)\b", case.text) is not None


NORI_TABLE = "scene-format.md: | object of Nori | means here |"
NORI_PARAMETERS = "scene-format.md: | parameter | of | given as | default | meaning |"
PATH = r"(?P<path>[\w.\[\]]+): "

RULES = [
    Rule("file that is not there", r'(?:\S+: )?there is no file "(.+?)"', INCOMPLETE, file_is_absent, "-"),
    Rule("pointer of Git LFS", r'(?:\S+: )?"(.+?)" is a pointer of Git LFS', INCOMPLETE, file_is_pointer, "-"),
    Rule("parameter ${}", r"the parameter \$(\w+) is not defined: give it", INCOMPLETE,
         lambda case, match: f"${match[1]}" in case.rest[:80] and not re.search(rf'<default name="{match[1]}"', case.text), "-"),
    Rule('{} "{}"', r'the (\w+) "([^"]+)" is not supported: ', OUTSIDE, names_type, row_of_refused),
    Rule('{} "{}" of no Nori', r'Nori has no (\w+) "([^"]+)"', OUTSIDE, lacks_nori_row, NORI_TABLE),
    Rule("<{}> of no Nori", r"Nori has no element <(\w+)>", OUTSIDE,
         lambda case, match: case.begins(match[1]) and not is_told("scene-format.md", f"| {match[1]} `"), NORI_TABLE),
    Rule("parameter '{2}' of {0} \"{1}\"", r"(\w+) \"([^\"]+)\" has no parameter '([^']+)'", lambda case, match: OUTSIDE if is_nori(case) else WRONG,
         lacks_parameter, lambda case, match: NORI_PARAMETERS if is_nori(case) else "Mitsuba 3: unreferenced property"),
    Rule("<{}> in no object", r"<(\w+)> stands in no object: <scene> itself", OUTSIDE,
         lambda case, match: case.begins(match[1]) and [tag for tag, _ in case.around] == ["scene"], NORI_PARAMETERS),
    Rule("'{0}' of {1} \"{2}\" not here", r"'(\w+)' of (\w+) \"([^\"]+)\" has no meaning here", OUTSIDE, given_at_object, NORI_PARAMETERS),
    Rule("'{0}' of {1} \"{2}\" without fileName", r"'(\w+)' of (\w+) \"([^\"]+)\" only has a meaning with fileName", OUTSIDE, given_at_object,
         "scene-format.md: | `scale` | texture `imagetexture` |"),
    Rule("<{}> of no Mitsuba here", r"there is no element <(\w+)>", OUTSIDE,
         lambda case, match: case.begins(match[1]) and not is_told("scene-format.md", f"### {match[1]} "), "scene-format.md: # Scene format"),
    Rule("<{2}> in {0} \"{1}\"", r"(\w+) \"([^\"]+)\" has no use for a <(\w+)>(?: called '(\w+)')?", OUTSIDE, names_idle_object, NORI_PARAMETERS),
    Rule("<{4}> as '{0}' of {1} \"{2}\"", r"'(\w+)' of (\w+) \"([^\"]+)\" wants (.*), not <(\w+)>", OUTSIDE, wants_other_tag, NORI_PARAMETERS),
    Rule("{0} \"{1}\" without '{2}'", r"(\w+) \"([^\"]+)\" needs '(\w+)'", OUTSIDE, lacks_needed, NORI_PARAMETERS),
    Rule('{} "{}" of no Mitsuba', r'there is no (shape|bsdf|emitter|texture|integrator|medium|film) "(\w+)"', WRONG, names_type, "Mitsuba 3: Plugin not found"),
    Rule('{} "{}"', r'(\w+) "([^"]*)" is not read: ', OUTSIDE, names_pbrt_type, pbrt_row),
    Rule("'{0}' of {1} \"{2}\"", r"'(\w+)' of (\w+) \"([^\"]*)\" is not read: ", OUTSIDE, lambda case, match: gives(match[1])(case, match), pbrt_word),
    Rule("unclosed block", r"this is begun and not ended", WRONG, is_unclosed, "pbrt: Missing end to AttributeBegin"),
    Rule("more than {1} includes", r"includes are limited to (\d+) within each other and (\d+) altogether", OUTSIDE, includes_many, "pbrt.md: | `Include` |"),
    Rule('Camera "spherical" equalarea', r'Camera "spherical" has the mapping "(\w+)"', OUTSIDE,
         lambda case, match: gives("mapping", match[1])(case, match) or match[1] == "equalarea" and not gives("mapping")(case, match),
         "pbrt.md: | `mapping` | string | equalarea |"),
    Rule("encoding of an image", r'Texture "imagemap" has the encoding "([^"]+)"', OUTSIDE, lambda case, match: gives("encoding", match[1])(case, match),
         "pbrt.md: | `encoding` | string | sRGB |"),
    Rule("checkerboard in space", r'Texture "checkerboard" has another dimension than 2', OUTSIDE, gives("dimension", "[^2]"), "pbrt.md: | `dimension` | integer | 2 |"),
    Rule("cloud too fine", r'MakeNamedMedium "cloud" is too fine', OUTSIDE, finer_than_a_file_may_be, "pbrt.md: - **Clouds** by formula"),
    Rule("part of a {}", r'Shape "(\w+)" is cut off by phimax', OUTSIDE, lambda case, match: number(case, "phimax", 360) < 360, "pbrt.md: | `phimax` | float | 360 |"),
    Rule("hole of a disk", r'Shape "disk" has a hole', OUTSIDE, lambda case, match: number(case, "innerradius", 0) > 0, "pbrt.md: | `innerradius` | float | 0 |"),
    Rule("metal of pbrt alone", r'there is no metal "(\w+)" in the table', OUTSIDE, lambda case, match: f'"metal-{match[1]}-' in statement(case), "pbrt.md: - **Surfaces and media**"),
    Rule("stretched {}", r"to_world stretches this (sphere|cylinder)", OUTSIDE, lambda case, match: f'"{match[1]}"' in statement(case) and is_stretched(case),
         lambda case, match: told_in("scene-format.md", f"### shape `{match[1]}`")),
    Rule("image of roughness", r"'(\w+)' of Material \"\w+\" is an image", OUTSIDE, lambda case, match: gives(match[1])(case, match), "pbrt.md: | `roughness` | float or texture | 0 |"),
    Rule("index of refraction as a colour", r'the spectrum "((?:metal|glass)-[^"]+)" is an index of refraction', OUTSIDE,
         lambda case, match: match[1] in statement(case), "pbrt.md: - **Surfaces and media**"),
    Rule("NanoVDB of an old version", r"(\S+): a NanoVDB file of version ", OUTSIDE, version_of_nvdb, "odd-files.md: | NanoVDB files of another version than 32 |"),
    Rule("layer without shapes that are read", r"the stage shows nothing", has_other_shapes, shows_nothing, "../guide/usd.md: Curves, points, patches"),
    Rule("reference to nothing", r"Unresolved reference prim path @(?:.*?/)?([^/@]+)@", WRONG, is_composed_wrongly, "USD: a composition error"),
    Rule("attribute of another type", r"its points are not three finite numbers each|one of its values has another type than its schema requires", WRONG,
         has_other_type, "USD: the type of the attribute in its schema"),
    Rule("transform that is a perspective", r"its transform is a perspective", WRONG,
         lambda case, match: any(row[3] != last for row, last in zip(local_transform(case), (0, 0, 0, 1))), "USD: matrices of UsdGeomXformOp place, and have (0, 0, 0, 1) last"),
    Rule("no stage", r".* is no stage: ", WRONG, does_not_open, "USD: the stage does not open"),
    Rule("asset that is not there", r"Could not load sublayer @(.+?)@", INCOMPLETE, asset_is_absent, "-"),
    Rule("asset that is not there", r"Could not open asset @(.+?)@", INCOMPLETE, asset_is_absent, "-"),
    Rule("asset that is not there", r"the asset @(.+?)@ is not found", INCOMPLETE, asset_is_absent, "-"),
    Rule("glTF 1", r"asset\.version: the asset", OUTSIDE, lambda case, match: not str(case.member("asset.version")).startswith("2."), "gltf.md: | `asset` | version, minVersion |"),
    Rule("glTF 1", r"glTF of version 1 is not read", OUTSIDE, lambda case, match: case.scene.read_bytes()[4:8] == b"\1\0\0\0", "gltf.md: | `asset` | version, minVersion |"),
    Rule("{name}", PATH + r"(?P<name>\w+) is not read: ", OUTSIDE, requires, lambda case, match: told_in("gltf.md", f"| `{match['name']}` | refused")),
    Rule("{name}", PATH + r"(?P<name>\w+) is not known here, and the file can't do without it", OUTSIDE,
         lambda case, match: requires(case, match) and not is_told("gltf.md", f"| `{match['name']}`"), "gltf.md: What is refused is an error only if the file requires it"),
    Rule("wrong type", PATH + r"a list is wanted here", WRONG, is_no(list), "glTF validator: TYPE_MISMATCH"),
    Rule("wrong type", PATH + r"an object is wanted here", WRONG, is_no(dict), "glTF validator: TYPE_MISMATCH"),
    Rule("wrong type", PATH + r"a text is wanted here", WRONG, is_no(str), "glTF validator: TYPE_MISMATCH"),
    Rule("wrong type", PATH + r"this needs the index of a texture", WRONG,
         lambda case, match: not isinstance((json_value(case, match) or {}).get("index") if isinstance(json_value(case, match), dict) else None, int), "glTF validator: UNDEFINED_PROPERTY"),
    Rule("wrong type", PATH + r"a whole number from (?P<least>\d+) to (?P<most>\d+) is wanted here", WRONG, is_no_whole_number, "glTF validator: TYPE_MISMATCH or INVALID_INDEX"),
    Rule("loop of nodes", PATH + r"this node stands in the scene already", WRONG, has_two_parents, "glTF validator: NODE_LOOP"),
    Rule("index out of range", PATH + r"there is no corner (?P<corner>\d+): POSITION has (?P<count>\d+)", WRONG, has_no_such_corner, "glTF validator: ACCESSOR_INDEX_OOB"),
    Rule("number that is not finite", r"accessors\[(?P<index>\d+)\]: element \d+ is not a finite number", WRONG, is_not_finite, "glTF validator: ACCESSOR_INVALID_FLOAT"),
]
