"""Which files are sent with a scene: those that it names, as the farm looks for them, none from outside."""

import gzip
import os

import pytest

from lightshaft import FileRefused
from lightshaft.scene_files import Folders, find_files, join, read_scene


def found(folder, text, given=None, allow=(), **options):
    """{name: bytes} of what would be sent with a scene of this text."""
    files = find_files(text.encode(), Folders(folder, allow, given), **options)
    return {name: source.read(0, source.size) for name, source in files.items()}


def mesh(name):
    return f'<shape type="ply"><string name="filename" value="{name}"/></shape>'


@pytest.fixture
def folder(tmp_path):
    """A scene's folder, beside a secret."""
    (tmp_path / "secret").write_bytes(b"secret")
    inside = tmp_path / "scene"
    for name in ("a.ply", "parts/b.ply", "frame_007.ply"):
        (inside / name).parent.mkdir(parents=True, exist_ok=True)
        (inside / name).write_bytes(name.encode())
    return inside


def test_files_are_known_by_the_names_that_the_farm_looks_for(folder):
    meshes = mesh("./a.ply") + mesh("b.ply") + mesh("gone.ply")
    text = f'<scene version="3.0.0"><path value="parts"/>{meshes}</scene>'
    assert found(folder, text) == {"a.ply": b"a.ply", "parts/b.ply": b"parts/b.ply"}


def test_names_of_windows_and_macos_are_found(folder):
    (folder / "man\u0303ana.ply").write_bytes(b"n")  # an n and its tilde apart, as macOS stores it
    windows, composed = "parts\\b.ply", "ma\u00f1ana.ply"
    text = f'<scene version="3.0.0">{mesh(windows)}{mesh(composed)}</scene>'
    assert found(folder, text) == {windows: b"parts/b.ply", composed: b"n"}


def test_scenes_may_be_packed_by_gzip(folder):
    more = gzip.compress(f'<scene version="3.0.0">{mesh("a.ply")}</scene>'.encode())
    (folder / "more.xml.gz").write_bytes(more)
    text = '<scene version="3.0.0"><include filename="more.xml.gz"/></scene>'
    assert found(folder, text) == {"more.xml.gz": more, "a.ply": b"a.ply"}
    (folder / "cut.xml.gz").write_bytes(more[:-9])
    with pytest.raises(FileRefused, match="cut.xml.gz is a gzip file that was cut short"):
        read_scene(folder / "cut.xml.gz")
    assert read_scene(folder / "more.xml.gz").startswith(b"<scene")


def test_parameters_are_put_in_the_longest_name_first(folder):
    text = (
        f'<scene version="3.0.0"><default name="dir" value="parts"/><default name="d" value="x"/>'
        f"{mesh('$dir/b.ply')}{mesh('$name')}</scene>"
    )
    assert set(found(folder, text, defines={"name": "a.ply"})) == {"parts/b.ply", "a.ply"}


def test_each_frame_has_its_files(folder):
    (folder / "frame_009.ply").write_bytes(b"9")
    text = f'<scene version="3.0.0">{mesh("frame_###.ply")}{mesh("f$frame")}</scene>'
    (folder / "f8").write_bytes(b"8")
    assert set(found(folder, text, frames="7-9")) == {"frame_007.ply", "frame_009.ply", "f8"}


def test_a_hash_in_the_name_of_a_folder_is_no_number_of_a_frame(folder):
    (folder / "shot#1").mkdir()
    (folder / "shot#1/f_2.ply").write_bytes(b"2")
    text = f'<scene version="3.0.0">{mesh("shot#1/f_#.ply")}</scene>'
    assert set(found(folder, text, frames="2-2")) == {"shot#1/f_2.ply"}


def test_included_files_are_sent_with_what_they_name(folder):
    (folder / "parts/more.xml").write_text(
        f'<scene version="3.0.0"><include filename="last.xml"/>{mesh("a.ply")}</scene>'
    )
    (folder / "parts/last.xml").write_text(
        f'<scene version="3.0.0">{mesh("parts/b.ply")}<include filename="more.xml"/></scene>'
    )
    text = '<scene version="3.0.0"><include filename="parts/more.xml"/></scene>'
    assert set(found(folder, text)) == {"parts/more.xml", "parts/last.xml", "a.ply", "parts/b.ply"}


@pytest.mark.parametrize(
    "name", ["../secret", "parts/../../secret", "{tmp}/secret", "link", "parts/link/secret"]
)
def test_nothing_outside_the_folder_is_sent(folder, tmp_path, name):
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "parts/link").symlink_to(tmp_path)
    text = f'<scene version="3.0.0">{mesh(name.format(tmp=tmp_path))}</scene>'

    with pytest.raises(FileRefused, match="allow="):
        found(folder, text)

    assert list(found(folder, text, allow=[tmp_path]).values()) == [b"secret"]


def test_an_included_file_outside_is_not_read(folder, tmp_path):
    (tmp_path / "outside.xml").write_text('<scene version="3.0.0"/>')
    with pytest.raises(FileRefused, match="outside.xml"):
        found(folder, '<scene version="3.0.0"><include filename="../outside.xml"/></scene>')


def test_given_files_go_first_and_may_be_in_memory(folder, tmp_path):
    text = f'<scene version="3.0.0">{mesh("a.ply")}{mesh("cloud.vol")}</scene>'
    given = {"./a.ply": b"mine", "cloud.vol": tmp_path / "secret", "unused": b"x"}
    assert found(folder, text, given) == {"a.ply": b"mine", "cloud.vol": b"secret"}


def test_folders_and_pipes_are_left_to_the_farm(folder):
    os.mkfifo(folder / "pipe")  # whoever opens it to read would wait for ever
    assert found(folder, f'<scene version="3.0.0">{mesh("pipe")}{mesh("parts")}{mesh("")}</scene>') == {}
    with pytest.raises(FileRefused, match="not a regular file"):
        found(folder, f'<scene version="3.0.0">{mesh("x")}</scene>', {"x": folder / "pipe"})


LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 9}">' for i in range(1, 40))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "<scene",
        "\x00\x01",
        f'<!DOCTYPE s [<!ENTITY l0 "l">{LAUGHS}]><scene version="3.0.0">{mesh("&l39;")}</scene>',
        '<!DOCTYPE s [<!ENTITY e SYSTEM "/etc/passwd">]><scene version="3.0.0">' + mesh("&e;") + "</scene>",
        '<!DOCTYPE s [<!ENTITY e "a.ply">]><scene version="3.0.0">' + mesh("&e;") + "</scene>",
    ],
    ids=["empty", "cut", "no text", "entities of entities", "entity of a file", "entity"],
)
def test_what_cannot_be_read_names_no_files(folder, text):
    assert found(folder, text) == {}


def test_a_parameter_of_parameters_does_not_grow_without_bound(folder):
    doubled = "".join(f'<default name="p{i}" value="$p{i - 1}$p{i - 1}"/>' for i in range(1, 200))
    assert (
        found(
            folder,
            f'<scene version="3.0.0"><default name="p0" value="ab"/>{doubled}{mesh("$p199")}</scene>',
        )
        == {}
    )


@pytest.mark.parametrize(
    "folder_name, name, expected",
    [
        ("", "a/./b/../c", "a/c"),
        ("x/y", "../z", "x/z"),
        ("x", "/abs", "/abs"),
        ("", "../../a", "../../a"),
        ("/a", "b//c", "/a/b/c"),
    ],
)
def test_names_are_joined_as_the_farm_does(folder_name, name, expected):
    assert join(folder_name, name) == expected
