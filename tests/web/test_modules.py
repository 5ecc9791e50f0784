"""The dashboard's pure functions, called in the browser that runs them."""
import hashlib
import json
import pathlib

import pytest

from stub_farm import StubFarm

SHOWN = pathlib.Path(__file__).resolve().parents[1] / "support/shown.json"


@pytest.fixture(scope="module")
def modules(browser):
    with StubFarm() as farm:
        page = browser.open(f"{farm.url}/demo.html")
        yield page
        page.close()


@pytest.mark.parametrize("size", [0, 3, 55, 56, 63, 64, 65, 1000, 4 * 2**20, 4 * 2**20 + 17])
def test_own_sha256_agrees_with_a_known_one(modules, size):
    """The fallback for insecure contexts, at the edges of its blocks and pieces."""
    data = bytes(i * 7 % 251 for i in range(251)) * (size // 251 + 1)
    text = modules.evaluate(f"""(async () => {{
      const {{ sha256Streaming }} = await import("/js/sha256.js");
      const bytes = Uint8Array.from({{length: {size}}}, (_, i) => i % 251 * 7 % 251);
      return sha256Streaming(new File([bytes], "x"));
    }})()""")

    assert text == hashlib.sha256(data[:size]).hexdigest()


@pytest.mark.parametrize("what, module, function", [
    ("figure", "format", "figure"), ("given", "format", "given"), ("duration", "format", "duration"), ("count", "format", "count"), ("samples", "format", "spp"),
    ("bytes", "format", "bytes"), ("percent", "format", "percent"), ("error_ticks", "plot_scale", "errorTicks"), ("time_ticks", "plot_scale", "timeTicks")])
def test_figures_and_ticks_are_shown_as_in_reports(modules, what, module, function):
    """The report's own are held to the same table by words_test.cpp and log_axis_test.cpp."""
    for value, shown in json.loads(SHOWN.read_text())[what]:
        call = f"f({json.dumps(value)})" if not what.endswith("ticks") else f"f({{ lo: {value[0]}, hi: {value[1]} }}).map((t) => t.label).filter(Boolean)"
        assert modules.evaluate(f"import('/js/{module}.js').then(({{ {function}: f }}) => {call})") == shown, value


@pytest.mark.parametrize("path, main, name", [
    ("bath.xml", "bath.xml", "bath.xml"), ("a/meshes/x.obj", "a/s.xml", "meshes/x.obj"), ("t/x.png", "a/s.xml", "../t/x.png"), ("x.obj", "a/b/s.xml", "../../x.obj")])
def test_files_are_named_as_seen_from_the_scene(modules, path, main, name):
    assert modules.evaluate(f"import('/js/bundle.js').then(({{ relative }}) => relative({json.dumps(path)}, {json.dumps(main)}))") == name


@pytest.mark.parametrize("before, after, touched", [
    ("abc", "bcd", "ad"),  # the first goes and one comes: what stays is not moved
    ("abc", "abc", ""), ("abc", "ac", "b"), ("", "ab", "ab"), ("ab", "", "ab"), ("ab", "axb", "x")])
def test_patch_touches_only_what_changed(modules, before, after, touched):
    """A moved element would start its animation again and lose the focus."""
    found = modules.evaluate(f"""(async () => {{
      const {{ h, patch }} = await import("/js/dom.js");
      const place = document.createElement("div");
      const show = (keys) => patch(place, ...[...keys].map((key) => h("p", {{ key, id: key }}, key)));
      show({json.dumps(before)});
      const watcher = new MutationObserver(() => {{}});
      watcher.observe(place, {{ childList: true }});
      show({json.dumps(after)});
      const nodes = watcher.takeRecords().flatMap((record) => [...record.addedNodes, ...record.removedNodes]);
      return [nodes.map((node) => node.id).sort().join(""), place.textContent];
    }})()""")

    assert found == [touched, after]


def plan(modules, files, main="main.xml"):
    """{name: text} of what bundle.js would send, and what it misses."""
    return modules.evaluate(f"""(async () => {{
      const {{ plan }} = await import("/js/bundle.js");
      const files = Object.entries({json.dumps(files)}).map(([path, text]) => ({{ path, file: new File([text], path.split("/").pop()) }}));
      const {{ assets, missing, unused }} = await plan(files, {json.dumps(main)});
      const texts = await Promise.all(assets.map(async ({{ name, file }}) => [name, await file.text()]));
      return {{ assets: Object.fromEntries(texts), missing, unused }};
    }})()""")


@pytest.mark.parametrize("paths, sorted_paths", [
    (["shot/assets.zip", "shot/scenes/main.xml"], ["shot/scenes/main.xml", "shot/assets.zip"]),
    (["a.tar.gz", "deep/er/s.pbrt", "deep/s.gltf"], ["deep/s.gltf", "deep/er/s.pbrt", "a.tar.gz"]),
    (["b/all.zip", "all.zip", "notes.txt"], ["all.zip", "b/all.zip"])])
def test_a_scene_comes_before_archives_however_deep_it_lies(modules, paths, sorted_paths):
    assert modules.evaluate(f"import('/js/bundle.js').then(({{ scenesAmong }}) => scenesAmong({json.dumps(paths)}.map((path) => ({{ path }}))))") == sorted_paths


@pytest.mark.parametrize("files, uri, sent, missing", [
    ({"100%.png": "p"}, "100%.png", {"100%.png": "p"}, []), ({}, "100%.png", {}, ["100%.png"]), ({"a b.png": "p"}, "a%20b.png", {"a b.png": "p"}, [])])
def test_a_name_in_a_gltf_that_can_not_be_decoded_is_kept(modules, files, uri, sent, missing):
    planned = plan(modules, {"main.gltf": json.dumps({"images": [{"uri": uri}]}), **files}, main="main.gltf")

    assert planned == {"assets": sent, "missing": missing, "unused": []}


def scene(*children):
    return f"<scene version='3.0.0'>{''.join(children)}</scene>"


def mesh(name):
    return f"<shape type='obj'><string name='filename' value='{name}'/></shape>"


def include(name):
    return f"<include filename='{name}'/>"


def test_an_include_is_looked_for_beside_the_file_that_includes_it(modules):
    inner = scene(mesh("right.obj"))
    planned = plan(modules, {
        "main.xml": scene(include("parts/a.xml")), "parts/a.xml": scene(include("b.xml")), "parts/b.xml": inner,
        "b.xml": scene(mesh("wrong.obj")), "right.obj": "r", "wrong.obj": "w"})

    assert set(planned["assets"]) == {"parts/a.xml", "parts/b.xml", "right.obj"}
    assert planned["assets"]["parts/b.xml"] == inner
    assert planned["missing"] == [] and set(planned["unused"]) == {"b.xml", "wrong.obj"}


def test_paths_are_searched_the_latest_first(modules):
    planned = plan(modules, {
        "main.xml": scene("<path value='old'/>", mesh("x.obj"), include("part.xml"), "<path value='new'/>"),
        "x.obj": "beside", "old/x.obj": "old", "new/x.obj": "new",
        "old/part.xml": scene("<!-- old -->"), "new/part.xml": scene("<!-- new -->")})

    assert planned["assets"]["new/x.obj"] == "new", "a mesh is looked for in all paths"
    assert "old/part.xml" in planned["assets"], "an include only in those that stand before it"
    assert len(planned["assets"]) == 2


def test_a_file_that_includes_itself_is_left_to_the_coordinator(modules):
    planned = plan(modules, {"main.xml": scene(include("a.xml")), "a.xml": scene(include("a.xml"), mesh("x.obj"))})

    assert set(planned["assets"]) == {"a.xml"} and planned["missing"] == ["x.obj"]


def test_parameters_in_names_take_all_files_along(modules):
    planned = plan(modules, {"main.xml": scene(mesh("$what.obj")), "x.obj": "x", "deep/y.obj": "y"})

    assert set(planned["assets"]) == {"x.obj", "deep/y.obj"}


def test_a_picture_that_failed_is_asked_for_again_without_a_new_version(modules):
    painted = modules.evaluate("""(async () => {
      await import("/js/live_image.js");
      const image = document.createElement("live-image");
      let asked = 0;
      image.source = async () => {
        asked += 1;
        if (asked < 3) throw new Error("away");
        return Object.assign(document.createElement("canvas"), { width: 4, height: 4 });
      };
      image.version = 1;
      document.body.append(image);
      const end = performance.now() + 15_000;
      while (!image.dataset.painted && performance.now() < end) await new Promise(requestAnimationFrame);
      image.remove();
      return [image.dataset.painted, asked];
    })()""")

    assert painted == ["1", 3]


def test_data_that_looks_like_a_node_is_shown_as_text(modules):
    shown = modules.evaluate("""(async () => {
      const { h, patch } = await import("/js/dom.js");
      const place = document.createElement("div");
      patch(place, h("p", null, JSON.parse('{"tag": "img", "key": null, "attributes": {"src": "/evil"}, "children": []}')));
      return [place.querySelectorAll("img").length, place.textContent];
    })()""")

    assert shown == [0, "[object Object]"]
