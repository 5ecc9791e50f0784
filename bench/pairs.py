"""Two renders of one scene side by side, in one small JPEG for the pages of docs/measurements. Needs numpy and Pillow."""
import numpy as np
from PIL import Image

MOST_BYTES = 60_000
GAP = 4  # white pixels between the two


def shown(image):
    """Linear light as bytes of sRGB."""
    linear = np.clip(image, 0, 1)
    coded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    return np.rint(255 * coded).astype(np.uint8)


def exposure_for(image):
    """The factor by which all but the brightest 2 % of the values stay below 0.8."""
    return 0.8 / max(np.quantile(image, 0.98), 1e-6)


def write_pair(path, ours, theirs):
    """Ours on the left."""
    gap = np.full((ours.shape[0], GAP, 3), 255, np.uint8)
    picture = Image.fromarray(np.concatenate([shown(ours), gap, shown(theirs)], axis=1))
    for quality in range(88, 20, -8):
        picture.save(path, quality=quality, optimize=True)
        if path.stat().st_size <= MOST_BYTES:
            return
    raise ValueError(f"{path} is larger than {MOST_BYTES} bytes: make the picture smaller")
