"""Makes a Blender file of a run: blender -b --python open_run.py -- RUN_FOLDER FILM.glb OUT.blend

Bodies come from the .glb file that `archetide-sim export` writes, obstacles with them. Water is read from
RUN_FOLDER/frames/surface.*.ply when a frame is shown, by the script "archetide_water" inside the Blender file: allow it to
run when Blender asks (or start Blender with --enable-autoexec). Needs Blender 3.0 or later.
"""
import builtins
import json
import math
import os
import sys

import bpy
import mathutils
import numpy

WATER = '''
import os
import bpy
import numpy

FRAMES = {frames!r}  # folder of surface.NNNNNN.ply
FIRST = {first}      # frame of the run that is frame 0 here


def read_ply(path):
    """Vertices (n, 3) and triangles (m, 3) of a PLY file that archetide wrote."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\\n") + len(b"end_header\\n")
    words = data[:end].split()
    n, m = (int(words[words.index(b"element", i) + 2]) for i in (0, words.index(b"vertex") + 2))
    floats = numpy.frombuffer(data, "<f4", 6 * n, end).reshape(n, 6)
    face = numpy.dtype([("count", "u1"), ("corner", "<i4", 3)])
    return floats[:, :3], numpy.frombuffer(data, face, m, end + 24 * n)["corner"]


def show_water(scene, _=None):
    water = bpy.data.objects.get("water")
    path = os.path.join(bpy.path.abspath(FRAMES), "surface.%06d.ply" % (scene.frame_current + FIRST))
    if water is None or not os.path.exists(path):
        return
    vertices, triangles = read_ply(path)
    mesh = water.data
    mesh.clear_geometry()
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.ravel())
    mesh.loops.add(3 * len(triangles))
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, 3 * len(triangles), 3))
    mesh.polygons.foreach_set("loop_total", numpy.full(len(triangles), 3))
    mesh.polygons.foreach_set("use_smooth", numpy.ones(len(triangles), bool))
    mesh.update(calc_edges=True)


bpy.app.handlers.frame_change_pre[:] = [
    h for h in bpy.app.handlers.frame_change_pre if h.__name__ != "show_water"]
bpy.app.handlers.frame_change_pre.append(show_water)
show_water(bpy.context.scene)
'''


def import_bodies(path):
    for name in ("bool", "int", "float"):  # the importer of Blender 3 asks an older numpy for them
        if name not in vars(numpy):
            setattr(numpy, name, getattr(builtins, name))
    bpy.ops.import_scene.gltf(filepath=path)


def water_material():
    material = bpy.data.materials.new("water")
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    transmission = "Transmission" if "Transmission" in shader.inputs else "Transmission Weight"
    for name, value in (("Base Color", (0.75, 0.9, 0.95, 1)), ("Roughness", 0.02), ("IOR", 1.33), (transmission, 1.0)):
        shader.inputs[name].default_value = value
    return material


def add_water(run, first):
    water = bpy.data.objects.new("water", bpy.data.meshes.new("water"))
    water.data.materials.append(water_material())
    bpy.context.scene.collection.objects.link(water)
    text = bpy.data.texts.new("archetide_water.py")
    text.write(WATER.format(frames=os.path.join(os.path.abspath(run), "frames"), first=first))
    text.use_module = True  # runs when the file is opened
    exec(compile(text.as_string(), text.name, "exec"), {"__name__": "archetide_water"})


def add_camera_and_sun(low, high):
    middle, size = (low + high) / 2, (high - low).length
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = middle + size * mathutils.Vector((0.75, -1.45, 0.6))
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (math.radians(35), math.radians(20), 0), 4
    scene = bpy.context.scene
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.7, 0.8, 0.95, 1)


def main(run, film, out):
    with open(os.path.join(run, "manifest.json")) as file:
        manifest = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = max(1, round(manifest["fps"]))
    scene.render.engine = "CYCLES"
    import_bodies(film)
    scene.frame_start, scene.frame_end = 0, manifest["frames"] - 1
    grid = manifest["grid"]
    low = mathutils.Vector(grid["origin"])
    high = low + grid["cell"] * mathutils.Vector(grid["cells"])
    add_water(run, 0)
    add_camera_and_sun(low, high)
    scene.frame_set(0)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(out))


main(*sys.argv[sys.argv.index("--") + 1:])
