"""The lines that Blender's Line Art and Freestyle find, of meshes and views that `ink.py` hands over; runs in a Python that has
bpy.

    python ink_peers.py FOLDER CASE lineart|freestyle

FOLDER has CASE.positions (float32, three a vertex), CASE.triangles (uint32) and CASE.views: a line a frame with the camera's
matrix by columns, its horizontal field of view in radians, width and height. Written are CASE-TOOL.lines, a line a
stroke: frame, closed (0 or 1), x and y of each point in pixels; and CASE-TOOL.seconds, a line a frame: wall and processor time.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

# Faces that meet at more are a crease, as Yugen has it.
CREASE = np.radians(40.0)


def mesh(folder, case):
    """With vertices in one place as one: both programs take a double for a border."""
    rows = np.fromfile(folder / f"{case}.positions", np.float32).reshape(-1, 3)
    triangles = np.fromfile(folder / f"{case}.triangles", np.uint32).reshape(-1, 3)
    _, first, which = np.unique(np.round(rows, 5), axis=0, return_index=True, return_inverse=True)
    triangles = which.reshape(-1)[triangles]
    whole = [len(set(t)) == 3 for t in triangles.tolist()]
    made = bpy.data.meshes.new(case)
    made.from_pydata(rows[first].tolist(), [], triangles[whole].tolist())
    made.shade_smooth()
    made.set_sharp_from_angle(angle=CREASE)
    made.update()
    return made


def scene(folder, case):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new(case, mesh(folder, case)))
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.clip_start = "HORIZONTAL", 0.01
    scene.camera = bpy.data.objects.new("camera", lens)
    scene.collection.objects.link(scene.camera)
    return scene


def views(folder, case):
    for line in (folder / f"{case}.views").read_text().splitlines():
        numbers = [float(word) for word in line.split()]
        matrix = Matrix(np.array(numbers[:16]).reshape(4, 4).T.tolist())
        # Yugen's cameras look along +z with +x to the left.
        yield matrix @ Matrix.Diagonal((-1, 1, -1, 1)), numbers[16], [int(n) for n in numbers[17:]]


def look(scene, view):
    matrix, fov, (width, height) = view
    scene.camera.matrix_world, scene.camera.data.angle_x = matrix, fov
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100


def to_pixels(view, points):
    matrix, fov, (width, height) = view
    seen = np.c_[points, np.ones(len(points))] @ np.array(matrix.inverted()).T
    scale = 0.5 * width / np.tan(0.5 * fov)
    return np.c_[0.5 * width - seen[:, 0] / seen[:, 2] * scale, 0.5 * height + seen[:, 1] / seen[:, 2] * scale]


def lineart(scene, views):
    """Contours and creases from the evaluated drawing."""
    drawing = bpy.data.grease_pencils.new("drawing")
    drawing.layers.new("lines").frames.new(scene.frame_current)
    ink = bpy.data.materials.new("ink")
    bpy.data.materials.create_gpencil_data(ink)
    drawing.materials.append(ink)
    holder = bpy.data.objects.new("drawing", drawing)
    scene.collection.objects.link(holder)
    modifier = holder.modifiers.new("lines", "LINEART")
    modifier.source_type, modifier.target_layer, modifier.target_material = "SCENE", "lines", ink
    for kind in ("contour", "loose", "crease", "material", "edge_mark", "intersection"):
        setattr(modifier, f"use_{kind}", kind in ("contour", "crease"))
    modifier.crease_threshold = np.pi - CREASE
    modifier.use_crease_on_smooth = True
    for view in views:
        look(scene, view)
        wall, processor = time.perf_counter(), time.process_time()
        graph = bpy.context.evaluated_depsgraph_get()
        graph.update()
        found = holder.evaluated_get(graph).data.layers[0].frames[0].drawing
        yield [time.perf_counter() - wall, time.process_time() - processor], [
            (s.cyclic, to_pixels(view, np.array([p.position for p in s.points]))) for s in found.strokes
        ]


def freestyle(scene, views):
    """Silhouettes, contours, creases and borders, smooth, as its own chains; the time of a picture without it is taken off."""
    from freestyle.types import StrokeShader
    import parameter_editor

    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.max_bounces = 0
    layer = scene.view_layers[0]
    lines = layer.freestyle_settings.linesets.new("lines") if not layer.freestyle_settings.linesets else layer.freestyle_settings.linesets[0]
    lines.linestyle = bpy.data.linestyles.new("lines")
    lines.visibility = "VISIBLE"
    for kind in ("silhouette", "border", "crease", "contour", "external_contour", "suggestive_contour", "edge_mark",
                 "material_boundary", "ridge_valley"):
        if hasattr(lines, f"select_{kind}"):
            setattr(lines, f"select_{kind}", kind in ("silhouette", "border", "crease", "contour"))
    layer.freestyle_settings.use_smoothness = True
    layer.freestyle_settings.crease_angle = np.pi - CREASE
    layer.use_freestyle = True
    found = []

    class Keep(StrokeShader):
        def shade(self, stroke):
            found.append(np.array([[v.point[0], v.point[1]] for v in stroke]))

    parameter_editor.callbacks_modifiers_post.append(lambda *_: [Keep()])
    for view in views:
        look(scene, view)
        spent = []
        for on in (False, True):
            scene.render.use_freestyle = on
            found.clear()
            wall, processor = time.perf_counter(), time.process_time()
            bpy.ops.render.render()
            spent.append([time.perf_counter() - wall, time.process_time() - processor])
        height = view[2][1]
        yield np.subtract(spent[1], spent[0]).tolist(), [
            (False, np.c_[p[:, 0], height - p[:, 1]]) for p in found
        ]


def main(folder, case, tool):
    folder = Path(folder)
    frames = {"lineart": lineart, "freestyle": freestyle}[tool](scene(folder, case), views(folder, case))
    with open(folder / f"{case}-{tool}.lines", "w") as lines, open(folder / f"{case}-{tool}.seconds", "w") as seconds:
        for number, (spent, strokes) in enumerate(frames):
            print(*spent, file=seconds)
            for closed, points in strokes:
                print(number, int(closed), *np.round(points, 3).reshape(-1), file=lines)


if __name__ == "__main__":
    main(*sys.argv[1:])
