"""The identity of a scene: a digest of everything it says, the same in every process on every machine."""

import hashlib
import json

from pydantic import TypeAdapter

from ..scene import Scene
from ._columns import IDENTITY_DIGITS

_scenes = TypeAdapter(Scene)


def scene_identity(scene: Scene, continued: str = "") -> str:
    """Digest of a scene's content.

    Parameters
    ----------
    scene
        Numbers count to the last bit; the order of fields does not.
    continued
        Identity of the scene whose end is this one's start, if it continues one. It stands for the state and
        the phase at the start, which follow from it.

    """
    content = _scenes.dump_python(scene, mode="python")
    # A name changes no motion.
    content["start"].pop("name", None)
    if continued:
        content["start"] = {"continues": continued}
        del content["drive"]["phase_rad"]
    # Python writes floats with as many digits as tell them apart, and infinity as a word.
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:IDENTITY_DIGITS]
