/* The runs of docs/bits.md by libclutch: reads bits.in, prints a hash of every output of every tick for each run.
 *
 * bits.in is what the image mps2-bits reads: for each run a header of 32 bytes, settings of 10, counts of 4, little-endian.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include "clutch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_SETTINGS 512
#define FIRST_KNOT 0x1000u

static FILE *in;
static clutch_servo servo;
static clutch_path path;
static clutch_stick_slip detector;

static void require(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s\n", what);
        exit(1);
    }
}

static uint64_t number(const uint8_t *bytes, int count)
{
    uint64_t out = 0;
    while (count-- > 0)
        out = out << 8 | bytes[count];
    return out;
}

static uint32_t crc = 0;

static void hash(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
    }
}

static void put(uint64_t value, int bytes)
{
    uint8_t out[8];
    for (int i = 0; i < bytes; i++)
        out[i] = (uint8_t)(value >> (8 * i));
    hash(out, (size_t)bytes);
}

static void put_real(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(bits, 4);
}

/* One run; 0 at the end of the file. */
static int one_run(void)
{
    uint8_t header[32], bytes[10];
    static clutch_setting settings[MAX_SETTINGS];
    static clutch_knot knots[CLUTCH_MAX_KNOTS];
    size_t settings_count = 0, knots_count = 0;
    if (fread(header, 1, sizeof header, in) != sizeof header)
        return 0;
    int64_t origin = (int64_t)number(header, 8);
    uint32_t volts_bits = (uint32_t)number(header + 8, 4), ticks = (uint32_t)number(header + 12, 4);
    uint32_t pairs = (uint32_t)number(header + 16, 4);
    float volts;
    memcpy(&volts, &volts_bits, sizeof volts);
    for (uint32_t i = 0; i < pairs; i++) {
        require(fread(bytes, 1, sizeof bytes, in) == sizeof bytes, "a setting");
        uint16_t key = (uint16_t)number(bytes, 2);
        uint64_t value = number(bytes + 2, 8);
        if (key < FIRST_KNOT) {
            require(settings_count < MAX_SETTINGS, "room for the settings");
            settings[settings_count].key = key;
            settings[settings_count++].value = value;
        } else {
            knots_count = (key - FIRST_KNOT) / 2 + 1u;
            require(knots_count <= CLUTCH_MAX_KNOTS, "room for the points");
            if ((key - FIRST_KNOT) % 2 == 0)
                knots[knots_count - 1].time_us = value;
            else
                knots[knots_count - 1].position_x65536 = (int64_t)value;
        }
    }
    const clutch_run run = {settings, settings_count, knots, knots_count};
    clutch_misfit misfit;
    require(clutch_servo_build(&servo, &run, &misfit) == CLUTCH_OK, "a servo");
    require(clutch_path_build(&path, &run, &misfit) == CLUTCH_OK, "a path");
    require(clutch_stick_slip_build(&detector, &run, &misfit) == CLUTCH_OK,
            "a detector");
    crc = 0xffffffffu;
    for (uint32_t k = 0; k < ticks; k++) {
        clutch_target target;
        clutch_output out;
        clutch_sticks sticks;
        require(fread(bytes, 1, 4, in) == 4, "counts");
        int32_t counts = (int32_t)number(bytes, 4);
        require(clutch_path_at(&path, k, &target) == CLUTCH_OK, "a target");
        target.position_x65536 += origin;
        if (k == 0)
            require(clutch_servo_start(&servo, counts, &target, volts) == CLUTCH_OK, "a start");
        require(clutch_servo_tick(&servo, counts, &target, &out) == CLUTCH_OK, "a tick");
        require(clutch_stick_slip_update(&detector, counts, target.velocity, &sticks) == CLUTCH_OK, "a look");
        put((uint64_t)target.position_x65536, 8);
        put_real(target.velocity);
        put_real(target.acceleration);
        put_real(out.tick.error);
        put_real(out.tick.error_rate);
        for (int i = 0; i < 3; i++)
            put_real(out.command.terms[i]);
        put_real(out.command.voltage);
        put_real(out.voltage);
        put(out.code, 2);
        put(out.command.limit, 1);
        put(sticks.stuck, 1);
        put((uint32_t)sticks.cycles, 4);
        put((uint32_t)sticks.stuck_ticks, 4);
        put(sticks.stair, 4);
        for (int i = 3; i < out.command.terms_count; i++)
            put_real(out.command.terms[i]);
    }
    printf("%08lx\n", (unsigned long)(crc ^ 0xffffffffu));
    return 1;
}

int main(void)
{
    in = fopen("bits.in", "rb");
    require(in != NULL, "bits.in");
    while (one_run())
        ;
    return 0;
}
