#!/usr/bin/env python3
"""Runs the whole chain on captures of known truth and prints one table of errors (Markdown).

Usage: benchmarks/quality/run_captures.py [--out DIR] [--program VITRINE] [--quality preview|final]
                                          [--lambertian] CAPTURE ...
Each CAPTURE is a capture folder with truth/scene.json. With --lambertian the baseline is run as well:
the same scan, meshes and light with every object forced to diffuse. Results are kept in DIR; a second
call re-uses finished stages.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys

ROWS = [
    ("lights found minus true", "lights", "count_difference", "{:+.0f}"),
    ("light direction, degrees", "light", "direction_error_deg", "{:.2f}"),
    ("light elevation, degrees (the paper's metric)", "light", "elevation_error_deg", "{:.2f}"),
    ("light distance, %", "light", "distance_error_percent", "{:+.1f}"),
    ("light intensity, %", "light", "intensity_error_percent", "{:+.1f}"),
    ("disc radius, %", "light", "radius_error_percent", "{:+.0f}"),
    ("objects missing", "objects", "missing", "{:.0f}"),
    ("objects of wrong class", "objects", "wrong_class", "{:.0f}"),
    ("refractive index", "object", "ior_error", "{:+.3f}"),
    ("absorption red, 1/m", "object", "sigma_a_error_per_m_red", "{:+.2f}"),
    ("absorption green, 1/m", "object", "sigma_a_error_per_m_green", "{:+.2f}"),
    ("absorption blue, 1/m", "object", "sigma_a_error_per_m_blue", "{:+.2f}"),
    ("sigma, ratio to truth", "object", "sigma_ratio", "{:.2f}"),
    ("diffuse albedo of metal, %", "object", "rho_d_error_percent", "{:+.1f}"),
    ("specular albedo of metal, %", "object", "rho_s_error_percent", "{:+.1f}"),
    ("insertion: object region", "insertion, mean", "object_error", "{:.3f}"),
    ("insertion: darker region", "insertion, mean", "darker_error", "{:.3f}"),
    ("insertion: brighter region", "insertion, mean", "brighter_error", "{:.3f}"),
    ("insertion: darker and brighter together", "insertion, mean", "changed_error", "{:.3f}"),
]


def run(program, capture, folder, extra):
    insertion = capture / "insertion.json"
    command = [program, "run", str(capture), "--out", str(folder), *extra]
    if insertion.exists():
        command += ["--insert", str(insertion)]
    code = subprocess.run(command, stdout=sys.stderr).returncode
    if code not in (0, 4):
        sys.exit(f"{' '.join(command)} ended with {code}")
    subprocess.run([program, "evaluate", str(folder), "--truth", str(capture / "truth/scene.json")],
                   check=True, stdout=subprocess.DEVNULL)
    record = json.loads((folder / "run.json").read_text())["stages"]
    return {
        "rows": json.loads((folder / "evaluation.json").read_text())["rows"],
        "seconds": sum(stage["seconds"] for stage in record.values()),
        "peak_mb": max(stage["peak_mb"] for stage in record.values()),
        "code": code,
    }


def cell(result, subject, quantity, form):
    found = [form.format(row["value"]) for row in result["rows"]
             if row["subject"].startswith(subject) and row["quantity"] == quantity
             and (subject != "light" or row["subject"].startswith("light "))]
    return "; ".join(found) if found else "–"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("captures", nargs="+", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/captures"))
    parser.add_argument("--program", default="build/release/bin/vitrine")
    parser.add_argument("--quality", choices=["preview", "final"], default="final")
    parser.add_argument("--lambertian", action="store_true")
    options = parser.parse_args()
    columns = []
    for capture in options.captures:
        folder = options.out / capture.name
        extra = ["--quality", options.quality]
        columns.append((capture.name, run(options.program, capture, folder, extra)))
        if options.lambertian:
            # The baseline shares scan, candidates and light: copy them, so that they are re-used.
            baseline = options.out / (capture.name + "_lambertian")
            if not baseline.exists():
                shutil.copytree(folder, baseline)
            columns.append((capture.name + ", Lambertian",
                            run(options.program, capture, baseline, [*extra, "--lambertian"])))
    print("| error of | " + " | ".join(name for name, _ in columns) + " |")
    print("|---|" + "---|" * len(columns))
    for title, subject, quantity, form in ROWS:
        print(f"| {title} | " + " | ".join(cell(result, subject, quantity, form)
                                           for _, result in columns) + " |")
    print("| exit code | " + " | ".join(str(result["code"]) for _, result in columns) + " |")
    print("| seconds, whole run | " +
          " | ".join(f"{result['seconds']:.0f}" for _, result in columns) + " |")
    print("| peak memory, MB | " +
          " | ".join(f"{result['peak_mb']:.0f}" for _, result in columns) + " |")


if __name__ == "__main__":
    main()
