"""Material transfer between the sample photos: same files on one thread and two, a stored material
gives the same picture as its photo, and bad input gets one clear sentence."""
import filecmp
import pathlib

from toolcase import Case, load

case = Case()
photos = pathlib.Path("data/photos")
source = ["--source", photos / "grapes.png", "--source-mask", photos / "grapes_mask.png"]
target = ["--target", photos / "bust.png", "--target-mask", photos / "bust_mask.png"]


def transfer(*arguments, out):
    return case.run("transfer", *arguments, "--out", out)


one, two, stored = (case.scratch / name for name in ("one", "two", "stored"))
code, out, err = transfer(*source, *target, "--threads", 1, out=one)
case.expect(code in (0, 4), f"transfer ends well: exit {code}\n{out}{err}")
code, out, err = transfer(*source, *target, "--threads", 2, out=two)
NAMES = ["transfer.png", "transfer.exr", "material.json", "relief_source.exr", "relief_target.exr",
         "lights_source.json", "lights_target.json"]
for name in NAMES:
    case.expect(filecmp.cmp(one / name, two / name, shallow=False), f"{name}: same on any threads")
case.expect((one / "report.html").stat().st_size > 100_000, "the report holds its pictures")
transfer("--material", one / "material.json", *target, out=stored)
case.expect(filecmp.cmp(one / "transfer.png", stored / "transfer.png", shallow=False),
            "material.json in place of its photo")
material = load(one / "material.json")
case.expect(material["schema"] == "vitrine.translucent/1", "schema of the material")
case.expect(all(a >= 0 for a in material["fit"]["a"]) and all(b < 0 for b in material["fit"]["b"]),
            "the profile falls")

# What cannot be used.
bad = ["--out", case.scratch / "bad"]
case.refused(["transfer", *target, *bad], 2, "--source", "--material")
case.refused(["transfer", *source, *bad], 2, "--target")
case.refused(["transfer", *source, "--target", photos / "bust.png", *bad], 3, "mask")
case.refused(["transfer", *source, "--target", photos / "bust.png", "--target-box", "1,2,3", *bad], 2,
             "x,y,w,h")
case.refused(["transfer", *source, "--target", photos / "bust.png", "--target-box",
              "700,700,200,200", *bad], 3, "box")
case.refused(["transfer", *source, "--target", photos / "bust.png", "--target-mask",
              photos / "bust.png.missing", *bad], 3, "bust.png.missing")
cut = case.scratch / "cut.png"
cut.write_bytes((photos / "bust.png").read_bytes()[:20000])
case.refused(["transfer", *source, "--target", cut, "--target-mask", photos / "bust_mask.png", *bad],
             3, "cut.png")
case.finish()
