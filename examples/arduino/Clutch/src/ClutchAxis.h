/* An axis of libclutch for Arduino.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef CLUTCH_AXIS_H
#define CLUTCH_AXIS_H

#include "clutch.h"

/* Servo, supervisor and path of a shaft, by settings that `clutch scenario header` has printed. */
class ClutchAxis {
public:
    /* Builds the axis; false if the settings make no run, and misfit() says which. */
    bool begin(const clutch_setting *settings, size_t count, const clutch_knot *knots, size_t knots_count,
               uint32_t period_us)
    {
        period = period_us;
        return clutch_axis_build(&axis, settings, count, knots, knots_count, &why) == CLUTCH_OK;
    }

    /* Consent to drive, from where the shaft is; `present` is the code that the converter has. False if the axis is not ready. */
    bool consent(uint16_t present)
    {
        code = present;
        started = false;
        return clutch_axis_consent(&axis, present) == CLUTCH_OK;
    }

    /* One period, at `now` of micros(): the code to write. A period that was missed counts as a lost sample. */
    uint16_t update(int32_t counts, uint32_t now)
    {
        clutch_sample sample = {};
        clutch_cycle cycle;
        sequence = (uint16_t)(sequence + (started ? (now - last + period / 2) / period : 1));
        started = true;
        last = now;
        sample.sequence = sequence;
        sample.time_us = now;
        sample.counts = counts;
        sample.board = CLUTCH_BOARD_DRIVING;
        if (clutch_axis_sample(&axis, &sample, &cycle) != CLUTCH_OK)
            return code;
        uint16_t told = code;
        clutch_axis_state(&axis, &now_state, &now_cause, &told);
        if (cycle.answered || now_state >= CLUTCH_STATE_HOLDING)
            code = told;
        if (cycle.asked)
            seen = cycle.output.tick.error;
        return code;
    }

    /* Ends control in the safe state; update() gives its codes. */
    void stop() { clutch_axis_stop(&axis); }

    /* Makes an axis that has ended ready for another consent. */
    bool acknowledge() { return clutch_axis_acknowledge(&axis) == CLUTCH_OK; }

    /* CLUTCH_STATE_ and CLUTCH_CAUSE_ of clutch.h. */
    uint8_t state() const { return now_state; }
    uint8_t cause() const { return now_cause; }

    /* Target minus position, rad, as the law saw it. */
    float error() const { return seen; }

    /* What was wrong with the settings. */
    const clutch_misfit &misfit() const { return why; }

private:
    clutch_axis axis;
    clutch_misfit why = {};
    uint32_t period = 0;
    uint32_t last = 0;
    uint16_t sequence = 0;
    uint16_t code = 0;
    bool started = false;
    uint8_t now_state = CLUTCH_STATE_DISCONNECTED;
    uint8_t now_cause = CLUTCH_CAUSE_NONE;
    float seen = 0.0f;
};

#endif
