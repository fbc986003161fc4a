"""Names of C, C++, their libraries, POSIX and the controller itself, which `code.prefix` must not be."""

_KEYWORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t
    char32_t class co_await co_return co_yield compl concept const const_cast consteval constexpr
    constinit continue decltype default delete do double dynamic_cast else enum explicit export extern
    false final float for friend goto if import inline int long module mutable namespace new noexcept
    not not_eq nullptr operator or or_eq override private protected public register reinterpret_cast
    requires restrict return short signed sizeof static static_assert static_cast struct switch template
    this thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using
    virtual void volatile wchar_t while xor xor_eq
"""
_HEADERS = """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg
    stdatomic stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar
    wchar wctype
"""
_TYPES = """
    clock div fpos imaxdiv intmax intptr ldiv lldiv max_align mbstate off ptrdiff rsize sig_atomic size ssize
    uintmax uintptr wctrans wint
"""
_ATOMIC = "bool char char16 char32 flag llong long schar short uchar uint ullong ulong ushort wchar"
_THREADS = "cnd mtx once thrd thrd_start tss tss_dtor"
_POSIX = """
    active_reg blkcnt blksize caddr cc char16 char32 clockid cpu_set daddr dev f fds fexcept fpregset
    fsblkcnt fsfilcnt fsid gid glob greg gregset iconv id idtype in_addr in_port ino key loff mcontext
    mm mode mqd msglen msgqnum nfds nlink pid posix_spawn_file_actions posix_spawnattr quad r re_dfa
    reg_errcode reg_syntax regex regmatch regoff rlim s_reg sa_family sem shmatt sig sigevent siginfo
    sigset sigval socklen speed stack suseconds tcflag timer u_int16 u_int32 u_int64 u_int8 u_quad
    ucontext uid useconds w wordexp x
"""
_PTHREAD = """
    attr barrier barrierattr cleanup cond condattr destructor key mutex mutexattr once rwlock rwlockattr
    spin spinlock
"""
_WIDTHS = [
    f"{sign}int{kind}{bits}"
    for sign in ("", "u")
    for kind in ("", "_least", "_fast")
    for bits in (8, 16, 32, 64)
]

KEYWORDS = frozenset(_KEYWORDS.split())
"""The keywords of C23 and C++23, including those with a meaning in some contexts only."""

STANDARD_NAMES = frozenset(
    [
        *_HEADERS.split(),
        *_TYPES.split(),
        *_WIDTHS,
        *_THREADS.split(),
        *_POSIX.split(),
        "atomic",
        *(f"atomic_{word}" for word in (*_ATOMIC.split(), *_TYPES.split(), *_WIDTHS)),
        "pthread",
        *(f"pthread_{word}" for word in _PTHREAD.split()),
    ]
)
"""Prefixes that would hide a C library header (stdio.h) or redefine one of its or POSIX's types (pid_t)."""

_OWN = """
    attitude call change_m climb_m displacement_m fold height innovation_m limits mean_m measured_m
    predictor run tiny velocity_m
"""
OWN_NAMES = frozenset(_OWN.split())
"""With one of these the name of a public function is that of another function or a variable of the C, as
`limits_init` is."""
