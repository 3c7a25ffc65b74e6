component clutch_axis "Slow, smooth motion of a shaft restrained by friction, by libclutch.";
description """An axis whose settings `clutch scenario header` has printed into run.h. A rising edge of \\fBconsent\\fR lets it drive, from
where the shaft is; a falling one is an operator's stop. Once control has ended the output is the safe state's,
until \\fBconsent\\fR falls and rises again. The thread's period has to be that of the settings; another one is refused.""";
pin in s32 counts "Counts of the encoder.";
pin in bit consent "Consent of an operator who sees the machine.";
pin in bit encoder_fault "There is no encoder.";
pin in bit converter_fault "The converter does not do what it is told.";
pin out float volts "Voltage for the actuator, V.";
pin out u32 code "The same as a code for a converter.";
pin out u32 state "State of control, CLUTCH_STATE_ of clutch.h: 3 running, 4 holding, 6 faulted.";
pin out u32 cause "Cause of the end of control, CLUTCH_CAUSE_ of clutch.h: 15 done.";
pin out float error "Target minus position, rad.";
pin out float target "Position of the target, counts.";
param r bit refused "The settings make no run, or the thread has another period.";
variable clutch_axis axis;
variable uint32_t number;
variable uint32_t last_us;
variable int consented;
variable int built;
option singleton yes;
option no_convenience_defines yes;
function _ fp "Once a period.";
include "run.h";
license "MIT OR Apache-2.0";
author "The clutch developers";
;;

/* The words of the pins are those of the library, too: so pins are reached by their instance. */
#define FUNCTION(name) static void name(struct __comp_state *own, long period)
FUNCTION(_)
{
    clutch_sample sample = {0};
    clutch_cycle cycle;
    uint8_t state, cause;
    uint16_t code;
    float volts;
    const uint32_t now_us = (uint32_t)(rtapi_get_time() / 1000);
    uint32_t passed;

    if (!own->built) {
        own->built = 1;
        own->refused = period != 1000L * run_period_us
            || clutch_axis_build(&own->axis, &run, NULL) != CLUTCH_OK;
        /* Before anybody has consented the converter holds what the safe state holds. */
        *own->code = run_safe_code;
        *own->volts = run_safe_v;
        own->consented = *own->consent;
        own->last_us = now_us - run_period_us;
    }
    if (own->refused)
        return;
    if (*own->consent && !own->consented) {
        clutch_axis_acknowledge(&own->axis);
        clutch_axis_consent(&own->axis, (uint16_t)*own->code);
    } else if (!*own->consent && own->consented) {
        clutch_axis_stop(&own->axis);
    }
    own->consented = *own->consent;

    /* A period that the thread left out is a sample that was lost. */
    passed = (now_us - own->last_us + run_period_us / 2) / run_period_us;
    own->number += passed < 1 ? 1 : passed < 0x7fff ? passed : 0x7fff;
    own->last_us = now_us;
    sample.sequence = (uint16_t)own->number;
    sample.time_us = now_us;
    sample.board = CLUTCH_BOARD_DRIVING;
    sample.counts = *own->counts;
    sample.encoder_fault = *own->encoder_fault;
    sample.converter_fault = *own->converter_fault;
    if (clutch_axis_sample(&own->axis, &sample, &cycle) != CLUTCH_OK)
        return;
    if (cycle.asked) {
        *own->error = cycle.output.tick.error;
        *own->target = (double)cycle.target.position_x65536 / 65536.0;
    }
    clutch_axis_state(&own->axis, &state, &cause, &code);
    if (cycle.answered || state >= CLUTCH_STATE_HOLDING)
        *own->code = code;
    *own->state = state;
    *own->cause = cause;
    clutch_axis_volts(&own->axis, (uint16_t)*own->code, &volts);
    *own->volts = volts;
}
