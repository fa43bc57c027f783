"""Writes mitsuba.txt: values of Mitsuba 3 for mitsuba.rs. Usage: python print_mitsuba.py > mitsuba.txt

A line that starts with a model's name gives its parameters; the lines below it are
wo, wi, f (without the cosine), pdf: ten numbers.
"""
import numpy as np
import mitsuba as mi

mi.set_variant("scalar_rgb")
rng = np.random.default_rng(1)
print(f"# Mitsuba {mi.__version__}, scalar_rgb")


def rgb(c):
    return {"type": "rgb", "value": list(c)}


def direction(below):
    z = rng.uniform(0.05, 1.0) * (-1 if below else 1)
    phi = rng.uniform(0, 2 * np.pi)
    r = np.sqrt(1 - z * z)
    return np.array([r * np.cos(phi), r * np.sin(phi), z])


def near(wo, eta, spread, transmit):
    """A direction near the mirror or refracted one, where the lobe is."""
    side = np.sign(wo[2])
    h = np.array([*(rng.normal(size=2) * spread), 1.0]) * [1, 1, side]
    h /= np.linalg.norm(h)
    c = wo @ h
    if not transmit:
        return 2 * c * h - wo
    if eta is None:
        # A sheet: the mirror direction on the other side.
        return (2 * c * h - wo) * [1, 1, -1]
    e = eta if side > 0 else 1 / eta
    t2 = 1 - (1 - c * c) / e**2
    return None if t2 <= 0 else (c / e - np.sqrt(t2)) * h - wo / e


def table(name, ours, plugin, n, spread=0.2, eta=1.0, sides=("r",)):
    print(name, *(f"{k}={v}" for k, v in ours.items()))
    bsdf = mi.load_dict(plugin)
    ctx = mi.BSDFContext()
    done = 0
    while done < n:
        # Radiance mode: Mitsuba's si.wi is our wo.
        side = sides[done % len(sides)]
        below = "b" in side
        transmit = "t" in side
        wo = direction(below)
        wi = near(wo, eta, spread, transmit) if done % 3 else direction(below != transmit)
        if wi is None or abs(wi[2]) < 0.02 or (wi[2] * wo[2] > 0) == transmit:
            continue
        wo, wi = np.float32(wo / np.linalg.norm(wo)), np.float32(wi / np.linalg.norm(wi))
        si = mi.SurfaceInteraction3f()
        si.wi = wo
        f = np.array(bsdf.eval(ctx, si, mi.Vector3f(wi))) / abs(wi[2])
        pdf = bsdf.pdf(ctx, si, mi.Vector3f(wi))
        print(*(f"{x:.8g}" for x in (*wo, *wi)), *(f"{x:.6g}" for x in (*f, pdf)))
        done += 1


kinds = ["beckmann", "ggx"]
gold = dict(eta=(0.19, 0.33, 1.47), k=(3.2, 2.5, 1.86))
text = lambda c: ",".join(map(str, c))
for d, ax, ay in [(0, 0.1, 0.1), (0, 0.3, 0.3), (0, 0.1, 0.5), (1, 0.1, 0.1), (1, 0.3, 0.3), (1, 0.5, 0.15)]:
    table("rough_conductor",
          dict(distribution=d, alpha_x=ax, alpha_y=ay, eta=text(gold["eta"]), k=text(gold["k"])),
          dict(type="roughconductor", distribution=kinds[d], alpha_u=ax, alpha_v=ay,
               eta=rgb(gold["eta"]), k=rgb(gold["k"])), 16, spread=ax)
for d, ax, ay in [(0, 0.1, 0.1), (0, 0.4, 0.2), (1, 0.3, 0.3), (1, 0.1, 0.4)]:
    table("rough_dielectric", dict(distribution=d, alpha_x=ax, alpha_y=ay, int_ior=1.5, ext_ior=1.0),
          dict(type="roughdielectric", distribution=kinds[d], alpha_u=ax, alpha_v=ay, int_ior=1.5, ext_ior=1.0),
          24, spread=ax, eta=1.5, sides=("r", "t", "rb", "tb"))
base, coat = (0.7, 0.3, 0.1), (0.9, 0.8, 1.0)
for nonlinear in (0, 1):
    common = dict(nonlinear=bool(nonlinear), int_ior=1.49, ext_ior=1.0,
                  diffuse_reflectance=rgb(base), specular_reflectance=rgb(coat))
    ours = dict(nonlinear=nonlinear, int_ior=1.49, ext_ior=1.0,
                diffuse_reflectance=text(base), specular_reflectance=text(coat))
    table("plastic", ours, dict(type="plastic", **common), 12)
    for d, a in [(0, 0.1), (1, 0.3), (0, 0.6)]:
        table("rough_plastic", dict(distribution=d, alpha=a, **ours),
              dict(type="roughplastic", distribution=kinds[d], alpha=a, **common), 12, spread=a)
plain = dict(roughness=0.5, anisotropic=0.0, metallic=0.0, spec_trans=0.0, eta=1.5, spec_tint=0.0, sheen=0.0,
             sheen_tint=0.0, flatness=0.0, clearcoat=0.0, clearcoat_gloss=0.0)
for change in [dict(), dict(metallic=1.0, roughness=0.3, anisotropic=0.8), dict(metallic=0.4, spec_tint=0.7),
               dict(sheen=1.0, sheen_tint=0.6), dict(flatness=0.8, roughness=0.8),
               dict(clearcoat=1.0, clearcoat_gloss=0.4), dict(spec_trans=0.7, roughness=0.4, anisotropic=0.3),
               dict(spec_trans=1.0, eta=1.33, metallic=0.2),
               dict(metallic=0.3, spec_trans=0.5, sheen=0.5, sheen_tint=0.5, flatness=0.5, clearcoat=0.7,
                    clearcoat_gloss=0.9, spec_tint=0.3, anisotropic=0.5)]:
    p = {**plain, **change}
    sides = ("r", "t", "rb", "tb") if p["spec_trans"] > 0 else ("r",)
    table("principled", dict(base_color=text(base), **p),
          dict(type="principled", base_color=rgb(base), **p), 16, spread=0.3, eta=p["eta"], sides=sides)
thin = dict(roughness=0.5, anisotropic=0.0, spec_trans=0.0, eta=1.5, spec_tint=0.0, sheen=0.0, sheen_tint=0.0,
            flatness=0.0, diff_trans=0.0)
for change in [dict(), dict(diff_trans=2.0), dict(sheen=0.7, sheen_tint=0.6, flatness=0.5, roughness=0.8, diff_trans=1.2),
               dict(spec_trans=1.0, roughness=0.4), dict(spec_trans=0.6, spec_tint=0.5, anisotropic=0.5, eta=1.4),
               dict(spec_trans=0.3, diff_trans=0.8, sheen=0.4)]:
    ours = thin | change
    table("principled_thin", dict(base_color=text(base), **ours),
          dict(type="principledthin", base_color=rgb(base), **ours), 16, eta=None, sides=("r", "t", "rb", "tb"))
