"""Captures that cannot tell everything: what can be done is done, what cannot be known is said (exit
4), every number is one, and a scene without glass or metal is a valid scene (exit 0)."""
import json
import pathlib
import shutil
import struct
import zlib

from toolcase import Case

case = Case()
captures = pathlib.Path("data/captures")


def copied(source, name):
    folder = case.scratch / name
    shutil.copytree(captures / source, folder, ignore=shutil.ignore_patterns("truth"))
    return folder


def clip(path):
    """The same PNG, all white."""
    width, height = struct.unpack(">II", path.read_bytes()[16:24])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = (b"\0" + b"\xff" * 3 * width) * height
    path.write_bytes(b"\x89PNG\r\n\x1a\n" +
                     chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def no_number(text):
    raise ValueError(text)


def estimate_of(capture, expected_code):
    """Runs the chain; its estimate.json holds numbers only (NaN and Infinity are refused)."""
    out_folder = case.scratch / (capture.name + "_out")
    code, out, err = case.run("run", capture, "--out", out_folder, timeout=1800)
    case.expect(code == expected_code, f"{capture.name}: exit {code}, not {expected_code}\n{out}{err}")
    for file in ["30_lights.json", "40_materials.json", "estimate.json"]:
        case.expect((out_folder / file).is_file(), f"{capture.name}: {file} is written")
    estimate = json.loads((out_folder / "estimate.json").read_text(), parse_constant=no_number)
    return estimate, out, (out_folder / "report.html").read_text()


# Diffuse things only.
estimate, out, report = estimate_of(captures / "diffuse_two_lights", 0)
case.expect(len(estimate["lights"]) == 2, "both lamps of the diffuse scene are found")
case.expect(all(o["class"] == "diffuse" for o in estimate["objects"]), "no glass, no metal there")
case.expect(estimate["objects"] or "No glass or metal was found" in report,
            "the report says that there is neither")

# Every pixel at the level where the sensor clips.
white = copied("bottle_and_ball", "white")
for picture in (white / "rgb").iterdir():
    clip(picture)
estimate, out, report = estimate_of(white, 4)
case.expect(estimate["lights_outcome"] == "not_identifiable", "clipped: no light can be found")
case.expect("clipped" in estimate["lights_reason"], "clipped: the reason says so")
case.expect("clipped" in out and "clipped" in report, "clipped: shown and in the report")

# One view.
single = copied("bottle_and_ball", "one_view")
for name in ["rgb.txt", "depth.txt", "groundtruth.txt", "associations.txt"]:
    if not (single / name).exists():
        continue
    lines = (single / name).read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    (single / name).write_text("\n".join(lines[: first + 1]) + "\n")
options = json.loads((single / "capture.json").read_text())
del options["reference_albedo"]  # of a frame that is gone
(single / "capture.json").write_text(json.dumps(options))
estimate, out, report = estimate_of(single, 4)
case.expect(estimate["lights_outcome"] == "not_identifiable", "one view: the light is not known")
case.expect("only one view" in estimate["lights_reason"], "one view: the reason says so")
case.expect("only one view" in out, "one view: shown")

case.finish()
