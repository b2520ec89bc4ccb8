"""Compile the C99 files of a schedule with every warning an error, and run what comes of it."""

import os
import re
import shutil
import subprocess

import numpy as np
import pytest

from schedules.files import file_name, write_schedule
from schedules.wire_names import axis_name

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion", "-Wshadow", "-Wcast-qual"]

#: Reads a policy and the coordinates, prints the status and the gains, which begin as -77.
DRIVER = """
#include <stdio.h>
#include "{header}"
int main(void) {{
    int outside;
    while (scanf("%d", &outside) == 1) {{
        {p}_condition at;
        {p}_gains gains;
        double x;
        int status;
        {read}
        {start}
        status = {p}_evaluate(&at, ({p}_policy)outside, &gains);
        printf("%d {formats}\\n", status, {values});
    }}
    return 0;
}}
"""


def compiler(name):
    program = shutil.which(name)
    if program is None:
        if os.environ.get("CI", "").lower() in ("1", "true"):
            pytest.fail(f"{name} is not installed: under CI this test must run")
        pytest.skip(f"{name} is not installed: the files were not compiled")
    return program


class Program:
    """Files of a schedule in a directory, and what compilers make of them."""

    def __init__(self, folder, schedule, fill=None):
        self.folder, self.schedule = folder, schedule
        self.header, self.source = (file_name(schedule, suffix) for suffix in "hc")
        for suffix, name in (("h", self.header), ("c", self.source)):
            (folder / name).write_bytes(write_schedule(schedule, suffix, fill))
        self.prefix = re.search(r"int (\w+)_evaluate\(", (folder / self.header).read_text())[1]

    def compile(self, *arguments, name="gcc", check=True):
        standard = ["-std=c99"] if name == "gcc" else []
        command = [compiler(name), *standard, *WARNINGS, *arguments]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=60, check=False)
        assert not check or done.returncode == 0, done.stderr
        return done

    def run(self, name, text=""):
        return subprocess.run(
            [self.folder / name], input=text, capture_output=True, text=True, timeout=60, check=False
        )  # fmt: skip

    def driver(self, *flags):
        """Compile a program that evaluates what it reads; its answer as statuses and gains."""
        axes = [axis_name(axis) for axis in self.schedule.axes]
        gains = [gain.name for gain in self.schedule.gains]
        text = DRIVER.format(
            header=self.header,
            p=self.prefix,
            read="\n".join(f'if (scanf("%lf", &x) != 1)\n return 1;\nat.{a} = ({self.prefix}_real)x;' for a in axes),
            start=" ".join(f"gains.{g} = ({self.prefix}_real)-77;" for g in gains),
            formats=" ".join(["%.17g"] * len(gains)),
            values=", ".join(f"(double)gains.{g}" for g in gains),
        )
        (self.folder / "driver.c").write_text(text)
        self.compile("-O2", *flags, "driver.c", self.source, "-o", "driver")

        def evaluate(points, policy=0):
            lines = "\n".join(f"{policy} " + " ".join(f"{x:.17g}" for x in point) for point in points)
            done = self.run("driver", lines)
            assert done.returncode == 0
            rows = np.array([[float(word) for word in line.split()] for line in done.stdout.splitlines()])
            assert len(rows) == len(points)
            return rows[:, 0].astype(int), rows[:, 1:]

        return evaluate
