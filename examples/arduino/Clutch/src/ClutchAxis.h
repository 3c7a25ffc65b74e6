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
    /* Builds the axis; false if the settings make no run, and misfit() says which. Until somebody consents the code is that with which
     * the safe state holds: write it first of all. */
    bool begin(const clutch_run &run, uint32_t period_us)
    {
        period = period_us;
        clutch_safe_codes safe;
        if (clutch_axis_build(&axis, &run, &why) != CLUTCH_OK ||
            clutch_axis_safe(&axis, &safe) != CLUTCH_OK)
            return false;
        now_code = safe.hold;
        look();
        return true;
    }

    /* Consent to drive, from where the shaft is; `present` is the code that the converter has. False if the axis is not ready. */
    bool consent(uint16_t present)
    {
        if (clutch_axis_consent(&axis, present) != CLUTCH_OK)
            return false;
        now_code = present;
        started = false;
        look();
        return true;
    }

    /* One period, at `now` of micros(): the code to write. A period that was missed counts as a lost sample. */
    uint16_t update(int32_t counts, uint32_t now)
    {
        clutch_sample sample = {};
        clutch_cycle cycle;
        uint32_t passed = started ? (now - last + period / 2) / period : 1;
        sequence = (uint16_t)(sequence + (passed < 0x7fff ? passed : 0x7fff));
        started = true;
        last = now;
        sample.sequence = sequence;
        sample.time_us = now;
        sample.counts = counts;
        sample.board = CLUTCH_BOARD_DRIVING;
        if (clutch_axis_sample(&axis, &sample, &cycle) != CLUTCH_OK)
            return now_code;
        if (cycle.asked)
            seen = cycle.output.tick.error;
        if (cycle.answered)
            now_code = cycle.code;
        look();
        return now_code;
    }

    /* Ends control in the safe state; update() gives its codes. */
    void stop()
    {
        clutch_axis_stop(&axis);
        look();
    }

    /* Makes an axis that has ended ready for another consent. */
    bool acknowledge()
    {
        const bool ready = clutch_axis_acknowledge(&axis) == CLUTCH_OK;
        look();
        return ready;
    }

    /* The code that the converter has or is to have. */
    uint16_t code() const { return now_code; }

    /* CLUTCH_STATE_ and CLUTCH_CAUSE_ of clutch.h. */
    uint8_t state() const { return now_state; }
    uint8_t cause() const { return now_cause; }

    /* Target minus position, rad, as the law saw it. */
    float error() const { return seen; }

    /* The error in the settings. */
    const clutch_misfit &misfit() const { return why; }

private:
    /* State and cause as they are; once control has ended, the safe state's code, too. */
    void look()
    {
        uint16_t told = now_code;
        clutch_axis_state(&axis, &now_state, &now_cause, &told);
        if (now_state >= CLUTCH_STATE_HOLDING)
            now_code = told;
    }

    clutch_axis axis;
    clutch_misfit why = {};
    uint32_t period = 0;
    uint32_t last = 0;
    uint16_t sequence = 0;
    uint16_t now_code = 0;
    bool started = false;
    uint8_t now_state = CLUTCH_STATE_DISCONNECTED;
    uint8_t now_cause = CLUTCH_CAUSE_NONE;
    float seen = 0.0f;
};

#endif
