#!/usr/bin/env python3
"""Yugen beside Mitsuba 3: time to equal error, samples a second, memory, start-up.

    cargo xtask bench                    Yugen alone: samples a second and memory per scene
    cargo xtask bench --peer             both, in turn, on the same scene files, and a table
    cargo xtask bench --peer --scene cbox --quick
    cargo xtask bench --peer --denoise   Yugen's pictures of 16 and 64 samples a pixel denoised, that time included

Scenes are read from the folder named by YUGEN_DATA (mitsuba/…, cloth/…). Mitsuba is installed from PyPI into
.venv/bench, its own environment; its llvm variant needs an LLVM library (Debian: libllvm19) and is left out,
with a line that says so, where there is none.

Mitsuba renders each scene at several sample counts, Yugen to several error targets (--error, which gives noisy parts
more samples; Mitsuba has no such budget). The error of a picture is the relative mean square error against a
converged reference, rendered by Mitsuba with another seed, in two halves: the product of the differences to each has
no part that is the reference's own noise. The time to a given error is read off the straight line through (log time,
log error). With --denoise it is the time that Mitsuba, which has no denoiser on a CPU, takes to the error of Yugen's
denoised picture. Times are of rendering alone, warm (Mitsuba's kernels compiled, scene loaded); start-up
is the wall clock of a whole process that renders one sample a pixel.
"""

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import time

import peer

OUT = peer.ROOT / "out" / "bench"
YUGEN = peer.ROOT / "target" / "dist" / "yugen"

# name: file under YUGEN_DATA, definitions, size, sample counts, samples of the reference
SCENES = {
    "cbox": ("mitsuba/scenes/cbox/cbox.xml", {"max_depth": 8}, (256, 256), (16, 64, 256), 8192),
    "veach_mis": ("mitsuba/docs/scenes/integrator_direct_both.xml", {}, (384, 256), (16, 64, 256), 8192),
    "matpreview_gold": ("mitsuba/docs/scenes/bsdf_conductor_gold.xml", {}, (320, 240), (16, 64, 256), 4096),
    "matpreview_aluminium": (
        "mitsuba/docs/scenes/bsdf_roughconductor_anisotropic_aluminium.xml", {}, (320, 240), (16, 64, 256), 4096,
    ),
    "cloth_dress": (None, {}, (256, 256), (16, 64, 256), 4096),
    "cloth_wind": (None, {}, (256, 256), (16, 64, 256), 4096),
}

# Relative errors that Yugen renders to; they lie about where Mitsuba's sample counts end.
TARGETS = (0.2, 0.1, 0.05)
# Samples a pixel of the pictures that are denoised.
DENOISED = (16, 64)

CLOTH = """<scene version="3.0.0">
  <default name="spp" value="64"/>
  <integrator type="path"><integer name="max_depth" value="6"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="{fov}"/>
    <transform name="to_world"><lookat origin="{origin}" target="{target}" up="{up}"/></transform>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="256"/><integer name="height" value="256"/><rfilter type="gaussian"/>
    </film>
  </sensor>
  {light}
  <shape type="obj">
    <string name="filename" value="{mesh}"/>
    <bsdf type="twosided">{bsdf}</bsdf>
  </shape>
  {floor}
</scene>
"""


def cloth_scenes(data, folder):
    """Two draped cloths in scenes of our own: satin under a lamp, plain weave under the sky."""
    import shutil

    for name in ["dress-handsup-drape.obj", "wind48x48.obj"]:
        shutil.copy(data / "cloth" / name, folder / name)
    dress, wind = bounds(folder / "dress-handsup-drape.obj"), bounds(folder / "wind48x48.obj")

    def view(box, direction, up):
        lo, hi = box
        centre = [(a + b) / 2 for a, b in zip(lo, hi)]
        size = math.dist(lo, hi)
        return dict(
            fov=35,
            origin=",".join(f"{c + d * size * 1.5}" for c, d in zip(centre, direction)),
            target=",".join(map(str, centre)),
            up=up,
        ), centre, size

    camera, centre, size = view(dress, (0.4, 0.2, 0.9), "0,1,0")
    lamp = f"""<shape type="sphere"><point name="center" x="{centre[0] + size}" y="{centre[1] + size}" z="{centre[2] + size}"/>
      <float name="radius" value="{0.15 * size}"/>
      <emitter type="area"><rgb name="radiance" value="60, 40, 20"/></emitter></shape>
      <emitter type="constant"><rgb name="radiance" value="0.05, 0.07, 0.1"/></emitter>"""
    satin = """<bsdf type="roughconductor"><string name="distribution" value="ggx"/>
      <float name="alpha_u" value="0.1"/><float name="alpha_v" value="0.4"/><string name="material" value="Au"/></bsdf>"""
    floor = f"""<shape type="rectangle"><transform name="to_world"><scale value="{3 * size}"/><rotate x="1" angle="-90"/>
      <translate x="{centre[0]}" y="{dress[0][1]}" z="{centre[2]}"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.4, 0.35, 0.3"/></bsdf></shape>"""
    (folder / "cloth_dress.xml").write_text(
        CLOTH.format(mesh="dress-handsup-drape.obj", light=lamp, bsdf=satin, floor=floor, **camera))

    camera, centre, size = view(wind, (0.3, 0.5, 0.8), "0,1,0")
    shutil.copy(data / "hdr" / "spiaggia_di_mondello_1k.hdr", folder / "sky.hdr")
    sky = '<emitter type="envmap"><string name="filename" value="sky.hdr"/></emitter>'
    weave = '<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.6, 0.1, 0.08"/><float name="alpha" value="0.25"/></bsdf>'
    (folder / "cloth_wind.xml").write_text(CLOTH.format(mesh="wind48x48.obj", light=sky, bsdf=weave, floor="", **camera))


def bounds(obj):
    lo, hi = [math.inf] * 3, [-math.inf] * 3
    for line in obj.read_text().splitlines():
        if line.startswith("v "):
            p = [float(x) for x in line.split()[1:4]]
            lo = [min(a, b) for a, b in zip(lo, p)]
            hi = [max(a, b) for a, b in zip(hi, p)]
    return lo, hi


# --- Mitsuba, in its own environment --------------------------------------------------------------------------

PEER = r"""
import json, os, sys, time
job = json.loads(sys.argv[1])
import mitsuba as mi, numpy as np
mi.set_variant(job["variant"])
defines = {k: v for k, v in job["defines"].items()}
scene = mi.load_file(job["scene"], **defines)
sensor = scene.sensors()[0]
params = mi.traverse(scene)
def film_size(w, h):
    p = mi.traverse(sensor)
    key = [k for k in p.keys() if k.endswith("film.size")][0]
    p[key] = [w, h]
    crop = [k for k in p.keys() if k.endswith("film.crop_size")]
    if crop:
        p[crop[0]] = [w, h]
    p.update()
film_size(*job["size"])
def render(spp, seed):
    image = mi.render(scene, sensor=sensor, spp=spp, seed=seed)
    return np.array(image)[:, :, :3]
out = []
for spp, seed, file in job["renders"]:
    chunk = job["chunk"]
    if spp > chunk:
        # Two halves that know nothing of each other.
        n = spp // chunk
        halves = [sum(render(chunk, seed * 1000 + k).astype(np.float64) for k in range(half, n, 2)) / (n // 2)
                  for half in (0, 1)]
        image, seconds = np.stack(halves), None
    else:
        render(spp, seed + 500)
        t = time.perf_counter()
        image = render(spp, seed)
        seconds = time.perf_counter() - t
    np.save(file, image)
    out.append({"spp": spp, "seconds": seconds})
print("\n" + json.dumps(out))
"""


def render_peer(variant, scene, defines, size, renders, chunk=256):
    env = dict(os.environ)
    if "llvm" in variant:
        env["DRJIT_LIBLLVM_PATH"] = peer.llvm_library()
    job = dict(variant=variant, scene=str(scene), defines={k: str(v) for k, v in defines.items()}, size=size,
               renders=renders, chunk=chunk)
    done = run([str(peer.python()), "-c", PEER, json.dumps(job)], env)
    # The program may log to standard output as well.
    return json.loads([line for line in done["stdout"].splitlines() if line.startswith("[{")][-1]), done


def run(command, env=None):
    """Runs a command; wall clock and peak memory of it beside its output."""
    started = time.perf_counter()
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    process = subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    stdout, stderr = process.communicate()
    if process.returncode != 0:
        raise SystemExit(f"{command[0]} failed:\n{stderr[-3000:]}")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return dict(stdout=stdout, wall=time.perf_counter() - started, peak=max(peak, before))


def yugen(scene, defines, size, budget, seed, output):
    command = [str(YUGEN), "render", str(scene), "-o", str(output), *budget, "--seed", str(seed), "--json",
               "--size", f"{size[0]}x{size[1]}"]
    for k, v in defines.items():
        command += ["-D", f"{k}={v}"]
    done = run(command)
    return json.loads(done["stdout"].splitlines()[-1]), done


def peak_memory(command, env=None):
    """Peak resident megabytes of one command, in a process of its own so that nothing else counts."""
    code = ("import resource,subprocess,sys;subprocess.run(sys.argv[1:],stdout=subprocess.DEVNULL,"
            "stderr=subprocess.DEVNULL,check=True);print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
    out = subprocess.run([sys.executable, "-c", code, *command], env=env, capture_output=True, text=True, check=True)
    return int(out.stdout.split()[-1]) / 1024


# --- the comparison -------------------------------------------------------------------------------------------

COMPARE = r"""
import json, sys, numpy as np, mitsuba as mi
mi.set_variant("scalar_rgb")
def load(f):
    if f.endswith(".npy"):
        return np.load(f)
    # The picture without the layers beside it.
    picture = dict(mi.Bitmap(f).split())["<root>"]
    return np.array(picture.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
job = json.loads(sys.argv[1])
halves = load(job["reference"])
ref = halves.mean(axis=0)
out = []
for f in job["images"]:
    x = load(f).astype(np.float64)
    # Relative to the reference, with a hundredth of its mean as the darkest that counts.
    scale = ref ** 2 + (0.01 * ref.mean()) ** 2 + 1e-12
    error = (x - halves[0]) * (x - halves[1]) / scale
    # A thousandth of the values may be outliers (fireflies) in either renderer; they would be all that is seen.
    order = np.argsort(np.maximum((x - ref) ** 2, (halves[0] - halves[1]) ** 2 / 4).ravel() / scale.ravel())
    keep = error.ravel()[order[: int(error.size * 0.999)]]
    out.append({"relmse": float(keep.mean()), "relmse_all": float(error.mean()), "mean_ratio": float(x.mean() / ref.mean())})
print(json.dumps(out))
"""


def compare(reference, images):
    job = json.dumps(dict(reference=str(reference), images=[str(i) for i in images]))
    out = subprocess.run([str(peer.python()), "-c", COMPARE, job], capture_output=True, text=True)
    if out.returncode != 0:
        raise SystemExit(out.stderr[-3000:])
    return json.loads(out.stdout.splitlines()[-1])


def time_to(error, points):
    """Seconds to reach `error` on the least-squares line through (log seconds, log error)."""
    xs = [math.log(t) for t, _ in points]
    ys = [math.log(e) for _, e in points]
    n = len(points)
    mx, my = sum(xs) / n, sum(ys) / n
    slope = sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)
    return math.exp(mx + (math.log(error) - my) / slope), slope


def scene_file(name, data):
    file, defines, size, counts, reference = SCENES[name]
    path = data / file if file else OUT / "cloth" / f"{name}.xml"
    return path, defines, size, counts, reference


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peer", action="store_true", help="also run Mitsuba 3 and compare")
    parser.add_argument("--denoise", action="store_true", help="with --peer: denoised pictures as well")
    parser.add_argument("--scene", action="append", choices=SCENES, help="only this scene (may be repeated)")
    parser.add_argument("--quick", action="store_true", help="a quarter of the samples for the reference")
    args = parser.parse_args()
    data = peer.data()
    (OUT / "cloth").mkdir(parents=True, exist_ok=True)
    cloth_scenes(data, OUT / "cloth")
    names = args.scene or list(SCENES)
    rows = []
    for name in names:
        path, defines, size, counts, reference_spp = scene_file(name, data)
        folder = OUT / name
        folder.mkdir(parents=True, exist_ok=True)
        ours = []
        pictures = [folder / f"yugen_{target}.exr" for target in TARGETS]
        for target, picture in zip(TARGETS, pictures):
            report, _ = yugen(path, defines, size, ["--error", str(target)], 1, picture)
            ours.append(report)
        start_ours = yugen(path, defines, size, ["--spp", "1"], 1, folder / "yugen_1.exr")[1]["wall"]
        row = dict(scene=name, rate=ours[-1]["samples_per_second"], startup=start_ours,
                   memory=peak_memory([str(YUGEN), "render", str(path), "-o", str(folder / "memory.exr"), "--spp", "1",
                                       "--size", f"{size[0]}x{size[1]}", "--json"]))
        if not args.peer:
            rows.append(row)
            print(f"{name:22} {row['rate'] / 1e6:7.2f} M samples/s  {row['memory']:7.1f} MB  {row['startup']:.2f} s start-up")
            continue
        variants = ["scalar_rgb"] + (["llvm_ad_rgb"] if peer.llvm_library() else [])
        if len(variants) == 1:
            print("no LLVM library found: llvm_ad_rgb is left out (Debian: apt-get install libllvm19)", file=sys.stderr)
        reference = folder / f"halves_{reference_spp}.npy"
        if args.quick:
            reference_spp //= 4
            reference = folder / f"halves_{reference_spp}.npy"
        if not reference.exists():
            print(f"{name}: reference, {reference_spp} samples a pixel", file=sys.stderr)
            render_peer(variants[-1], path, defines, size, [(reference_spp, 77, str(reference))])
        error_ours = compare(reference, pictures)
        row["bias"] = error_ours[-1]["mean_ratio"]
        ours_points = [(r["render_seconds"], e["relmse"]) for r, e in zip(ours, error_ours)]
        best = None
        clean = []
        if args.denoise:
            cleaned = [folder / f"denoised_{spp}.exr" for spp in DENOISED]
            clean = [yugen(path, defines, size, ["--spp", str(spp), "--denoise"], 1, picture)[0]
                     for spp, picture in zip(DENOISED, cleaned)]
            for report, error in zip(clean, compare(reference, cleaned)):
                report["relmse"] = error["relmse"]
        for variant in variants:
            files = [folder / f"{variant}_{s}.npy" for s in counts]
            report, _ = render_peer(variant, path, defines, size, [(s, 1, str(f)) for s, f in zip(counts, files)])
            errors = compare(reference, files)
            points = [(r["seconds"], e["relmse"]) for r, e in zip(report, errors)]
            target = points[-1][1]
            t_peer, _ = time_to(target, points)
            t_ours, slope = time_to(target, ours_points)
            rate = counts[-1] * size[0] * size[1] / report[-1]["seconds"]
            start = render_peer(variant, path, defines, size, [(1, 1, str(folder / "start.npy"))])[1]["wall"]
            row[variant] = dict(ratio=t_peer / t_ours, rate=rate, seconds=t_peer, startup=start, error=target)
            row[variant]["denoised"] = [time_to(r["relmse"], points)[0] / (r["render_seconds"] + r["denoise_seconds"])
                                        for r in clean]
            if best is None or t_peer / t_ours < best:
                best = t_peer / t_ours
        row["ratio"] = best
        row["slope"] = slope
        rows.append(row)
        line = f"{name:22} {row['ratio']:6.2f}x  ours {row['rate'] / 1e6:6.2f} M/s"
        for variant in variants:
            line += f"  {variant} {row[variant]['rate'] / 1e6:6.2f} M/s ({row[variant]['ratio']:.2f}x)"
        print(line, f" mean/ref {row['bias']:.4f}", flush=True)
        for k, (spp, r) in enumerate(zip(DENOISED, clean)):
            print(f"{'':22} denoised, {spp} samples: {r['relmse']:.5f} in {r['render_seconds']:.2f} + "
                  f"{r['denoise_seconds']:.2f} s", *(f"  {v} {row[v]['denoised'][k]:.2f}x" for v in variants), flush=True)
    write_table(rows, args.peer)


def geometric(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def write_table(rows, with_peer):
    lines = []
    if with_peer:
        variants = [v for v in ("scalar_rgb", "llvm_ad_rgb") if all(v in r for r in rows)]
        lines.append("| scene | time to equal error: peer / Yugen (the faster peer) | " + " | ".join(variants)
                     + " | Yugen M samples/s | " + " | ".join(f"{v} M samples/s" for v in variants)
                     + " | error falls as time^ | start-up s, Yugen / " + " / ".join(variants) + " | Yugen MB |")
        lines.append("|" + "---|" * (5 + 2 * len(variants) + 1))
        for r in rows:
            lines.append(
                f"| {r['scene']} | **{r['ratio']:.2f}** | " + " | ".join(f"{r[v]['ratio']:.2f}" for v in variants)
                + f" | {r['rate'] / 1e6:.2f} | " + " | ".join(f"{r[v]['rate'] / 1e6:.2f}" for v in variants)
                + f" | {r['slope']:.2f} | {r['startup']:.2f} / " + " / ".join(f"{r[v]['startup']:.2f}" for v in variants)
                + f" | {r['memory']:.0f} |")
        mean = math.exp(sum(math.log(r["ratio"]) for r in rows) / len(rows))
        lines.append(f"\nGeometric mean of the ratio to the faster peer: **{mean:.2f}**.")
        for variant in variants:
            if rows[0][variant]["denoised"]:
                lines.append(f"\nDenoised, {' and '.join(map(str, DENOISED))} samples a pixel, time of {variant} to equal error over "
                             "Yugen's: " + ", ".join(f"{r['scene']} " + " and ".join(f"{x:.2f}" for x in r[variant]["denoised"])
                                                     for r in rows)
                             + f"; geometric mean **{geometric([x for r in rows for x in r[variant]['denoised']]):.2f}**.")
    else:
        lines.append("| scene | M samples/s | MB | start-up s |\n|---|---|---|---|")
        for r in rows:
            lines.append(f"| {r['scene']} | {r['rate'] / 1e6:.2f} | {r['memory']:.0f} | {r['startup']:.2f} |")
    text = "\n".join(lines) + "\n"
    (OUT / "table.md").write_text(text)
    (OUT / "table.json").write_text(json.dumps(rows, indent=1))
    print("\n" + text)


if __name__ == "__main__":
    main()
