"""How exactly `yugen capture calibrate` finds lamps in polished balls that the path tracer has drawn.

    cargo xtask bench calibrate [CASE …]

Chromium balls lie on dark, light or chequered matt ground, which they mirror, under eight far lamps of half a degree's
radius in a black room. A case is ground-radius-balls, with -lens for a camera twelve radii above: light-80-2, say. For
each it prints the outline's error in pixels and the directions' in degrees, or what the program says instead; of floats
(exr) and of 8 bits a channel in which the lamps' mirror images are white (png). Pictures are drawn once and kept in
out/bench/balls; BALLS names another folder, YUGEN another program. At the end it counts how many directions are wrong by
more than is said of them for 99 of 100, unsure ones that are refused otherwise among them.
"""

import json
import math
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
OUT = pathlib.Path(os.environ.get("BALLS", ROOT / "out" / "bench" / "balls"))
YUGEN = os.environ.get("YUGEN")
GROUNDS = {"dark": (0.03, 0.03), "light": (0.6, 0.6), "checker": (0.12, 0.6)}
#: Feet of the balls in radii from the middle of the picture, y up; and the picture's size in radii.
PLACES = {
    1: ([(0.31, 0.17)], (5, 4)),
    2: ([(-2.83, 0.61), (2.71, -0.37)], (9, 6)),
    3: ([(-3.05, 1.57), (3.12, 1.21), (0.23, -1.63)], (10, 7)),
}
CASES = [
    f"{ground}-{radius}-{balls}{lens}"
    for radius, balls, lens in [(20, 1, ""), (40, 1, ""), (80, 1, ""), (40, 2, ""), (40, 3, ""), (80, 2, "-lens"),
                                (160, 1, ""), (400, 1, "")]
    for ground in GROUNDS
]
ALTITUDE = 12.0


def lamps():
    """Unit vectors toward them: a spiral from 12 to 75 degrees off the camera's axis."""
    for i in range(8):
        polar, turn = math.radians(12 + 9 * i), 2.4 * i + 0.3
        yield (math.sin(polar) * math.cos(turn), math.sin(polar) * math.sin(turn), math.cos(polar))


def scene(ground, balls, size, samples, lens, lamp):
    """Balls of radius 1 on z = 0, seen from above."""
    pixels, width = size
    if lens:
        fov = 2 * math.degrees(math.atan(0.5 * width / ALTITUDE))
        camera = f'<sensor type="perspective"><float name="fov" value="{fov}"/><string name="fov_axis" value="x"/>'
        scale, height = "", ALTITUDE
    else:
        camera, scale, height = '<sensor type="orthographic">', f'<scale x="{width / 2}" y="{width / 2}"/>', 30
    dark, light = GROUNDS[ground]
    texture = (
        f'<texture type="checkerboard" name="reflectance"><rgb name="color0" value="{dark}"/>'
        f'<rgb name="color1" value="{light}"/><transform name="to_uv"><scale x="43" y="43"/></transform></texture>'
    )
    far = [20000 * c for c in lamp]
    parts = [
        '<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="5"/></integrator>',
        f'{camera}<transform name="to_world">{scale}<lookat origin="0,0,{height}" target="0,0,0" up="0,1,0"/></transform>',
        f'<film type="hdrfilm"><integer name="width" value="{pixels[0]}"/><integer name="height" value="{pixels[1]}"/>'
        f'<rfilter type="gaussian"/></film><sampler type="independent"><integer name="sample_count" value="{samples}"/>'
        "</sampler></sensor>",
        f'<shape type="rectangle"><transform name="to_world"><scale value="30"/></transform>'
        f'<bsdf type="diffuse">{texture}</bsdf></shape>',
        f'<shape type="sphere"><point name="center" x="{far[0]}" y="{far[1]}" z="{far[2]}"/><float name="radius" '
        'value="174.5"/><emitter type="area"><rgb name="radiance" value="13000"/></emitter></shape>',
    ]
    for x, y in balls:
        parts.append(
            f'<shape type="sphere"><point name="center" x="{x}" y="{y}" z="1"/><float name="radius" value="1"/>'
            '<bsdf type="conductor"><string name="material" value="Cr"/></bsdf></shape>'
        )
    return "\n".join(parts) + "</scene>"


def draw(case):
    """The folders of floats and of bytes, the balls as x, y, radius, and the focal length in pixels or none."""
    ground, radius, count, *lens = case.split("-")
    radius, (balls, extent) = int(radius), PLACES[int(count)]
    pixels = [round(radius * e) for e in extent]
    width = pixels[0] / radius
    samples = {20: 64, 40: 64, 80: 32, 160: 8, 400: 2}[radius]
    floats, bytes_ = OUT / case / "exr", OUT / case / "png"
    for i, lamp in enumerate(lamps()):
        for folder, form in ((floats, "exr"), (bytes_, "png")):
            folder.mkdir(parents=True, exist_ok=True)
            if (folder / f"{i}.{form}").exists():
                continue
            text = folder.parent / "scene.xml"
            text.write_text(scene(ground, balls, (pixels, width), samples, lens, lamp))
            command = [YUGEN, "render", text, "-o", folder / f"{i}.{form}", "--seed", str(i), "--clamp", "2"]
            subprocess.run(command, check=True, capture_output=True)
    middle = [p / 2 for p in pixels]
    focal = None
    if lens:
        focal = ALTITUDE * radius
    truth = []
    for x, y in balls:
        if lens:
            # The ends of the outline on the line through the middle of the picture.
            off, turn = math.hypot(x, y), math.atan2(y, x)
            axis, half = math.atan(off / (ALTITUDE - 1)), math.asin(1 / math.hypot(off, ALTITUDE - 1))
            near, end = focal * math.tan(axis - half), focal * math.tan(axis + half)
            at, r = 0.5 * (near + end), 0.5 * (end - near)
            truth.append((middle[0] + at * math.cos(turn), middle[1] - at * math.sin(turn), r))
        else:
            truth.append((middle[0] + x * radius, middle[1] - y * radius, radius))
    return (floats, bytes_), truth, focal


def degrees(a, b):
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    return math.degrees(math.atan2(math.hypot(*cross), sum(x * y for x, y in zip(a, b))))


def main(cases):
    global YUGEN
    if not YUGEN:
        subprocess.run(["cargo", "build", "--release", "--package", "yugen-cli"], cwd=ROOT, check=True)
        YUGEN = ROOT / "target" / "release" / "yugen"
    wrong = 0
    all_lamps = list(lamps())
    degrees_off = lambda light: degrees(light["light"], all_lamps[int(light["file"].split(".")[0])])
    bounds = []
    for case in cases:
        folders, truth, focal = draw(case)
        if os.environ.get("DRAW"):
            continue
        for folder in folders:
            command = [YUGEN, "capture", "calibrate", folder, "--balls", str(len(truth)), "--json", "--force"]
            command += ["--preview", folder.parent / f"{folder.name}.preview.png"]
            command += ["--focal", str(focal)] if focal else []
            done = subprocess.run([str(c) for c in command + ["--tolerance", "20"]], capture_output=True, text=True)
            if done.returncode == 0:
                lights = json.loads(done.stdout)["lights"]
                bounds += [(degrees_off(light), light["uncertainty_degrees"]) for light in lights]
            done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
            if done.returncode:
                print(f"{case:22} {folder.name}: {done.stderr.strip()}", flush=True)
                continue
            found = json.loads(done.stdout)
            outline = 0
            for x, y, r in truth:
                near = min(found["balls"], key=lambda b: math.hypot(b["x"] - x, b["y"] - y))
                outline = max(outline, math.hypot(near["x"] - x, near["y"] - y), abs(near["radius"] - r))
            off = [degrees_off(light) for light in found["lights"]]
            said = [l.get("uncertainty_degrees") or 0 for l in found["lights"]]
            wrong += max(off) > 0.3
            print(
                f"{case:22} {folder.name}: {len(off)} of 8 lights, outline within {outline:.3f} pixels, directions within "
                f"{max(off):.3f} degrees ({sum(off) / len(off):.3f} in the mean; {max(said):.3f} said)",
                flush=True,
            )
    beyond = [(off, said) for off, said in bounds if off > said]
    worst = max((off / said for off, said in bounds), default=0)
    print(f"{len(beyond)} of {len(bounds)} directions beyond what is said of 99 in 100, {worst:.2f} times that at most")
    print(f"{wrong} of {2 * len(cases)} wrong by more than .3 degrees without a word")


if __name__ == "__main__":
    main(sys.argv[1:] or CASES)
