/* A board for the wire protocol of docs/wire.md, version 4: the state machine, in portable C99.
 *
 * No malloc, no floating point, no library but <stdint.h>, <stddef.h> and <string.h>. It has one board, in
 * static memory, below 300 bytes. It reads no clock: all times are a counter of microseconds that wraps.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The board's properties. `Hello` reports them to the host. */
typedef struct {
    uint32_t board;           /* its serial number; 0 and 1 are the simulated boards */
    uint32_t boot;            /* a different number at each power-up, which cannot be guessed */
    uint32_t counts_per_rev;  /* encoder counts per revolution, after quadrature */
    uint8_t dac_bits;         /* converter: bits, 1 to 16 */
    int32_t dac_lowest_mv;    /* at the brake's terminals: voltage of code 0, mV */
    int32_t dac_highest_mv;   /* at the brake's terminals: voltage one step above the highest code, mV */
    uint32_t period_min_us;   /* shortest sampling period, us */
    uint32_t period_max_us;   /* longest sampling period, us */
    uint32_t watchdog_max_us; /* longest watchdog time, us */
    uint16_t boot_code;       /* output at power-up: safe on this rig when nobody controls */
    uint8_t started_by;       /* CLUTCH_RESET_CAUSE_... of clutch_wire.h, from the chip's register; else UNKNOWN, 0 */
    uint8_t warnings;         /* bits CLUTCH_WARNING_..., or 0 */
} board_params_t;

/* ---- functions for you to call; all from one thread, none from an interrupt while another of them runs ----
 * */

/* Power-up: puts out boot_code, state Boot. NULL if all is well; otherwise nothing is put out, and the text
 * says which parameter is wrong. */
const char *board_init(const board_params_t *params);

/* A byte has come. Answers, applies codes. */
void board_byte(uint8_t byte, uint32_t now_us);

/* A sampling period begins; now_us is the time at which the encoder was read. Sends the sample. */
void board_tick(uint32_t now_us);

/* Checks the watchdog: call it as often as you can, best from the main loop. */
void board_poll(uint32_t now_us);

/* Set your timer to this: time from tick to tick, us; 0 while there is nothing to sample. */
uint32_t board_period_us(void);

/* Changes with each accepted Configure: start the timer anew, even if the period is the same. */
uint32_t board_configurations(void);

/* CLUTCH_BOARD_STATE_... of clutch_wire.h: for a lamp or a display. */
uint8_t board_state(void);

/* ---- functions for you to write for your hardware ---- */

/* The encoder's counter as it was at the time given to board_tick; wraps. */
int32_t read_encoder(void);

/* Puts out a code, 0 to 2^dac_bits - 1. */
void write_dac(uint16_t code);

/* Sends bytes, at most 68: all of them or none. Must not wait for the line. */
void serial_write(const uint8_t *bytes, size_t count);

/* CLUTCH_STATUS_ENCODER_FAULT, CLUTCH_STATUS_DAC_FAULT, both, or 0: the hardware's report about itself.
 * Return 0 if it has none. */
uint8_t hardware_faults(void);

#ifdef __cplusplus
}
#endif
#endif
