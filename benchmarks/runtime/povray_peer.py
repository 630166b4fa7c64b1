#!/usr/bin/env python3
"""Photons stored per CPU second: ours beside POV-Ray's on the canonical scene, in one run.

Usage: povray_peer.py [--program build/release/bin/vitrine_render_speed] [--rounds 5]
Needs POV-Ray 3.7 (scripts/install_packages scripts/benchmark_packages.txt). Runs both in turn, so
that other load on the machine meets both alike, and prints the medians and their ratio. POV-Ray
shoots at an analytic sphere, we at a mesh of at least 20 000 triangles.
"""
import argparse
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def povray_rate(count, folder):
    """Stored photons and CPU seconds of POV-Ray's photon pass, on one thread."""
    command = ["povray", f"+I{HERE / 'canonical.pov'}", "+W8", "+H8", "+WT1", "-D", "-GA",
               f"Declare=Count={count}", f"+O{folder}/picture.png", "All_Console=On"]
    log = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    stored = int(re.search(r"Surface photons stored:\s+(\d+)", log)[1])
    seconds = float(re.search(r"Photon Time:.*?with ([\d.]+) CPU-seconds", log, re.S)[1])
    return stored, seconds


def our_rate(program, count, triangles):
    line = subprocess.run([program, "photons", str(count), str(triangles)], capture_output=True,
                          text=True, check=True).stdout
    words = line.split()
    values = dict(zip(words[::2], words[1::2]))
    return int(values["stored"]), float(values["cpu_s"]), int(values["triangles"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="build/release/bin/vitrine_render_speed")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--triangles", type=int, default=20000)
    arguments = parser.parse_args()
    if not shutil.which("povray"):
        sys.exit("povray is missing: scripts/install_packages scripts/benchmark_packages.txt")
    theirs, ours = [], []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            stored, seconds = povray_rate(2_000_000, folder)
            theirs.append(stored / seconds)
            stored, seconds, triangles = our_rate(arguments.program, 1_000_000,
                                                  arguments.triangles)
            ours.append(stored / seconds)
    print(f"POV-Ray, analytic sphere:         {statistics.median(theirs):10.0f} photons stored per "
          "CPU second")
    print(f"ours, mesh of {triangles:7d} triangles: {statistics.median(ours):10.0f}")
    print(f"ratio {statistics.median(o / t for o, t in zip(ours, theirs)):.2f}")


if __name__ == "__main__":
    main()
