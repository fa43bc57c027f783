"""Rays a second, Yugen beside Mitsuba 3 (Embree), on the same meshes, in turn.

    cargo xtask bench rays [MESH.obj ...]

Rays start evenly in the mesh's box and go in directions drawn evenly: 2^20 of them, best of five.
"""
import os
import time
from pathlib import Path

import peer


def meshes():
    if peer.words():
        return [Path(p) for p in peer.words()]
    names = ["mitsuba/common/meshes/sphere.obj", "mesh/dancing_girl/DancingGirl.obj",
             "mesh/spot/spot_triangulated.obj", "mesh/teapot.obj"]
    return [peer.data() / n for n in names]


def yugen(path):
    """Closest and occlusion rays, M/s."""
    words = peer.example("yugen-transport", "ray_rate", path).splitlines()[-1].split()
    return float(words[-5]), float(words[-4])


def processor_seconds():
    """What both programs are measured by: time on a core, as if all cores were used evenly."""
    return time.process_time() / len(os.sched_getaffinity(0))


def mitsuba(mi, dr, path, count=1 << 20):
    """The same through Mitsuba; the results are reduced to a number so that nothing is optimised away."""
    scene = mi.load_dict({"type": "scene", "mesh": {"type": "obj", "filename": str(path)}})
    box = scene.bbox()
    rng = mi.PCG32(size=count)
    p = mi.Point3f(rng.next_float32(), rng.next_float32(), rng.next_float32())
    o = mi.Point3f(box.min) + p * mi.Vector3f(box.max - box.min)
    d = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    ray = mi.Ray3f(o, d)
    dr.eval(ray)
    rates = []
    for trace in (lambda: dr.select(scene.ray_intersect_preliminary(ray, coherent=False).is_valid(), 1.0, 0.0),
                  lambda: dr.select(scene.ray_test(ray, coherent=False), 1.0, 0.0)):
        best = float("inf")
        for _ in range(6):
            start = processor_seconds()
            hit = trace()
            dr.eval(hit)
            dr.sync_thread()
            best = min(best, processor_seconds() - start)
        rates.append(count / best / 1e6)
    return rates


def main():
    mi, dr = peer.mitsuba()
    print(f"{'M rays/s':28} {'closest':>22} {'occlusion':>26}")
    print(f"{'':28} {'yugen':>7} {'mitsuba':>8} {'ratio':>6} {'yugen':>9} {'mitsuba':>8} {'ratio':>6}")
    product = [1.0, 1.0]
    paths = meshes()
    for path in paths:
        ours, theirs = yugen(path), mitsuba(mi, dr, path)
        cells = []
        for i in range(2):
            product[i] *= ours[i] / theirs[i]
            cells.append(f"{ours[i]:7.2f} {theirs[i]:8.2f} {ours[i] / theirs[i]:6.2f}")
        print(f"{path.name:28} {cells[0]}   {cells[1]}")
    means = [p ** (1 / len(paths)) for p in product]
    print(f"geometric mean of the ratios: closest {means[0]:.2f}, occlusion {means[1]:.2f}")


if __name__ == "__main__":
    peer.enter()
    main()
