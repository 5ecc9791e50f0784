"""Hostile scenes in Mitsuba's XML, pbrt's text and glTF: names of other files, wrong sizes, great depth. The coordinator's `lightshaft-scene`
reads them: each is refused with an error message, or read in a time that its size allows."""

import io
import json
import struct
import zipfile

from attack_kit import LocalFarm, TINY, UNLIMITED, Bystander, ask, group, shown, still_serves

# Seconds in which a hostile scene is refused or read. A megabyte is read in a tenth of a second (docs/design/fuzzing.md), and none here
# has more than 32 MB; `lightshaft-scene` has 120 s at the very most (SECURITY.md).
SOON = 20
OPEN = '<scene version="3.0.0">'
GOOD = "as it should be"  # is taken: so the others come to the reader, and are refused for what they are
BALL = '<shape type="sphere"/>'


def zipped_of(files):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


def within(text):
    return TINY.replace("</scene>", text + "</scene>")


def xml():
    yield GOOD, TINY
    entity = '<!DOCTYPE scene [<!ENTITY a {}>]>'
    yield "an external entity", entity.format('SYSTEM "file:///etc/passwd"') + within('<bsdf type="diffuse" id="&a;"/><shape type="&a;"/>')
    yield "an external entity as text", entity.format('SYSTEM "/etc/passwd"') + within("&a;")
    yield "an entity by HTTP", entity.format('SYSTEM "http://127.0.0.1:1/x"') + within("&a;")
    yield "a parameter entity", '<!DOCTYPE scene [<!ENTITY % a SYSTEM "file:///etc/passwd"> %a;]>' + TINY
    yield "an external DTD", '<!DOCTYPE scene SYSTEM "file:///etc/passwd">' + TINY
    laughs = '<!ENTITY l0 "lol">' + "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12))
    yield "a billion laughs", f"<!DOCTYPE scene [{laughs}]>" + within('<bsdf type="diffuse" id="&l11;"/><shape type="&l11;"/>')
    yield "laughs by defaults", within('<default name="a0" value="lol"/>' + "".join(f'<default name="a{i}" value="{f"$a{i - 1}" * 10}"/>' for i in range(1, 12)) + BALL.replace("/>", '><string name="id" value="$a11"/></shape>'))
    yield "a default of itself", within('<default name="a" value="$a$a"/><default name="b" value="$b"/>')
    for name in ("/etc/passwd", "../../../../etc/passwd", "file:///etc/passwd", "http://127.0.0.1:1/a.xml", "\\\\host\\share", "a.xml", "scene.xml", "", "%2e%2e/a", "/dev/zero", "/proc/self/environ", "nul\tl"):
        yield f"include of {name!r}", OPEN + f'<include filename="{name}"/></scene>'
    for name in ("/etc/passwd", "/dev/zero", "/proc/self/mem", "../data/token", "http://127.0.0.1:1/a.png"):
        yield f"bitmap {name!r}", within(f'<texture type="bitmap"><string name="filename" value="{name}"/></texture>')
        yield f"mesh {name!r}", within(f'<shape type="ply"><string name="filename" value="{name}"/></shape>')
        yield f"grid {name!r}", within(f'<medium type="heterogeneous"><volume type="gridvolume" name="sigma_t"><string name="filename" value="{name}"/></volume></medium>')
    yield "a path element", OPEN + '<path value="/etc"/><include filename="passwd"/></scene>'
    yield "20,000 deep", OPEN + '<bsdf type="twosided">' * 20_000 + "</bsdf>" * 20_000 + "</scene>"
    yield "a million open elements", OPEN + "<a>" * 1_000_000
    yield "references that double 60 times", within('<bsdf type="diffuse" id="b0"/>' + "".join(f'<bsdf type="blendbsdf" id="b{i}"><ref id="b{i - 1}"/><ref id="b{i - 1}"/></bsdf>' for i in range(1, 60)) + '<shape type="sphere"><ref id="b59"/></shape>')
    yield "textures that double 60 times", within('<texture type="checkerboard" id="t0"/>' + "".join(f'<texture type="checkerboard" id="t{i}"><ref id="t{i - 1}" name="color0"/><ref id="t{i - 1}" name="color1"/></texture>' for i in range(1, 60)) + '<shape type="sphere"><bsdf type="diffuse"><ref id="t59" name="reflectance"/></bsdf></shape>')
    yield "a reference to itself", within('<bsdf type="twosided" id="a"><ref id="a"/></bsdf><shape type="sphere"><ref id="a"/></shape>')
    yield "references in a ring", within('<bsdf type="twosided" id="a"><ref id="b"/></bsdf><bsdf type="twosided" id="b"><ref id="a"/></bsdf><shape type="sphere"><ref id="a"/></shape>')
    yield "instances that double 60 times", within(f'<shape type="shapegroup" id="g0">{BALL}</shape>' + "".join(f'<shape type="shapegroup" id="g{i}">' + f'<shape type="instance"><ref id="g{i - 1}"/></shape>' * 2 + "</shape>" for i in range(1, 60)) + '<shape type="instance"><ref id="g59"/></shape>')
    yield "31 MB of blanks", OPEN + " " * 31_000_000 + "</scene>"
    yield "31 MB of one comment", OPEN + "<!--" + "a" * 31_000_000 + "--></scene>"
    yield "4 million comments", OPEN + "<!---->" * 4_000_000 + "</scene>"
    yield "31 MB in one attribute", OPEN + '<string name="n" value="' + "a" * 31_000_000 + '"/></scene>'
    yield "200,000 attributes", OPEN + "<shape " + " ".join(f'a{i}=""' for i in range(200_000)) + "/></scene>"
    yield "400,000 elements of no name", OPEN + "<q/>" * 400_000 + "</scene>"
    yield "33 MB", OPEN + " " * 33_000_000 + "</scene>"
    yield "a spectrum of a million numbers", within('<emitter type="constant"><spectrum name="radiance" value="' + ",".join(f"{400 + i * 1e-6}:1" for i in range(1_000_000)) + '"/></emitter>')
    yield "a number of 10 MB", within('<shape type="sphere"><float name="radius" value="' + "1" * 10_000_000 + '"/></shape>')
    for value in ("nan", "inf", "-inf", "1e400", "-1", "0", "0x1p2000", "1e-400", "1,5", "", "1 2"):
        yield f"a radius of {value!r}", within(f'<shape type="sphere"><float name="radius" value="{value}"/></shape>')
    for width in ("0", "-1", "2147483647", "4294967297", "1e9", "99999999999999999999"):
        yield f"a film of {width}", TINY.replace('name="width" value="16"', f'name="width" value="{width}"')
    yield "an expression as transform", within('<shape type="sphere"><transform name="to_world"><matrix value="' + "nan " * 16 + '"/></transform></shape>')
    yield "UTF-16", TINY.encode("utf-16")
    yield "UTF-32 by its name", '<?xml version="1.0" encoding="UTF-32"?>' + TINY
    yield "broken UTF-8", TINY.encode().replace(b"volpath", b"vol\xff\xfepath")
    yield "NUL in the text", TINY.replace("volpath", "vol\0path")
    yield "NUL by a reference", TINY.replace("volpath", "vol&#0;path")
    yield "markup in names", within('<bsdf type="&lt;script&gt;alert(1)&lt;/script&gt;" id="&lt;img src=x onerror=alert(1)&gt;"/>')
    yield "nothing", ""
    yield "another document", "<html><script>alert(1)</script></html>"
    yield "a plugin by its path", within('<bsdf type="/usr/lib/libevil.so"/>')
    yield "a plugin that is a method", within('<bsdf type="__class__"/>')


def pbrt():
    head = 'Film "rgb" "integer xresolution" 16 "integer yresolution" 16\nCamera "perspective"\nWorldBegin\nLightSource "infinite"\n'
    yield GOOD, head + 'Shape "sphere"\n'
    for name in ("/etc/passwd", "../../../etc/passwd", "file:///etc/passwd", "http://127.0.0.1:1/a", "a.pbrt", "", "/dev/zero"):
        yield f"Include {name!r}", head + f'Include "{name}"\n'
        yield f"Import {name!r}", head + f'Import "{name}"\n'
    for name in ("/etc/passwd", "../token"):
        yield f"plymesh {name!r}", head + f'Shape "plymesh" "string filename" "{name}"\n'
        yield f"imagemap {name!r}", head + f'Texture "t" "spectrum" "imagemap" "string filename" "{name}"\n'
    yield "200,000 AttributeBegin", head + "AttributeBegin\n" * 200_000
    yield "AttributeEnd alone", head + "AttributeEnd\n" * 1000
    yield "a million of [", head + 'Shape "sphere" "float radius" ' + "[" * 1_000_000
    yield "objects that double", head + 'ObjectBegin "a0"\nShape "sphere"\nObjectEnd\n' + "".join(f'ObjectBegin "a{i}"\nObjectInstance "a{i - 1}"\nObjectInstance "a{i - 1}"\nObjectEnd\n' for i in range(1, 60)) + 'ObjectInstance "a59"\n'
    yield "textures that double", head + 'Texture "t0" "spectrum" "constant"\n' + "".join(f'Texture "t{i}" "spectrum" "mix" "texture tex1" "t{i - 1}" "texture tex2" "t{i - 1}"\n' for i in range(1, 60)) + 'Material "diffuse" "texture reflectance" "t59"\nShape "sphere"\n'
    yield "materials in a ring", head + 'MakeNamedMaterial "a" "string type" "mix" "string materials" ["b" "b"]\nMakeNamedMaterial "b" "string type" "mix" "string materials" ["a" "a"]\nNamedMaterial "a"\nShape "sphere"\n'
    yield "28 MB of numbers", head + 'Shape "trianglemesh" "integer indices" [' + "0 " * 14_000_000 + "]\n"
    yield "a string that does not end", head + '"' + "a" * 1_000_000
    yield "a number that is none", head + 'Shape "sphere" "float radius" 1e999\n'
    yield "NaN", head + 'Shape "sphere" "float radius" nan\n'
    yield "an index of 2^31", head + 'Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2147483647]\n'
    yield "an index of -1", head + 'Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 -1]\n'
    yield "a film of 2^31", head.replace("16", "2147483647")
    yield "NUL", head.replace("perspective", "per\0spective")


def gltf_text(**more):
    return json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                       "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                       "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
                       "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + "A" * 48}], **more})


def glb(text, version=2, length=None, chunk=None, kind=0x4E4F534A, binary=b""):
    text = text.encode() + b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text) if chunk is None else chunk, kind) + text + (struct.pack("<II", len(binary), 0x4E4942) + binary if binary else b"")
    return b"glTF" + struct.pack("<II", version, 12 + len(body) if length is None else length) + body


def gltf():
    yield GOOD, gltf_text()
    for uri in ("/etc/passwd", "../../../etc/passwd", "file:///etc/passwd", "http://127.0.0.1:1/a", "%2e%2e/%2e%2e/token", "", "data:,", "data:application/octet-stream;base64,%%%", "/dev/zero", "a\0b"):
        yield f"buffer {uri!r}", gltf_text(buffers=[{"byteLength": 36, "uri": uri}])
        yield f"image {uri!r}", gltf_text(images=[{"uri": uri}], textures=[{"source": 0}], materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}], meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}])
    for count in (2 ** 31, 2 ** 63, 2 ** 64, -1, 0, 1.5, 1e300, "3", None):
        yield f"an accessor of {count}", gltf_text(accessors=[{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}])
        yield f"a view at {count}", gltf_text(bufferViews=[{"buffer": 0, "byteOffset": count, "byteLength": 36}])
        yield f"a buffer of {count}", gltf_text(buffers=[{"byteLength": count, "uri": "data:application/octet-stream;base64," + "A" * 48}])
    yield "a sparse accessor of 2^31", gltf_text(accessors=[{"componentType": 5126, "count": 2 ** 31 - 1, "type": "VEC3", "sparse": {"count": 1, "indices": {"bufferView": 0, "componentType": 5125}, "values": {"bufferView": 0}}}])
    yield "a node that is its own child", gltf_text(nodes=[{"mesh": 0, "children": [0]}])
    yield "nodes in a ring", gltf_text(nodes=[{"children": [1]}, {"children": [0]}])
    yield "nodes that double 60 times", gltf_text(nodes=[{"children": [i + 1, i + 1]} for i in range(60)] + [{"mesh": 0}])
    yield "100,000 nodes deep", gltf_text(nodes=[{"children": [i + 1]} for i in range(100_000)] + [{"mesh": 0}])
    yield "indices out of range", gltf_text(nodes=[{"mesh": 10 ** 9}])
    yield "indices below zero", gltf_text(scenes=[{"nodes": [-1]}])
    yield "JSON 100,000 deep", '{"asset":' + "[" * 100_000
    yield "28 MB of numbers", '{"asset":{"version":"2.0"},"extras":[' + "0," * 14_000_000 + "0]}"
    yield "version 3", gltf_text(asset={"version": "3.0"})
    yield "another type", "[]"


def glbs():
    good = gltf_text()
    for label, data in ((GOOD, glb(good)), ("a length of 0", glb(good, length=0)), ("a length of 4 GB", glb(good, length=2 ** 32 - 1)), ("a chunk of 4 GB", glb(good, chunk=2 ** 32 - 1)), ("a chunk of 0", glb(good, chunk=0)), ("version 1", glb(good, version=1)),
                        ("a chunk of another kind", glb(good, kind=0x4E4942)), ("cut in its head", glb(good)[:15]), ("cut in its text", glb(good)[:100]), ("only its head", b"glTF"), ("two texts", glb(good) + glb(good)[12:])):
        yield label, data


def attempt_all(record, farm, texts, send):
    for label, text in texts:
        with record.expecting(label):
            answer = send(text if isinstance(text, bytes) else text.encode())
            read = answer.status == 201 or b"the numbers here are a file" in answer.body  # which `lightshaft submit` cuts from a glTF and sends along
            right = answer.status in (201, 400, 413, 415, 422) and (read or label != GOOD) and answer.seconds < SOON and b"root:x:" not in answer.body
            record.attempt(label, right, shown(answer))
            if answer.status == 201:
                ask(farm, "DELETE", f"/api/v1/jobs/{json.loads(answer.body)['id']}", farm.mallory)


@group("Scenes as text: XML, pbrt, glTF", quick=True)
def scene_texts(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        farm.mallory = farm.token_of("mallory")
        bob = Bystander(farm)

        def bundle(name):
            return lambda text: ask(farm, "POST", "/api/v1/jobs?spp=2", farm.mallory, zipped_of({name: text, "job.json": json.dumps({"scene": name})}), "application/zip", patience=180)

        large = 3_000_000

        def chosen(texts):
            return ((label, text) for label, text in texts if not record.quick or len(text) < large)

        with bob.watching():
            record.row = "XML: entities, laughs, files and addresses of others, depth, doubling references, 31 MB of one thing, numbers, encodings"
            attempt_all(record, farm, chosen(xml()), lambda text: ask(farm, "POST", "/api/v1/jobs?spp=2", farm.mallory, text, "application/xml", patience=180))
            record.row = "pbrt: files of others, depth, doubling objects and textures, rings, 28 MB arrays, indices"
            attempt_all(record, farm, chosen(pbrt()), bundle("a.pbrt"))
            record.row = "glTF and GLB: addresses, sizes up to 2^64, rings and doubling graphs, depth, lengths that lie"
            attempt_all(record, farm, chosen(gltf()), bundle("a.gltf"))
            attempt_all(record, farm, glbs(), bundle("a.glb"))
        record.row = "another user meanwhile: no request refused, none longer than a second"
        record.attempt("beside all of them", bob.served(), f"{bob.told()} {bob.refused[:2]}")
        record.row = "afterwards"
        still_serves(record, farm, bob.token)
        record.attempt("a scene is read", bob.submits(), bob.refused[-1:])
