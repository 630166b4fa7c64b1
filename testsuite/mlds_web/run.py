"""Runs whole sessions of `vitrine mlds serve` in headless Chromium.

Usage: run.py PROGRAM SCRATCH [SCREENSHOTS [STIMULI]]. Exit 77 (skipped) where Node, Chromium or
playwright-core are not to be had. The screens are saved in the folder SCREENSHOTS; STIMULI is a
folder of ten rendered pictures, shown in place of stripes.
"""

import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import zlib

HERE = pathlib.Path(__file__).resolve().parent


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def find_chromium():
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if shutil.which(name):
            return shutil.which(name)
    skip("no Chromium (Debian package chromium)")


def png(width, height, grey):
    """A grey PNG with a bright stripe whose place tells the stimulus."""
    rows = b"".join(
        b"\0" + bytes(255 if abs(x - grey) < 3 else 110 for x in range(width)) for _ in range(height)
    )

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows))
            + chunk(b"IEND", b""))


def write_stimuli(folder, count=10):
    folder.mkdir(parents=True)
    files = [f"stimulus_{i + 1:02d}.png" for i in range(count)]
    for i, file in enumerate(files):
        (folder / file).write_bytes(png(128, 128, 14 + 11 * i))
    series = {
        "schema": "vitrine.mlds_stimuli/1",
        "title": "Stripes",
        "ior": [round(1.4 + 0.065 * i / (count - 1), 9) for i in range(count)],
        "images": files,
    }
    (folder / "stimuli.json").write_text(json.dumps(series))


def main():
    program, scratch = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    if not shutil.which("node"):
        skip("no Node (Debian package nodejs)")
    chromium = find_chromium()
    modules = scratch / "modules"
    version = json.loads((HERE / "package.json").read_text())["dependencies"]["playwright-core"]
    installed = modules / "node_modules" / "playwright-core" / "package.json"
    if not installed.exists() or json.loads(installed.read_text())["version"] != version:
        if not shutil.which("npm"):
            skip("no npm (Debian package npm)")
        modules.mkdir(parents=True, exist_ok=True)
        shutil.copy(HERE / "package.json", modules)
        command = ["npm", "install", "--no-audit", "--no-fund", "--no-package-lock", "--silent"]
        if subprocess.run(command, cwd=modules, timeout=300).returncode != 0:
            skip("playwright-core could not be installed (no network?)")
    work = scratch / "work"
    shutil.rmtree(work, ignore_errors=True)
    if len(sys.argv) > 4:
        shutil.copytree(sys.argv[4], work / "stimuli")
    else:
        write_stimuli(work / "stimuli")
    environment = dict(os.environ, NODE_PATH=str(modules / "node_modules"))
    arguments = [str(program), str(work), chromium, *sys.argv[3:4]]
    result = subprocess.run(["node", str(HERE / "sessions.cjs"), *arguments], env=environment,
                            timeout=600)
    sys.exit(result.returncode)


if __name__ == "__main__":
    main()
