"""Cloth of scenes that `cloth.py` hands over, moved by Blender; runs in a Python that has bpy.

    python cloth_blender.py FOLDER CASE blender|blender_self

`blender_self` touches itself. FOLDER has what crates/motion/benches/cloth/cases.rs writes there; cloth_case.py
says what is written beside it.
"""

import sys
from pathlib import Path

import bpy
import cloth_case
import numpy as np

RATE = 60
# Steps of a frame: Blender's own.
QUALITY = 5


def faces(triangles, flat, cell):
    """Squares where two triangles that follow each other are one, so that Blender knows threads from the bias."""
    found, k = [], 0
    while k < len(triangles):
        first = triangles[k].tolist()
        second = triangles[k + 1].tolist() if k + 1 < len(triangles) else []
        shared = [v for v in first if v in second]
        if len(shared) == 2 and (np.abs(np.subtract(*flat[shared])) > 0.3 * cell).all():
            turn = next(i for i, v in enumerate(first) if v not in shared)
            a, p, q = first[turn:] + first[:turn]
            found.append([a, p, next(v for v in second if v not in shared), q])
            k += 2
        else:
            found.append(first)
            k += 1
    return found


def solid(name, positions, polygons):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(positions).tolist(), [], polygons)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def build(folder, name, touches):
    numbers, positions, triangles, flat, held = cloth_case.read(folder, name)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.gravity = RATE, (0, -9.80665, 0)
    scene.frame_start, scene.frame_end = 1, int(numbers["frames"][0]) + 1
    (weft, warp, shear), (mass,), (cell,) = numbers["moduli"], numbers["areal_mass"], numbers["cell"]
    body, cloth = numbers["distance"]
    on_body, on_cloth = numbers["friction"]
    cloth_object = solid("cloth", positions, faces(triangles, flat, cell))
    modifier = cloth_object.modifiers.new("cloth", "CLOTH")
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = scene.frame_start, scene.frame_end
    s = modifier.settings
    s.quality = QUALITY
    s.mass = mass * cloth_case.area(flat, triangles) / len(positions)
    # A spring along threads has the stiffness given here by its mean length: that of a strip a cell wide.
    stretch = 0.5 * (weft + warp) * cell
    s.tension_stiffness = s.compression_stiffness = stretch
    # Of the two diagonals of a square only the longer one pulls.
    s.shear_stiffness = 2 * shear * cell
    s.tension_damping = s.compression_damping = numbers["damping"][0] * stretch / cell
    s.shear_damping = numbers["damping"][0] * 2 * shear
    # The moment of an edge of length L is half of .1 times this times L times the cell for each radian.
    s.bending_model = "ANGULAR"
    rigidity = 0.5 * sum(numbers["rigidity"])
    s.bending_stiffness = rigidity / (0.05 * cell**2)
    s.bending_damping = numbers["damping"][1] * 0.2 * s.bending_stiffness
    # It slows what flies freely; a sixtieth of a newton second for each metre and vertex would hold silk in the air.
    s.air_damping = 0
    c = modifier.collision_settings
    c.use_collision, c.distance_min, c.friction = True, body, 100 * on_body
    c.use_self_collision, c.self_distance_min, c.self_friction = touches, cloth, 100 * on_cloth
    if len(held):
        group = cloth_object.vertex_groups.new(name="held")
        group.add(held.tolist(), 1.0, "REPLACE")
        s.vertex_group_mass = "held"
    if "ball" in numbers:
        *middle, radius = numbers["ball"]
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=radius, location=middle)
        ball = bpy.context.object
        ball.modifiers.new("collision", "COLLISION")
        ball.collision.thickness_outer, ball.collision.cloth_friction = 0.001, 100 * on_body
        ball.collision.damping = 0
    return scene, cloth_object, numbers


def main(folder, name, tool):
    folder = Path(folder)
    scene, cloth, numbers = build(folder, name, tool == "blender_self")
    scene.frame_set(scene.frame_start)

    def positions():
        mesh = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        found = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", found)
        return found

    cloth_case.play(folder, name, tool, numbers, lambda number: scene.frame_set(scene.frame_start + number), positions)


if __name__ == "__main__":
    main(*sys.argv[1:])
