#!/usr/bin/env python3
"""Denoised pictures against converged ones, beside what Open Image Denoise makes of the same samples.

    cargo xtask bench denoise                         a table: errors, seconds, and how far off the estimate of them is
    cargo xtask bench denoise --scene glass --picture glass.png

Scenes are those of bench.py, read from the folder named by YUGEN_DATA, two of examples/scenes, and two of
benches/scenes. All are rendered 192 pixels high. Errors are relative mean square errors as in bench.py: against two
converged pictures that know nothing of each other, without the worst thousandth of the values. Open Image Denoise gets
picture, albedo and normal, once as the reconstruction filter makes them, and once as means of each pixel's own samples
(a box filter), to be filtered afterwards; the better of the two counts.
"""

import argparse
import json
import os
import shutil
import subprocess

import peer

if __name__ == "__main__":
    peer.enter()
import numpy as np
import OpenEXR

import bench

ROOT = peer.ROOT
OUT = ROOT / "out" / "denoise"
HEIGHT = 192
SAMPLES = (16, 64)
# What a gaussian of half a pixel's deviation does to a smooth picture beyond averaging over a pixel.
TAPS = (1 / 12, 5 / 6, 1 / 12)
# file from the project's folder, width, samples of each converged picture
OWN = {
    "glass": ("benches/scenes/glass.toml", 192, 1024),
    "teapot": ("benches/scenes/teapot.toml", 256, 1024),
    "fabric": ("examples/scenes/fabric.toml", 192, 1024),
    "brocade": ("examples/scenes/brocade.toml", 192, 1024),
}


def find(name, data):
    """Scene file, what to define, width, samples of the converged pictures."""
    if name in OWN:
        file, width, samples = OWN[name]
        return ROOT / file, {}, width, samples
    file, defines, (width, height), _, samples = bench.SCENES[name]
    path = data / file if file else OUT / "cloth" / f"{name}.xml"
    return path, defines, width * HEIGHT // height, samples // 2


def unfiltered(path, data):
    """The same scene with a box filter, in a folder of its own."""
    if path.suffix == ".toml":
        folder = OUT / "box" / path.parent.name
        shutil.copytree(path.parent, folder, dirs_exist_ok=True)
        copy = folder / path.name
        copy.write_text(path.read_text().replace("[film]\n", '[film]\nfilter = "box"\n'))
        return copy
    root = data / "mitsuba" if path.is_relative_to(data) else OUT / "cloth"
    folder = OUT / "box" / root.name
    if not folder.exists():
        shutil.copytree(root, folder)
        for xml in folder.rglob("*.xml"):
            xml.write_text(xml.read_text().replace('<rfilter type="gaussian"', '<rfilter type="box"'))
    return folder / path.relative_to(root)


def render(path, defines, width, output, samples, seed, *more):
    command = [str(bench.YUGEN), "render", str(path), "-o", str(output), "--spp", str(samples), "--seed", str(seed),
               "--size", f"{width}x{HEIGHT}", "--allow", os.environ["YUGEN_DATA"], "--checkpoint", "0", "--json", *more]
    for key, value in defines.items():
        command += ["-D", f"{key}={value}"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def read(path, *names):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.stack([np.array(file.channels()[n].pixels, dtype=np.float64) for n in names], -1)


def open_image_denoise(path, filtered):
    import pyoidn
    colour, albedo, normal = (np.ascontiguousarray(read(path, *names), dtype=np.float32) for names in (
        ("noisy.R", "noisy.G", "noisy.B") if filtered else "RGB",
        ("albedo.R", "albedo.G", "albedo.B"), ("shading_normal.X", "shading_normal.Y", "shading_normal.Z")))
    out = np.asarray(pyoidn.denoise(colour, albedo=np.clip(albedo, 0, 1), normal=normal, hdr=True), dtype=np.float64)
    if not filtered:
        for axis in (0, 1):
            padded = np.pad(out, [(1, 1) if a == axis else (0, 0) for a in range(3)], mode="edge")
            out = sum(t * np.take(padded, np.arange(i, i + out.shape[axis]), axis) for i, t in enumerate(TAPS))
    return out


class Truth:
    def __init__(self, halves):
        self.halves, self.mean = halves, halves.mean(axis=0)
        self.scale = self.mean ** 2 + (0.01 * self.mean.mean()) ** 2 + 1e-12

    def squares(self, x):
        error = (x - self.halves[0]) * (x - self.halves[1]) / self.scale
        worst = np.maximum((x - self.mean) ** 2, (self.halves[0] - self.halves[1]) ** 2 / 4) / self.scale
        return error.ravel()[np.argsort(worst.ravel())[: int(error.size * 0.999)]]

    def error(self, x):
        return self.squares(x).mean()

    def claimed(self, error):
        return np.sort((error ** 2 / self.scale).ravel())[: int(error.size * 0.999)].mean()


def montage(path, truth, pictures):
    """Pictures side by side, as a display shows them, and what is wrong with them below: white where half is."""
    from PIL import Image
    exposure = 0.4 / np.median(truth.mean.mean(axis=2))
    # Rec. 2020 to sRGB.
    to_srgb = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    show = lambda x: np.clip(x @ to_srgb.T * exposure, 0, 1) ** (1 / 2.2)
    wrong = lambda x: np.clip(2 * np.sqrt(((x - truth.mean) ** 2 / truth.scale).mean(axis=2, keepdims=True)), 0, 1)
    rows = [np.concatenate([show(x) for x in pictures], 1),
            np.concatenate([wrong(x).repeat(3, 2) for x in pictures], 1)]
    Image.fromarray((255 * np.concatenate(rows)).round().astype(np.uint8)).save(path, quality=92)


def main():
    names = [*bench.SCENES, *OWN]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", action="append", choices=names, help="only this scene (may be repeated)")
    parser.add_argument("--quick", action="store_true", help="a quarter of the samples for the converged pictures")
    parser.add_argument("--picture", help="raw, denoised, Open Image Denoise, converged, of 16 samples; one scene")
    args = parser.parse_args()
    data = peer.data()
    (OUT / "cloth").mkdir(parents=True, exist_ok=True)
    bench.cloth_scenes(data, OUT / "cloth")
    print("| scene | samples | raw | denoised | Open Image Denoise | estimated error over true | seconds |")
    print("|---|---|---|---|---|---|---|")
    gains, duels = [], []
    for name in args.scene or names:
        path, defines, width, converged = find(name, data)
        converged //= 4 if args.quick else 1
        halves = []
        for seed in (1001, 1002):
            file = OUT / f"{name}_{converged}_{seed}.exr"
            if not file.exists():
                render(path, defines, width, file, converged, seed)
            halves.append(read(file, *"RGB"))
        truth = Truth(np.stack(halves))
        for samples in SAMPLES:
            file, box = OUT / f"{name}.exr", OUT / f"{name}_box.exr"
            layers = ["--aov", "albedo,shading_normal"]
            report = render(path, defines, width, file, samples, 7, "--denoise", *layers)
            render(unfiltered(path, data), defines, width, box, samples, 7, *layers)
            raw, clean = read(file, "noisy.R", "noisy.G", "noisy.B"), read(file, *"RGB")
            others = [open_image_denoise(file, True), open_image_denoise(box, False)]
            other = min(others, key=truth.error)
            before, after, theirs = map(truth.error, (raw, clean, other))
            claim = np.sqrt(truth.claimed(read(file, "error.R", "error.G", "error.B")) / after)
            gains.append(before / after)
            duels.append(theirs / after)
            print(f"| {name} | {samples} | {before:.5f} | {after:.5f} | {theirs:.5f} | {claim:.2f} "
                  f"| {report['denoise_seconds']:.2f} |", flush=True)
            if args.picture and samples == SAMPLES[0]:
                montage(args.picture, truth, [raw, clean, other, truth.mean])
    print(f"\nError of the raw picture over that of the denoised one: geometric mean {bench.geometric(gains):.2f}, "
          f"least {min(gains):.2f}; of Open Image Denoise over it: {bench.geometric(duels):.2f}, least {min(duels):.2f}.")


if __name__ == "__main__":
    main()
