"""Imports every .glb below some folders into Blender (`bpy` from PyPI) and checks that it sees as many vertices and
triangles as the files say. Blender imports nodes outside of the scene too, so that is all levels.

    python3 -m pip install --target target/bpy bpy==5.0.1 "numpy<2"
    PYTHONPATH=target/bpy python3 .ci/blender.py out/avenue out/palms

Packed files (`.web.glb`) are left out: Blender's importer does not know EXT_meshopt_compression. Exit code 1 when counts
differ or a file can not be imported.
"""

import json
import struct
import sys
from pathlib import Path

import bpy


def stated(path):
    """Vertices and triangles of the meshes of all nodes, as the file tells them."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    root = json.loads(data[20 : 20 + length])
    vertices = triangles = 0
    for node in root.get("nodes", []):
        for primitive in root["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            vertices += root["accessors"][primitive["attributes"]["POSITION"]]["count"]
            triangles += root["accessors"][primitive["indices"]]["count"] // 3
    return vertices, triangles


def seen(path):
    """The same as Blender has them after import."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path), merge_vertices=False)
    vertices = triangles = 0
    # Bones of clips bring shapes of their own, which no collection of the scene shows.
    for thing in bpy.context.scene.objects:
        if thing.type == "MESH":
            thing.data.calc_loop_triangles()
            vertices += len(thing.data.vertices)
            triangles += len(thing.data.loop_triangles)
    return vertices, triangles


def main():
    files = sorted(f for folder in sys.argv[1:] for f in Path(folder).rglob("*.glb") if not f.name.endswith(".web.glb"))
    if not files:
        sys.exit("no .glb file found")
    faults = 0
    for file in files:
        try:
            said, found = stated(file), seen(file)
        except Exception as error:  # whatever an importer may raise
            print(f"FAILED {file.name}: {error}")
            faults += 1
            continue
        same = said == found
        faults += not same
        print(f"{'ok    ' if same else 'FAILED'} {file.name}: {said[0]} vertices, {said[1]} triangles; Blender "
              + ("the same" if same else f"{found[0]} and {found[1]}"))
    sys.exit(1 if faults else 0)


main()
