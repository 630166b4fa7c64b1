#!/usr/bin/env python3
"""Half B on real photographs: prints how well each material photo is reproduced (self PSNR against
the best single colour) and writes the dressed objects to look at. There is no truth for these.

    VITRINE_REAL_DATA=FOLDER benchmarks/quality/transfer_real.py OUT [--vitrine PROGRAM]

Pictures and results stay out of the repository: the licences of some photos are unknown.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys

OPAQUE, TRANSLUCENT, HDR = "photos_opaque", "photos_translucent", "hdr_photos"
BUDDHA = ["--target", f"{OPAQUE}/buddha_00060_rot90cw_half.png",
          "--target-mask", f"{OPAQUE}/buddha_00060_rot90cw_half_mask.png"]
GRAPE = ["--source", f"{TRANSLUCENT}/grapes.jpg", "--source-box", "1880,990,480,490"]
WAX = ["--source", f"{HDR}/CandleGlass.exr", "--source-mask", f"{HDR}/candleglass_wax_mask.png"]
PETAL = ["--source", f"{TRANSLUCENT}/hibiscus.png",
         "--source-mask", f"{TRANSLUCENT}/hibiscus_mask.png"]
CASES = {  # name: (material photo, object photo, bar on self PSNR above the best single colour)
    "grapes_on_vase": (GRAPE, ["--target", f"{OPAQUE}/vase.jpg", "--target-box", "180,0,680,1022"],
                       2.5),
    "grapes_on_egg": (GRAPE, ["--target", f"{OPAQUE}/egg1.jpg", "--target-box", "200,120,310,310"],
                      2.5),
    "wax_on_head": (WAX, BUDDHA, 2.5),
    "petal_on_head": (PETAL, BUDDHA, None),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--vitrine", default="build/release/bin/vitrine")
    parser.add_argument("--method", default="default")
    arguments = parser.parse_args()
    root = os.environ.get("VITRINE_REAL_DATA")
    if not root or not pathlib.Path(root).is_dir():
        print("skipped: VITRINE_REAL_DATA is not set to a folder")
        return 0
    missed = 0
    for name, (source, target, bar) in CASES.items():
        paths = [f"{root}/{a}" if "/" in a else a for a in source + target]
        command = [arguments.vitrine, "transfer", *paths, "--out", str(arguments.out / name),
                   "--method", arguments.method, "--json", "--quiet"]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode not in (0, 4):
            print(f"{name}: exit {run.returncode}: {run.stderr.strip()}")
            missed += 1
            continue
        summary = json.loads(run.stdout)
        gain = summary["self_psnr_db"] - summary["flat_psnr_db"]
        verdict = "" if bar is None else f" (bar {bar}: {'reached' if gain >= bar else 'MISSED'})"
        missed += bar is not None and gain < bar
        print(f"{name:15} self {summary['self_psnr_db']:.1f} dB, best colour "
              f"{summary['flat_psnr_db']:.1f} dB, gain {gain:+.1f}{verdict}, "
              f"{summary['seconds']:.1f} s, {arguments.out / name / 'transfer.png'}")
        for warning in summary["warnings"]:
            print(f"    {warning}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
