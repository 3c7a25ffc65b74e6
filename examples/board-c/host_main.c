/* board.c on Linux: a board on a pseudo-terminal, with a crude shaft, in real time.
 *
 *     gcc -std=c99 -O2 -Wall -Wextra -I ../../crates/clutch-wire/include board.c host_main.c -o board_host
 *     ./board_host [SECONDS [PATIENCE]]
 *
 * Prints the path of the pseudo-terminal, then runs until it is interrupted, or for that many seconds of its clock. With a patience
 * of so many seconds, for tests on a busy machine, that clock stands still where the machine stalls, and while a host that has
 * answered the last sample has not yet answered this one, for as long as that at most. Without, it is the machine's.
 * The shaft: inertia, a weight on a string, viscous drag, a brake with Coulomb friction that sticks.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#define _GNU_SOURCE
#include "board.h"
#include "clutch_wire.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define COUNTS_PER_REV 20000
#define DAC_BITS 12
#define DAC_LOWEST_V (-10.0)
#define DAC_STEP_V (20.0 / 4096.0)
#define BOOT_CODE 2970 /* 4.5 V: holds the weight with margin */

static int line = -1; /* the board's end of the pseudo-terminal */
static int client;    /* somebody has the other end open */

/* ---- the shaft ---- */

static struct {
    double angle, speed; /* rad, rad/s */
    double volts;        /* at the brake */
    uint64_t moved_ns;   /* up to here */
} shaft;

/* One short step. */
static void move(double seconds)
{
    const double inertia = 0.0017, drive = 0.2 * 9.81 * 0.024, drag = 0.001, gain = 0.14;
    double press = gain * (shaft.volts > 0 ? shaft.volts : 0); /* a pad only pushes */
    double friction = 0.15 * press, sign, torque, next;
    if (shaft.speed == 0) {
        if (drive <= 0.2 * press)
            return; /* stuck */
        sign = 1; /* the weight pulls this way, and nothing pulls the other way */
    } else {
        sign = shaft.speed > 0 ? 1 : -1;
    }
    torque = drive - sign * friction - drag * shaft.speed;
    next = shaft.speed + torque / inertia * seconds;
    if (shaft.speed != 0 && next * shaft.speed < 0)
        next = 0; /* friction stops a shaft, it does not reverse it */
    shaft.angle += 0.5 * (shaft.speed + next) * seconds;
    shaft.speed = next;
}

/* ---- the clock ---- */

static uint64_t patience_ns;
/* With patience: time that the board has, what the machine's clock was then, and until when on it time stands still. */
static uint64_t own_ns, seen_ns, still_until_ns;
/* Bytes have come since the last sample. */
static int answered;

static uint64_t machine_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static uint64_t now_ns(void)
{
    const uint64_t stall_ns = 10000000; /* who looks again after more than that was not running */
    uint64_t machine = machine_ns(), passed = machine - seen_ns;
    if (patience_ns == 0)
        return machine;
    seen_ns = machine;
    if (machine >= still_until_ns)
        own_ns += passed < stall_ns ? passed : stall_ns;
    return own_ns;
}

/* A sample is out: a host that has answered the last one owes an answer. */
static void wait_for_answer(void)
{
    if (patience_ns != 0 && answered)
        still_until_ns = machine_ns() + patience_ns;
    answered = 0;
}

static void hear_answer(void)
{
    answered = 1;
    still_until_ns = 0;
}

static void move_to(uint64_t ns)
{
    while (shaft.moved_ns < ns) {
        uint64_t step = ns - shaft.moved_ns < 10000 ? ns - shaft.moved_ns : 10000;
        move((double)step * 1e-9);
        shaft.moved_ns += step;
    }
}

static uint32_t micros(uint64_t ns)
{
    return (uint32_t)(ns / 1000u);
}

/* ---- the functions that board.c needs ---- */

int32_t read_encoder(void)
{
    /* The weight only sinks: the angle is never below 0, so the cast rounds down. */
    return (int32_t)(uint32_t)(uint64_t)(shaft.angle * (COUNTS_PER_REV / 6.283185307179586));
}

void write_dac(uint16_t code)
{
    move_to(now_ns()); /* under the voltage that has been there until now */
    shaft.volts = DAC_LOWEST_V + DAC_STEP_V * code;
}

void serial_write(const uint8_t *bytes, size_t count)
{
    /* Bytes that do not fit are dropped: they would come too late to be of use. */
    if (client && write(line, bytes, count) < 0 && errno != EAGAIN)
        client = 0;
}

uint8_t hardware_faults(void)
{
    return 0; /* nothing here breaks */
}

/* ---- the pseudo-terminal ---- */

/* Raw bytes, and nothing left for the next client to read. */
static int reset_line(const char *path)
{
    struct termios modes;
    int end = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (end < 0)
        return -1;
    if (tcgetattr(end, &modes) == 0) {
        cfmakeraw(&modes);
        tcsetattr(end, TCSANOW, &modes);
    }
    tcflush(end, TCIFLUSH);
    close(end);
    return 0;
}

static const char *open_line(void)
{
    static char path[64];
    line = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (line < 0 || grantpt(line) != 0 || unlockpt(line) != 0 || ptsname_r(line, path, sizeof path) != 0)
        return NULL;
    if (fcntl(line, F_SETFL, fcntl(line, F_GETFL) | O_NONBLOCK) != 0 || reset_line(path) != 0)
        return NULL;
    return path;
}

/* Reads the available bytes; waits for them up to `until`. */
static void listen(const char *path, uint64_t until)
{
    uint64_t now = now_ns(), wait = until > now ? until - now : 0;
    struct timespec span;
    struct pollfd fd;
    uint8_t bytes[256];
    ssize_t got, i;
    span.tv_sec = (time_t)(wait / 1000000000u);
    span.tv_nsec = (long)(wait % 1000000000u);
    fd.fd = line;
    fd.events = POLLIN;
    fd.revents = 0;
    if (ppoll(&fd, 1, &span, NULL) < 0)
        return; /* a signal */
    if ((fd.revents & POLLHUP) != 0 && (fd.revents & POLLIN) == 0) {
        /* With no peer connected, ppoll returns immediately, so sleep. The board continues. */
        if (client)
            reset_line(path);
        client = 0;
        clock_nanosleep(CLOCK_MONOTONIC, 0, &span, NULL);
        return;
    }
    client = 1;
    if ((fd.revents & POLLIN) == 0)
        return;
    got = read(line, bytes, sizeof bytes);
    now = now_ns(); /* before time goes on: a host that is late is not late here */
    if (got > 0)
        hear_answer();
    move_to(now);
    for (i = 0; i < got; i++)
        board_byte(bytes[i], micros(now));
}

/* The number of this power-up: nobody who cannot hear the board shall know it. */
static int unguessable(uint32_t *number) {
    FILE *source = fopen("/dev/urandom", "rb");
    size_t got = source != NULL ? fread(number, sizeof *number, 1, source) : 0;
    if (source != NULL) {
        (void)fclose(source);
    }
    return got == 1;
}

/* 0 if it is not a time. */
static uint64_t seconds_ns(const char *name, const char *text)
{
    char *rest;
    double seconds = strtod(text, &rest);
    if (*rest == 0 && seconds > 0 && seconds < 1e9)
        return (uint64_t)(seconds * 1e9);
    fprintf(stderr, "%s = %s: expected a number above 0 and below 1e9\n", name, text);
    return 0;
}

int main(int argc, char **argv)
{
    const uint64_t idle_ns = 10000000;
    board_params_t params;
    const char *path, *error;
    uint64_t start, end = UINT64_MAX, next_tick = UINT64_MAX;
    uint32_t configurations = 0;
    if (argc > 1)
        end = seconds_ns("SECONDS", argv[1]);
    if (argc > 2)
        patience_ns = seconds_ns("PATIENCE", argv[2]);
    if (end == 0 || (argc > 2 && patience_ns == 0))
        return 2;
    own_ns = seen_ns = machine_ns();
    start = now_ns();
    end = end == UINT64_MAX ? end : start + end;
    path = open_line();
    if (path == NULL) {
        perror("pseudo-terminal");
        return 1;
    }
    params.board = 99; /* 0 and 1 are the simulated boards of `clutch daq` */
    if (!unguessable(&params.boot)) {
        perror("/dev/urandom");
        return 1;
    }
    params.counts_per_rev = COUNTS_PER_REV;
    params.dac_bits = DAC_BITS;
    params.dac_lowest_mv = -10000;
    params.dac_highest_mv = 10000;
    params.period_min_us = 500;
    params.period_max_us = 1000000;
    params.watchdog_max_us = 1000000;
    params.boot_code = BOOT_CODE;
    params.started_by = CLUTCH_RESET_CAUSE_POWER;
    params.warnings = 0;
    shaft.moved_ns = start;
    error = board_init(&params);
    if (error != NULL) {
        fprintf(stderr, "%s\n", error);
        return 2;
    }
    printf("%s\n", path);
    fflush(stdout);

    while (now_ns() < end) {
        uint64_t now, until;
        if (configurations != board_configurations()) {
            configurations = board_configurations();
            next_tick = now_ns(); /* the first sample at once */
        }
        /* Bytes wake it up; without any, the watchdog is checked each 200 us. */
        until = now_ns() + (board_period_us() != 0 ? 200000 : idle_ns);
        listen(path, next_tick < until ? next_tick : until);
        now = now_ns();
        move_to(now);
        board_poll(micros(now));
        if (configurations == board_configurations() && now >= next_tick) {
            uint64_t period = (uint64_t)board_period_us() * 1000u;
            board_tick(micros(now));
            wait_for_answer();
            next_tick += period;
            if (next_tick < now) /* periods that the machine slept through stay out */
                next_tick += (now - next_tick) / period * period + period;
        }
    }
    close(line);
    return 0;
}
