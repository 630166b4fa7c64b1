"""A user who edits silhouettes and gives boxes: only what depends on them runs again, and they win."""
import json
import pathlib
import shutil
import struct
import zlib

from toolcase import Case, load

case = Case()
root = pathlib.Path("data/captures/bottle_and_ball")

# Half of the views: enough to step in, and quick.
capture = case.scratch / "capture"
shutil.copytree(root, capture, ignore=shutil.ignore_patterns("truth"))
lines = [line for line in (capture / "rgb.txt").read_text().splitlines() if not line.startswith("#")]
(capture / "rgb.txt").write_text("\n".join(lines[::2]) + "\n")
settings = load(capture / "capture.json")
settings.pop("reference_albedo", None)
(capture / "capture.json").write_text(json.dumps(settings))
frame = pathlib.Path(lines[2].split()[1]).stem
out = case.scratch / "out"


def read_mask(path):
    """An 8-bit grey PNG as (width, height, rows of 0 / 1)."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 0), (path, depth, colour)
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    raw, before, rows = zlib.decompress(packed), bytes(width), []
    for y in range(height):
        kind, line = raw[y * (width + 1)], bytearray(raw[y * (width + 1) + 1:(y + 1) * (width + 1)])
        for x in range(width):
            a, b, c = (line[x - 1] if x else 0), before[x], (before[x - 1] if x else 0)
            nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            line[x] = (line[x] + (0, a, b, (a + b) // 2, nearest)[kind]) & 255
        rows.append([1 if value > 127 else 0 for value in line])
        before = bytes(line)
    return width, height, rows


def overlap(a, b):
    both = sum(p & q for r, s in zip(a[2], b[2]) for p, q in zip(r, s))
    either = sum(p | q for r, s in zip(a[2], b[2]) for p, q in zip(r, s))
    return both / max(1, either)


def candidates():
    code, text, err = case.run("candidates", capture, "--out", out)
    case.expect(code == 0, f"candidates: exit {code}\n{text}{err}")
    return text, load(out / "20_candidates" / "candidates.json")["objects"]


def silhouette(object_id):
    return read_mask(out / "20_candidates" / "silhouettes" / f"{frame}_{object_id}.png")


def stages(text):
    return {line.split()[0]: "done before" in line for line in text.splitlines() if line.strip()}


text, found = candidates()
case.expect(len(found) == 2, f"bottle and ball are found: {[item['id'] for item in found]}")
first_bytes = (out / "20_candidates" / "candidates.json").read_bytes()

# The user knows better: here, the true outline of the ball.
edit_file = next((root / "truth" / "mask").glob(f"{frame}_*ball*.png"))
edit = read_mask(edit_file)
ball = max((item["id"] for item in found), key=lambda name: overlap(silhouette(name), edit))
case.expect(overlap(silhouette(ball), edit) > 0.9, "the ball's own outline is close")
edits = out / "edits" / "silhouettes"
edits.mkdir(parents=True)
shutil.copy(edit_file, edits / f"{frame}_{ball}.png")
text, found = candidates()
ran = stages(text)
case.expect(ran.get("reconstruct") is True, f"the scan is not made again: {text}")
case.expect(ran.get("candidates") is False, f"the candidates are: {text}")
case.expect(overlap(silhouette(ball), edit) == 1, "the edited outline is taken as it is")

# Misnamed edits are refused, not lost.
(edits / f"{frame}_{ball}.png").rename(edits / f"{frame}_object_9.png")
case.refused(["candidates", capture, "--out", out], 3, "object_9", "one of object_0, object_1")
(edits / f"{frame}_object_9.png").rename(edits / f"nothing_{ball}.png")
case.refused(["candidates", capture, "--out", out], 3, "the id of a frame")
shutil.rmtree(edits)

# A rectangle in one picture stands for the thing there, and replaces what was found.
rows = edit[2]
columns = [x for row in rows for x, value in enumerate(row) if value]
lines = [y for y, row in enumerate(rows) if any(row)]
box = [min(columns), min(lines), max(columns) - min(columns) + 1, max(lines) - min(lines) + 1]
boxes = out / "edits" / "boxes.json"
boxes.write_text(json.dumps({"schema": "vitrine.boxes/1",
                             "boxes": [{"frame": frame, "box_px": box}]}))
text, found = candidates()
case.expect(len(found) == 2, f"the box replaces the ball: {[item['id'] for item in found]}")
case.expect(overlap(silhouette(found[-1]["id"]), edit) > 0.85, "the box holds the ball")
boxes.write_text(json.dumps({"schema": "vitrine.boxes/1",
                             "boxes": [{"frame": "gone", "box_px": box}]}))
case.refused(["candidates", capture, "--out", out], 3, "boxes.json:", "gone")
boxes.write_text(json.dumps({"schema": "vitrine.boxes/1", "boxes": [{"min": [0, 0, 0]}]}))
case.refused(["candidates", capture, "--out", out], 3, "min_m")

# Without edits everything is as it was.
boxes.unlink()
candidates()
case.expect((out / "20_candidates" / "candidates.json").read_bytes() == first_bytes,
            "without edits the candidates are those of the first run")
case.finish()
