#!/usr/bin/env python3
"""Real-time pictures beside the reference's, on the same scenes.

    cargo xtask bench realtime                        a table: error, FLIP, frames, milliseconds a megapixel and frame
    cargo xtask bench realtime --scene cbox --integrator direct --frames 256

Scenes are Mitsuba's (from the folder named by YUGEN_DATA), those of examples/scenes, and every mesh (by itself, under the
default sun and sky, or with the lights of its file). Each is rendered by the reference renderer to twice the samples and
by the real-time renderer, once with direct light alone and once with all. error: root mean square of the difference over that of the reference. ratio: of the means. FLIP: mean, of display
values (Andersson et al. 2020), with the white of the reference's brightest hundredth.
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", action="append", help="only this one (again for more)")
    parser.add_argument("--integrator", action="append", choices=["direct", "path"])
    parser.add_argument("--frames", type=int, default=128)
    parser.add_argument("--size", default="192x144")
    arguments = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
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
