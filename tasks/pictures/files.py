"""Pictures as files: what the name ends with says which kind."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.util import find_spec
from io import BytesIO
from itertools import chain
from pathlib import Path

import numpy as np
import PIL.Image

from plancurate.errors import PlancurateError
from plancurate.tasks.pictures.film import FRAMES_A_SECOND, film, side_by_side, still
from plancurate.tasks.pictures.render import Image
from plancurate.tasks.pictures.shot import Shot

PNG, GIF, MP4, RRD = ".png", ".gif", ".mp4", ".rrd"
ENDINGS = (PNG, GIF, MP4, RRD)
COLOURS = 96  # of a GIF or a small PNG: with more it grows by half and looks the same
VIZ = "pip install 'plancurate[viz]'"


def require_writable(file: Path) -> None:
    """PlancurateError unless a picture of that name can be made here, before anything is done for it."""
    kind = file.suffix.lower()
    if kind not in ENDINGS:
        raise PlancurateError(f"{file}: unknown ending '{file.suffix}'; {', '.join(ENDINGS)} are pictures")
    if not file.absolute().parent.is_dir():
        raise PlancurateError(f"{file}: there is no folder {file.absolute().parent}; make it first")
    if kind == MP4:
        ffmpeg()
    if kind == RRD and find_spec("rerun") is None:
        raise PlancurateError(f"{file}: the package rerun-sdk is missing; {VIZ} would bring it")


def write_shots(file: Path, shots: Sequence[Shot], size: tuple[int, int]) -> None:
    """Write shots side by side, each of that width and height in pixels; whole or not at all."""
    require_writable(file)
    kind = file.suffix.lower()
    if kind == RRD:
        from plancurate.tasks.pictures.recording import write_recording

        whole(file, lambda path: write_recording(path, shots))
    elif kind == PNG:
        image = side_by_side([still(shot, size, shots) for shot in shots])
        whole(file, lambda path: path.write_bytes(png(image)))
    else:
        write = write_gif if kind == GIF else write_mp4
        whole(file, lambda path: write(path, film(shots, size)))


def whole(file: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make a file of another name, and give it its own once it is complete."""
    with tempfile.TemporaryDirectory(dir=file.absolute().parent, prefix=".picture-") as folder:
        unfinished = Path(folder) / file.name
        write(unfinished)
        unfinished.replace(file)


def png(image: Image, colours: int | None = None) -> bytes:
    """An image (h, w, 3) as a PNG; with fewer colours it is a third as large.

    The few are chosen by the octree of the image's colours, which keeps those of thin lines.
    """
    made, buffer = PIL.Image.fromarray(image), BytesIO()
    if colours:
        made = made.quantize(colours, PIL.Image.Quantize.FASTOCTREE, dither=PIL.Image.Dither.NONE)
    made.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def write_gif(file: Path, images: Iterable[Image]) -> None:
    """Write an endless GIF with one set of colours."""
    made = [PIL.Image.fromarray(image) for image in images]
    some = np.concatenate([np.asarray(image) for image in made[:: max(len(made) // 4, 1)]])
    palette = PIL.Image.fromarray(some).quantize(COLOURS)
    first, *rest = (image.quantize(palette=palette, dither=PIL.Image.Dither.NONE) for image in made)
    duration = round(1000 / FRAMES_A_SECOND)
    first.save(file, save_all=True, append_images=rest, duration=duration, loop=0, optimize=False)


def write_mp4(file: Path, images: Iterable[Image]) -> None:
    """Write an H.264 film that every browser plays."""
    first, images = ahead(iter(images))
    height, width = first.shape[:2]
    words = [
        ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
        "-r", str(FRAMES_A_SECOND), "-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p",
        str(file),
    ]  # fmt: skip
    content = b"".join(image.tobytes() for image in images)
    done = subprocess.run(words, input=content, capture_output=True, check=False)
    if done.returncode:
        raise PlancurateError(f"{file.name}: ffmpeg made no film: {done.stderr.decode()[-300:]}")


def ahead(images: Iterator[Image]) -> tuple[Image, Iterator[Image]]:
    """The first image, and all of them."""
    first = next(images)
    return first, chain([first], images)


def ffmpeg() -> str:
    """The program that makes films; PlancurateError where there is none."""
    if found := shutil.which("ffmpeg"):
        return found
    if find_spec("imageio_ffmpeg") is None:
        raise PlancurateError(f".mp4: there is no program ffmpeg; {VIZ} would bring one, and .gif needs none")
    from imageio_ffmpeg import get_ffmpeg_exe

    return str(get_ffmpeg_exe())
