"""The dashboard's pure functions, called in the browser that runs them."""
import hashlib
import json

import pytest

from stub_farm import StubFarm


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
    }})()""", timeout=60)

    assert text == hashlib.sha256(data[:size]).hexdigest()


@pytest.mark.parametrize("call, shown", [
    ("figure(0)", "0"), ("figure(null)", "–"), ("figure(0.0021)", "0.00210"), ("figure(7.2e-5)", "7.20 × 10⁻⁵"), ("figure(1234)", "1,230"),
    ("duration(0.42)", "0.4 s"), ("duration(59)", "59 s"), ("duration(252)", "4.2 min"), ("duration(4310)", "1 h 12 min"), ("duration(273600)", "3 d 4 h"), ("duration(null)", "–"),
    ("bytes(1536)", "1.5 KiB"), ("bytes(0)", "0 B"), ("percent(1)", "100 %"), ("percent(0.9999)", "99 %"), ("percent(0.001)", "1 %"), ("percent(0)", "0 %"),
])
def test_figures_are_written_for_people(modules, call, shown):
    assert modules.evaluate(f"import('/js/format.js').then(({{ figure, duration, bytes, percent }}) => {call})") == shown


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
