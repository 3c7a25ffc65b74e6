/* An axis with a quadrature encoder on two pins and a converter on an analog output.
 *
 * run.h is printed by `clutch scenario header mine.toml > run.h`, beside this file. The scenario says which converter there is: for an
 * output of 12 bit from 0 to 3.3 V behind an amplifier that makes 0 to 10 V of it,
 *     --set rig.dac.bits=12 --set rig.dac.lowest_v=0 --set rig.dac.highest_v=10
 *
 * Not for a load that may hurt: the interrupts below lose counts above some ten thousand a second, and nothing but this sketch
 * watches over it. Set your board's watchdog, and see docs/firmware.md for what an image of ours does beside.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include <ClutchAxis.h>
#include "run.h"

const int PIN_A = 2, PIN_B = 3, PIN_CONSENT = 4;

ClutchAxis axis;
volatile int32_t counts = 0;
uint32_t next = 0;
bool consented = false;

void edge()
{
    static uint8_t before = 0;
    /* Which way each pair of readings goes. */
    static const int8_t way[16] = {0, -1, 1, 0, 1, 0, 0, -1, -1, 0, 0, 1, 0, 1, -1, 0};
    const uint8_t now = (uint8_t)(digitalRead(PIN_A) << 1 | digitalRead(PIN_B));
    counts = counts + way[before << 2 | now];
    before = now;
}

void setup()
{
    Serial.begin(115200);
    pinMode(PIN_A, INPUT_PULLUP);
    pinMode(PIN_B, INPUT_PULLUP);
    pinMode(PIN_CONSENT, INPUT_PULLUP);
    /* Before anything that takes time: the brake holds. Until here the output floats; a resistor has to hold it where the brake is on. */
    analogWriteResolution(12);
    analogWrite(A0, run_safe_code);
    if (!axis.begin(run, run_period_us)) {
        Serial.print("the settings make no run: key ");
        Serial.println(axis.misfit().key);
        for (;;)
            delay(1000);
    }
    attachInterrupt(digitalPinToInterrupt(PIN_A), edge, CHANGE);
    attachInterrupt(digitalPinToInterrupt(PIN_B), edge, CHANGE);
    /* A switch that is closed already is no consent: somebody has to open it first, and to close it. */
    consented = digitalRead(PIN_CONSENT) == LOW;
    next = micros();
}

void loop()
{
    if ((int32_t)(micros() - next) < 0)
        return;
    next += run_period_us;
    /* The switch closes to ground; opening it stops. */
    const bool wanted = digitalRead(PIN_CONSENT) == LOW;
    if (wanted && !consented) {
        axis.acknowledge();
        axis.consent(axis.code());
    } else if (!wanted && consented) {
        axis.stop();
    }
    consented = wanted;
    noInterrupts();
    const int32_t now = counts;
    interrupts();
    analogWrite(A0, axis.update(now, micros()));
}
