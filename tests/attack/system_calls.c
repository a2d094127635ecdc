/* Preloaded: the n-th call of one kind on files below a folder kills the process, or fails, before, inside or after.
   A call that fails with EINTR was interrupted by Ctrl-C. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum call { PWRITE, FSYNC, RENAME, FTRUNCATE, UNLINK, PREAD };
enum moment { BEFORE, INSIDE, AFTER };

int left; /* until the call that is wanted */
static int armed, wanted, moment, failure; /* failure 0: kill */
static char under[PATH_MAX];

void arm(int call, int number, int when, int error, const char *folder) {
    wanted = call, left = number, moment = when, failure = error;
    snprintf(under, sizeof under, "%s/", folder);
    armed = 1;
}

static void die(void) { kill(getpid(), SIGKILL); pause(); }
static void *killer(void *_) { die(); return _; }

static int is_due(int call, int fd, const char *path) {
    char link[64], found[PATH_MAX] = "";
    if (!armed || call != wanted) return 0;
    if (path) {
        if (*path != '/' && getcwd(found, sizeof found - 1)) strncat(found, "/", sizeof found - strlen(found) - 1);
        strncat(found, path, sizeof found - strlen(found) - 1);
    } else {
        snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
        ssize_t size = readlink(link, found, sizeof found - 1);
        if (size < 0) return 0;
        found[size] = 0;
    }
    /* The folder itself is synchronised too. */
    size_t length = strlen(under);
    if (strncmp(found, under, length) && (strlen(found) + 1 != length || strncmp(found, under, length - 1))) return 0;
    /* A disk that cannot be read stays so. */
    int more = __sync_sub_and_fetch(&left, 1);
    return call == PREAD ? more <= 0 : more == 0;
}

/* The call may be made in part: PART is what of it. */
#define FAULTY(CALL, FD, PATH, PART, WHOLE)                                     \
    if (!is_due(CALL, FD, PATH)) return WHOLE;                                  \
    if (failure == EINTR) kill(getpid(), SIGINT);                               \
    if (moment == BEFORE) { if (!failure) die(); errno = failure; return -1; }  \
    if (moment == INSIDE && !failure) {                                         \
        pthread_t other;                                                        \
        (void)!PART;                                                            \
        if (CALL != PWRITE) pthread_create(&other, NULL, killer, NULL), (void)!WHOLE; \
        die();                                                                  \
    }                                                                           \
    if (moment == INSIDE) { (void)!PART; errno = failure; return -1; }          \
    (void)!WHOLE;                                                               \
    if (!failure) die();                                                        \
    errno = failure;                                                            \
    return -1;

#define REAL(NAME) static __typeof__(NAME) *real; if (!real) real = (__typeof__(NAME) *)dlsym(RTLD_NEXT, #NAME)

ssize_t pwrite(int fd, const void *data, size_t size, off_t at) {
    REAL(pwrite);
    FAULTY(PWRITE, fd, NULL, real(fd, data, size / 2, at), real(fd, data, size, at))
}
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at) {
    REAL(pwrite64);
    FAULTY(PWRITE, fd, NULL, real(fd, data, size / 2, at), real(fd, data, size, at))
}
ssize_t pread(int fd, void *data, size_t size, off_t at) {
    REAL(pread);
    FAULTY(PREAD, fd, NULL, 0, real(fd, data, size, at))
}
ssize_t pread64(int fd, void *data, size_t size, off64_t at) {
    REAL(pread64);
    FAULTY(PREAD, fd, NULL, 0, real(fd, data, size, at))
}
int fsync(int fd) { REAL(fsync); FAULTY(FSYNC, fd, NULL, 0, real(fd)) }
int fdatasync(int fd) { REAL(fdatasync); FAULTY(FSYNC, fd, NULL, 0, real(fd)) }
int rename(const char *old, const char *new) { REAL(rename); FAULTY(RENAME, -1, new, 0, real(old, new)) }
int ftruncate(int fd, off_t size) { REAL(ftruncate); FAULTY(FTRUNCATE, fd, NULL, 0, real(fd, size)) }
int ftruncate64(int fd, off64_t size) { REAL(ftruncate64); FAULTY(FTRUNCATE, fd, NULL, 0, real(fd, size)) }
int unlink(const char *path) { REAL(unlink); FAULTY(UNLINK, -1, path, 0, real(path)) }
