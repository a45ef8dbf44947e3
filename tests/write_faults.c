/* Faults at writes, for a process that loads this before its C library (LD_PRELOAD).

   Counts what changes files below the path FAULT_UNDER: opening to write, writing, cutting, renaming, removing, making
   folders. From number FAULT_AT on, FAULT says what happens instead: "kill" ends the process as `kill -9` does, before
   the call; anything else fails it with ENOSPC, as a disk that is full does, and goes on failing whatever adds bytes. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static long counted;

static int below(const char *path) {
    const char *under = getenv("FAULT_UNDER");
    return under && path && strncmp(path, under, strlen(under)) == 0;
}

/* Whether this call is to fail; adds says that it needs space. */
static int faulty(const char *path, int adds) {
    if (!below(path)) return 0;
    const char *at = getenv("FAULT_AT"), *what = getenv("FAULT");
    long number = __atomic_add_fetch(&counted, 1, __ATOMIC_SEQ_CST);
    if (!at || !what || number < atol(at)) return 0;
    if (strcmp(what, "kill") == 0) kill(getpid(), SIGKILL);
    if (!adds) return 0;
    errno = ENOSPC;
    return 1;
}

static int faulty_file(int file, int adds) {
    char link[64], path[4096];
    if (!getenv("FAULT_UNDER")) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return faulty(path, adds);
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define ON_FILE(type, name, adds, parameters, arguments) \
    type name parameters { return faulty_file(file, adds) ? -1 : REAL(name) arguments; }
#define ON_PATH(type, name, adds, parameters, arguments) \
    type name parameters { return faulty(path, adds) ? -1 : REAL(name) arguments; }
#define OPEN(name) \
    int name(const char *path, int flags, ...) { \
        va_list rest; \
        va_start(rest, flags); \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest); \
        return flags & (O_WRONLY | O_RDWR) && faulty(path, flags & O_CREAT) ? -1 : REAL(name)(path, flags, mode); \
    }

OPEN(open)
OPEN(open64)
ON_FILE(ssize_t, write, 1, (int file, const void *bytes, size_t size), (file, bytes, size))
ON_FILE(ssize_t, pwrite, 1, (int file, const void *bytes, size_t size, off_t at), (file, bytes, size, at))
ON_FILE(ssize_t, pwrite64, 1, (int file, const void *bytes, size_t size, off64_t at), (file, bytes, size, at))
ON_FILE(ssize_t, writev, 1, (int file, const struct iovec *parts, int count), (file, parts, count))
ON_FILE(int, ftruncate, 0, (int file, off_t size), (file, size))
ON_FILE(int, ftruncate64, 0, (int file, off64_t size), (file, size))
ON_PATH(int, rename, 0, (const char *path, const char *to), (path, to))
ON_PATH(int, mkdir, 1, (const char *path, mode_t mode), (path, mode))
ON_PATH(int, unlink, 0, (const char *path), (path))
ON_PATH(int, rmdir, 0, (const char *path), (path))

/* How many such calls this process has counted. */
long faults_counted(void) { return counted; }
