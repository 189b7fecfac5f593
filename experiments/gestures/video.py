"""Commands from a video: landmarks by MediaPipe, overlays as PNG, a table of commands with their times."""

import contextlib
import importlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from hrcjax.hand import (
    BONES,
    COMMANDS,
    GESTURES,
    LANDMARKS,
    Classifier,
    CommandParams,
    initial_commands,
    update_commands,
)
from hrcjax.lab.atomic import replace_file
from hrcjax.lab.errors import UsageError
from hrcjax.lab.progress import Progress
from hrcjax.lab.table import aligned
from hrcjax.lab.writable import check_writable

from .config import RunConfig

HANDS = 2
"""Hands that are looked for."""
MODEL = "hand_landmarker.task"
LINES = {"open": "#ff5a50", "closed": "#35d07f", "pointing": "#58a6ff", "none": "#bbbbbb"}
IMAGES = (".png", ".jpg", ".jpeg")
EXTRA = "reading a video needs the extra: pip install 'hrcjax[perception]'"
Frame = tuple[float, NDArray]
"""Time [s], and image (row, column, 3) of red, green and blue in 0 to 255."""


def _module(name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(f"{EXTRA} ({name} is not installed)") from error


def frames(config: RunConfig) -> Iterator[Frame]:
    """Frames with their times.

    Raises:
        UsageError: the video cannot be read.
    """
    folder = Path(config.video)
    if folder.is_dir():
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGES)
        if not files:
            raise UsageError(f"--video {folder}: no images; accepted are {', '.join(IMAGES)}")
        for k, path in enumerate(files):
            if k / config.rate < config.seconds:
                yield k / config.rate, np.asarray(Image.open(path).convert("RGB"))
        return
    cv2: Any = _module("cv2")
    webcam = config.video.isdigit()
    if not webcam and not folder.is_file():
        raise UsageError(f"--video {config.video}: no such file or folder")
    video = cv2.VideoCapture(int(config.video) if webcam else config.video)
    if not video.isOpened():
        raise UsageError(
            f"--video {config.video}: no {'webcam of this number' if webcam else 'video that can be read'}"
        )
    rate, k, begin = video.get(cv2.CAP_PROP_FPS) or config.rate, 0, cv2.getTickCount()
    try:
        while True:
            good, image = video.read()
            t = (cv2.getTickCount() - begin) / cv2.getTickFrequency() if webcam else k / rate
            if not good or t >= config.seconds:
                return
            yield t, np.ascontiguousarray(image[:, :, ::-1])
            k += 1
    finally:
        video.release()


@contextlib.contextmanager
def landmarker(models: Path) -> Iterator[Any]:
    """MediaPipe's finder of hands: (time [s], image) -> landmarks in pixels (hand, 21, 2), and whether there is such a hand.

    Raises:
        UsageError: the extra is not installed, or the model file is missing.
    """
    model = models / MODEL
    if not model.is_file():
        raise UsageError(f"--models {models}: no file {MODEL} in it")
    media: Any = _module("mediapipe")
    vision: Any = _module("mediapipe.tasks.python.vision")
    tasks: Any = _module("mediapipe.tasks.python")
    options = vision.HandLandmarkerOptions(
        base_options=tasks.BaseOptions(model_asset_path=str(model)),
        running_mode=vision.RunningMode.VIDEO,
        num_hands=HANDS,
    )
    with vision.HandLandmarker.create_from_options(options) as finder:

        def find(t: float, image: NDArray) -> tuple[NDArray, NDArray]:
            data = media.Image(image_format=media.ImageFormat.SRGB, data=np.ascontiguousarray(image))
            found = finder.detect_for_video(data, round(1000 * t)).hand_landmarks[:HANDS]
            x = np.full((HANDS, LANDMARKS, 2), np.nan, np.float32)
            for k, hand in enumerate(found):
                # shares of width and height, each: in pixels both axes have one unit
                x[k] = [(mark.x * image.shape[1], mark.y * image.shape[0]) for mark in hand]
            return x, np.arange(HANDS) < len(found)

        yield find


def overlay(image: NDArray, x: NDArray, seen: NDArray, probability: NDArray, words: str) -> Image.Image:
    """The image with landmarks, the gesture of each hand, and the state of the commands."""
    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    for hand in np.flatnonzero(seen):
        likely = int(probability[hand].argmax())
        colour = LINES[GESTURES[likely]]
        for a, b in BONES:
            draw.line([tuple(x[hand, a]), tuple(x[hand, b])], fill=colour, width=3)
        for mark in x[hand]:
            draw.ellipse([*(mark - 3), *(mark + 3)], fill=colour)
        top = x[hand].min(axis=0) - [0, 24]
        draw.text(tuple(top), f"{GESTURES[likely]} {probability[hand, likely]:.2f}", fill=colour, font_size=18)
    draw.rectangle([0, 0, picture.width, 26], fill="#000000")
    draw.text((6, 4), words, fill="#ffffff", font_size=16)
    return picture


def watched(config: RunConfig, model: Classifier, params: CommandParams) -> int:
    """Reads a video; returns the exit status: 0.

    Raises:
        UsageError: an option is not accepted, something is not installed or missing.
    """
    if not 0 < config.rate <= 1000 or not config.seconds > 0 or config.every < 1:
        raise UsageError("--rate is accepted from over 0 to 1000, --seconds over 0, --every from 1")
    check_writable(config.out, "--out")
    classify = jax.jit(jax.vmap(model.probabilities))
    update = jax.jit(update_commands)
    state, before, lines, count, hands = initial_commands(jnp.dtype("float32"), True), -np.inf, [], 0, 0
    with landmarker(config.models) as find, Progress(None, unit="frame") as progress:
        for k, (t, image) in enumerate(frames(config)):
            x, seen = find(t, image)
            probability = np.asarray(classify(jnp.asarray(x)))
            state, command = update(params, state, jnp.asarray(probability), jnp.asarray(seen), jnp.float32(t - before))
            before, given, stands = t, int(command), "stands" if bool(state.stopped) else "may move"
            if given:
                lines.append([f"{t:.2f}", COMMANDS[given], stands])
            if given or k % config.every == 0:
                config.out.mkdir(parents=True, exist_ok=True)
                words = f"{t:.2f} s   {stands}   {COMMANDS[given] if given else ''}"
                picture = overlay(image, x, seen, probability, words)
                replace_file(config.out / f"{k:06d}.png", lambda path, p=picture: p.save(path, format="PNG"))
            count, hands = count + 1, hands + int(seen.any())
            progress.advance()
    print(aligned([["time [s]", "command", "arm"], *lines], "><<"))
    print(
        f"\n{count} frames, a hand in {hands}; {len(lines)} commands. The arm stands at the beginning. Overlays: {config.out}"
    )
    return 0
