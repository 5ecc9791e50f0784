"""Evaluates nodes whose inputs are all constant, in the same way as Cycles. A value is a number or three numbers."""

import colorsys
import math

import numpy as np

LUMINANCE = (0.2126390, 0.7151687, 0.0721923)  # of linear Rec.709


def luminance(colour):
    return sum(weight * c for weight, c in zip(LUMINANCE, colour))


def as_type(value, kind, source):
    """Converts a value of a socket of type `source` for a socket of type VALUE, RGBA or VECTOR: a colour becomes
    its luminance as a number, and a vector its mean."""
    if value is None or kind not in ("VALUE", "RGBA", "VECTOR"):
        return value
    if kind == "VALUE":
        if not isinstance(value, list):
            return value
        return sum(value) / len(value) if source == "VECTOR" else luminance(value)
    return value if isinstance(value, list) else [value] * 3


def computed(node, output, value):
    """Returns the value of the node at `output`, or None if it cannot be computed here or an input is not
    constant. `value(name)` returns the value of the input with that identifier: a number, three numbers, or None
    if it is not constant."""
    build = NODES.get(node.type)
    if build is None:
        return None
    try:
        return build(node, output, value)
    except (TypeError, ValueError, OverflowError):  # an input that is not constant, or out of all range
        return None


def _mixed(share, one, two):
    return [a + (b - a) * share for a, b in zip(one, two)]


def _clamped(x, low=0.0, high=1.0):
    return min(max(x, low), high)


# The colour matching functions x, y, z of CIE 1931 (2 degrees) from 380 to 780 nm, every 20 nm.
MATCHING = np.array([
    [0.0014, 0.0000, 0.0065], [0.0143, 0.0004, 0.0679], [0.1344, 0.0040, 0.6456], [0.3483, 0.0230, 1.7471],
    [0.2908, 0.0600, 1.6692], [0.0956, 0.1390, 0.8130], [0.0049, 0.3230, 0.2720], [0.0633, 0.7100, 0.0782],
    [0.2904, 0.9540, 0.0203], [0.5945, 0.9950, 0.0039], [0.9163, 0.8700, 0.0017], [1.0622, 0.6310, 0.0008],
    [0.8544, 0.3810, 0.0002], [0.4479, 0.1750, 0.0000], [0.1649, 0.0610, 0.0000], [0.0468, 0.0170, 0.0000],
    [0.0114, 0.0041, 0.0000], [0.0029, 0.0010, 0.0000], [0.0007, 0.0002, 0.0000], [0.0002, 0.0001, 0.0000],
    [0.0000, 0.0000, 0.0000],
])  # fmt: skip
TO_REC709 = np.array([
    [3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252],
])  # fmt: skip


def blackbody(kelvin):
    """Returns the colour of a black body with luminance 1 in linear Rec.709, by Planck's law. It matches Blender
    between 800 and 12000 kelvin, and never has negative components."""
    kelvin = _clamped(kelvin, 800.0, 12000.0)
    wave = np.arange(380.0, 781.0, 20.0)
    xyz = wave**-5 / np.expm1(1.4387769e7 / (wave * kelvin)) @ MATCHING  # hc / k in nm K
    return [max(float(c), 0.0) for c in TO_REC709 @ (xyz / xyz[1])]


def _separated(node, output, value):
    r, g, b = value("Color")
    mode = getattr(node, "mode", "RGB")
    if mode == "HSV":
        r, g, b = colorsys.rgb_to_hsv(r, g, b)
    elif mode == "HSL":
        hue, light, saturation = colorsys.rgb_to_hls(r, g, b)
        r, g, b = hue, saturation, light
    return {"Red": r, "Green": g, "Blue": b}.get(output.identifier)


def _combined(node, output, value):
    r, g, b = (value(name) + 0.0 for name in ("Red", "Green", "Blue"))
    mode = getattr(node, "mode", "RGB")
    if mode == "HSV":
        return list(colorsys.hsv_to_rgb(r, g, b))
    if mode == "HSL":
        return list(colorsys.hls_to_rgb(r, b, g))
    return [r, g, b]


def _hue_saturation(node, output, value):
    colour = value("Color")
    hue, saturation, light = colorsys.rgb_to_hsv(*colour)
    hue = math.fmod(hue + value("Hue") + 0.5, 1.0)
    saturation = _clamped(saturation * value("Saturation"))
    changed = colorsys.hsv_to_rgb(hue, saturation, light * value("Value"))
    return [max(c, 0.0) for c in _mixed(value("Fac"), colour, changed)]


def _ramp(node, output, value):
    red, green, blue, alpha = node.color_ramp.evaluate(_clamped(value("Fac")))
    return float(alpha) if output.identifier == "Alpha" else [float(red), float(green), float(blue)]


def _rgb_curves(node, output, value):
    curves = node.mapping
    curves.initialize()
    colour = value("Color")
    whole, each = curves.curves[3], curves.curves[:3]
    changed = [curves.evaluate(own, curves.evaluate(whole, c)) for own, c in zip(each, colour)]
    return _mixed(value("Fac"), colour, changed)


def _float_curve(node, output, value):
    curves = node.mapping
    curves.initialize()
    x = value("Value")
    return x + (curves.evaluate(curves.curves[0], x) - x) * value("Factor")


def _map_range(node, output, value):
    if node.data_type != "FLOAT":
        return None
    x, low, high, to_low, to_high = (
        value(name) for name in ("Value", "From Min", "From Max", "To Min", "To Max")
    )
    if high == low:
        return 0.0
    share = (x - low) / (high - low)
    kind = node.interpolation_type
    if kind == "STEPPED":
        steps = value("Steps")
        share = math.floor(share * (steps + 1)) / steps if steps > 0 else 0.0
    elif kind == "SMOOTHSTEP":
        share = _clamped(share)
        share = share * share * (3 - 2 * share)
    elif kind == "SMOOTHERSTEP":
        share = _clamped(share)
        share = share**3 * (share * (share * 6 - 15) + 10)
    result = to_low + share * (to_high - to_low)
    clamps = node.clamp and kind in ("LINEAR", "STEPPED")
    return _clamped(result, min(to_low, to_high), max(to_low, to_high)) if clamps else result


def _clamp(node, output, value):
    low, high = value("Min"), value("Max")
    if node.clamp_type == "RANGE" and low > high:
        low, high = high, low
    return _clamped(value("Value"), low, high)


def _bright_contrast(node, output, value):
    contrast = value("Contrast")
    gain, offset = 1 + contrast, value("Bright") - contrast / 2
    return [max(gain * c + offset, 0.0) for c in value("Color")]


def _math(node, output, value):
    operation = MATH.get(node.operation)
    if operation is None:
        return None
    names = ("Value", "Value_001", "Value_002")[: operation.__code__.co_argcount]
    result = float(operation(*(value(name) for name in names)))
    return _clamped(result) if node.use_clamp else result


BLENDS = {
    "MIX": lambda a, b: b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
    "DIFFERENCE": lambda a, b: abs(a - b),
    "DARKEN": lambda a, b: min(a, b),
    "LIGHTEN": lambda a, b: max(a, b),
}


def _blended(node, share, one, two):
    blend = BLENDS.get(node.blend_type)
    return None if blend is None else _mixed(share, one, [blend(a, b) for a, b in zip(one, two)])


def _mix(node, output, value):
    if node.data_type not in ("FLOAT", "RGBA") or getattr(node, "factor_mode", "UNIFORM") != "UNIFORM":
        return None
    share = value("Factor_Float")
    share = _clamped(share) if node.clamp_factor else share + 0.0
    if node.data_type == "FLOAT":
        one, two = value("A_Float"), value("B_Float")
        return one + (two - one) * share
    result = _blended(node, share, value("A_Color"), value("B_Color"))
    return [_clamped(c) for c in result] if node.clamp_result else result


def _mix_rgb(node, output, value):
    result = _blended(node, _clamped(value("Fac")), value("Color1"), value("Color2"))
    return [_clamped(c) for c in result] if node.use_clamp else result


MATH = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b: math.pow(a, b) if a > 0 or b == int(b) and a else float(b == 0),
    "SQRT": lambda a: math.sqrt(a) if a > 0 else 0.0,
    "INVERSE_SQRT": lambda a: 1 / math.sqrt(a) if a > 0 else 0.0,
    "ABSOLUTE": lambda a: abs(a),
    "EXPONENT": lambda a: math.exp(a),
    "MINIMUM": lambda a, b: min(a, b),
    "MAXIMUM": lambda a, b: max(a, b),
    "LESS_THAN": lambda a, b: a < b,
    "GREATER_THAN": lambda a, b: a > b,
    "SIGN": lambda a: (a > 0) - (a < 0),
    "ROUND": lambda a: math.floor(a + 0.5),
    "FLOOR": lambda a: math.floor(a),
    "CEIL": lambda a: math.ceil(a),
    "TRUNC": lambda a: math.trunc(a),
    "FRACT": lambda a: a - math.floor(a),
    "MODULO": lambda a, b: math.fmod(a, b) if b else 0.0,
    "SINE": lambda a: math.sin(a),
    "COSINE": lambda a: math.cos(a),
    "TANGENT": lambda a: math.tan(a),
    "RADIANS": lambda a: math.radians(a),
    "DEGREES": lambda a: math.degrees(a),
}
NODES = {
    "BLACKBODY": lambda node, output, value: blackbody(value("Temperature")),
    "BRIGHTCONTRAST": _bright_contrast,
    "CLAMP": _clamp,
    "COMBINE_COLOR": _combined,
    "COMBXYZ": lambda node, output, value: [value(name) + 0.0 for name in "XYZ"],
    "CURVE_FLOAT": _float_curve,
    "CURVE_RGB": _rgb_curves,
    "GAMMA": lambda node, output, value: [c ** value("Gamma") if c > 0 else c for c in value("Color")],
    "HUE_SAT": _hue_saturation,
    "INVERT": lambda node, output, value: _mixed(
        value("Fac"), value("Color"), [1 - c for c in value("Color")]
    ),
    "MAP_RANGE": _map_range,
    "MATH": _math,
    "MIX": _mix,
    "MIX_RGB": _mix_rgb,
    "RGBTOBW": lambda node, output, value: luminance(value("Color")),
    "SEPARATE_COLOR": _separated,
    "SEPXYZ": lambda node, output, value: value("Vector")["XYZ".index(output.identifier)],
    "VALTORGB": _ramp,
}
