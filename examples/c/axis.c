/* An axis by libclutch: ten seconds on a shaft that this program computes. On a board the three functions below are yours.
 *
 *     cargo xtask libclutch x86_64-unknown-linux-gnu
 *     clutch scenario header board_smc_2 > run.h
 *     cc -I. -Itarget/libclutch/include examples/c/axis.c target/libclutch/x86_64-unknown-linux-gnu/libclutch.a -o axis
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include "run.h"
#include "shaft.h"

#include <stdio.h>

static shaft_t shaft = SHAFT_AT_REST;

static int32_t read_encoder(void)
{
    return shaft_counts(&shaft, run_counts_per_rev);
}

static void write_converter(uint16_t code)
{
    shaft_convert(&shaft, code);
}

static void wait_for_the_next_period(void)
{
    for (int i = 0; i < run_period_us; i++)
        shaft_move(&shaft);
}

int main(void)
{
    static clutch_axis axis;
    clutch_misfit misfit;
    if (clutch_axis_build(&axis, &run, &misfit) != CLUTCH_OK) {
        printf("the settings make no run: key %u, value %g\n", misfit.key, (double)misfit.value);
        return 1;
    }
    /* Consent. On a machine somebody gives it, who sees the machine. */
    clutch_axis_consent(&axis, 2970);

    float most = 0.0f;
    clutch_sample sample = {0};
    sample.board = CLUTCH_BOARD_DRIVING;
    for (uint32_t period = 0;; period++) {
        clutch_cycle cycle;
        sample.sequence = (uint16_t)period;
        sample.time_us = period * run_period_us;
        sample.counts = read_encoder();
        if (clutch_axis_sample(&axis, &sample, &cycle) != CLUTCH_OK)
            return 1;
        /* The law's answer, or once control has ended the safe state. */
        if (cycle.answered || cycle.state >= CLUTCH_STATE_HOLDING)
            write_converter(cycle.code);
        if (cycle.state >= CLUTCH_STATE_HOLDING) {
            printf("state %u, cause %u after %lu periods; largest error after a second: %.4f deg\n", cycle.state,
                   cycle.cause, (unsigned long)period, (double)most * 57.29578);
            return cycle.cause == CLUTCH_CAUSE_DONE ? 0 : 1;
        }
        if (period >= 1000 && cycle.asked) {
            const float error = cycle.output.tick.error;
            most = error > most ? error : -error > most ? -error : most;
        }
        wait_for_the_next_period();
    }
}
