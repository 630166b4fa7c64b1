"""Photos and masks that material transfer cannot use, or only just: one clear sentence and the right
exit code each. Pictures are made here, byte by byte."""
import math
import struct
import zlib

from toolcase import Case

SIZE = 120
case = Case()


def png(name, pixel, channels=3, bits=8, size=SIZE):
    """Writes a PNG; pixel(x, y) gives `channels` codes."""
    rows = bytearray()
    for y in range(size):
        rows.append(0)
        for x in range(size):
            for code in pixel(x, y):
                rows += struct.pack(">H" if bits == 16 else ">B", code)
    colour_type = {1: 0, 2: 4, 3: 2, 4: 6}[channels]

    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))

    path = case.scratch / name
    path.write_bytes(b"\x89PNG\r\n\x1a\n" +
                     chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, bits, colour_type, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(bytes(rows))) + chunk(b"IEND", b""))
    return path


def is_object(x, y):
    return (x - 60) ** 2 + (y - 60) ** 2 < 45 ** 2


def shade(x, y):
    """0 to 1: a ball lit from the upper left."""
    u, v = (x - 60) / 45, (60 - y) / 45
    return 0.15 + 0.75 * max(0.0, -0.5 * u + 0.5 * v + 0.7 * math.sqrt(max(0.0, 1 - u * u - v * v)))


def picture(x, y, colour=(200, 220, 120)):
    return [int(c * shade(x, y)) for c in colour] if is_object(x, y) else [60, 60, 70]


def cmyk_jpeg(name):
    """16 x 16 pixels, four components, every coefficient 0."""
    def segment(marker, data):
        return bytes([0xFF, marker]) + struct.pack(">H", len(data) + 2) + data

    frame = struct.pack(">BHHB", 8, 16, 16, 4) + b"".join(bytes([i, 0x11, 0]) for i in (1, 2, 3, 4))
    table = bytes([1] + [0] * 15) + b"\0"
    scan = bytes([4]) + b"".join(bytes([i, 0]) for i in (1, 2, 3, 4)) + bytes([0, 63, 0])
    path = case.scratch / name
    path.write_bytes(b"\xFF\xD8" + segment(0xEE, b"Adobe\0\x64\0\0\0\0\0") +
                     segment(0xDB, b"\0" + bytes([1] * 64)) + segment(0xC0, frame) +
                     segment(0xC4, b"\x00" + table) + segment(0xC4, b"\x10" + table) +
                     segment(0xDA, scan) + b"\0" * 4 + b"\xFF\xD9")
    return path


photo = png("photo.png", picture)
mask = png("mask.png", lambda x, y: [255 if is_object(x, y) else 0], 1)
target = ["--target", photo, "--target-mask", mask]


def source(path, mask_path=mask):
    return ["--source", path, "--source-mask", mask_path]


def refused(arguments, *words):
    out = case.scratch / "refused"
    case.refused(["transfer", *arguments, "--out", out], 3, *words)
    case.expect(not (out / "transfer.png").exists(), "nothing is written for what is refused")


def taken(arguments, name, codes=(0, 4)):
    """Goes through; returns everything it said."""
    out = case.scratch / name
    code, said, err = case.run("transfer", *arguments, "--out", out)
    case.expect(code in codes, f"{name}: exit {code}\n{said}{err}")
    case.expect((out / "transfer.png").exists(), f"{name}: a picture is written")
    return said + err


# Masks.
refused([*source(photo, png("empty.png", lambda x, y: [0], 1)), *target], "empty.png", "an empty mask")
refused([*source(photo, png("full.png", lambda x, y: [255], 1)), *target], "full.png", "full")
refused([*source(photo, png("dot.png", lambda x, y: [255 if (x, y) == (9, 9) else 0], 1)), *target],
        "dot.png", "pixels thick", "larger")
refused([*source(photo, png("other.png", lambda x, y: [255 if x > 30 else 0], 1, size=90)), *target],
        "other.png", "120 x 120", "90 x 90")
# A mask that lies on the background, beside the object: black there.
beside = png("beside.png", lambda x, y: [255 if 112 < x < 192 and 112 < y < 192 else 0], 1, size=200)
black = png("black_around.png", lambda x, y: picture(x, y) if is_object(x, y) else [0, 0, 0], size=200)
said = taken([*source(black, beside), *target], "beside", codes=(4,))
case.expect("dark" in said or "black" in said, f"a mask beside the object is said: {said}")

# Pictures that are read, and what is said of them.
said = taken([*source(png("no_blue.png", lambda x, y: [*picture(x, y)[:2], 0])), *target], "no_blue",
             codes=(4,))
case.expect("blue channel" in said, f"a black channel is named: {said}")
said = taken([*source(png("white.png", lambda x, y: [min(255, 3 * c) for c in picture(x, y)])),
              *target], "white")
case.expect("over-exposed" in said, f"over-exposure is said: {said}")
taken([*source(png("deep.png", lambda x, y: [257 * c for c in picture(x, y)], 3, 16)), *target], "deep")
taken([*source(png("grey.png", lambda x, y: picture(x, y)[1:2], 1)), *target], "grey")
alpha = png("alpha.png", lambda x, y: [*picture(x, y), 255 if is_object(x, y) else 0], 4)
taken(["--source", alpha, *target], "alpha")
opaque = png("opaque.png", lambda x, y: [*picture(x, y), 255], 4)
refused(["--source", opaque, *target], "opaque.png", "a mask or a box")

# Files that cannot be read.
refused([*source(cmyk_jpeg("cmyk.jpg")), *target], "cmyk.jpg", "CMYK")
for name, data in (("cut.png", photo.read_bytes()[:300]),
                   ("cut.jpg", cmyk_jpeg("whole.jpg").read_bytes()[:25]),
                   ("nothing.png", b""), ("text.png", b"not a picture")):
    (case.scratch / name).write_bytes(data)
    refused([*source(case.scratch / name), *target], name)
refused([*source(photo, case.scratch / "cut.png"), *target], "cut.png")
refused(["--source", photo, "--source-box", "100,100,50,50", *target], "photo.png", "120 x 120")
(case.scratch / "material.json").write_text(
    '{"schema": "vitrine.translucent/1", "inradius_px": 50, "fitted": {}}')
refused(["--material", case.scratch / "material.json", *target], "material.json", '"fit"')
case.finish()
