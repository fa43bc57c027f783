#!/usr/bin/env python3
"""The real-time renderer beside Filament, both on the GPU that is there, against Yugen's reference.

    cargo xtask bench stage --peer                    a table: error, FLIP, seconds of processors for a frame's megapixel
    cargo xtask bench stage --peer --size 320x180 --frames 1,4,16

One GLB made here (balls of metal, brushed and not, of lacquer and of chalk on a floor, KHR_materials_anisotropy, four point
lights of KHR_lights_punctual) under an image of a sky with two soft windows. Filament is that of PyPI's
filly, with shadow maps of 1024 x 1024 for all four, which is its default, and four samples a pixel. Lights are seen by both
as candela, environments as nits; because Filament's exposure is that of a camera, its picture is scaled by the two
factors, of the lights and of the environment, that bring it nearest to the reference. error: root mean square of the
difference over that of the reference. FLIP: mean, of display values, with the white of the reference's brightest
hundredth. Seconds are those of all processors, of a frame among many: on a software GPU, that is what a frame costs.
"""

import argparse
import json
import math
import resource
import struct

import peer

PACKAGES = ["filly==0.2.1", "numpy", "OpenEXR", "flip-evaluator"]
NAME = "filament"
if __name__ == "__main__":
    peer.enter(NAME, PACKAGES)
import filly
import numpy as np
import OpenEXR
from realtime import YUGEN, display, load, render

from flip_evaluator import evaluate

OUT = peer.ROOT / "out" / "stage_peer"
EYE, TARGET, FOV = (0.0, 1.7, 4.2), (0.0, 0.3, 0.0), 50.0
LIGHTS = [(-1.8, 2.2, 1.2), (1.8, 2.4, 1.0), (-0.9, 2.6, -1.5), (1.2, 1.8, 2.2)]
CANDELA = 12.0
LAMP = (1.0, 0.9, 0.75)
# Exposure values at ISO 100, for what is dark first.
EXPOSURES = range(-6, 9, 2)
# Name, base colour, metallic, roughness, strength of anisotropy, its angle.
MATERIALS = [
    ("chalk", (0.7, 0.68, 0.62), 0.0, 1.0, 0.0, 0.0),
    ("brushed gold", (1.0, 0.77, 0.34), 1.0, 0.4, 0.8, 0.0),
    ("brushed steel", (0.6, 0.58, 0.56), 1.0, 0.5, 0.6, math.pi / 2),
    ("gold", (1.0, 0.77, 0.34), 1.0, 0.35, 0.0, 0.0),
    ("lacquer", (0.5, 0.02, 0.02), 0.0, 0.3, 0.0, 0.0),
    ("floor", (0.4, 0.33, 0.25), 0.0, 0.9, 0.0, 0.0),
]


def ball(rings=64, sectors=128):
    """Positions, normals, tangents, (u, v) and triangles of a ball of radius one."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, sectors + 1), indexing="ij"
    )
    normal = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1)
    tangent = np.stack([np.cos(phi), 0 * phi, -np.sin(phi), 1 + 0 * phi], -1)
    uv = np.stack([phi / (2 * np.pi), theta / np.pi], -1)
    at = np.arange(rings)[:, None] * (sectors + 1) + np.arange(sectors)
    below = at + sectors + 1
    triangles = np.concatenate([np.stack([at, below, at + 1], -1), np.stack([at + 1, below, below + 1], -1)])
    flat = [a.reshape(-1, a.shape[-1]) for a in (normal, normal, tangent, uv)]
    return *flat, triangles.reshape(-1, 3)


def plane(half):
    """The same of a floor that looks up."""
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * float(half)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]])
    return corners, np.tile([0, 1, 0], (4, 1)), np.tile([1, 0, 0, 1], (4, 1)), uv, np.array([[0, 1, 2], [0, 2, 3]])


def sky(width=1024):
    """Radiance from all around, as both programs take it: a dim sky and two soft windows. Rows from above, RGB."""
    height = width // 2
    theta, phi = np.meshgrid(
        (np.arange(height) + 0.5) * np.pi / height, (np.arange(width) + 0.5) * 2 * np.pi / width, indexing="ij"
    )
    up = 0.5 + 0.5 * np.cos(theta)
    light = up[..., None] * [0.25, 0.35, 0.5] + (1 - up)[..., None] * [0.12, 0.1, 0.08]
    for middle, wide, colour in [((1.1, 1.2), (0.3, 0.35), [9, 8, 6.5]), ((0.9, 4.4), (0.25, 0.5), [5, 6, 7.5])]:
        x, y = (phi - middle[1]) / wide[1], (theta - middle[0]) / wide[0]
        light += np.exp(-(x**4) - y**4)[..., None] * colour
    return light.astype(np.float32)


def glb(path, candela):
    """Writes the scene; lights of no candela are left out."""
    blob, views, accessors, meshes, nodes = bytearray(), [], [], [], []

    def accessor(array, kind, dtype, target):
        array = np.ascontiguousarray(array, dtype)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes, "target": target})
        blob.extend(array.tobytes())
        component = {"f4": 5126, "u4": 5125}[dtype]
        entry = {"bufferView": len(views) - 1, "componentType": component, "type": kind}
        entry["count"] = array.size if kind == "SCALAR" else len(array)
        if kind == "VEC3" and target == 34962:
            entry |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    def shape(parts):
        position, normal, tangent, uv, triangles = parts
        attributes = {
            "POSITION": accessor(position, "VEC3", "f4", 34962),
            "NORMAL": accessor(normal, "VEC3", "f4", 34962),
            "TANGENT": accessor(tangent, "VEC4", "f4", 34962),
            "TEXCOORD_0": accessor(uv, "VEC2", "f4", 34962),
        }
        return attributes, accessor(triangles.ravel(), "SCALAR", "u4", 34963)

    round_one, flat = shape(ball()), shape(plane(6))
    materials = []
    for k, (name, colour, metallic, roughness, strength, angle) in enumerate(MATERIALS):
        pbr = {"baseColorFactor": [*colour, 1], "metallicFactor": metallic, "roughnessFactor": roughness}
        material = {"name": name, "pbrMetallicRoughness": pbr}
        if strength:
            material["extensions"] = {
                "KHR_materials_anisotropy": {"anisotropyStrength": strength, "anisotropyRotation": angle}
            }
        materials.append(material)
        attributes, indices = flat if name == "floor" else round_one
        meshes.append({"primitives": [{"attributes": attributes, "indices": indices, "material": k}]})
        node = {"mesh": k, "name": name}
        if name != "floor":
            node |= {"translation": [(k - 2) * 0.8, 0.36, 0.25 * (k % 2)], "scale": [0.36] * 3}
        nodes.append(node)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "materials": materials, "meshes": meshes,
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(blob)}],
        "extensionsUsed": ["KHR_materials_anisotropy"],
    }
    if candela:
        document["extensionsUsed"].append("KHR_lights_punctual")
        lights = [{"type": "point", "intensity": candela, "color": LAMP} for _ in LIGHTS]
        document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
        nodes += [
            {"translation": at, "extensions": {"KHR_lights_punctual": {"light": k}}} for k, at in enumerate(LIGHTS)
        ]
    document |= {"nodes": nodes, "scenes": [{"nodes": list(range(len(nodes)))}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def used():
    """Seconds that processors have worked for this process and for those that it started and that ended."""
    return [sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]


def filament(model, size, environment, light, frames):
    """Linear picture of Filament and, of `frames` frames, the seconds of processors for one."""
    width, height = size
    with filly.Renderer() as renderer:
        scene = renderer.create_scene()
        loaded = scene.load(str(model))
        for lamp in loaded.lights:
            lamp.casts_shadows = True
        scene.environment = renderer.create_environment(environment)
        scene.environment_visible = True
        scene.environment_intensity = light
        scene.shadows, scene.tone_mapping, scene.encoding = True, "linear", "srgb"
        scene.msaa = 4
        camera = renderer.create_camera()
        # The field of view of both is that across.
        down = math.degrees(2 * math.atan(math.tan(math.radians(FOV) / 2) * height / width))
        camera.set_perspective(fov_y_deg=down, aspect=width / height, near=0.1, far=100)
        camera.position = EYE
        camera.look_at(TARGET)
        scene.camera = camera
        target = renderer.create_render_target(width=width, height=height)

        # It gives bytes, so a picture is put together from exposures, each where the one before is white.
        linear = None
        for value in EXPOSURES:
            camera.exposure = value
            renderer.render(scene, target)
            renderer.finish()
            shown = np.asarray(target.read(), np.float64)[..., :3] / 255
            light = np.where(shown < 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4) * 2.0**value
            linear = light if linear is None else np.where(white, light, linear)
            white = shown > 0.95
        before = used()[0]
        for _ in range(frames):
            renderer.render(scene, target)
        renderer.finish()
        return linear, (used()[0] - before) / max(frames, 1)


def measures(reference, picture):
    """Error and FLIP."""
    white = max(np.quantile(reference, 0.99), 1e-9)
    error = np.sqrt(((picture - reference) ** 2).mean() / (reference**2).mean())
    return error, evaluate(display(reference, white), display(picture, white), "LDR")[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", default="1,4,16,64", help="of Yugen, in one picture")
    parser.add_argument("--reference", type=int, default=512, help="samples a pixel of the reference")
    parser.add_argument("--timed", default="1920x1080", help="size at which Filament is timed: its shadow maps cost the same at any")
    arguments = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    size = tuple(map(int, arguments.size.split("x")))
    megapixels = size[0] * size[1] * 1e-6
    environment = sky()
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": environment}).write(str(OUT / "sky.exr"))
    glb(OUT / "lit.glb", CANDELA)
    glb(OUT / "unlit.glb", 0)
    scene = OUT / "scene.toml"
    # A glTF file placed in a scene brings its shapes alone.
    lights = "".join(
        f'[[light]]\ntype = "point"\nat = {list(at)}\nintensity = {[CANDELA * c for c in LAMP]}\n\n' for at in LIGHTS
    )
    scene.write_text(
        f'[scene]\nworking_space = "srgb"\n\n{lights}'
        f"[camera]\nfrom = {list(EYE)}\nto = {list(TARGET)}\nfov = {FOV}\n\n"
        '[[shape]]\ntype = "file"\nfile = "lit.glb"\n\n'
        '[[light]]\ntype = "environment"\nimage = "sky.exr"\n'
    )
    lamps, _ = filament(OUT / "lit.glb", size, environment, 0.0, 0)
    around, _ = filament(OUT / "unlit.glb", size, environment, 1.0, 0)
    timed = tuple(map(int, arguments.timed.split("x")))
    _, seconds = filament(OUT / "lit.glb", timed, environment, 1.0, 20)
    seconds /= timed[0] * timed[1] * 1e-6
    print(f"{'light':<8}{'program':<22}{'error %':>8}{'FLIP':>8}{'CPU s/Mpx and frame':>22}")
    for integrator in ("direct", "path"):
        common = ["--size", arguments.size, "--integrator", integrator]
        reference = OUT / f"reference.{integrator}.exr"
        render(scene, reference, *common, "--spp", arguments.reference)
        truth = load(reference)
        both = np.stack([lamps.ravel(), around.ravel()], -1)
        factors = np.linalg.lstsq(both, truth.ravel(), rcond=None)[0]
        error, flip = measures(truth, (both @ factors).reshape(truth.shape))
        print(f"{integrator:<8}{'Filament':<22}{100 * error:>8.2f}{flip:>8.4f}{seconds:>22.2f}", flush=True)
        spent = {}
        counts = [int(n) for n in arguments.frames.split(",")]
        # Shaders are compiled once and kept.
        render(scene, OUT / "first.exr", *common, "--by", "realtime", "--spp", 1)
        for frames in counts:
            picture, before = OUT / f"realtime.{integrator}.{frames}.exr", used()[1]
            report = render(scene, picture, *common, "--by", "realtime", "--spp", frames)
            spent[frames] = used()[1] - before
            error, flip = measures(truth, load(picture))
            # What start and end take falls out of the difference to the smallest number of frames.
            more = frames - counts[0]
            cost = f"{(spent[frames] - spent[counts[0]]) / more / megapixels:>22.2f}" if more else f"{'':>22}"
            print(f"{integrator:<8}{f'Yugen, {frames} frames':<22}{100 * error:>8.2f}{flip:>8.4f}{cost}", flush=True)
        print(f"{'':<8}Filament's lights times {factors[0]:.4g}, its environment times {factors[1]:.4g}")
    print(f"\n{arguments.size} on {report['adapter']}; reference of {arguments.reference} samples a pixel")


if __name__ == "__main__":
    main()
