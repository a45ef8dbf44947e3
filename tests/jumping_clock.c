/* A clock that jumps, for a process that loads this before its C library (LD_PRELOAD).

   The time of day is 50 minutes too early for a second, then right, then 50 minutes too late, and so on. Files get the
   system's time, and what only counts seconds, the monotonic clock, goes on as it does when a clock is set. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static time_t jump(void) {
    struct timespec now;
    REAL(clock_gettime)(CLOCK_MONOTONIC, &now);
    return (now.tv_sec % 3 - 1) * 3000;
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    int failed = REAL(clock_gettime)(clock, now);
    if (!failed && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) now->tv_sec += jump();
    return failed;
}

int gettimeofday(struct timeval *now, void *zone) {
    int failed = REAL(gettimeofday)(now, zone);
    if (!failed) now->tv_sec += jump();
    return failed;
}

time_t time(time_t *now) {
    time_t jumped = REAL(time)(NULL) + jump();
    if (now) *now = jumped;
    return jumped;
}
