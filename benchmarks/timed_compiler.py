"""A compiler launcher that notes what each object takes: python timed_compiler.py LOG COMPILER ARGUMENTS..."""

import os
import resource
import subprocess
import sys
from pathlib import Path

log, *command = sys.argv[1:]
status = subprocess.call(command)
if status == 0 and "-o" in command and (made := Path(command[command.index("-o") + 1])).suffix == ".o":
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    size = subprocess.run(["size", made], capture_output=True, text=True, check=True).stdout.split()
    code = int(size[size.index("filename") + 1])
    line = f"{used.ru_utime + used.ru_stime:.2f}|{code}|{made}\n"
    with os.fdopen(os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT), "w") as file:
        file.write(line)
sys.exit(status)
