/* board.c on a NUCLEO-G474RE with the STM32 core for Arduino.
 *
 * NOT RUN ON HARDWARE. It was compiled only against stand-ins for the Arduino functions, so registers, pins
 * and clocks are from the data sheet and nothing else. Read it as the outline of your own sketch, and go
 * through the checklist of docs/board.md before you connect a brake.
 *
 * Copy board.c, board.h and clutch_wire.h into this folder. build_opt.h makes the serial buffers larger: with
 * the usual 64 bytes the longest frame (66) never fits.
 *
 *   PA0, PA1   encoder A and B            timer TIM2, 32 bits, counts in hardware
 *   PA4        DAC, 0 to 3.3 V            through the driver stage: 0 to 10 V at the brake
 *   PB5        output enabled (high)      relay or analogue switch, see docs/board.md
 *   ST-Link    Serial, 921600 baud        LPUART1 over USB
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include "board.h"
#include "clutch_wire.h"
#include <EEPROM.h>
#include <IWatchdog.h>

static const uint32_t BAUD = 921600;
static const uint16_t BOOT_CODE = 1844;       /* 4.5 V of 0 to 10 V: choose the safe code for your rig */
static const uint32_t HANG_US = 20000;        /* the hardware watchdog resets a program that hangs for this long */
static const uint32_t BOARD_ID = 4711;        /* the board's own serial number; 0 and 1 are taken */

static HardwareTimer *sampling;
static uint32_t configurations;
static volatile bool pending;                 /* a sample was taken and is not sent yet */
static volatile uint32_t taken_us;
static volatile int32_t taken_counts;

/* The board's clock. Not micros(): that is composed of two counters, and in an interrupt it can be a
 * millisecond behind. */
static uint32_t clock_us()
{
    return TIM5->CNT;
}

/* The interrupt only takes the sample: time and counts belong together. */
static void take_sample()
{
    taken_us = clock_us();
    taken_counts = (int32_t)TIM2->CNT;
    pending = true;
}

/* ---- the functions that board.c needs ---- */

extern "C" int32_t read_encoder(void)
{
    return taken_counts;
}

extern "C" void write_dac(uint16_t code)
{
    analogWrite(PA4, code);
}

extern "C" void serial_write(const uint8_t *bytes, size_t count)
{
    /* All or nothing, and never wait: a sample that comes late is of no use. */
    if ((size_t)Serial.availableForWrite() >= count)
        Serial.write(bytes, count);
}

extern "C" uint8_t hardware_faults(void)
{
    /* This hardware cannot tell a broken wire from a shaft at rest. A differential receiver with a fault
     * output would be read here: CLUTCH_STATUS_ENCODER_FAULT. */
    return 0;
}

/* ---- start ---- */

/* Both edges of both signals, filtered, 32 bits: the counter needs no interrupt. */
static void start_encoder()
{
    __HAL_RCC_GPIOA_CLK_ENABLE();
    __HAL_RCC_TIM2_CLK_ENABLE();
    GPIO_InitTypeDef pins = {};
    pins.Pin = GPIO_PIN_0 | GPIO_PIN_1;
    pins.Mode = GPIO_MODE_AF_PP;
    pins.Pull = GPIO_PULLUP;
    pins.Alternate = GPIO_AF1_TIM2;
    HAL_GPIO_Init(GPIOA, &pins);
    TIM2->ARR = 0xFFFFFFFF;
    TIM2->CCMR1 = TIM_CCMR1_CC1S_0 | TIM_CCMR1_CC2S_0 | (3u << TIM_CCMR1_IC1F_Pos) | (3u << TIM_CCMR1_IC2F_Pos);
    TIM2->CCER = 0; /* if the counts fall while the weight sinks: TIM_CCER_CC1P reverses the direction */
    TIM2->SMCR = TIM_SMCR_SMS_0 | TIM_SMCR_SMS_1;
    TIM2->CR1 = TIM_CR1_CEN;
}

/* 32 bits, 1 MHz. The timers run at the core's clock on this board. */
static void start_clock()
{
    __HAL_RCC_TIM5_CLK_ENABLE();
    TIM5->PSC = SystemCoreClock / 1000000 - 1;
    TIM5->ARR = 0xFFFFFFFF;
    TIM5->EGR = TIM_EGR_UG;
    TIM5->CR1 = TIM_CR1_CEN;
}

/* A different number at each power-up, which a host that has not heard it cannot guess: from a counter, and from the
 * noise of a pin that is not connected. A chip with a generator of random numbers should ask that instead. */
static uint32_t next_boot()
{
    uint32_t counter, boot;
    EEPROM.get(0, counter);
    counter++;
    EEPROM.put(0, counter);
    boot = counter;
    for (int i = 0; i < 64; i++) {
        boot = (boot ^ (uint32_t)analogRead(PB1) ^ micros()) * 0x9e3779b1u;
        boot ^= boot >> 15;
    }
    return boot;
}

void setup()
{
    /* The output comes first, and only then the switch that connects it to the brake. */
    analogWriteResolution(12);
    analogWrite(PA4, BOOT_CODE);
    pinMode(PB5, OUTPUT);
    digitalWrite(PB5, HIGH);

    start_encoder();
    start_clock();
    Serial.begin(BAUD);
    board_params_t params;
    params.board = BOARD_ID;
    params.boot = next_boot();
    params.counts_per_rev = 20000;
    params.dac_bits = 12;
    params.dac_lowest_mv = 0;       /* at the brake, behind the driver stage: measure it */
    params.dac_highest_mv = 10000;
    params.period_min_us = 500;
    params.period_max_us = 100000;
    params.watchdog_max_us = 1000000;
    params.boot_code = BOOT_CODE;
    if (board_init(&params) != NULL) {
        digitalWrite(PB5, LOW);
        for (;;) { /* a parameter above is wrong: stay with the output of the hardware alone */
        }
    }
    sampling = new HardwareTimer(TIM6);
    sampling->attachInterrupt(take_sample);
    IWatchdog.begin(HANG_US);
}

/* Sends the sample if there is one. */
static void serve_sample()
{
    if (!pending)
        return;
    noInterrupts(); /* time and counts of one sample */
    uint32_t now = taken_us;
    pending = false;
    interrupts();
    board_tick(now);
}

void loop()
{
    IWatchdog.reload();
    /* The order keeps the times that board.c sees from going back: the clock is read first, and a sample
     * taken before that is served before the byte. */
    uint32_t now = clock_us();
    serve_sample();
    board_poll(now);
    if (Serial.available() > 0)
        board_byte((uint8_t)Serial.read(), now);
    if (configurations != board_configurations()) {
        configurations = board_configurations();
        sampling->pause();
        noInterrupts();
        pending = false;
        interrupts();
        sampling->setOverflow(board_period_us(), MICROSEC_FORMAT);
        sampling->refresh();
        sampling->resume();
    }
}
