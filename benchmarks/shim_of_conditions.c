/* LD_PRELOAD library that simulates two conditions: no threads left, and a clock set an hour forward.

   A condition begins when the file SHIM_FOLDER/<condition>.<pid> is created. Otherwise, a test would
   need another user and the right to set the clock. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static int is_on(const char *condition)
{
    const char *folder = getenv("SHIM_FOLDER");
    char path[512];
    int before = errno, found;
    if (!folder)
        return 0;
    snprintf(path, sizeof path, "%s/%s.%d", folder, condition, getpid());
    found = access(path, F_OK) == 0;
    errno = before;
    return found;
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *), void *given)
{
    static int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    if (!real)
        real = dlsym(RTLD_NEXT, "pthread_create");
    return is_on("no threads") ? EAGAIN : real(thread, attributes, run, given);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static int (*real)(clockid_t, struct timespec *);
    int result;
    if (!real)
        real = dlsym(RTLD_NEXT, "clock_gettime");
    result = real(clock, now);
    if (clock == CLOCK_REALTIME && is_on("clock stepped"))
        now->tv_sec += 3600;
    return result;
}
