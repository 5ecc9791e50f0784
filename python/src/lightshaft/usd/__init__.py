"""Reads stages of USD as scenes: submit("scene.usda") uses it, and `python -m lightshaft.usd` writes them as
Mitsuba XML with the files that it names.

It needs the extra `usd` of this package: pip install 'lightshaft[usd]'.
"""

from importlib.util import find_spec

from ..errors import MissingPackage

_NEEDED = {"pxr": "usd-core", "PIL": "pillow", "mapbox_earcut": "mapbox-earcut"}
_MISSING = [package for module, package in _NEEDED.items() if find_spec(module) is None]
if _MISSING:
    raise MissingPackage(
        f"stages of USD need {', '.join(_MISSING)}, not installed here: pip install 'lightshaft[usd]'"
    )

from .scene import StageScene, read  # noqa: E402

__all__ = ["StageScene", "read"]
