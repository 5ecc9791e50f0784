#!/usr/bin/env python3
"""Animated glTF by others at some seconds: where our corners stand, and where Blender's import puts them.

usage: gltf_poses.py FOLDER --blender PYTHON [--times T,...] [SCENE...]
FOLDER holds the folder Models of KhronosGroup/glTF-Sample-Assets ; SCENE is a path in it, by default the
skins and morph targets of SCENES. PYTHON has bpy 5 (tests/venv.sh blender). For each scene and second: the largest distance of a corner of
one to the nearest corner of the other, over the diagonal of the box around Blender's. Nothing is rendered. A bench, not a test: needs numpy and scipy.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

SCENES = [f"{name}/glTF-Binary/{name}.glb" for name in ("CesiumMan", "RiggedFigure", "Fox", "BrainStem", "AnimatedMorphCube", "AnimatedMorphSphere", "MorphStressTest")]


def blender_corners(scene_file, times, out):
    """Runs within Blender's Python. Blender turns +y of glTF to +z."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=scene_file)
    scene = bpy.context.scene
    shapes_of_bones = {item for group in bpy.data.collections if group.name.startswith("glTF_not_exported") for item in group.objects}
    found = {}
    for time in times:
        frame = float(time) * scene.render.fps / scene.render.fps_base
        scene.frame_set(int(frame), subframe=frame % 1)
        corners = []
        for instance in bpy.context.evaluated_depsgraph_get().object_instances:
            item = instance.object
            if item.type != "MESH" or item.original in shapes_of_bones:
                continue
            points = np.empty(3 * len(item.data.vertices), np.float32)
            item.data.vertices.foreach_get("co", points)
            matrix = np.array(instance.matrix_world)
            world = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
            corners.append(np.stack([world[:, 0], world[:, 2], -world[:, 1]], 1))
        found[time] = np.concatenate(corners)
    np.savez(out, **found)


def ply_corners(path):
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    width = sum(line.startswith("property float") for line in lines)
    return np.frombuffer(body, "<f4", count * width).reshape(count, width)[:, :3].astype(float)


def our_corners(xml):
    root, groups, all_corners = ElementTree.parse(xml).getroot(), {}, []

    def placed(shape, points):
        matrix = shape.find("transform[@name='to_world']/matrix")
        if matrix is None:
            return points
        m = np.array(matrix.get("value").split(), float).reshape(4, 4)
        return points @ m[:3, :3].T + m[:3, 3]

    def corners_of(shape):
        return placed(shape, ply_corners(xml.parent / shape.find("string[@name='filename']").get("value")))

    for shape in root.iter("shape"):
        if shape.get("type") == "shapegroup":
            groups[shape.get("id")] = np.concatenate([corners_of(s) for s in shape.findall("shape")])
    for shape in root.findall("shape"):
        if shape.get("type") == "ply":
            all_corners.append(corners_of(shape))
        elif shape.get("type") == "instance":
            all_corners.append(placed(shape, groups[shape.find("ref").get("id")]))
    return np.concatenate(all_corners)


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, errors="replace")
    if done.returncode:
        sys.exit(f"{command[0]} failed:\n{done.stdout}{done.stderr}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--blender", required=True)
    parser.add_argument("--times", default="0.5,1.2,3")
    options = parser.parse_args()
    from agreement import BIN
    from scipy.spatial import KDTree

    times = options.times.split(",")
    print("| scene | corners, ours and Blender's | " + " | ".join(f"{t} s" for t in times) + " |\n|---|---|" + "---|" * len(times))
    for name in options.scenes or SCENES:
        scene = (options.folder / name).resolve()
        with tempfile.TemporaryDirectory() as folder:
            run(options.blender, __file__, "--as-blender", scene, pathlib.Path(folder, "theirs.npz"), *times)
            theirs = np.load(pathlib.Path(folder, "theirs.npz"))
            cells = []
            for time in times:
                xml = pathlib.Path(folder, time, "scene.xml")
                xml.parent.mkdir()
                run(BIN / "lightshaft", "convert", scene, xml, "-D", f"time={time}")
                a, b = our_corners(xml), theirs[time]
                diagonal = np.linalg.norm(np.ptp(b, axis=0))
                cells.append(f"{max(KDTree(b).query(a)[0].max(), KDTree(a).query(b)[0].max()) / diagonal:.1e}")
        print(f"| {scene.stem} | {len(a)}, {len(b)} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--as-blender"]:
        blender_corners(sys.argv[2], sys.argv[4:], sys.argv[3])
    else:
        main()
