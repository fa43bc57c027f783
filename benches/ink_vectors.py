"""Yugen's strokes as SVG, read by vpype (PyPI): groups, strokes, identities, closed loops and boxes as the painter has them.

    cargo xtask bench ink_vectors

The result stands in docs/ink.md under 'Vectors'. What is not as it should be is said, and ends in an error.
"""

import sys
import tempfile
from pathlib import Path

import peer

PACKAGES = ["vpype==1.15.0"]
# A middle line is simplified to a tenth of a pixel and written to a hundredth; round ends are half polygons of twelve sides.
TOLERANCE, ROUND = 0.11, 0.04


def groups(parsed, kind):
    """Of layers and the objects in them: the identities of their strokes in their order."""
    inner = lambda group: (e for e in group if isinstance(e, kind))
    return {
        (layer.id, object.values["data-object"]): [stroke.values["data-id"] for stroke in inner(object)]
        for layer in inner(parsed)
        for object in inner(layer)
    }


def main():
    peer.enter("vectors", PACKAGES)
    import svgelements
    import vpype

    with tempfile.TemporaryDirectory() as folder:
        lines = peer.example("yugen-ink", "svg_peer", folder).splitlines()
        file = str(Path(folder) / "drawing.svg")
        by_stroke = vpype.read_svg_by_attributes(file, ["data-id"], 0.1, crop=False)
        by_layer = vpype.read_multilayer_svg(file, 0.1, crop=False)
        found = groups(svgelements.SVG.parse(file), svgelements.Group)
    wrong, expected = [], {}
    strokes = []
    for line in lines:
        layer, name, identity, closed, middle, ink = line.split("\t")
        expected.setdefault((layer, name), []).append(identity)
        strokes.append((identity, closed == "true", *([float(v) for v in box.split()] for box in (middle, ink))))
    if found != expected:
        wrong.append(f"groups and identities: {found}, expected {expected}")
    names = [layer.metadata.get("vp_name") for layer in by_layer.layers.values()]
    if names != ["cun", "gou"]:
        wrong.append(f"layers {names}")
    # The first is the paper, which has no identity.
    read = list(by_stroke.layers.values())[1:]
    if len(read) != len(strokes):
        wrong.append(f"{len(read)} strokes, expected {len(strokes)}")
    off, loops = [0.0, 0.0], 0
    for lines, (identity, closed, middle, ink) in zip(read, strokes):
        *outlines, centre = lines
        loops += closed
        if len(outlines) != 1 + closed or any(o[0] != o[-1] for o in outlines) or (centre[0] == centre[-1]) != closed:
            wrong.append(f"{identity}: {len(outlines)} outlines, closed: {[o[0] == o[-1] for o in lines]}, expected {closed}")
        reach = max(i - m for i, m in zip(ink[2:], middle[2:]))
        for k, (these, box, most) in enumerate([([centre], middle, TOLERANCE), (outlines, ink, TOLERANCE + ROUND * reach)]):
            xs, ys = ([part(p) for line in these for p in line] for part in (lambda p: p.real, lambda p: p.imag))
            apart = max(abs(a - b) for a, b in zip((min(xs), min(ys), max(xs), max(ys)), box))
            off[k] = max(off[k], apart)
            if apart > most:
                wrong.append(f"{identity}: a box is off by {apart:.3f} pixels, of {most:.3f}")
    print("| layers | groups of objects | strokes | of them closed | identities | boxes off: middle lines, ink, pixels |")
    print("| --- | --- | --- | --- | --- | --- |")
    count = len({s[0] for s in strokes})
    print(f"| {len(names)} | {len(found)} | {len(read)} | {loops} | {count} | {off[0]:.2f}, {off[1]:.2f} |")
    if not loops or wrong:
        sys.exit("\n".join(wrong) or "no stroke is closed: nothing was shown of loops")


if __name__ == "__main__":
    main()
