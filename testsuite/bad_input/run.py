"""Bad input gets one clear sentence and the right exit code, and leaves nothing half written."""
import pathlib
import shutil

from toolcase import Case

case = Case()
root = pathlib.Path("data/captures/bottle_and_ball")


def capture(name):
    """A copy of the sample capture without its truth, to be damaged."""
    folder = case.scratch / name
    shutil.copytree(root, folder, ignore=shutil.ignore_patterns("truth"))
    return folder


def replace(path, old, new):
    text = path.read_text()
    assert old in text, (path, old)
    path.write_text(text.replace(old, new))


def truncate(path, share=0.5):
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])


# Usage.
case.refused(["check", root, "--treads", "2"], 2, "--threads")
case.refused(["chek"], 2, "check")
case.refused(["run", root], 2, "--out")
case.refused(["run", root, "--out", case.scratch / "o", "--at", "000003,1,2"], 2, "--insert")
case.refused(["run", root, "--out", case.scratch / "o", "--poses", "guess"], 2, "poses")

# The folder.
case.refused(["check", case.scratch / "nowhere"], 3, "nowhere", "no such folder")
(case.scratch / "empty").mkdir()
case.refused(["check", case.scratch / "empty"], 3, "an empty folder")

# Pictures.
damaged = capture("one_truncated")
truncate(damaged / "rgb" / "000004.png")
code, out, err = case.run("check", damaged)
case.expect(code == 0 and "000004.png" in out, f"one truncated frame is left out: {out}{err}")
truncate(damaged / "depth" / "000007.png")
case.refused(["check", damaged], 3, "000007.png")

size = capture("size")
replace(size / "camera_intrinsic.json", '"width": 640', '"width": 641')
case.refused(["check", size], 3, "641 x 360", "640 x 360")
focal = capture("focal")
replace(focal / "camera_intrinsic.json", "520.0,\n  0,", "-520.0,\n  0,")
case.refused(["check", focal], 3, "focal lengths > 0")

# Depth.
scale = capture("scale")
replace(scale / "capture.json", '"depth_scale": 5000', '"depth_scale": 1000')
case.refused(["check", scale], 3, "depth_scale 5000 would make")
unpaired = capture("unpaired")
replace(unpaired / "depth.txt", "\n0.", "\n7.")
case.refused(["check", unpaired], 3, "80 %")

# JSON.
key = capture("key")
replace(key / "capture.json", '"depth_scale"', '"depth_scael"')
case.refused(["check", key], 3, "capture.json:2:", 'Did you mean "depth_scale"?')
comma = capture("comma")
replace(comma / "capture.json", '5000,', '5000')
case.refused(["check", comma], 3, "capture.json:3:", "comma")
nesting = capture("nesting")
(nesting / "capture.json").write_text('{"a":' + "[" * 100000 + "]" * 100000 + "}")
case.refused(["check", nesting], 3, "nesting")

# Poses.
poses = capture("poses")
lines = (poses / "groundtruth.txt").read_text().splitlines()
first = lines[1].split()[1:]
(poses / "groundtruth.txt").write_text(
    "\n".join(" ".join([line.split()[0], *first]) for line in lines[1:]) + "\n")
case.refused(["check", poses], 3, "poses that differ")

# Insertion files are looked at before any work is done.
out_folder = case.scratch / "never_made"
insertion = case.scratch / "insertion.json"
insertion.write_text('{"schema": "vitrine.insertion/1", "objects": [{"mesh": "gone.obj"}]}')
case.refused(["run", root, "--out", out_folder, "--insert", insertion], 3, "gone.obj", "missing")
insertion.write_text('{"schema": "vitrine.insertion/1", "objects": [{"mehs": "a.obj"}]}')
case.refused(["run", root, "--out", out_folder, "--insert", insertion], 3, '"mesh"')
insertion.write_text('{"schema": "vitrine.insertion/1", "objects": [{"mesh": "../a.obj"}]}')
case.refused(["run", root, "--out", out_folder, "--insert", insertion], 3, "within the folder")
case.refused(["run", root, "--out", out_folder, "--insert", case.scratch / "x.ply", "--at",
              "000003,10,10"], 3, "x.ply")
case.expect(not out_folder.exists(), "nothing is made for input that is refused")

# A workspace where nothing can be written.
blocked = case.scratch / "blocked"
blocked.write_text("a file, not a folder")
case.refused(["run", root, "--out", blocked], 1, "blocked")

case.finish()
