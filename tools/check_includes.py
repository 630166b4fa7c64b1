#!/usr/bin/env python3
"""Checks that every file looks down: includes only its own floor's folder and lower floors, and that
outside libraries stay on the floors that docs/architecture.md gives them.

Usage: tools/check_includes.py [SOURCE_DIR]      exit 1 and a list when something is wrong
"""
import pathlib
import re
import sys

FLOORS = {
    "base": 0, "math": 1, "image": 2, "optics": 2, "geometry": 2, "capture": 3, "trace": 3,
    "scene": 3, "reconstruct": 4, "render": 4, "estimate": 5, "synthetic": 5, "perception": 5,
    "compose": 6, "pipeline": 7,
}
LIBRARIES = {
    r"spdlog/": {"base"},
    r"nlohmann/": {"base"},
    r"tbb/": {"base"},
    r"Imf|Imath|png\.h|jpeglib\.h": {"image"},
    r"embree": {"trace"},
    r"open3d/": {"reconstruct"},
    r"ceres/": {"reconstruct", "estimate", "perception"},
    r"opencv2/": {"image", "capture", "reconstruct", "estimate"},
    r"tiny_obj_loader|tiny_gltf": {"geometry"},
    r"CLI/": set(),
    r"httplib": set(),
}
IN_HEADERS = {r"Eigen/", r"fmt/"}
HEADER_EXCEPTIONS = {"base/json_reader.h": "nlohmann/"}  # included by .cpp files only, checked below


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".") / "src" / "vitrine"
    errors = []
    for path in sorted(root.rglob("*")):
        if path.suffix not in {".h", ".cpp", ".inl"}:
            continue
        floor = path.relative_to(root).parts[0]
        if floor not in FLOORS:
            errors.append(f"{path}: folder {floor} is not a floor")
            continue
        is_test = path.stem.endswith("_test")
        for number, line in enumerate(path.read_text().splitlines(), 1):
            place = f"{path}:{number}"
            ours = re.match(r'\s*#include "([a-z]+)/', line)
            if ours:
                other = ours.group(1)
                if other not in FLOORS:
                    errors.append(f"{place}: unknown floor {other}")
                elif other != floor and FLOORS[other] >= FLOORS[floor]:
                    if not (is_test and other == "synthetic"):
                        errors.append(f"{place}: {floor} may not include {other}")
                if path.suffix == ".h" and "base/json_reader.h" in line and \
                        not path.name.endswith("_json.h"):
                    errors.append(f"{place}: json_reader.h belongs in .cpp files and *_json.h")
            theirs = re.match(r"\s*#include <([^>]+)>", line)
            if theirs:
                for pattern, floors in LIBRARIES.items():
                    if re.match(pattern, theirs.group(1)):
                        if floor not in floors:
                            errors.append(f"{place}: <{theirs.group(1)}> does not belong on {floor}")
                        name = str(path.relative_to(root))
                        if path.suffix == ".h" and not re.match(
                                HEADER_EXCEPTIONS.get(name, "$^"), theirs.group(1)):
                            errors.append(f"{place}: <{theirs.group(1)}> may not show in a header")
    print("\n".join(errors) if errors else "every include looks down")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
