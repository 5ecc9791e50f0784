"""Which LLVM library Mitsuba's fast variants can work with, of those that a machine has."""
import glob
import os
import re

FOLDERS = ("/usr/lib/*", "/usr/lib/llvm-*/lib", "/usr/local/lib")
OLDEST = 17  # Dr.Jit says 15; Mitsuba 3.9.1 dies with that one, which cannot compile `fminimum` for x86
NAME = re.compile(r"libLLVM(?:-|\.so\.)(\d+)[\d.]*(?:\.so(?:\.\d+)*)?$")


def newest(folders=FOLDERS):
    """The path of the newest that will do, or None."""
    found = [(int(match[1]), path) for folder in folders for path in sorted(glob.glob(folder + "/libLLVM*"))
             if (match := NAME.search(path))]
    version, path = max(found, default=(0, None))
    return path if version >= OLDEST else None


def name_it():
    """Tells Dr.Jit, unless DRJIT_LIBLLVM_PATH does already. Ends the program if there is none: a race against a slower
    variant would say too little of Mitsuba."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    path = newest()
    if path is None:
        raise SystemExit(f"mitsuba3.py: no LLVM library of version {OLDEST} or later in {', '.join(FOLDERS)}: install one "
                         "(Debian: apt install libllvm19), name one with DRJIT_LIBLLVM_PATH, or ask for --variant scalar_rgb")
    os.environ["DRJIT_LIBLLVM_PATH"] = path


if __name__ == "__main__":
    name_it()
