/* Drives board.c from a pipe, for the comparison with the Rust board. Integers are little-endian.
 *
 *   'I' board u32, boot u32, counts_per_rev u32, dac_bits u8, lowest i32, highest i32, period_min u32,
 *       period_max u32, watchdog_max u32, boot_code u16,
 *       started_by u8, brown-out low u8      power-up
 *   'B' now u32, length u16, bytes                           bytes come
 *   'T' now u32, counts i32, faults u8                       a period begins
 *   'P' now u32                                              the watchdog is checked
 *
 * Each is answered: length u16, bytes sent, code u16, state u8, period u32, configurations u32.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include "board.h"
#include "clutch_wire.h"

#include <stdio.h>
#include <stdlib.h>

static uint8_t sent[65536];
static size_t sent_count;
static uint16_t code;
static int32_t counts;
static uint8_t faults;

int32_t read_encoder(void)
{
    return counts;
}

void write_dac(uint16_t to)
{
    code = to;
}

void serial_write(const uint8_t *bytes, size_t count)
{
    if (count == 0 || count > CLUTCH_MAX_FRAME || sent_count + count > sizeof sent)
        exit(3);
    memcpy(sent + sent_count, bytes, count);
    sent_count += count;
}

uint8_t hardware_faults(void)
{
    return faults;
}

static void take(uint8_t *bytes, size_t count)
{
    if (fread(bytes, 1, count, stdin) != count)
        exit(4);
}

static uint32_t take_u32(void)
{
    uint8_t bytes[4];
    take(bytes, 4);
    return clutch_get_u32(bytes);
}

static int32_t take_i32(void)
{
    uint8_t bytes[4];
    take(bytes, 4);
    return clutch_get_i32(bytes);
}

static uint16_t take_u16(void)
{
    uint8_t bytes[2];
    take(bytes, 2);
    return clutch_get_u16(bytes);
}

static uint8_t take_u8(void)
{
    uint8_t byte;
    take(&byte, 1);
    return byte;
}

int main(void)
{
    int what;
    while ((what = getchar()) != EOF) {
        uint8_t head[2], tail[11];
        uint32_t now;
        sent_count = 0;
        if (what == 'I') {
            board_params_t p;
            const char *error;
            p.board = take_u32();
            p.boot = take_u32();
            p.counts_per_rev = take_u32();
            p.dac_bits = take_u8();
            p.dac_lowest_mv = take_i32();
            p.dac_highest_mv = take_i32();
            p.period_min_us = take_u32();
            p.period_max_us = take_u32();
            p.watchdog_max_us = take_u32();
            p.boot_code = take_u16();
            p.started_by = take_u8();
            p.warnings = take_u8() ? CLUTCH_WARNING_BROWN_OUT : 0;
            code = 0xffff;
            error = board_init(&p);
            if (error != NULL) { /* the text is the answer */
                sent_count = strlen(error);
                memcpy(sent, error, sent_count);
            }
        } else if (what == 'B') {
            uint16_t count, i;
            now = take_u32();
            count = take_u16();
            for (i = 0; i < count; i++)
                board_byte(take_u8(), now);
        } else if (what == 'T') {
            now = take_u32();
            counts = take_i32();
            faults = take_u8();
            board_tick(now);
        } else if (what == 'P') {
            board_poll(take_u32());
        } else {
            return 5;
        }
        clutch_put_u16(head, (uint16_t)sent_count);
        clutch_put_u16(tail, code);
        clutch_put_u8(tail + 2, board_state());
        clutch_put_u32(tail + 3, board_period_us());
        clutch_put_u32(tail + 7, board_configurations());
        fwrite(head, 1, sizeof head, stdout);
        fwrite(sent, 1, sent_count, stdout);
        fwrite(tail, 1, sizeof tail, stdout);
    }
    return fflush(stdout) == 0 ? 0 : 6;
}
