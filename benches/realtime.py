#!/usr/bin/env python3
"""Real-time pictures beside the reference's, on the same scenes.

    cargo xtask bench realtime                        a table: error, FLIP, frames, milliseconds a megapixel and frame
    cargo xtask bench realtime --scene cbox --integrator direct --frames 256
    cargo xtask bench realtime --denoise --scene cbox-rgb --scene fabric --scene shomen --truth 512

Scenes are Mitsuba's (from the folder named by YUGEN_DATA), those of examples/scenes, and every mesh (by itself, under the
default sun and sky, or with the lights of its file). Each is rendered by the reference renderer to twice the samples and
by the real-time renderer, once with direct light alone and once with all. error: root mean square of the difference over that of the reference. ratio: of the means. FLIP: mean, of display
values (Andersson et al. 2020), with the white of the reference's brightest hundredth.

--denoise: pictures of 4, 16 and 64 frames as they are and denoised, against --truth frames of another seed. error: root mean
square of errors relative to each value, without the worst thousandth. estimate: the same of what the denoiser claims, over
it. s/Mpx: seconds of denoising a megapixel. shomen is the Noh stage by night, seen from the front, white at its file's
exposure.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys

import peer

if __name__ == "__main__":
    peer.enter()
import flip_evaluator
import numpy as np
import OpenEXR

OUT = peer.ROOT / "out" / "realtime"
YUGEN = peer.ROOT / "target" / "dist" / "yugen"
MITSUBA = [
    "scenes/cbox/cbox-rgb.xml",
    "tests/scenes/bsdf_spheres/test_arealight_path.xml",
    "tests/scenes/bsdf_spheres/test_constant_path.xml",
    "tests/scenes/bsdf_spheres/test_pointlight_path.xml",
    "tests/scenes/bsdf_spheres/test_textured_diffuse_path.xml",
    "tests/scenes/floating_sphere/test_directional_direct.xml",
    "tests/scenes/orthographic_sensor/test_orthographic_path.xml",
    "docs/scenes/bsdf_conductor_gold.xml",
    "docs/scenes/bsdf_roughconductor_anisotropic_aluminium.xml",
    "docs/scenes/integrator_direct_both.xml",
]
OWN = ["brocade", "fabric", "films", "models", "red_ball_glossy_five", "red_ball_glossy_surface", "roughness"]


def scenes():
    """Name and file of each scene there is."""
    data = os.environ.get("YUGEN_DATA")
    found = {name: peer.ROOT / "examples" / "scenes" / f"{name}.toml" for name in OWN}
    if data:
        data = pathlib.Path(data)
        found |= {pathlib.Path(file).stem: data / "mitsuba" / file for file in MITSUBA}
        for pattern in ("*.obj", "*.glb"):
            found |= {file.stem: file for file in sorted((data / "mesh").rglob(pattern))}
    else:
        print("YUGEN_DATA is not set: only the scenes of examples/scenes", file=sys.stderr)
    return found


def night():
    """The Noh stage by its fires."""
    file = OUT / "stage.toml"
    subprocess.run([YUGEN, "noh", "stage", "-o", file], check=True, stdout=subprocess.DEVNULL)
    return file


def render(scene, output, *options):
    """What the program reports; raises with its complaint."""
    command = [YUGEN, "render", scene, "-o", output, "--json", "--checkpoint", "0", *map(str, options)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or ["it said nothing"])[-1])
    return json.loads(done.stdout)


def load(path):
    """R, G and B."""
    channels = OpenEXR.File(str(path)).channels()
    for name in ("RGBA", "RGB"):
        if name in channels:
            return channels[name].pixels[..., :3].astype(np.float64)
    return np.stack([channels[c].pixels for c in "RGB"], -1).astype(np.float64)


def display(linear, white):
    """sRGB values from 0 to 1."""
    x = np.clip(linear / white, 0, 1)
    return np.where(x < 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def layer(path, name):
    """R, G and B of a layer."""
    found = OpenEXR.File(str(path), separate_channels=True).channels()
    return np.stack([found[name + c].pixels for c in "RGB"], -1).astype(np.float64)


def root_mean(squares):
    """Without the worst thousandth."""
    return np.sqrt(np.sort(squares.ravel())[: int(0.999 * squares.size)].mean())


def differ(picture, truth, white):
    """Root mean square of errors relative to each value, dark ones counting as a hundredth of the mean; FLIP."""
    error = root_mean((picture - truth) ** 2 / (truth**2 + (0.01 * truth.mean()) ** 2))
    return error, flip_evaluator.evaluate(display(truth, white), display(picture, white), "LDR")[1]


def denoising(names, size, seed, frames_of_truth):
    """Prints what denoising does to pictures of few frames."""
    width, height = map(int, size.split("x"))
    print("| scene | frames | error | FLIP | denoised: error | FLIP | estimate | s/Mpx |\n" + "| --- " * 8 + "|")
    for name in names:
        file = night() if name == "shomen" else scenes()[name]
        common = ["--size", size, "--by", "realtime", *(["--camera", name] if name == "shomen" else [])]
        truth = OUT / f"{name}.{size}.truth.exr"
        render(file, truth, *common, "--spp", frames_of_truth, "--seed", 1000)
        want = layer(truth, "")
        white = 2.0**5 if name == "shomen" else max(np.quantile(want, 0.99), 1e-9)
        for frames in (4, 16, 64):
            output = OUT / f"{name}.{size}.{frames}.exr"
            report = render(file, output, *common, "--spp", frames, "--denoise", "--seed", seed)
            clean, raw, claim = (layer(output, of) for of in ("", "noisy.", "error."))
            (before, flip_before), (after, flip_after) = (differ(p, want, white) for p in (raw, clean))
            estimate = root_mean(claim**2 / (want**2 + (0.01 * want.mean()) ** 2)) / after
            cost = report["denoise_seconds"] / (width * height * 1e-6)
            print(f"| {name} | {frames} | {100 * before:.1f} % | {flip_before:.3f} | {100 * after:.1f} % | "
                  f"{flip_after:.3f} | {estimate:.2f} | {cost:.1f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", action="append", help="only this one (again for more)")
    parser.add_argument("--integrator", action="append", choices=["direct", "path"])
    parser.add_argument("--frames", type=int, default=128)
    parser.add_argument("--size", default="192x144")
    parser.add_argument("--denoise", action="store_true", help="what denoising does to few frames")
    parser.add_argument("--truth", type=int, default=512, help="frames of what --denoise compares with")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    if arguments.denoise:
        names = arguments.scene or ["cbox-rgb", "fabric", "shomen"]
        return denoising(names, arguments.size, arguments.seed, arguments.truth)
    width, height = map(int, arguments.size.split("x"))
    print(f"{'scene':<44}{'light':<8}{'error %':>8}{'ratio':>8}{'FLIP':>8}{'ms/Mpx':>9}")
    adapter, failed = "", 0
    for name, file in scenes().items():
        if arguments.scene and name not in arguments.scene:
            continue
        for integrator in arguments.integrator or ["direct", "path"]:
            common = ["--size", arguments.size, "--integrator", integrator]
            reference, picture = (OUT / f"{name}.{integrator}.{by}.exr" for by in ("reference", "realtime"))
            try:
                render(file, reference, *common, "--spp", 2 * arguments.frames)
                report = render(file, picture, *common, "--by", "realtime", "--spp", arguments.frames)
            except RuntimeError as complaint:
                print(f"{name:<44}{integrator:<8}{complaint}")
                failed += 1
                continue
            adapter = report["adapter"]
            a, b = load(reference), load(picture)
            error = np.sqrt(((a - b) ** 2).mean() / (a**2).mean())
            white = max(np.quantile(a, 0.99), 1e-9)
            _, flip, _ = flip_evaluator.evaluate(display(a, white), display(b, white), "LDR")
            cost = 1e3 * report["render_seconds"] / report["samples_per_pixel"] / (width * height * 1e-6)
            row = f"{100 * error:>8.2f}{b.mean() / a.mean():>8.4f}{flip:>8.4f}{cost:>9.0f}"
            print(f"{name:<44}{integrator:<8}{row}", flush=True)
    print(f"\n{arguments.frames} frames of {arguments.size} on {adapter}")
    if failed or not adapter:
        sys.exit(f"{failed} pictures were not made")


if __name__ == "__main__":
    main()
