// A filter of system calls (seccomp) for processes that read input from strangers. The kernel enforces it on
// the process and all its descendants, irrevocably.
#pragma once

namespace ls {

// Restricts this process to the system calls that the renderer, the readers of scene files, their libraries
// and the C library need (the list is in call_filter.cpp). All other calls fail with EPERM, among them those
// that open sockets, type into a terminal, signal or trace other processes, lock files, or change modes,
// owners, times, sizes and names of files. Calls that are newer than the list fail with ENOSYS, as on an
// older kernel. Also gives up gaining rights (no_new_privs). Returns false if the kernel has no filters;
// builds with sanitizers have none either. Call it while the process has only one thread: any other existing
// thread would stay unrestricted.
bool limit_calls();

// Denies this process starting threads, processes and programs from now on, besides limit_calls(). Returns
// false if the kernel has no filters.
bool forbid_processes();

// Denies this process starting other processes from now on, besides limit_calls(), but allows threads and
// becoming another program. The process can no longer change what signal it gets when its parent ends.
// Returns false if the kernel has no filters.
bool forbid_children();

}  // namespace ls
