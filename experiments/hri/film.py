"""Pictures one after another as a film: GIF by Pillow, MP4 by imageio-ffmpeg, which brings an ffmpeg of its own."""

# pyright: reportMissingImports=false
# imageio-ffmpeg is an extra

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hrcjax.lab.atomic import replace_file

try:
    import imageio_ffmpeg as _ffmpeg
except ImportError:
    _ffmpeg = None
ffmpeg: Any = _ffmpeg


def gif(pictures: Sequence[NDArray], rate: float) -> bytes:
    """Pictures (height width 3) of bytes as a GIF that runs at a rate [Hz] and begins anew."""
    images = [Image.fromarray(one) for one in pictures]
    palette = images[len(images) // 2].quantize(64)
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in images]
    file = io.BytesIO()
    frames[0].save(
        file, "GIF", save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0, optimize=True
    )
    return file.getvalue()


def save_mp4(pictures: Sequence[NDArray], rate: float, path: Path) -> bool:
    """Writes an MP4; False: imageio-ffmpeg is not installed."""
    if ffmpeg is None:
        return False
    height, width = (2 * (size // 2) for size in pictures[0].shape[:2])  # the codec asks for even sizes

    def write(place: Path) -> None:
        # the codec is chosen by the name's end
        film = place.with_name(place.name + ".mp4")
        writer = ffmpeg.write_frames(str(film), (width, height), fps=rate, macro_block_size=2)
        writer.send(None)
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture[:height, :width]))
        writer.close()
        film.replace(place)

    replace_file(path, write)
    return True
