#!/usr/bin/env python3
"""Copies a capture with poses that are off, as a tracker leaves them (by links, but for the poses).

Usage: benchmarks/quality/perturb_poses.py CAPTURE OUT [--metres M] [--degrees D] [--seed N]
The camera of every frame but the first, which fixes the world, is moved by M and turned by D in the
root mean square over frames, in random directions. Poses are those of groundtruth.txt.
"""
import argparse
import math
import pathlib
import random


def turned(axis_angle, q):
    """Quaternion x y z w of the rotation vector, times q."""
    angle = math.sqrt(sum(a * a for a in axis_angle))
    s = 0.5 if angle < 1e-12 else math.sin(0.5 * angle) / angle
    ax, ay, az = (s * a for a in axis_angle)
    aw = math.cos(0.5 * angle)
    x, y, z, w = q
    return (aw * x + ax * w + ay * z - az * y, aw * y - ax * z + ay * w + az * x,
            aw * z + ax * y - ay * x + az * w, aw * w - ax * x - ay * y - az * z)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--metres", type=float, default=0.003)
    parser.add_argument("--degrees", type=float, default=0.3)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for path in options.capture.iterdir():
        link = options.out / path.name
        if path.name != "groundtruth.txt" and not link.exists():
            link.symlink_to(path.resolve())
    rng = random.Random(options.seed)
    shift = options.metres / math.sqrt(3.0)
    turn = math.radians(options.degrees) / math.sqrt(3.0)
    lines, is_first = [], True
    for line in (options.capture / "groundtruth.txt").read_text().splitlines():
        words = line.split()
        if line.startswith("#") or len(words) != 8:
            lines.append(line)
            continue
        t, q = [float(w) for w in words[1:4]], [float(w) for w in words[4:]]
        if not is_first:
            t = [x + rng.gauss(0.0, shift) for x in t]
            q = turned([rng.gauss(0.0, turn) for _ in range(3)], q)
        is_first = False
        lines.append(" ".join([words[0]] + [f"{x:.9f}" for x in (*t, *q)]))
    (options.out / "groundtruth.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
