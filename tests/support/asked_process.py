"""Has a process of this machine make system calls, and says what the kernel answered: what it may do, asked of the process itself.
Linux on x86-64; the process is one that this one may trace (its descendant, or anybody's for root)."""

import ctypes
import os
import struct

ATTACH, DETACH, PEEK, POKE, STEP, GETREGS, SETREGS = 16, 17, 2, 5, 9, 12, 13
# indices of registers in user_regs_struct
ORIG_RAX, RAX, RDI, RSI, RDX, RIP, RSP = 15, 10, 14, 13, 12, 16, 19
SYSCALL = b"\x0f\x05"
ANY_THREAD = 0x40000000  # __WALL
WORD = 8

_libc = ctypes.CDLL(None, use_errno=True)
_libc.ptrace.restype = ctypes.c_long
_libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]


def _ptrace(request, pid, address=None, data=None):
    ctypes.set_errno(0)
    result = _libc.ptrace(request, pid, address, data)
    if ctypes.get_errno():
        raise OSError(ctypes.get_errno(), f"ptrace request {request} of process {pid}: {os.strerror(ctypes.get_errno())}")
    return result


class AskedProcess:
    """Stopped while asked. It must wait in a system call, as an idle one does: that call's instruction is borrowed."""

    def __init__(self, pid):
        self.pid = pid

    def __enter__(self):
        # A process that has just started may still be on its way to the call in which it waits.
        for _ in range(100_000):
            _ptrace(ATTACH, self.pid)
            os.waitpid(self.pid, ANY_THREAD)
            self.before = (ctypes.c_ulong * 27)()
            _ptrace(GETREGS, self.pid, None, ctypes.addressof(self.before))
            if self._instruction()[:2] == SYSCALL:
                return self
            _ptrace(DETACH, self.pid)
            os.sched_yield()
        raise AssertionError("it waits in no system call")

    def _instruction(self):
        return struct.pack("<q", _ptrace(PEEK, self.pid, self.before[RIP] - len(SYSCALL)))

    def __exit__(self, *error):
        _ptrace(SETREGS, self.pid, None, ctypes.addressof(self.before))
        _ptrace(DETACH, self.pid)

    def call(self, number, *arguments):
        """0, or the errno. A text is passed by its address."""
        instruction = self.before[RIP] - len(SYSCALL)
        place = (self.before[RSP] - 4096) & ~15  # on its stack, below all that is in use
        regs = (ctypes.c_ulong * 27)(*self.before)
        regs[ORIG_RAX], regs[RIP], regs[RAX] = 2 ** 64 - 1, instruction, number
        for register, value in zip((RDI, RSI, RDX), arguments):
            regs[register] = place if isinstance(value, str) else value % 2 ** 64
            if isinstance(value, str):
                self._put(place, value.encode() + b"\0")
        _ptrace(SETREGS, self.pid, None, ctypes.addressof(regs))
        _ptrace(STEP, self.pid)
        os.waitpid(self.pid, ANY_THREAD)
        _ptrace(GETREGS, self.pid, None, ctypes.addressof(regs))
        answer = ctypes.c_long(regs[RAX]).value
        return -answer if -4096 < answer < 0 else 0

    def _put(self, place, data):
        data += bytes(-len(data) % WORD)
        for at in range(0, len(data), WORD):
            _ptrace(POKE, self.pid, place + at, struct.unpack_from("<Q", data, at)[0])
