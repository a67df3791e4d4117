/* Loaded into QEMU before all else: its clock is slower by 168 / 16, so that a firmware that believes in 16 MHz lives in real time. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <poll.h>
#include <signal.h>
#include <time.h>

typedef int clock_function(clockid_t, struct timespec *);
typedef int poll_function(struct pollfd *, nfds_t, const struct timespec *, const sigset_t *);

int clock_gettime(clockid_t clock, struct timespec *at)
{
    static clock_function *real;
    if (!real)
        real = (clock_function *)dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(clock, at);
    if (!failed && clock == CLOCK_MONOTONIC) {
        long long nanos = (at->tv_sec * 1000000000LL + at->tv_nsec) * 16 / 168;
        at->tv_sec = nanos / 1000000000;
        at->tv_nsec = nanos % 1000000000;
    }
    return failed;
}

/* A timeout is a time of the slow clock. Without this the wait for a timer ends a tenth of the way, some ten times for each tick. */
int ppoll(struct pollfd *files, nfds_t count, const struct timespec *timeout, const sigset_t *signals)
{
    static poll_function *real;
    if (!real)
        real = (poll_function *)dlsym(RTLD_NEXT, "ppoll");
    struct timespec slow;
    if (timeout && timeout->tv_sec < 1000000) {
        long long nanos = (timeout->tv_sec * 1000000000LL + timeout->tv_nsec) * 168 / 16;
        slow.tv_sec = nanos / 1000000000;
        slow.tv_nsec = nanos % 1000000000;
        timeout = &slow;
    }
    return real(files, count, timeout, signals);
}
