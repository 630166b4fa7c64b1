"""The main job on the sample capture: it finds and measures what is there, gives the same files on one
thread and on two, and survives being killed at any moment."""
import filecmp
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import time

from toolcase import Case, load

case = Case()
root = pathlib.Path("data/captures/bottle_and_ball")
arguments = ["run", root, "--insert", root / "insertion.json", "--quality", "preview"]
MAY_DIFFER = {"run.json", "report.html", "evaluation.json", ".lock"}  # times, and which run it was


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*")
                  if path.is_file() and path.name not in MAY_DIFFER)


# One undisturbed run.
whole = case.scratch / "whole"
start = time.monotonic()
code, out, err = case.run(*arguments, "--out", whole, "--threads", 2)
elapsed = time.monotonic() - start
case.expect(code in (0, 4), f"run ends well: exit {code}\n{out}{err}")
for name in ["10_scan/mesh.ply", "20_candidates/candidates.json", "30_lights.json",
             "40_materials.json", "estimate.json", "50_insert/000003_with.exr",
             "60_composite/000003.png", "60_composite/000003.exr", "report.html", "run.json"]:
    case.expect((whole / name).is_file(), f"{name} is written")

# What it found, against truth (loose: docs/results.md has the figures).
code, out, err = case.run("evaluate", whole, "--truth", root / "truth" / "scene.json")
case.expect(code == 0, f"evaluate: {err}")
rows = load(whole / "evaluation.json")["rows"]


def value(subject, quantity):
    for row in rows:
        if row["subject"].startswith(subject) and row["quantity"] == quantity:
            return row["value"]
    case.expect(False, f"{subject} {quantity} is missing in the evaluation")
    return float("nan")


case.expect(value("light 0", "direction_error_deg") <= 5, "light direction within 5 degrees")
case.expect(abs(value("light 0", "distance_error_percent")) <= 25, "light distance within 25 %")
case.expect(value("objects", "missing") == 0, "both objects are found")
case.expect(value("objects", "wrong_class") == 0, "both are of the right class")
transparent = [row["subject"] for row in rows if row["quantity"] == "ior_error"]
case.expect(len(transparent) == 1 and abs(value(transparent[0], "ior_error")) <= 0.1,
            "refractive index within 0.1")
specular = [row["subject"] for row in rows if row["quantity"] == "sigma_ratio"]
case.expect(len(specular) == 1 and 1 / 1.5 <= value(specular[0], "sigma_ratio") <= 1.5,
            "sigma within a factor 1.5")
case.expect(value("insertion, mean", "object_error") <= 0.35, "object region within 0.35")

# The report opens from disk and asks nothing of a network.
report = (whole / "report.html").read_text()
case.expect(not re.search(r'(src|href)="(?!data:)', report), "the report is self-contained")

# Once more: nothing to do.
code, out, err = case.run(*arguments, "--out", whole, "--threads", 2)
case.expect(out.count("done before") == 5, f"a second run does nothing again:\n{out}")

# The same on one thread, killed three times on the way.
random.seed(os.getpid())
broken = case.scratch / "broken"
command = [case.program, *map(str, arguments), "--out", str(broken), "--threads", "1"]
for _ in range(3):
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(random.uniform(0.05, 0.5) * elapsed)
    process.send_signal(signal.SIGKILL)
    process.wait()
code, out, err = case.run(*arguments, "--out", broken, "--threads", 1)
case.expect(code in (0, 4), f"the killed run goes on: exit {code}\n{out}{err}")
case.expect(files(whole) == files(broken), "the same files are there")
for name in files(whole):
    case.expect(filecmp.cmp(whole / name, broken / name, shallow=False), f"{name} is identical")

# Two runs on one workspace; and a polite stop.
process = subprocess.Popen([case.program, *map(str, arguments), "--out", str(case.scratch / "busy")],
                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
deadline = time.monotonic() + 20
while not (case.scratch / "busy" / "run.json").exists() and time.monotonic() < deadline:
    time.sleep(0.05)
case.refused([*arguments, "--out", case.scratch / "busy"], 1, "in use", str(process.pid))
process.send_signal(signal.SIGINT)
stopped = time.monotonic()
err = process.communicate(timeout=60)[1]
case.expect(process.returncode == 130, f"SIGINT ends with 130, got {process.returncode}")
case.expect(time.monotonic() - stopped < 2.5, "SIGINT stops within 2 s")
case.expect("goes on" in err, f"it says how to go on: {err}")

# The bridge between the halves: a material lifted from a photo, worn by an object in the capture.
bridge = case.scratch / "bridge"
photos = pathlib.Path("data/photos")
code, out, err = case.run(
    "transfer", "--source", photos / "grapes.png", "--source-mask", photos / "grapes_mask.png",
    "--target", photos / "bust.png", "--target-mask", photos / "bust_mask.png", "--out", bridge)
case.expect(code in (0, 4), f"transfer ends well: exit {code}\n{out}{err}")
shutil.copy("scenes/meshes/box.ply", bridge / "body.ply")


def insertion(**scale):
    body = {"mesh": "body.ply", "to_world": [.04, 0, 0, .05, 0, .04, 0, -.12, 0, 0, .04, .02,
                                             0, 0, 0, 1],
            "material": {"kind": "translucent", "file": "material.json", **scale}}
    with open(bridge / "insertion.json", "w", encoding="utf-8") as file:
        json.dump({"schema": "vitrine.insertion/1", "objects": [body], "frames": ["000003"]}, file)
    return ["run", root, "--insert", bridge / "insertion.json", "--quality", "preview", "--out", whole]


case.refused(insertion(), 3, "scale_px_per_m", "--object-size-m")
pictures = []
for scale in (7272, 727):
    code, out, err = case.run(*insertion(scale_px_per_m=scale))
    case.expect(code in (0, 4), f"insertion of a translucent body: exit {code}\n{out}{err}")
    picture = whole / "60_composite" / "000003.png"
    case.expect(picture.is_file(), "its picture is written")
    pictures.append(picture.read_bytes())
case.expect(pictures[0] != pictures[1], "the scale of the material counts")

case.finish()
