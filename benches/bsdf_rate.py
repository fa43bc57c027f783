"""Nanoseconds a call of the reflectance models, on one core; with --peer, beside the plugins of Mitsuba 3 for the same.

    cargo xtask bench bsdf --peer

The models have their default parameters, the plugins those of the same surface. Directions are cosine-distributed;
Mitsuba gets 2^20 pairs at once and its results are summed, so that nothing is optimised away. Its time is what all
cores spent.
"""

import sys
import time

import peer

# Model of Yugen to plugin of Mitsuba.
PLUGINS = {
    "lambert": {"type": "diffuse"},
    "rough_conductor": {"type": "roughconductor", "distribution": "ggx", "alpha": 0.1, "material": "Au"},
    "rough_dielectric": {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.1},
    "rough_plastic": {"type": "roughplastic", "distribution": "ggx", "alpha": 0.1},
    "principled": {"type": "principled", "roughness": 0.5, "metallic": 0.3, "spec_tint": 0.5, "clearcoat": 0.5},
    "principled_thin": {"type": "principledthin", "roughness": 0.5, "spec_trans": 0.3, "diff_trans": 0.6},
}
COUNT = 1 << 20


def yugen():
    """Model to nanoseconds of eval, pdf, eval_pdf and sample."""
    rows = {}
    for line in peer.example("yugen-reflectance", "bsdf_rate").splitlines()[1:]:
        words = line.split()
        if len(words) == 5:
            rows[words[0]] = [float(w) for w in words[1:]]
    return rows


def mitsuba(mi, dr, plugin):
    """Nanoseconds of eval, pdf, eval_pdf and sample."""
    bsdf = mi.load_dict(plugin)
    rng = mi.PCG32(size=COUNT)
    two = lambda: mi.Point2f(rng.next_float32(), rng.next_float32())
    interaction = dr.zeros(mi.SurfaceInteraction3f, COUNT)
    interaction.wi = mi.warp.square_to_cosine_hemisphere(two())
    wo, u1, u2 = mi.warp.square_to_cosine_hemisphere(two()), rng.next_float32(), two()
    dr.eval(interaction, wo, u1, u2)
    context = mi.BSDFContext()
    calls = [
        lambda: bsdf.eval(context, interaction, wo).x,
        lambda: bsdf.pdf(context, interaction, wo),
        lambda: (lambda f, pdf: f.x + pdf)(*bsdf.eval_pdf(context, interaction, wo)),
        lambda: bsdf.sample(context, interaction, u1, u2)[1].x,
    ]
    out = []
    for call in calls:
        best = float("inf")
        for _ in range(8):
            start = time.process_time()
            dr.eval(dr.sum(call()))
            dr.sync_thread()
            best = min(best, time.process_time() - start)
        out.append(best / COUNT * 1e9)
    return out


def main():
    ours = yugen()
    names = ["eval", "pdf", "eval_pdf", "sample"]
    print(f"{'ns a call on a core':26}" + "".join(f"{n:>10}" for n in names))
    for model, times in ours.items():
        print(f"{model:26}" + "".join(f"{t:10.1f}" for t in times))
    if "--peer" not in sys.argv:
        return
    mi, dr = peer.mitsuba()
    print(f"\n{'Mitsuba, and its time over ours':26}")
    for model, plugin in PLUGINS.items():
        theirs = mitsuba(mi, dr, plugin)
        cells = "".join(f"{t:10.1f} ({t / o:4.2f})" for t, o in zip(theirs, ours[model]))
        print(f"{plugin['type']:26}{cells}")


if __name__ == "__main__":
    if "--peer" in sys.argv:
        peer.enter()
    main()
