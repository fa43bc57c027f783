"""Cloth of scenes that `cloth.py` hands over, moved by solvers of Newton; runs in a Python that has it.

    python cloth_newton.py FOLDER CASE vbd|style3d

FOLDER has what crates/motion/benches/cloth/cases.rs writes there; cloth_case.py says what is written beside it.
"""

import sys
from pathlib import Path

import cloth_case
import newton
import numpy as np
import warp as wp
from newton.solvers import style3d

# Steps of a frame and iterations of each, as the examples of Newton's own that stand nearest have it: cloth_twist and cloth_style3d.
STEPS, ITERATIONS = 10, 4
# Stiffness of contact, N/m: Newton's own.
CONTACT = 1e3


def angles(flat, triangles, radius, along):
    """Of the edges that two triangles share: length, and angle where the cloth is bent to a cylinder, round one axis or the other."""
    turned = flat[:, along] / radius
    bent = np.stack([radius * np.sin(turned), radius * np.cos(turned), flat[:, 1 - along]], 1)
    corners = bent[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    of = np.arange(len(edges)) // 3
    order = np.lexsort(edges.T)
    edges, of = edges[order], of[order]
    pair = np.flatnonzero((edges[1:] == edges[:-1]).all(1))
    length = np.linalg.norm(np.subtract(*flat[edges[pair].T]), axis=1)
    cosine = (normals[of[pair]] * normals[of[pair + 1]]).sum(1)
    return length, np.arccos(np.clip(cosine, -1, 1))


def bending(numbers, flat, triangles):
    """Stiffness k of edges whose energy is k/2 times length times angle squared, such that a cylinder of this mesh holds as much as one
    of the fabric."""
    area = cloth_case.area(flat, triangles)
    cell = np.sqrt(2 * area / len(triangles))
    radius = 20 * cell
    found = []
    for along, rigidity in [(1, numbers["rigidity"][0]), (0, numbers["rigidity"][1])]:
        length, angle = angles(flat, triangles, radius, along)
        found.append(rigidity * area / radius**2 / (length * angle**2).sum())
    return sum(found) / 2


def simulate(folder, name, tool):
    numbers, positions, triangles, flat, held = cloth_case.read(folder, name)
    (weft, warp, shear), (mass,) = numbers["moduli"], numbers["areal_mass"]
    damping, bending_damping = numbers["damping"]
    on_body, on_cloth = numbers["friction"]
    body, cloth = numbers["distance"]
    builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(0.0, -9.80665, 0.0))
    common = {
        "pos": wp.vec3(0), "rot": wp.quat_identity(), "vel": wp.vec3(0), "scale": 1.0, "density": mass,
        "vertices": [wp.vec3(*map(float, p)) for p in positions], "indices": triangles.reshape(-1).tolist(),
        "particle_radius": body,
    }
    if tool == "style3d":
        newton.solvers.SolverStyle3D.register_custom_attributes(builder)
        along_warp, along_weft = numbers["rigidity"]
        style3d.add_cloth_mesh(
            builder, panel_verts=flat.tolist(), panel_indices=triangles.reshape(-1).tolist(),
            tri_aniso_ke=wp.vec3(weft, warp, shear),
            edge_aniso_ke=wp.vec3(along_weft, along_warp, 0.5 * (along_weft + along_warp)), **common,
        )
    else:
        # Isotropic, without contraction across: the moduli in the mean, and shear as it follows from them.
        young, bend = 0.5 * (weft + warp), bending(numbers, flat, triangles)
        builder.add_cloth_mesh(
            tri_ke=0.5 * young, tri_ka=0.0, tri_kd=0.25 * damping * young,
            edge_ke=bend, edge_kd=bending_damping * bend, **common,
        )
        builder.color(include_bending=True)
    if "ball" in numbers:
        *middle, radius = numbers["ball"]
        # What two surfaces have is the mean of both.
        mu = 2 * on_body - on_cloth
        builder.add_shape_sphere(
            -1, xform=wp.transform(wp.vec3(*middle), wp.quat_identity()), radius=radius,
            cfg=newton.ModelBuilder.ShapeConfig(ke=CONTACT, kd=0.0, mu=mu),
        )
    model = builder.finalize()
    model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = CONTACT, 0.0, on_cloth
    flags, inverse = model.particle_flags.numpy(), model.particle_inv_mass.numpy()
    flags[held] &= ~int(newton.ParticleFlags.ACTIVE)
    inverse[held] = 0
    model.particle_flags.assign(flags)
    model.particle_inv_mass.assign(inverse)
    if tool == "style3d":
        solver = newton.solvers.SolverStyle3D(model, config=newton.solvers.SolverStyle3D.Config(iterations=ITERATIONS))
        solver.collision.radius = 0.5 * cloth
    else:
        solver = newton.solvers.SolverVBD(
            model, iterations=ITERATIONS, particle_enable_self_contact=True,
            particle_self_contact_margin=cloth, particle_self_contact_gap=cloth,
        )
    states = [model.state(), model.state()]
    control = model.control()
    pipeline = newton.CollisionPipeline(model)
    contacts = pipeline.contacts()
    states[0].particle_q.assign(positions)

    def frame():
        for _ in range(STEPS):
            states[0].clear_forces()
            pipeline.collide(states[0], contacts)
            solver.step(states[0], states[1], control, contacts, 1 / 60 / STEPS)
            states.reverse()

    # Compiles what is needed; then from the beginning.
    frame()
    states[0].particle_q.assign(positions)
    states[0].particle_qd.zero_()

    def timed(_):
        if tool == "vbd":
            solver.rebuild_bvh(states[0])
        frame()
        wp.synchronize()

    cloth_case.play(folder, name, tool, numbers, timed, lambda: states[0].particle_q.numpy())


if __name__ == "__main__":
    folder, name, tool = sys.argv[1:]
    wp.config.quiet = True
    wp.config.kernel_cache_dir = str(Path(sys.prefix) / "kernels")
    with wp.ScopedDevice("cpu"):
        simulate(Path(folder), name, tool)
