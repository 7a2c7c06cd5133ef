/* A disk that fails: preloaded, it counts the calls that change files below a folder, and lets one of them fail.

   disk_watch(folder) names the folder; disk_fail(at, how) lets call number `at` (0 is the next one) fail, and returns the
   number of calls since the last disk_fail. `how` is an errno: ENOSPC for a disk that is full from there on (what frees
   space still works), another one for a single error; or -1 for the end of the process, as kill -9 leaves the disk: half of
   a write is done, and nothing afterwards. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static char folder[PATH_MAX];
static atomic_long calls;
static long fail_at = -1;
static int fail_how, dead, full;

void disk_watch(const char *path) { snprintf(folder, sizeof folder, "%s", path); }

long disk_fail(long at, int how) {
    long before = calls;
    calls = 0;
    fail_at = at;
    fail_how = how;
    dead = full = 0;
    return before;
}

static int below(const char *path) { return *folder && !strncmp(path, folder, strlen(folder)); }

static int path_watched(int at, const char *path) {
    char where[PATH_MAX], link[64];
    if (!*folder) return 0;
    if (*path == '/') return below(path);
    snprintf(link, sizeof link, at == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", at);
    ssize_t length = readlink(link, where, sizeof where - 1);
    return length > 0 && (where[length] = 0, below(where));
}

static int fd_watched(int fd) {
    char where[PATH_MAX], link[64];
    if (!*folder) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, where, sizeof where - 1);
    return length > 0 && (where[length] = 0, below(where));
}

/* Whether a call must fail: 0, or -1 with errno set; 1 where a write should do half. */
static int verdict(int writes) {
    if (dead) return errno = EIO, -1;
    if (full && writes) return errno = ENOSPC, -1;
    if (calls++ != fail_at) return 0;
    if (fail_how == ENOSPC) full = 1;
    if (fail_how == -1) dead = 1;
    if (writes > 1 && fail_how != EIO) return 1;
    return errno = fail_how == -1 ? EIO : fail_how, -1;
}

#define REAL(name) ((typeof(&name))dlsym(RTLD_NEXT, #name))
enum { FREES, WRITES, DATA };

static int open_in(const char *name, int at, const char *path, int flags, mode_t mode) {
    int (*real)(int, const char *, int, ...) = dlsym(RTLD_NEXT, name);
    if ((flags & (O_CREAT | O_TRUNC)) && path_watched(at, path) && verdict(WRITES)) return -1;
    return real(at, path, flags, mode);
}
#define MODE mode_t mode = 0; if (flags & (O_CREAT | O_TMPFILE)) { va_list more; va_start(more, flags); mode = va_arg(more, mode_t); va_end(more); }
int open(const char *path, int flags, ...) { MODE return open_in("openat", AT_FDCWD, path, flags, mode); }
int open64(const char *path, int flags, ...) { MODE return open_in("openat64", AT_FDCWD, path, flags, mode); }
int openat(int at, const char *path, int flags, ...) { MODE return open_in("openat", at, path, flags, mode); }
int openat64(int at, const char *path, int flags, ...) { MODE return open_in("openat64", at, path, flags, mode); }

/* The size that is written now; -1 for an error. */
static ssize_t allowed(int fd, size_t size) {
    if (!fd_watched(fd)) return size;
    int found = verdict(DATA);
    return found < 0 ? -1 : found ? (ssize_t)(size / 2) : (ssize_t)size;
}
#define HALF(call) ssize_t some = allowed(fd, size); if (some < 0) return -1; if (some == 0 && size) return errno = full ? ENOSPC : EIO, -1; size = some; return call
ssize_t write(int fd, const void *data, size_t size) { HALF(REAL(write)(fd, data, size)); }
ssize_t pwrite(int fd, const void *data, size_t size, off_t at) { HALF(REAL(pwrite)(fd, data, size, at)); }
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at) { HALF(REAL(pwrite64)(fd, data, size, at)); }
ssize_t writev(int fd, const struct iovec *parts, int count) {
    return fd_watched(fd) && verdict(WRITES) ? -1 : REAL(writev)(fd, parts, count);
}
#define ON_FILE(name, more, ...) int name(int fd more) { return fd_watched(fd) && verdict(WRITES) ? -1 : REAL(name)(fd __VA_ARGS__); }
#define COMMA ,
ON_FILE(fsync, )
ON_FILE(fdatasync, )
ON_FILE(ftruncate, COMMA off_t size, , size)
ON_FILE(ftruncate64, COMMA off64_t size, , size)

int rename(const char *old, const char *new) { return path_watched(AT_FDCWD, new) && verdict(FREES) ? -1 : REAL(rename)(old, new); }
int renameat(int a, const char *old, int b, const char *new) { return path_watched(b, new) && verdict(FREES) ? -1 : REAL(renameat)(a, old, b, new); }
int unlink(const char *path) { return path_watched(AT_FDCWD, path) && verdict(FREES) ? -1 : REAL(unlink)(path); }
int unlinkat(int at, const char *path, int flags) { return path_watched(at, path) && verdict(FREES) ? -1 : REAL(unlinkat)(at, path, flags); }
int rmdir(const char *path) { return path_watched(AT_FDCWD, path) && verdict(FREES) ? -1 : REAL(rmdir)(path); }
int mkdir(const char *path, mode_t mode) { return path_watched(AT_FDCWD, path) && verdict(WRITES) ? -1 : REAL(mkdir)(path, mode); }
int mkdirat(int at, const char *path, mode_t mode) { return path_watched(at, path) && verdict(WRITES) ? -1 : REAL(mkdirat)(at, path, mode); }
