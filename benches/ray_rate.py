"""Rays a second, Yugen beside Mitsuba 3 (Embree), on the same meshes, in turn.

Usage: python benches/ray_rate.py [MESH.obj ...]
Needs `pip install mitsuba` and LLVM for `llvm_ad_rgb` (DRJIT_LIBLLVM_PATH where it is not found by itself).
Rays start evenly in the mesh's box and go in directions drawn evenly: 2^20 of them, best of five.
"""
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DATA = os.environ.get("YUGEN_DATA")


def meshes():
    if len(sys.argv) > 1:
        return [Path(p) for p in sys.argv[1:]]
    if not DATA:
        sys.exit("name meshes, or set YUGEN_DATA")
    names = ["mitsuba/common/meshes/sphere.obj", "mesh/dancing_girl/DancingGirl.obj",
             "mesh/spot/spot_triangulated.obj", "mesh/teapot.obj"]
    return [Path(DATA) / n for n in names]


def yugen(path):
    """Closest and occlusion rays, M/s."""
    command = ["cargo", "run", "-q", "--release", "-p", "yugen-transport", "--example", "ray_rate", "--", str(path)]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    words = out.splitlines()[-1].split()
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
    try:
        import drjit as dr
        import mitsuba as mi
    except ImportError:
        sys.exit("Mitsuba is missing: pip install mitsuba")
    mi.set_variant("llvm_ad_rgb")
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
    main()
