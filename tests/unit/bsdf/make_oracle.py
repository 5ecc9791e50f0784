#!/usr/bin/env python3
"""Writes oracle_values.inc: f |cos wi| of each material as Mitsuba 3 evaluates it, at fixed directions.

Needs the `mitsuba` package (3.9.1 made the committed table) in an environment of its own:
    python3 tests/unit/bsdf/make_oracle.py > tests/unit/bsdf/oracle_values.inc
The material names are the keys of the table in mitsuba_values_test.cpp.
"""
import math
import random

import mitsuba as mi

mi.set_variant("scalar_rgb")


def rgb(r, g, b):
    return {"type": "rgb", "value": [r, g, b]}


GOLD = {"eta": rgb(0.14, 0.37, 1.44), "k": rgb(3.98, 2.38, 1.60)}
MATERIALS = {
    "diffuse": {"type": "diffuse", "reflectance": rgb(0.2, 0.5, 0.9)},
    "twosided": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(0.2, 0.5, 0.9)}},
}
for dist in ("beckmann", "ggx"):
    for a in (0.02, 0.1, 0.5, 1.0):
        MATERIALS[f"conductor_{dist}_{a}"] = dict(GOLD, type="roughconductor", distribution=dist, alpha=a)
    MATERIALS[f"conductor_{dist}_aniso"] = dict(GOLD, type="roughconductor", distribution=dist, alpha_u=0.3, alpha_v=0.05,
                                               specular_reflectance=rgb(0.9, 0.8, 0.7))
    for a in (0.05, 0.1, 0.3, 0.7):
        MATERIALS[f"plastic_{dist}_{a}"] = {"type": "roughplastic", "distribution": dist, "alpha": a,
                                            "int_ior": 1.49, "ext_ior": 1.000277,
                                            "diffuse_reflectance": rgb(0.1, 0.27, 0.9)}
    MATERIALS[f"plastic_{dist}_nonlinear"] = {"type": "roughplastic", "distribution": dist, "alpha": 0.2,
                                              "int_ior": 1.9, "ext_ior": 1.0, "nonlinear": True,
                                              "diffuse_reflectance": rgb(0.1, 0.27, 0.9),
                                              "specular_reflectance": rgb(1, 0.5, 0.25)}
    for a in (0.1, 0.5):
        MATERIALS[f"glass_{dist}_{a}"] = {"type": "roughdielectric", "distribution": dist, "alpha": a, "int_ior": 1.5, "ext_ior": 1.0,
                                          "specular_reflectance": rgb(0.9, 0.8, 0.7), "specular_transmittance": rgb(0.5, 0.6, 0.7)}
    MATERIALS[f"glass_{dist}_aniso"] = {"type": "roughdielectric", "distribution": dist, "alpha_u": 0.4, "alpha_v": 0.1,
                                        "int_ior": 1.333, "ext_ior": 1.0}
for ior in (1.49, 1.9):
    MATERIALS[f"smooth_plastic_{ior}"] = {"type": "plastic", "int_ior": ior, "ext_ior": 1.0, "diffuse_reflectance": rgb(0.1, 0.27, 0.9)}
MATERIALS["smooth_plastic_nonlinear"] = {"type": "plastic", "int_ior": 1.49, "ext_ior": 1.0, "nonlinear": True,
                                         "diffuse_reflectance": rgb(0.1, 0.27, 0.9)}
MATERIALS["mask"] = {"type": "mask", "opacity": 0.3, "bsdf": {"type": "diffuse", "reflectance": rgb(0.2, 0.5, 0.9)}}
MATERIALS["blend"] = {"type": "blendbsdf", "weight": 0.25, "bsdf_0": {"type": "diffuse", "reflectance": rgb(0.2, 0.5, 0.9)},
                      "bsdf_1": dict(GOLD, type="roughconductor", distribution="ggx", alpha=0.3)}
BASE = rgb(0.8, 0.4, 0.1)
MATERIALS["principled"] = {"type": "principled", "base_color": BASE}
MATERIALS["principled_metal"] = {"type": "principled", "base_color": BASE, "metallic": 0.7, "roughness": 0.3,
                                 "anisotropic": 0.5, "spec_tint": 0.4, "specular": 0.8}
MATERIALS["principled_cloth"] = {"type": "principled", "base_color": BASE, "roughness": 0.7, "sheen": 0.8, "sheen_tint": 0.5,
                                 "flatness": 0.6, "clearcoat": 0.7, "clearcoat_gloss": 0.3}
MATERIALS["principled_thin"] = {"type": "principled", "base_color": BASE, "eta": 0.8, "spec_tint": 0.5, "metallic": 0.2,
                                "clearcoat": 1.0, "clearcoat_gloss": 0.9, "roughness": 0.4}
MATERIALS["principled_glass"] = {"type": "principled", "base_color": BASE, "spec_trans": 0.9, "eta": 1.4, "roughness": 0.5}
MATERIALS["principled_glass_all"] = {"type": "principled", "base_color": BASE, "spec_trans": 0.4, "metallic": 0.3, "roughness": 0.45,
                                     "anisotropic": 0.8, "spec_tint": 0.6, "specular": 0.3, "sheen": 0.2, "sheen_tint": 1.0,
                                     "flatness": 0.3, "clearcoat": 0.5, "clearcoat_gloss": 0.1}
PLAIN_MAP = {"flip_invalid_normals": False, "use_shadowing_function": False}
ROUGH_GOLD = dict(GOLD, type="roughconductor", distribution="ggx", alpha_u=0.4, alpha_v=0.15)
# 4 x 2 heights, bilinear.
HEIGHTS = {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(mi.TensorXf([0.1, 0.4, 0.8, 0.3, 0.2, 0.9, 0.5, 0.6], shape=(2, 4, 1)))}
for plain in (False, True):
    flags = PLAIN_MAP if plain else {}
    MATERIALS["normalmap" + "_plain" * plain] = {"type": "normalmap", "normalmap": rgb(0.85, 0.35, 0.75), "bsdf": ROUGH_GOLD, **flags}
    MATERIALS["bumpmap" + "_plain" * plain] = {"type": "bumpmap", "arbitrary": HEIGHTS, "scale": 0.7, "bsdf": ROUGH_GOLD, **flags}


def direction(cos_theta, phi):
    s = math.sqrt(max(0.0, 1 - cos_theta * cos_theta))
    return [s * math.cos(phi), s * math.sin(phi), cos_theta]


def pairs(name, material):
    rng = random.Random(name)
    for k, mu in enumerate((0.99, 0.8, 0.5, 0.2, 0.05)):
        wo = direction(mu, rng.uniform(0, 2 * math.pi))
        for spread in (0.05, 0.3, 1.0):
            mirror = [-wo[0], -wo[1], wo[2]]
            wi = [m + spread * rng.gauss(0, 1) for m in mirror]
            wi[2] = abs(wi[2])
            n = math.sqrt(sum(x * x for x in wi))
            wi = [x / n for x in wi]
            yield wo, wi
            if "glass" in name:  # both sides, in and out
                yield [wo[0], wo[1], -wo[2]], [wi[0], wi[1], -wi[2]]
                yield wo, [wi[0] / 2, wi[1] / 2, -math.sqrt(1 - (wi[0] ** 2 + wi[1] ** 2) / 4)]
                yield [wo[0], wo[1], -wo[2]], wi
    if name == "twosided":
        yield [0.6, 0, -0.8], [0, 0.6, -0.8]


print("// Made by make_oracle.py with Mitsuba", mi.__version__ + ". {material, wo, wi, f |cos wi|}")
for name, spec in MATERIALS.items():
    bsdf = mi.load_dict(spec)
    for wo, wi in pairs(name, spec):
        si = mi.SurfaceInteraction3f()
        si.wi = wo
        si.uv = [0.4, 0.55]
        si.n = [0, 0, 1]
        si.sh_frame = mi.Frame3f([0, 0, 1])
        si.sh_frame.s, si.sh_frame.t = [1, 0, 0], [0, 1, 0]
        si.dp_du, si.dp_dv = [2, 0, 0], [-0.5, 1.5, 0]
        si.t = 1
        v = bsdf.eval(mi.BSDFContext(), si, wi)
        numbers = ", ".join("{" + ", ".join(f"{float(x):.8g}" for x in t) + "}" for t in (wo, wi, v))
        print(f'{{"{name}", {numbers}}},')
