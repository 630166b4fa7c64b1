"""What every case of the test suite needs: run the program, say what is wrong, count."""
import json
import os
import pathlib
import shutil
import subprocess
import sys


class Case:
    """Runs `vitrine` in a scratch folder and collects failed expectations."""

    def __init__(self):
        self.program = sys.argv[1]
        self.scratch = pathlib.Path(sys.argv[2])
        shutil.rmtree(self.scratch, ignore_errors=True)
        self.scratch.mkdir(parents=True)
        self.failures = 0

    def run(self, *arguments, timeout=600, env=None):
        """Returns (exit code, stdout, stderr)."""
        command = [self.program, *map(str, arguments)]
        environment = dict(os.environ, **(env or {}))
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout,
                              env=environment)
        return done.returncode, done.stdout, done.stderr

    def expect(self, condition, what):
        if not condition:
            self.failures += 1
            print("FAILED:", what)

    def refused(self, arguments, code, *words):
        """The program must end with `code` and one clear line that holds all `words`."""
        got, out, err = self.run(*arguments)
        shown = " ".join(map(str, arguments))
        self.expect(got == code, f"{shown}: exit {got}, expected {code}\n{out}{err}")
        for word in words:
            self.expect(word in err, f"{shown}: '{word}' is not in: {err.strip()}")
        lines = [line for line in err.splitlines() if line.startswith("vitrine: ")]
        self.expect(len(lines) == 1, f"{shown}: one line was expected, got: {err.strip()}")

    def finish(self):
        print("failed expectations:", self.failures)
        sys.exit(1 if self.failures else 0)


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)
