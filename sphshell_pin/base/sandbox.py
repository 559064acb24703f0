"""The start of a child process that reads files of strangers: it computes, and answers on a pipe.

Run as a program, before anything else is loaded, so that all its threads are confined. On Linux
(x86-64, ARM64) the kernel refuses it every system call that is not listed here: it opens no file
for writing, makes, renames and removes none, opens no socket, starts no process and signals none
but itself. Landlock, on any architecture, refuses the file operations and TCP once more. A system
that has neither leaves it to the limits that each child sets.
"""

import ctypes
import fcntl
import os
import signal
import struct
import sys
from contextlib import suppress

_CALLS = (  # number on x86-64 and on ARM64, - where there is none
    "read 0 63 write 1 64 futex 202 98 mmap 9 222 munmap 11 215 mprotect 10 226 madvise 28 233 "
    "brk 12 214 mremap 25 216 close 3 57 fstat 5 80 newfstatat 262 79 statx 332 291 stat 4 - "
    "lstat 6 - lseek 8 62 pread64 17 67 readv 19 65 writev 20 66 access 21 - faccessat 269 48 "
    "faccessat2 439 439 readlink 89 - readlinkat 267 78 getdents 78 - getdents64 217 61 "
    "getcwd 79 17 chdir 80 49 statfs 137 43 fstatfs 138 44 fadvise64 221 223 umask 95 166 "
    "dup 32 23 dup2 33 - dup3 292 24 pipe2 293 59 poll 7 - ppoll 271 73 select 23 - "
    "pselect6 270 72 epoll_create1 291 20 epoll_ctl 233 21 epoll_wait 232 - epoll_pwait 281 22 "
    "eventfd2 290 19 rt_sigaction 13 134 rt_sigprocmask 14 135 rt_sigreturn 15 139 "
    "rt_sigtimedwait 128 137 rt_sigsuspend 130 133 sigaltstack 131 132 restart_syscall 219 128 "
    "sched_yield 24 124 sched_getaffinity 204 123 sched_getparam 143 121 "
    "sched_getscheduler 145 120 sched_get_priority_max 146 125 sched_get_priority_min 147 126 "
    "get_mempolicy 239 236 mbind 237 235 getcpu 309 168 mincore 27 232 msync 26 227 "
    "membarrier 324 283 nanosleep 35 101 clock_nanosleep 230 115 clock_gettime 228 113 "
    "clock_getres 229 114 gettimeofday 96 169 time 201 - times 100 153 getitimer 36 102 "
    "setitimer 38 103 alarm 37 - "
    "getpid 39 172 getppid 110 173 gettid 186 178 getuid 102 174 geteuid 107 175 getgid 104 176 "
    "getegid 108 177 getresuid 118 148 getresgid 120 150 getgroups 115 158 getpgrp 111 - "
    "getpgid 121 155 getsid 124 156 uname 63 160 sysinfo 99 179 getrusage 98 165 getrlimit 97 163 "
    "setrlimit 160 164 set_robust_list 273 99 get_robust_list 274 100 set_tid_address 218 96 "
    "rseq 334 293 getrandom 318 278 arch_prctl 158 - prctl 157 167 exit 60 93 exit_group 231 94"
)
_WRITING = os.O_ACCMODE | os.O_CREAT | os.O_TRUNC
_THREAD = 0x10000  # CLONE_THREAD
_OWN = (0, 1, 2, 3, 4, 1030)  # of fcntl: duplicates and flags
_TERMINAL = (0x5401, 0x5450, 0x5451, 0x541B)  # of ioctl: whether it is one, close-on-exec, FIONREAD
_ARCHITECTURES = {"x86_64": (0xC000003E, 0, 317), "aarch64": (0xC00000B7, 1, 277)}
_NEWEST = 424  # larger numbers are the same everywhere, and missing in older kernels


def confine() -> None:
    """Have the kernel refuse this process, for good, all but to compute, read and answer."""
    if not sys.platform.startswith("linux") or sys.maxsize < 2**32:
        return
    system = ctypes.CDLL(None, use_errno=True)
    if system.prctl(38, 1, 0, 0, 0):  # PR_SET_NO_NEW_PRIVS
        return
    system.syscall.argtypes = [ctypes.c_long] * 5
    _landlock(system)
    _filter(system)


def _landlock(system: ctypes.CDLL) -> None:
    """Refuse what Landlock of this kernel knows, but to read."""
    version = system.syscall(444, 0, 0, 1, 0)
    if version < 1:
        return
    files = (1 << {1: 13, 2: 14, 3: 15, 4: 15}.get(version, 16)) - 1 & ~0b1100  # not to read
    rules = struct.pack("QQQ", files, 3 if version >= 4 else 0, 3 if version >= 6 else 0)
    buffer = ctypes.create_string_buffer(rules, len(rules))
    number = system.syscall(444, ctypes.addressof(buffer), len(rules), 0, 0)
    if number >= 0:
        system.syscall(446, number, 0, 0, 0)
        os.close(number)


def _filter(system: ctypes.CDLL) -> None:
    """Refuse every system call that is not listed: a program of the kernel's packet filter."""
    machine = os.uname().machine
    if machine not in _ARCHITECTURES:
        return
    kind, column, seccomp = _ARCHITECTURES[machine]
    words = _CALLS.split()
    plain = [int(number) for number in words[1 + column :: 3] if number != "-"]
    own = os.getpid()
    # Number of the call, its argument, the bits looked at, the values allowed.
    bounded = [
        ((257, 56), 2, _WRITING, (0,)),  # openat
        ((2, -1), 1, _WRITING, (0,)),  # open
        ((56, 220), 0, _THREAD, (_THREAD,)),  # clone
        ((62, 129), 0, 0xFFFFFFFF, (own,)),  # kill
        ((234, 131), 0, 0xFFFFFFFF, (own,)),  # tgkill
        ((302, 261), 0, 0xFFFFFFFF, (0,)),  # prlimit64
        ((72, 25), 1, 0xFFFFFFFF, _OWN),  # fcntl
        ((16, 29), 1, 0xFFFFFFFF, _TERMINAL),  # ioctl
    ]
    load, equal, at_least, both, answer = 0x20, 0x15, 0x35, 0x54, 0x06
    allow, refuse, unknown = 0x7FFF0000, 0x00050001, 0x00050026  # EPERM, ENOSYS
    program = [(load, 0, 0, 4), (equal, 1, 0, kind), (answer, 0, 0, refuse), (load, 0, 0, 0)]
    for number in plain:
        program += [(equal, 0, 1, number), (answer, 0, 0, allow)]
    for numbers, argument, bits, values in bounded:
        if numbers[column] >= 0:
            tests = [one for v in values for one in ((equal, 0, 1, v), (answer, 0, 0, allow))]
            program += [
                (equal, 0, len(tests) + 3, numbers[column]),
                (load, 0, 0, 16 + 8 * argument),
                (both, 0, 0, bits),
                *tests,
                (answer, 0, 0, refuse),
            ]
    program += [(at_least, 0, 1, _NEWEST), (answer, 0, 0, unknown), (answer, 0, 0, refuse)]
    code = b"".join(struct.pack("HBBI", *one) for one in program)
    buffer = ctypes.create_string_buffer(code, len(code))
    filters = struct.pack("HxxxxxxQ", len(program), ctypes.addressof(buffer))
    whole = ctypes.create_string_buffer(filters, len(filters))
    system.syscall(seccomp, 1, 0, ctypes.addressof(whole), 0)


def main() -> None:
    """Serve with the module that is the first argument; `sys.path` are the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C: it ends the child
    pipes = os.dup(0), os.dup(1)
    with suppress(OSError):
        fcntl.fcntl(pipes[0], fcntl.F_SETOWN, os.getpid())  # whom SIGIO is for, if wanted
    nothing = os.open(os.devnull, os.O_RDWR)  # libraries may write reports to standard output
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    module, sys.path[:] = sys.argv[1], sys.argv[2:]
    # NumPy's threads wait by turning in circles, and nothing here is large enough for two.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    confine()
    from importlib import import_module

    import_module(module).serve(*pipes)


if __name__ == "__main__":
    main()
