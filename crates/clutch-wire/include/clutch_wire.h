/* The serial DAQ protocol, for boards in C99 or C++11. Generated from the table of clutch-wire:
 *     cargo run -p clutch-wire --example table -- header
 * Do not edit. docs/wire.md has the meaning of the fields and the duties of a board.
 *
 * Works with any byte order and alignment: nothing is cast, bytes are assembled one by one.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef CLUTCH_WIRE_H
#define CLUTCH_WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define CLUTCH_VERSION 4u
#define CLUTCH_WATCHDOG_PERIODS 100u
#define CLUTCH_SCHEMA UINT64_C(0xa44cde503340b147)
#define CLUTCH_MAX_BODY 87u  /* longest frame before stuffing, bytes */
#define CLUTCH_MAX_FRAME 89u /* longest frame on the wire, bytes */
#define CLUTCH_MAX_LIST 8u  /* most numbers of a list */

/* BoardState: The present state of the board. */
#define CLUTCH_BOARD_STATE_BOOT 0u /* Powered up; never configured since; the output is boot_code. */
#define CLUTCH_BOARD_STATE_READY 1u /* Configured; samples go out; the output is as it was, or a safe output goes on. */
#define CLUTCH_BOARD_STATE_ARMED 2u /* The host has consented; the first Actuate starts the run. */
#define CLUTCH_BOARD_STATE_RUNNING 3u /* The output follows the host. */
#define CLUTCH_BOARD_STATE_STOPPED 4u /* Stopped by the host; the safe output is on. */
#define CLUTCH_BOARD_STATE_FAULTED 5u /* A fault is latched; the safe output is on. */

/* SafeKind: The board's way to its safe output. */
#define CLUTCH_SAFE_KIND_HOLD 0u /* hold_code at once. */
#define CLUTCH_SAFE_KIND_RAMP 1u /* From the present code to hold_code, by ramp_step each period. */
#define CLUTCH_SAFE_KIND_RELEASE 2u /* release_code at once. */
#define CLUTCH_SAFE_KIND_HOLD_THEN_RELEASE 3u /* hold_code at once, release_code after hold_periods. */

/* BoardFault: The reason why the board went to its safe output by itself. */
#define CLUTCH_BOARD_FAULT_WATCHDOG 1u /* No Actuate was applied for watchdog_us; value is the time since the last one, us. */
#define CLUTCH_BOARD_FAULT_ENCODER 2u /* The encoder's reading cannot be trusted; value is the board's own detail. */
#define CLUTCH_BOARD_FAULT_CONVERTER 3u /* The converter did not take a code; value is the board's own detail. */

/* StopReason: The host's reason to stop the run. */
#define CLUTCH_STOP_REASON_DONE 0u /* The run is over. */
#define CLUTCH_STOP_REASON_OPERATOR 1u /* Somebody asked for it. */
#define CLUTCH_STOP_REASON_FAULT 2u /* The host saw a fault; the board latches it. */

/* ResetCause: The reason why the board's program started. */
#define CLUTCH_RESET_CAUSE_UNKNOWN 0u /* The board cannot know. */
#define CLUTCH_RESET_CAUSE_POWER 1u /* The supply came, or had been too low. */
#define CLUTCH_RESET_CAUSE_PIN 2u /* The reset pin: a button, or a debugger. */
#define CLUTCH_RESET_CAUSE_WATCHDOG 3u /* The hardware watchdog: the program had hung. */
#define CLUTCH_RESET_CAUSE_SOFTWARE 4u /* The program or a debugger asked for it. */
#define CLUTCH_RESET_CAUSE_FAULT 5u /* A fault of the processor, an unexpected interrupt, or a panic had stopped the program. */
#define CLUTCH_RESET_CAUSE_CLOCK 6u /* A clock had stopped, and the program with it. */

/* Refusal: The board's reason to refuse a frame. */
#define CLUTCH_REFUSAL_VERSION 1u /* Another version of the protocol; value is the board's. */
#define CLUTCH_REFUSAL_SCHEMA 2u /* Another table of messages; value is the low 32 bits of the board's schema hash. */
#define CLUTCH_REFUSAL_RUN 3u /* The run number is not a new one (Configure) or not the configured one; value is the board's. */
#define CLUTCH_REFUSAL_CONFIG 4u /* The configuration hash is not the configured one; value is the low 32 bits of the board's. */
#define CLUTCH_REFUSAL_STATE 5u /* Not in this state; value is the BoardState, or a controller's own state of control. */
#define CLUTCH_REFUSAL_PERIOD 6u /* The period is out of the board's range; value is the period asked for, us. */
#define CLUTCH_REFUSAL_WATCHDOG 7u /* The watchdog time is below two periods, above a hundred, or above the board's limit; value is the time asked for, us. */
#define CLUTCH_REFUSAL_SAFE 8u /* No such safe output: unknown kind, or a code above the converter's top; value is the kind. */
#define CLUTCH_REFUSAL_LATE 9u /* Came too late. A board of version 1 shows this in Sample.status instead; value is the delay, us. */
#define CLUTCH_REFUSAL_BUSY 10u /* Cannot be done just now: ask again; value is 0. */
#define CLUTCH_REFUSAL_CODE 11u /* The code is above the converter's top; value is the code. */
#define CLUTCH_REFUSAL_SETTING 12u /* A setting that is missing, or whose value is of a kind that is not known; value is its key. */
#define CLUTCH_REFUSAL_UNFIT 13u /* The settings make no run; value is the key of the offending one, and above its 16 bits the number of the condition between several that does not hold, or 0. */
#define CLUTCH_REFUSAL_NO_BOARD 14u /* Nothing answers where the controller's encoder and converter should be; value is 0. */
#define CLUTCH_REFUSAL_DIFFERS 15u /* Configure differs from the settings; value is 0. */
#define CLUTCH_REFUSAL_BOOT 16u /* Arm does not bring back the number of the power-up that the hello had; value is 0. */

/* Bits of the field status of Sample. */
#define CLUTCH_STATUS_STATE 0x07u /* The bits that hold the BoardState. */
#define CLUTCH_STATUS_ENCODER_FAULT 0x08u /* The encoder's reading cannot be trusted. */
#define CLUTCH_STATUS_DAC_FAULT 0x10u /* The converter did not take the last code. */
#define CLUTCH_STATUS_LATE 0x20u /* An Actuate since the sample before came too late and was not applied. */

/* Bits of the field flags of Telemetry. */
#define CLUTCH_TELEMETRY_SUPERSEDED 0x01u /* A newer sample was there already. */
#define CLUTCH_TELEMETRY_ANSWERED 0x02u /* The sample was answered. */
#define CLUTCH_TELEMETRY_ASKED 0x04u /* The law was asked: error, rate, terms and demand are set. */
#define CLUTCH_TELEMETRY_TARGETED 0x08u /* The path was asked for its target. */
#define CLUTCH_TELEMETRY_LIMIT 0x30u /* The limit that decided the voltage: 0 none, 1 the lowest, 2 the highest, 3 a demand that was not a number. */

/* Bits of the field warnings of Hello. */
#define CLUTCH_WARNING_BROWN_OUT 0x01u /* The supply may fall further before it resets the board than the board's program asks for. */

/* Integers, little-endian. */
static inline void clutch_put_u8(uint8_t *at, uint8_t value)
{
    at[0] = value;
}

static inline void clutch_put_u16(uint8_t *at, uint16_t value)
{
    at[0] = (uint8_t)(value & 0xffu);
    at[1] = (uint8_t)(value >> 8);
}

static inline void clutch_put_u32(uint8_t *at, uint32_t value)
{
    clutch_put_u16(at, (uint16_t)(value & 0xffffu));
    clutch_put_u16(at + 2, (uint16_t)(value >> 16));
}

static inline void clutch_put_u64(uint8_t *at, uint64_t value)
{
    clutch_put_u32(at, (uint32_t)(value & 0xffffffffu));
    clutch_put_u32(at + 4, (uint32_t)(value >> 32));
}

static inline void clutch_put_i32(uint8_t *at, int32_t value)
{
    clutch_put_u32(at, (uint32_t)value);
}

static inline uint8_t clutch_get_u8(const uint8_t *at)
{
    return at[0];
}

static inline uint16_t clutch_get_u16(const uint8_t *at)
{
    return (uint16_t)(at[0] | ((unsigned)at[1] << 8));
}

static inline uint32_t clutch_get_u32(const uint8_t *at)
{
    return clutch_get_u16(at) | ((uint32_t)clutch_get_u16(at + 2) << 16);
}

static inline uint64_t clutch_get_u64(const uint8_t *at)
{
    return clutch_get_u32(at) | ((uint64_t)clutch_get_u32(at + 4) << 32);
}

static inline int32_t clutch_get_i32(const uint8_t *at)
{
    uint32_t bits = clutch_get_u32(at);
    int32_t value;
    memcpy(&value, &bits, sizeof value); /* a cast would depend on the compiler */
    return value;
}

/* A list: how many numbers, and each. Numbers beyond its room are left out. */
static inline void clutch_put_list(uint8_t *at, const uint32_t *numbers, uint8_t count)
{
    uint8_t i;
    if (count > CLUTCH_MAX_LIST)
        count = CLUTCH_MAX_LIST;
    at[0] = count;
    for (i = 0; i < count; i++)
        clutch_put_u32(at + 1 + 4 * i, numbers[i]);
}

static inline uint8_t clutch_get_list(const uint8_t *at, uint32_t *numbers)
{
    uint8_t i, count = at[0] > CLUTCH_MAX_LIST ? CLUTCH_MAX_LIST : at[0];
    for (i = 0; i < count; i++)
        numbers[i] = clutch_get_u32(at + 1 + 4 * i);
    return count;
}

/* CRC-32/ISO-HDLC: that of Ethernet and zip. */
static inline uint32_t clutch_crc32(const uint8_t *bytes, size_t count)
{
    uint32_t crc = 0xffffffffu;
    size_t i;
    int bit;
    for (i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (bit = 0; bit < 8; bit++)
            crc = (crc >> 1) ^ ((crc & 1u) ? 0xedb88320u : 0u);
    }
    return crc ^ 0xffffffffu;
}

/* Adds the CRC to a body of `length` bytes (CRC included), stuffs it; bytes on the wire. */
static inline size_t clutch_frame(uint8_t *wire, uint8_t *body, size_t length)
{
    size_t i, code = 0; /* where the present block's code goes */
    uint8_t distance = 1;
    clutch_put_u32(body + length - 4, clutch_crc32(body, length - 4));
    for (i = 0; i < length; i++) {
        if (body[i] == 0) {
            wire[code] = distance;
            code = i + 1;
            distance = 1;
        } else {
            wire[i + 1] = body[i];
            distance++;
        }
    }
    wire[code] = distance;
    wire[length + 1] = 0;
    return length + 2;
}

/* Discover: Asks for the board's identity. Any state. The layout is the same in all versions. */
#define CLUTCH_DISCOVER_KIND 0x01u
#define CLUTCH_DISCOVER_LENGTH 18u
#define CLUTCH_DISCOVER_NONCE 1u
#define CLUTCH_DISCOVER_VERSION 5u
#define CLUTCH_DISCOVER_SCHEMA 6u
typedef struct {
    uint32_t nonce; /* Number that the answer echoes. */
    uint8_t version; /* The host's version of the protocol. */
    uint64_t schema; /* The host's schema hash. */
} clutch_discover_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_discover(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_discover_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_DISCOVER_KIND;
    clutch_put_u32(body + CLUTCH_DISCOVER_NONCE, m->nonce);
    clutch_put_u8(body + CLUTCH_DISCOVER_VERSION, m->version);
    clutch_put_u64(body + CLUTCH_DISCOVER_SCHEMA, m->schema);
    return clutch_frame(wire, body, CLUTCH_DISCOVER_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_DISCOVER_KIND. */
static inline void clutch_get_discover(const uint8_t *body, clutch_discover_t *m)
{
    m->nonce = clutch_get_u32(body + CLUTCH_DISCOVER_NONCE);
    m->version = clutch_get_u8(body + CLUTCH_DISCOVER_VERSION);
    m->schema = clutch_get_u64(body + CLUTCH_DISCOVER_SCHEMA);
}

/* Configure: Prepares a run: period, watchdog and safe output. Starts the samples. */
#define CLUTCH_CONFIGURE_KIND 0x02u
#define CLUTCH_CONFIGURE_LENGTH 36u
#define CLUTCH_CONFIGURE_RUN 1u
#define CLUTCH_CONFIGURE_CONFIG 3u
#define CLUTCH_CONFIGURE_PERIOD_US 11u
#define CLUTCH_CONFIGURE_WATCHDOG_US 15u
#define CLUTCH_CONFIGURE_SAFE_KIND 19u
#define CLUTCH_CONFIGURE_HOLD_CODE 20u
#define CLUTCH_CONFIGURE_RELEASE_CODE 22u
#define CLUTCH_CONFIGURE_RAMP_STEP 24u
#define CLUTCH_CONFIGURE_HOLD_PERIODS 28u
typedef struct {
    uint16_t run; /* Number of the new run; other than that of the run before. */
    uint64_t config; /* The host's hash of the scenario; the board stores and echoes it. */
    uint32_t period_us; /* Time from sample to sample. [us] */
    uint32_t watchdog_us; /* Longest time without an applied Actuate while armed or running. [us] */
    uint8_t safe_kind; /* Way to the safe output: a SafeKind. */
    uint16_t hold_code; /* The code that holds. [DAC code] */
    uint16_t release_code; /* The code that releases. [DAC code] */
    uint32_t ramp_step; /* Step of the ramp to hold_code. [2^-16 DAC codes per period] */
    uint32_t hold_periods; /* Time for which HoldThenRelease holds. [periods] */
} clutch_configure_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_configure(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_configure_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_CONFIGURE_KIND;
    clutch_put_u16(body + CLUTCH_CONFIGURE_RUN, m->run);
    clutch_put_u64(body + CLUTCH_CONFIGURE_CONFIG, m->config);
    clutch_put_u32(body + CLUTCH_CONFIGURE_PERIOD_US, m->period_us);
    clutch_put_u32(body + CLUTCH_CONFIGURE_WATCHDOG_US, m->watchdog_us);
    clutch_put_u8(body + CLUTCH_CONFIGURE_SAFE_KIND, m->safe_kind);
    clutch_put_u16(body + CLUTCH_CONFIGURE_HOLD_CODE, m->hold_code);
    clutch_put_u16(body + CLUTCH_CONFIGURE_RELEASE_CODE, m->release_code);
    clutch_put_u32(body + CLUTCH_CONFIGURE_RAMP_STEP, m->ramp_step);
    clutch_put_u32(body + CLUTCH_CONFIGURE_HOLD_PERIODS, m->hold_periods);
    return clutch_frame(wire, body, CLUTCH_CONFIGURE_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_CONFIGURE_KIND. */
static inline void clutch_get_configure(const uint8_t *body, clutch_configure_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_CONFIGURE_RUN);
    m->config = clutch_get_u64(body + CLUTCH_CONFIGURE_CONFIG);
    m->period_us = clutch_get_u32(body + CLUTCH_CONFIGURE_PERIOD_US);
    m->watchdog_us = clutch_get_u32(body + CLUTCH_CONFIGURE_WATCHDOG_US);
    m->safe_kind = clutch_get_u8(body + CLUTCH_CONFIGURE_SAFE_KIND);
    m->hold_code = clutch_get_u16(body + CLUTCH_CONFIGURE_HOLD_CODE);
    m->release_code = clutch_get_u16(body + CLUTCH_CONFIGURE_RELEASE_CODE);
    m->ramp_step = clutch_get_u32(body + CLUTCH_CONFIGURE_RAMP_STEP);
    m->hold_periods = clutch_get_u32(body + CLUTCH_CONFIGURE_HOLD_PERIODS);
}

/* Arm: Consent to the run that was configured. */
#define CLUTCH_ARM_KIND 0x03u
#define CLUTCH_ARM_LENGTH 19u
#define CLUTCH_ARM_RUN 1u
#define CLUTCH_ARM_CONFIG 3u
#define CLUTCH_ARM_BOOT 11u
typedef struct {
    uint16_t run; /* The configured run. */
    uint64_t config; /* The configured hash. */
    uint32_t boot; /* The number of the power-up that the board gave in its hello: who arms has heard the board. */
} clutch_arm_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_arm(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_arm_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_ARM_KIND;
    clutch_put_u16(body + CLUTCH_ARM_RUN, m->run);
    clutch_put_u64(body + CLUTCH_ARM_CONFIG, m->config);
    clutch_put_u32(body + CLUTCH_ARM_BOOT, m->boot);
    return clutch_frame(wire, body, CLUTCH_ARM_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_ARM_KIND. */
static inline void clutch_get_arm(const uint8_t *body, clutch_arm_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_ARM_RUN);
    m->config = clutch_get_u64(body + CLUTCH_ARM_CONFIG);
    m->boot = clutch_get_u32(body + CLUTCH_ARM_BOOT);
}

/* Actuate: A code for the converter, in answer to a sample. */
#define CLUTCH_ACTUATE_KIND 0x04u
#define CLUTCH_ACTUATE_LENGTH 13u
#define CLUTCH_ACTUATE_RUN 1u
#define CLUTCH_ACTUATE_SEQUENCE 3u
#define CLUTCH_ACTUATE_CODE 5u
#define CLUTCH_ACTUATE_VALID_US 7u
typedef struct {
    uint16_t run; /* The configured run. */
    uint16_t sequence; /* Sequence number of the sample it answers. */
    uint16_t code; /* The code to put out. [DAC code] */
    uint16_t valid_us; /* Not applied if it arrives later than this after that sample was taken. [us] */
} clutch_actuate_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_actuate(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_actuate_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_ACTUATE_KIND;
    clutch_put_u16(body + CLUTCH_ACTUATE_RUN, m->run);
    clutch_put_u16(body + CLUTCH_ACTUATE_SEQUENCE, m->sequence);
    clutch_put_u16(body + CLUTCH_ACTUATE_CODE, m->code);
    clutch_put_u16(body + CLUTCH_ACTUATE_VALID_US, m->valid_us);
    return clutch_frame(wire, body, CLUTCH_ACTUATE_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_ACTUATE_KIND. */
static inline void clutch_get_actuate(const uint8_t *body, clutch_actuate_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_ACTUATE_RUN);
    m->sequence = clutch_get_u16(body + CLUTCH_ACTUATE_SEQUENCE);
    m->code = clutch_get_u16(body + CLUTCH_ACTUATE_CODE);
    m->valid_us = clutch_get_u16(body + CLUTCH_ACTUATE_VALID_US);
}

/* Stop: Ends the run: safe output. */
#define CLUTCH_STOP_KIND 0x05u
#define CLUTCH_STOP_LENGTH 8u
#define CLUTCH_STOP_RUN 1u
#define CLUTCH_STOP_REASON 3u
typedef struct {
    uint16_t run; /* The configured run. */
    uint8_t reason; /* Reason: a StopReason. */
} clutch_stop_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_stop(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_stop_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_STOP_KIND;
    clutch_put_u16(body + CLUTCH_STOP_RUN, m->run);
    clutch_put_u8(body + CLUTCH_STOP_REASON, m->reason);
    return clutch_frame(wire, body, CLUTCH_STOP_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_STOP_KIND. */
static inline void clutch_get_stop(const uint8_t *body, clutch_stop_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_STOP_RUN);
    m->reason = clutch_get_u8(body + CLUTCH_STOP_REASON);
}

/* Ping: Asks for the board's time. Any state. */
#define CLUTCH_PING_KIND 0x06u
#define CLUTCH_PING_LENGTH 11u
#define CLUTCH_PING_RUN 1u
#define CLUTCH_PING_NONCE 3u
typedef struct {
    uint16_t run; /* The host's run; the answer echoes it. */
    uint32_t nonce; /* Number that the answer echoes. */
} clutch_ping_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_ping(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_ping_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_PING_KIND;
    clutch_put_u16(body + CLUTCH_PING_RUN, m->run);
    clutch_put_u32(body + CLUTCH_PING_NONCE, m->nonce);
    return clutch_frame(wire, body, CLUTCH_PING_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_PING_KIND. */
static inline void clutch_get_ping(const uint8_t *body, clutch_ping_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_PING_RUN);
    m->nonce = clutch_get_u32(body + CLUTCH_PING_NONCE);
}

/* Set: One setting of the run to come. For boards in the controller role: the loop then runs on them. */
#define CLUTCH_SET_KIND 0x07u
#define CLUTCH_SET_LENGTH 17u
#define CLUTCH_SET_RUN 1u
#define CLUTCH_SET_KEY 3u
#define CLUTCH_SET_VALUE 5u
typedef struct {
    uint16_t run; /* Number of the run to come; the first setting of another run discards those before. */
    uint16_t key; /* Number of the setting. */
    uint64_t value; /* Its value: a whole number, or the bits of a real one of 32 bits. */
} clutch_set_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_set(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_set_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_SET_KIND;
    clutch_put_u16(body + CLUTCH_SET_RUN, m->run);
    clutch_put_u16(body + CLUTCH_SET_KEY, m->key);
    clutch_put_u64(body + CLUTCH_SET_VALUE, m->value);
    return clutch_frame(wire, body, CLUTCH_SET_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_SET_KIND. */
static inline void clutch_get_set(const uint8_t *body, clutch_set_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_SET_RUN);
    m->key = clutch_get_u16(body + CLUTCH_SET_KEY);
    m->value = clutch_get_u64(body + CLUTCH_SET_VALUE);
}

/* Hello: The board's identity, abilities and present state. Answers Discover. */
#define CLUTCH_HELLO_KIND 0x81u
#define CLUTCH_HELLO_LENGTH 66u
#define CLUTCH_HELLO_NONCE 1u
#define CLUTCH_HELLO_VERSION 5u
#define CLUTCH_HELLO_SCHEMA 6u
#define CLUTCH_HELLO_BOARD 14u
#define CLUTCH_HELLO_BOOT 18u
#define CLUTCH_HELLO_COUNTS_PER_REV 22u
#define CLUTCH_HELLO_DAC_BITS 26u
#define CLUTCH_HELLO_DAC_LOWEST_MV 27u
#define CLUTCH_HELLO_DAC_HIGHEST_MV 31u
#define CLUTCH_HELLO_PERIOD_MIN_US 35u
#define CLUTCH_HELLO_PERIOD_MAX_US 39u
#define CLUTCH_HELLO_WATCHDOG_MAX_US 43u
#define CLUTCH_HELLO_BOOT_CODE 47u
#define CLUTCH_HELLO_STARTED_BY 49u
#define CLUTCH_HELLO_WARNINGS 50u
#define CLUTCH_HELLO_STATE 51u
#define CLUTCH_HELLO_RUN 52u
#define CLUTCH_HELLO_CONFIG 54u
typedef struct {
    uint32_t nonce; /* The nonce of Discover. */
    uint8_t version; /* The board's version of the protocol. */
    uint64_t schema; /* The board's schema hash. */
    uint32_t board; /* The board's own serial number; 0 and 1 are simulated boards, and 0 one whose clock may wait. */
    uint32_t boot; /* Another number at each power-up, which cannot be guessed; Arm brings it back. */
    uint32_t counts_per_rev; /* Encoder counts per revolution, after quadrature. [counts per revolution] */
    uint8_t dac_bits; /* Resolution of the converter. [bits] */
    int32_t dac_lowest_mv; /* Output at code 0. [mV] */
    int32_t dac_highest_mv; /* Output one step above the highest code. [mV] */
    uint32_t period_min_us; /* Shortest period. [us] */
    uint32_t period_max_us; /* Longest period. [us] */
    uint32_t watchdog_max_us; /* Longest watchdog time. [us] */
    uint16_t boot_code; /* The code put out from power-up to the first safe output or run. [DAC code] */
    uint8_t started_by; /* The reason why its program started: a ResetCause. */
    uint8_t warnings; /* Conditions of the board that its owner should mend: bits. */
    uint8_t state; /* The present state of the board: a BoardState. */
    uint16_t run; /* The latched run; 0 if none since power-up. */
    uint64_t config; /* The latched hash; 0 if none since power-up. */
} clutch_hello_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_hello(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_hello_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_HELLO_KIND;
    clutch_put_u32(body + CLUTCH_HELLO_NONCE, m->nonce);
    clutch_put_u8(body + CLUTCH_HELLO_VERSION, m->version);
    clutch_put_u64(body + CLUTCH_HELLO_SCHEMA, m->schema);
    clutch_put_u32(body + CLUTCH_HELLO_BOARD, m->board);
    clutch_put_u32(body + CLUTCH_HELLO_BOOT, m->boot);
    clutch_put_u32(body + CLUTCH_HELLO_COUNTS_PER_REV, m->counts_per_rev);
    clutch_put_u8(body + CLUTCH_HELLO_DAC_BITS, m->dac_bits);
    clutch_put_i32(body + CLUTCH_HELLO_DAC_LOWEST_MV, m->dac_lowest_mv);
    clutch_put_i32(body + CLUTCH_HELLO_DAC_HIGHEST_MV, m->dac_highest_mv);
    clutch_put_u32(body + CLUTCH_HELLO_PERIOD_MIN_US, m->period_min_us);
    clutch_put_u32(body + CLUTCH_HELLO_PERIOD_MAX_US, m->period_max_us);
    clutch_put_u32(body + CLUTCH_HELLO_WATCHDOG_MAX_US, m->watchdog_max_us);
    clutch_put_u16(body + CLUTCH_HELLO_BOOT_CODE, m->boot_code);
    clutch_put_u8(body + CLUTCH_HELLO_STARTED_BY, m->started_by);
    clutch_put_u8(body + CLUTCH_HELLO_WARNINGS, m->warnings);
    clutch_put_u8(body + CLUTCH_HELLO_STATE, m->state);
    clutch_put_u16(body + CLUTCH_HELLO_RUN, m->run);
    clutch_put_u64(body + CLUTCH_HELLO_CONFIG, m->config);
    return clutch_frame(wire, body, CLUTCH_HELLO_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_HELLO_KIND. */
static inline void clutch_get_hello(const uint8_t *body, clutch_hello_t *m)
{
    m->nonce = clutch_get_u32(body + CLUTCH_HELLO_NONCE);
    m->version = clutch_get_u8(body + CLUTCH_HELLO_VERSION);
    m->schema = clutch_get_u64(body + CLUTCH_HELLO_SCHEMA);
    m->board = clutch_get_u32(body + CLUTCH_HELLO_BOARD);
    m->boot = clutch_get_u32(body + CLUTCH_HELLO_BOOT);
    m->counts_per_rev = clutch_get_u32(body + CLUTCH_HELLO_COUNTS_PER_REV);
    m->dac_bits = clutch_get_u8(body + CLUTCH_HELLO_DAC_BITS);
    m->dac_lowest_mv = clutch_get_i32(body + CLUTCH_HELLO_DAC_LOWEST_MV);
    m->dac_highest_mv = clutch_get_i32(body + CLUTCH_HELLO_DAC_HIGHEST_MV);
    m->period_min_us = clutch_get_u32(body + CLUTCH_HELLO_PERIOD_MIN_US);
    m->period_max_us = clutch_get_u32(body + CLUTCH_HELLO_PERIOD_MAX_US);
    m->watchdog_max_us = clutch_get_u32(body + CLUTCH_HELLO_WATCHDOG_MAX_US);
    m->boot_code = clutch_get_u16(body + CLUTCH_HELLO_BOOT_CODE);
    m->started_by = clutch_get_u8(body + CLUTCH_HELLO_STARTED_BY);
    m->warnings = clutch_get_u8(body + CLUTCH_HELLO_WARNINGS);
    m->state = clutch_get_u8(body + CLUTCH_HELLO_STATE);
    m->run = clutch_get_u16(body + CLUTCH_HELLO_RUN);
    m->config = clutch_get_u64(body + CLUTCH_HELLO_CONFIG);
}

/* Configured: The run is prepared; samples follow. Answers Configure. */
#define CLUTCH_CONFIGURED_KIND 0x82u
#define CLUTCH_CONFIGURED_LENGTH 19u
#define CLUTCH_CONFIGURED_RUN 1u
#define CLUTCH_CONFIGURED_CONFIG 3u
#define CLUTCH_CONFIGURED_BOOT 11u
typedef struct {
    uint16_t run; /* The run. */
    uint64_t config; /* The hash. */
    uint32_t boot; /* As in Hello: the host sees a board that was reset in between. */
} clutch_configured_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_configured(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_configured_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_CONFIGURED_KIND;
    clutch_put_u16(body + CLUTCH_CONFIGURED_RUN, m->run);
    clutch_put_u64(body + CLUTCH_CONFIGURED_CONFIG, m->config);
    clutch_put_u32(body + CLUTCH_CONFIGURED_BOOT, m->boot);
    return clutch_frame(wire, body, CLUTCH_CONFIGURED_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_CONFIGURED_KIND. */
static inline void clutch_get_configured(const uint8_t *body, clutch_configured_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_CONFIGURED_RUN);
    m->config = clutch_get_u64(body + CLUTCH_CONFIGURED_CONFIG);
    m->boot = clutch_get_u32(body + CLUTCH_CONFIGURED_BOOT);
}

/* Armed: The consent is taken. Answers Arm. */
#define CLUTCH_ARMED_KIND 0x83u
#define CLUTCH_ARMED_LENGTH 15u
#define CLUTCH_ARMED_RUN 1u
#define CLUTCH_ARMED_CONFIG 3u
typedef struct {
    uint16_t run; /* The run. */
    uint64_t config; /* The hash. */
} clutch_armed_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_armed(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_armed_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_ARMED_KIND;
    clutch_put_u16(body + CLUTCH_ARMED_RUN, m->run);
    clutch_put_u64(body + CLUTCH_ARMED_CONFIG, m->config);
    return clutch_frame(wire, body, CLUTCH_ARMED_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_ARMED_KIND. */
static inline void clutch_get_armed(const uint8_t *body, clutch_armed_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_ARMED_RUN);
    m->config = clutch_get_u64(body + CLUTCH_ARMED_CONFIG);
}

/* Sample: A measurement, one each period. */
#define CLUTCH_SAMPLE_KIND 0x84u
#define CLUTCH_SAMPLE_LENGTH 18u
#define CLUTCH_SAMPLE_RUN 1u
#define CLUTCH_SAMPLE_SEQUENCE 3u
#define CLUTCH_SAMPLE_TIME_US 5u
#define CLUTCH_SAMPLE_COUNTS 9u
#define CLUTCH_SAMPLE_STATUS 13u
typedef struct {
    uint16_t run; /* The run. */
    uint16_t sequence; /* 0 after Configure, then one more each period; wraps. */
    uint32_t time_us; /* Time of the measurement, by the board's clock; wraps. [us] */
    int32_t counts; /* The encoder's counter; wraps. [counts] */
    uint8_t status; /* BoardState and flags. */
} clutch_sample_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_sample(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_sample_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_SAMPLE_KIND;
    clutch_put_u16(body + CLUTCH_SAMPLE_RUN, m->run);
    clutch_put_u16(body + CLUTCH_SAMPLE_SEQUENCE, m->sequence);
    clutch_put_u32(body + CLUTCH_SAMPLE_TIME_US, m->time_us);
    clutch_put_i32(body + CLUTCH_SAMPLE_COUNTS, m->counts);
    clutch_put_u8(body + CLUTCH_SAMPLE_STATUS, m->status);
    return clutch_frame(wire, body, CLUTCH_SAMPLE_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_SAMPLE_KIND. */
static inline void clutch_get_sample(const uint8_t *body, clutch_sample_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_SAMPLE_RUN);
    m->sequence = clutch_get_u16(body + CLUTCH_SAMPLE_SEQUENCE);
    m->time_us = clutch_get_u32(body + CLUTCH_SAMPLE_TIME_US);
    m->counts = clutch_get_i32(body + CLUTCH_SAMPLE_COUNTS);
    m->status = clutch_get_u8(body + CLUTCH_SAMPLE_STATUS);
}

/* Fault: The board went to its safe output by itself. */
#define CLUTCH_FAULT_KIND 0x85u
#define CLUTCH_FAULT_LENGTH 18u
#define CLUTCH_FAULT_RUN 1u
#define CLUTCH_FAULT_SEQUENCE 3u
#define CLUTCH_FAULT_TIME_US 5u
#define CLUTCH_FAULT_CAUSE 9u
#define CLUTCH_FAULT_VALUE 10u
typedef struct {
    uint16_t run; /* The run. */
    uint16_t sequence; /* Sequence number of the newest sample. */
    uint32_t time_us; /* Time of the fault, by the board's clock. [us] */
    uint8_t cause; /* Cause: a BoardFault. */
    uint32_t value; /* Detail of the cause. */
} clutch_fault_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_fault(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_fault_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_FAULT_KIND;
    clutch_put_u16(body + CLUTCH_FAULT_RUN, m->run);
    clutch_put_u16(body + CLUTCH_FAULT_SEQUENCE, m->sequence);
    clutch_put_u32(body + CLUTCH_FAULT_TIME_US, m->time_us);
    clutch_put_u8(body + CLUTCH_FAULT_CAUSE, m->cause);
    clutch_put_u32(body + CLUTCH_FAULT_VALUE, m->value);
    return clutch_frame(wire, body, CLUTCH_FAULT_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_FAULT_KIND. */
static inline void clutch_get_fault(const uint8_t *body, clutch_fault_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_FAULT_RUN);
    m->sequence = clutch_get_u16(body + CLUTCH_FAULT_SEQUENCE);
    m->time_us = clutch_get_u32(body + CLUTCH_FAULT_TIME_US);
    m->cause = clutch_get_u8(body + CLUTCH_FAULT_CAUSE);
    m->value = clutch_get_u32(body + CLUTCH_FAULT_VALUE);
}

/* Stopped: The run is over. Answers Stop. */
#define CLUTCH_STOPPED_KIND 0x86u
#define CLUTCH_STOPPED_LENGTH 10u
#define CLUTCH_STOPPED_RUN 1u
#define CLUTCH_STOPPED_REASON 3u
#define CLUTCH_STOPPED_CODE 4u
typedef struct {
    uint16_t run; /* The run. */
    uint8_t reason; /* The reason of Stop. */
    uint16_t code; /* The code that is put out now. [DAC code] */
} clutch_stopped_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_stopped(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_stopped_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_STOPPED_KIND;
    clutch_put_u16(body + CLUTCH_STOPPED_RUN, m->run);
    clutch_put_u8(body + CLUTCH_STOPPED_REASON, m->reason);
    clutch_put_u16(body + CLUTCH_STOPPED_CODE, m->code);
    return clutch_frame(wire, body, CLUTCH_STOPPED_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_STOPPED_KIND. */
static inline void clutch_get_stopped(const uint8_t *body, clutch_stopped_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_STOPPED_RUN);
    m->reason = clutch_get_u8(body + CLUTCH_STOPPED_REASON);
    m->code = clutch_get_u16(body + CLUTCH_STOPPED_CODE);
}

/* Pong: The board's time. Answers Ping. */
#define CLUTCH_PONG_KIND 0x87u
#define CLUTCH_PONG_LENGTH 15u
#define CLUTCH_PONG_RUN 1u
#define CLUTCH_PONG_NONCE 3u
#define CLUTCH_PONG_TIME_US 7u
typedef struct {
    uint16_t run; /* The run of Ping. */
    uint32_t nonce; /* The nonce of Ping. */
    uint32_t time_us; /* Time at which Ping was taken, by the board's clock. [us] */
} clutch_pong_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_pong(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_pong_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_PONG_KIND;
    clutch_put_u16(body + CLUTCH_PONG_RUN, m->run);
    clutch_put_u32(body + CLUTCH_PONG_NONCE, m->nonce);
    clutch_put_u32(body + CLUTCH_PONG_TIME_US, m->time_us);
    return clutch_frame(wire, body, CLUTCH_PONG_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_PONG_KIND. */
static inline void clutch_get_pong(const uint8_t *body, clutch_pong_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_PONG_RUN);
    m->nonce = clutch_get_u32(body + CLUTCH_PONG_NONCE);
    m->time_us = clutch_get_u32(body + CLUTCH_PONG_TIME_US);
}

/* Refused: The board refuses a frame. The layout is the same in all versions. */
#define CLUTCH_REFUSED_KIND 0x88u
#define CLUTCH_REFUSED_LENGTH 11u
#define CLUTCH_REFUSED_REQUEST 1u
#define CLUTCH_REFUSED_REASON 2u
#define CLUTCH_REFUSED_VALUE 3u
typedef struct {
    uint8_t request; /* Kind of the frame that is refused. */
    uint8_t reason; /* Reason: a Refusal. */
    uint32_t value; /* Detail of the reason. */
} clutch_refused_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_refused(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_refused_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_REFUSED_KIND;
    clutch_put_u8(body + CLUTCH_REFUSED_REQUEST, m->request);
    clutch_put_u8(body + CLUTCH_REFUSED_REASON, m->reason);
    clutch_put_u32(body + CLUTCH_REFUSED_VALUE, m->value);
    return clutch_frame(wire, body, CLUTCH_REFUSED_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_REFUSED_KIND. */
static inline void clutch_get_refused(const uint8_t *body, clutch_refused_t *m)
{
    m->request = clutch_get_u8(body + CLUTCH_REFUSED_REQUEST);
    m->reason = clutch_get_u8(body + CLUTCH_REFUSED_REASON);
    m->value = clutch_get_u32(body + CLUTCH_REFUSED_VALUE);
}

/* ControllerHello: A board in the controller role. Answers Discover; the Hello of the board that it drives follows. */
#define CLUTCH_CONTROLLER_HELLO_KIND 0x89u
#define CLUTCH_CONTROLLER_HELLO_LENGTH 51u
#define CLUTCH_CONTROLLER_HELLO_NONCE 1u
#define CLUTCH_CONTROLLER_HELLO_VERSION 5u
#define CLUTCH_CONTROLLER_HELLO_SCHEMA 6u
#define CLUTCH_CONTROLLER_HELLO_SETTINGS 14u
#define CLUTCH_CONTROLLER_HELLO_BOARD 22u
#define CLUTCH_CONTROLLER_HELLO_BOOT 26u
#define CLUTCH_CONTROLLER_HELLO_CLOCK_HZ 30u
#define CLUTCH_CONTROLLER_HELLO_KNOTS 34u
#define CLUTCH_CONTROLLER_HELLO_STATE 36u
#define CLUTCH_CONTROLLER_HELLO_RUN 37u
#define CLUTCH_CONTROLLER_HELLO_CONFIG 39u
typedef struct {
    uint32_t nonce; /* The nonce of Discover. */
    uint8_t version; /* The board's version of the protocol. */
    uint64_t schema; /* The board's schema hash. */
    uint64_t settings; /* The board's hash of its table of settings. */
    uint32_t board; /* The board's own serial number; 0 and 1 are emulated boards. */
    uint32_t boot; /* Another number at each power-up, which cannot be guessed; Arm brings it back. */
    uint32_t clock_hz; /* Frequency of Telemetry.cycles; 0 if it counts nothing. [Hz] */
    uint16_t knots; /* Points that a path given as a table may have. */
    uint8_t state; /* State of control: the supervisor's state. */
    uint16_t run; /* The latched run; 0 if none since power-up. */
    uint64_t config; /* The latched hash; 0 if none since power-up. */
} clutch_controller_hello_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_controller_hello(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_controller_hello_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_CONTROLLER_HELLO_KIND;
    clutch_put_u32(body + CLUTCH_CONTROLLER_HELLO_NONCE, m->nonce);
    clutch_put_u8(body + CLUTCH_CONTROLLER_HELLO_VERSION, m->version);
    clutch_put_u64(body + CLUTCH_CONTROLLER_HELLO_SCHEMA, m->schema);
    clutch_put_u64(body + CLUTCH_CONTROLLER_HELLO_SETTINGS, m->settings);
    clutch_put_u32(body + CLUTCH_CONTROLLER_HELLO_BOARD, m->board);
    clutch_put_u32(body + CLUTCH_CONTROLLER_HELLO_BOOT, m->boot);
    clutch_put_u32(body + CLUTCH_CONTROLLER_HELLO_CLOCK_HZ, m->clock_hz);
    clutch_put_u16(body + CLUTCH_CONTROLLER_HELLO_KNOTS, m->knots);
    clutch_put_u8(body + CLUTCH_CONTROLLER_HELLO_STATE, m->state);
    clutch_put_u16(body + CLUTCH_CONTROLLER_HELLO_RUN, m->run);
    clutch_put_u64(body + CLUTCH_CONTROLLER_HELLO_CONFIG, m->config);
    return clutch_frame(wire, body, CLUTCH_CONTROLLER_HELLO_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_CONTROLLER_HELLO_KIND. */
static inline void clutch_get_controller_hello(const uint8_t *body, clutch_controller_hello_t *m)
{
    m->nonce = clutch_get_u32(body + CLUTCH_CONTROLLER_HELLO_NONCE);
    m->version = clutch_get_u8(body + CLUTCH_CONTROLLER_HELLO_VERSION);
    m->schema = clutch_get_u64(body + CLUTCH_CONTROLLER_HELLO_SCHEMA);
    m->settings = clutch_get_u64(body + CLUTCH_CONTROLLER_HELLO_SETTINGS);
    m->board = clutch_get_u32(body + CLUTCH_CONTROLLER_HELLO_BOARD);
    m->boot = clutch_get_u32(body + CLUTCH_CONTROLLER_HELLO_BOOT);
    m->clock_hz = clutch_get_u32(body + CLUTCH_CONTROLLER_HELLO_CLOCK_HZ);
    m->knots = clutch_get_u16(body + CLUTCH_CONTROLLER_HELLO_KNOTS);
    m->state = clutch_get_u8(body + CLUTCH_CONTROLLER_HELLO_STATE);
    m->run = clutch_get_u16(body + CLUTCH_CONTROLLER_HELLO_RUN);
    m->config = clutch_get_u64(body + CLUTCH_CONTROLLER_HELLO_CONFIG);
}

/* Taken: The setting is taken. Answers Set. */
#define CLUTCH_TAKEN_KIND 0x8au
#define CLUTCH_TAKEN_LENGTH 17u
#define CLUTCH_TAKEN_RUN 1u
#define CLUTCH_TAKEN_KEY 3u
#define CLUTCH_TAKEN_VALUE 5u
typedef struct {
    uint16_t run; /* The run. */
    uint16_t key; /* The setting. */
    uint64_t value; /* The value, as it was taken. */
} clutch_taken_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_taken(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_taken_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_TAKEN_KIND;
    clutch_put_u16(body + CLUTCH_TAKEN_RUN, m->run);
    clutch_put_u16(body + CLUTCH_TAKEN_KEY, m->key);
    clutch_put_u64(body + CLUTCH_TAKEN_VALUE, m->value);
    return clutch_frame(wire, body, CLUTCH_TAKEN_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_TAKEN_KIND. */
static inline void clutch_get_taken(const uint8_t *body, clutch_taken_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_TAKEN_RUN);
    m->key = clutch_get_u16(body + CLUTCH_TAKEN_KEY);
    m->value = clutch_get_u64(body + CLUTCH_TAKEN_VALUE);
}

/* Telemetry: A sample after consent, and the controller's result for it. Real numbers are sent as their 32 bits. */
#define CLUTCH_TELEMETRY_KIND 0x8bu
#define CLUTCH_TELEMETRY_LENGTH 55u /* without the numbers of its list */
#define CLUTCH_TELEMETRY_RUN 1u
#define CLUTCH_TELEMETRY_NUMBER 3u
#define CLUTCH_TELEMETRY_TICK 5u
#define CLUTCH_TELEMETRY_SEQUENCE 9u
#define CLUTCH_TELEMETRY_TIME_US 11u
#define CLUTCH_TELEMETRY_COUNTS 15u
#define CLUTCH_TELEMETRY_STATUS 19u
#define CLUTCH_TELEMETRY_FLAGS 20u
#define CLUTCH_TELEMETRY_ARRIVAL 21u
#define CLUTCH_TELEMETRY_STATES 22u
#define CLUTCH_TELEMETRY_CAUSE 23u
#define CLUTCH_TELEMETRY_VALUE 24u
#define CLUTCH_TELEMETRY_LATENESS_US 28u
#define CLUTCH_TELEMETRY_ERROR 32u
#define CLUTCH_TELEMETRY_ERROR_RATE 36u
#define CLUTCH_TELEMETRY_DEMAND 40u
#define CLUTCH_TELEMETRY_CODE 44u
#define CLUTCH_TELEMETRY_CYCLES 46u
#define CLUTCH_TELEMETRY_TERMS 50u
typedef struct {
    uint16_t run; /* The run. */
    uint16_t number; /* One more with each frame of this kind; wraps. A gap is lost telemetry. */
    uint32_t tick; /* The run's tick, low half. */
    uint16_t sequence; /* Sequence number of the sample. */
    uint32_t time_us; /* Time of the sample. [us] */
    int32_t counts; /* Counts of the sample. [counts] */
    uint8_t status; /* Status of the sample: BoardState and flags. */
    uint8_t flags; /* The controller's findings: bits. */
    uint8_t arrival; /* Arrival of the sample: the supervisor's number for it. */
    uint8_t states; /* The supervisor's state after it (high half) and before it (low half). */
    uint8_t cause; /* Cause of the end of control, if it has ended: the supervisor's number for it. */
    uint32_t value; /* Value that the check that ended control saw. [bits] */
    uint32_t lateness_us; /* Time that the answer before took. [us] */
    uint32_t error; /* The error. [bits, rad] */
    uint32_t error_rate; /* Its rate. [bits, rad/s] */
    uint32_t demand; /* The law's voltage within its limits. [bits, V] */
    uint16_t code; /* Code given to the converter. [DAC code] */
    uint32_t cycles; /* Clock cycles of the tick before: see ControllerHello.clock_hz. [clock cycles] */
    uint8_t terms_count; /* at most 8 */
    uint32_t terms[8]; /* The law's terms: how many, and each. [bits] */
} clutch_telemetry_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_telemetry(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_telemetry_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_TELEMETRY_KIND;
    clutch_put_u16(body + CLUTCH_TELEMETRY_RUN, m->run);
    clutch_put_u16(body + CLUTCH_TELEMETRY_NUMBER, m->number);
    clutch_put_u32(body + CLUTCH_TELEMETRY_TICK, m->tick);
    clutch_put_u16(body + CLUTCH_TELEMETRY_SEQUENCE, m->sequence);
    clutch_put_u32(body + CLUTCH_TELEMETRY_TIME_US, m->time_us);
    clutch_put_i32(body + CLUTCH_TELEMETRY_COUNTS, m->counts);
    clutch_put_u8(body + CLUTCH_TELEMETRY_STATUS, m->status);
    clutch_put_u8(body + CLUTCH_TELEMETRY_FLAGS, m->flags);
    clutch_put_u8(body + CLUTCH_TELEMETRY_ARRIVAL, m->arrival);
    clutch_put_u8(body + CLUTCH_TELEMETRY_STATES, m->states);
    clutch_put_u8(body + CLUTCH_TELEMETRY_CAUSE, m->cause);
    clutch_put_u32(body + CLUTCH_TELEMETRY_VALUE, m->value);
    clutch_put_u32(body + CLUTCH_TELEMETRY_LATENESS_US, m->lateness_us);
    clutch_put_u32(body + CLUTCH_TELEMETRY_ERROR, m->error);
    clutch_put_u32(body + CLUTCH_TELEMETRY_ERROR_RATE, m->error_rate);
    clutch_put_u32(body + CLUTCH_TELEMETRY_DEMAND, m->demand);
    clutch_put_u16(body + CLUTCH_TELEMETRY_CODE, m->code);
    clutch_put_u32(body + CLUTCH_TELEMETRY_CYCLES, m->cycles);
    clutch_put_list(body + CLUTCH_TELEMETRY_TERMS, m->terms, m->terms_count);
    return clutch_frame(wire, body, CLUTCH_TELEMETRY_LENGTH + 4u * (size_t)body[CLUTCH_TELEMETRY_TERMS]);
}

/* From the body that clutch_push accepted as CLUTCH_TELEMETRY_KIND. */
static inline void clutch_get_telemetry(const uint8_t *body, clutch_telemetry_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_TELEMETRY_RUN);
    m->number = clutch_get_u16(body + CLUTCH_TELEMETRY_NUMBER);
    m->tick = clutch_get_u32(body + CLUTCH_TELEMETRY_TICK);
    m->sequence = clutch_get_u16(body + CLUTCH_TELEMETRY_SEQUENCE);
    m->time_us = clutch_get_u32(body + CLUTCH_TELEMETRY_TIME_US);
    m->counts = clutch_get_i32(body + CLUTCH_TELEMETRY_COUNTS);
    m->status = clutch_get_u8(body + CLUTCH_TELEMETRY_STATUS);
    m->flags = clutch_get_u8(body + CLUTCH_TELEMETRY_FLAGS);
    m->arrival = clutch_get_u8(body + CLUTCH_TELEMETRY_ARRIVAL);
    m->states = clutch_get_u8(body + CLUTCH_TELEMETRY_STATES);
    m->cause = clutch_get_u8(body + CLUTCH_TELEMETRY_CAUSE);
    m->value = clutch_get_u32(body + CLUTCH_TELEMETRY_VALUE);
    m->lateness_us = clutch_get_u32(body + CLUTCH_TELEMETRY_LATENESS_US);
    m->error = clutch_get_u32(body + CLUTCH_TELEMETRY_ERROR);
    m->error_rate = clutch_get_u32(body + CLUTCH_TELEMETRY_ERROR_RATE);
    m->demand = clutch_get_u32(body + CLUTCH_TELEMETRY_DEMAND);
    m->code = clutch_get_u16(body + CLUTCH_TELEMETRY_CODE);
    m->cycles = clutch_get_u32(body + CLUTCH_TELEMETRY_CYCLES);
    m->terms_count = clutch_get_list(body + CLUTCH_TELEMETRY_TERMS, m->terms);
}

/* Ended: Control has ended, but not by a sample. */
#define CLUTCH_ENDED_KIND 0x8cu
#define CLUTCH_ENDED_LENGTH 17u
#define CLUTCH_ENDED_RUN 1u
#define CLUTCH_ENDED_TICK 3u
#define CLUTCH_ENDED_STATES 7u
#define CLUTCH_ENDED_CAUSE 8u
#define CLUTCH_ENDED_VALUE 9u
typedef struct {
    uint16_t run; /* The run. */
    uint32_t tick; /* The run's tick, low half. */
    uint8_t states; /* The supervisor's state after it (high half) and before it (low half). */
    uint8_t cause; /* Cause: the supervisor's number for it. */
    uint32_t value; /* Value that the check saw. [bits] */
} clutch_ended_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_ended(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_ended_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_ENDED_KIND;
    clutch_put_u16(body + CLUTCH_ENDED_RUN, m->run);
    clutch_put_u32(body + CLUTCH_ENDED_TICK, m->tick);
    clutch_put_u8(body + CLUTCH_ENDED_STATES, m->states);
    clutch_put_u8(body + CLUTCH_ENDED_CAUSE, m->cause);
    clutch_put_u32(body + CLUTCH_ENDED_VALUE, m->value);
    return clutch_frame(wire, body, CLUTCH_ENDED_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_ENDED_KIND. */
static inline void clutch_get_ended(const uint8_t *body, clutch_ended_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_ENDED_RUN);
    m->tick = clutch_get_u32(body + CLUTCH_ENDED_TICK);
    m->states = clutch_get_u8(body + CLUTCH_ENDED_STATES);
    m->cause = clutch_get_u8(body + CLUTCH_ENDED_CAUSE);
    m->value = clutch_get_u32(body + CLUTCH_ENDED_VALUE);
}

/* Link: Counters of the controller's own line; each second, and at each end. */
#define CLUTCH_LINK_KIND 0x8du
#define CLUTCH_LINK_LENGTH 43u
#define CLUTCH_LINK_RUN 1u
#define CLUTCH_LINK_RECEIVED 3u
#define CLUTCH_LINK_LOST 7u
#define CLUTCH_LINK_LATE 11u
#define CLUTCH_LINK_DUPLICATED 15u
#define CLUTCH_LINK_REORDERED 19u
#define CLUTCH_LINK_BAD_FRAMES 23u
#define CLUTCH_LINK_REJECTED 27u
#define CLUTCH_LINK_DEADLINE_MISSES 31u
#define CLUTCH_LINK_DROPPED 35u
typedef struct {
    uint16_t run; /* The run. */
    uint32_t received; /* Samples of the run. */
    uint32_t lost; /* Samples lost. */
    uint32_t late; /* Samples that a newer one had overtaken. */
    uint32_t duplicated; /* Samples that came twice. */
    uint32_t reordered; /* Samples that came after a newer one. */
    uint32_t bad_frames; /* Frames that were not whole. */
    uint32_t rejected; /* Samples that were not believed. */
    uint32_t deadline_misses; /* Answers later than the deadline. */
    uint32_t dropped; /* Frames to the host for which there was no room. */
} clutch_link_t;

/* The frame for the wire; its length, bytes. */
static inline size_t clutch_encode_link(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_link_t *m)
{
    uint8_t body[CLUTCH_MAX_BODY];
    body[0] = CLUTCH_LINK_KIND;
    clutch_put_u16(body + CLUTCH_LINK_RUN, m->run);
    clutch_put_u32(body + CLUTCH_LINK_RECEIVED, m->received);
    clutch_put_u32(body + CLUTCH_LINK_LOST, m->lost);
    clutch_put_u32(body + CLUTCH_LINK_LATE, m->late);
    clutch_put_u32(body + CLUTCH_LINK_DUPLICATED, m->duplicated);
    clutch_put_u32(body + CLUTCH_LINK_REORDERED, m->reordered);
    clutch_put_u32(body + CLUTCH_LINK_BAD_FRAMES, m->bad_frames);
    clutch_put_u32(body + CLUTCH_LINK_REJECTED, m->rejected);
    clutch_put_u32(body + CLUTCH_LINK_DEADLINE_MISSES, m->deadline_misses);
    clutch_put_u32(body + CLUTCH_LINK_DROPPED, m->dropped);
    return clutch_frame(wire, body, CLUTCH_LINK_LENGTH);
}

/* From the body that clutch_push accepted as CLUTCH_LINK_KIND. */
static inline void clutch_get_link(const uint8_t *body, clutch_link_t *m)
{
    m->run = clutch_get_u16(body + CLUTCH_LINK_RUN);
    m->received = clutch_get_u32(body + CLUTCH_LINK_RECEIVED);
    m->lost = clutch_get_u32(body + CLUTCH_LINK_LOST);
    m->late = clutch_get_u32(body + CLUTCH_LINK_LATE);
    m->duplicated = clutch_get_u32(body + CLUTCH_LINK_DUPLICATED);
    m->reordered = clutch_get_u32(body + CLUTCH_LINK_REORDERED);
    m->bad_frames = clutch_get_u32(body + CLUTCH_LINK_BAD_FRAMES);
    m->rejected = clutch_get_u32(body + CLUTCH_LINK_REJECTED);
    m->deadline_misses = clutch_get_u32(body + CLUTCH_LINK_DEADLINE_MISSES);
    m->dropped = clutch_get_u32(body + CLUTCH_LINK_DROPPED);
}

/* Bytes before stuffing of the frame with this body, CRC included; 0 for a kind that is not known. */
static inline size_t clutch_length(const uint8_t *body)
{
    switch (body[0]) {
    case CLUTCH_DISCOVER_KIND: return CLUTCH_DISCOVER_LENGTH;
    case CLUTCH_CONFIGURE_KIND: return CLUTCH_CONFIGURE_LENGTH;
    case CLUTCH_ARM_KIND: return CLUTCH_ARM_LENGTH;
    case CLUTCH_ACTUATE_KIND: return CLUTCH_ACTUATE_LENGTH;
    case CLUTCH_STOP_KIND: return CLUTCH_STOP_LENGTH;
    case CLUTCH_PING_KIND: return CLUTCH_PING_LENGTH;
    case CLUTCH_SET_KIND: return CLUTCH_SET_LENGTH;
    case CLUTCH_HELLO_KIND: return CLUTCH_HELLO_LENGTH;
    case CLUTCH_CONFIGURED_KIND: return CLUTCH_CONFIGURED_LENGTH;
    case CLUTCH_ARMED_KIND: return CLUTCH_ARMED_LENGTH;
    case CLUTCH_SAMPLE_KIND: return CLUTCH_SAMPLE_LENGTH;
    case CLUTCH_FAULT_KIND: return CLUTCH_FAULT_LENGTH;
    case CLUTCH_STOPPED_KIND: return CLUTCH_STOPPED_LENGTH;
    case CLUTCH_PONG_KIND: return CLUTCH_PONG_LENGTH;
    case CLUTCH_REFUSED_KIND: return CLUTCH_REFUSED_LENGTH;
    case CLUTCH_CONTROLLER_HELLO_KIND: return CLUTCH_CONTROLLER_HELLO_LENGTH;
    case CLUTCH_TAKEN_KIND: return CLUTCH_TAKEN_LENGTH;
    case CLUTCH_TELEMETRY_KIND: return CLUTCH_TELEMETRY_LENGTH + 4u * (size_t)body[CLUTCH_TELEMETRY_TERMS];
    case CLUTCH_ENDED_KIND: return CLUTCH_ENDED_LENGTH;
    case CLUTCH_LINK_KIND: return CLUTCH_LINK_LENGTH;
    default: return 0;
    }
}

/* Results of clutch_push besides a kind. */
#define CLUTCH_NOTHING 0        /* no frame ends here */
#define CLUTCH_BAD_COBS (-1)    /* a code points past the end */
#define CLUTCH_TOO_LONG (-2)    /* more bytes than the longest frame; reported once */
#define CLUTCH_TOO_SHORT (-3)   /* shorter than a kind and a CRC */
#define CLUTCH_BAD_CRC (-4)     /* the checksum does not hold */
#define CLUTCH_UNKNOWN_KIND (-5)
#define CLUTCH_BAD_LENGTH (-6)  /* not the length of its kind */

/* Finds frames in a stream of bytes. All zero to start with. */
typedef struct {
    uint8_t body[CLUTCH_MAX_BODY];
    uint8_t length;   /* bytes in body */
    uint8_t count;    /* bytes since the delimiter */
    uint8_t left;     /* bytes of the block still to come */
    uint8_t dropping; /* too long: drop up to the delimiter */
} clutch_decoder_t;

/* Takes a byte. A kind (> 0): a frame is in d->body until the next byte. An error (< 0): a frame was dropped. */
static inline int clutch_push(clutch_decoder_t *d, uint8_t byte)
{
    uint8_t length = d->length, count = d->count, left = d->left, dropping = d->dropping;
    size_t expected;
    if (byte != 0) {
        if (dropping)
            return CLUTCH_NOTHING;
        if (count >= CLUTCH_MAX_FRAME - 1u) {
            d->dropping = 1;
            return CLUTCH_TOO_LONG;
        }
        d->count++;
        if (left > 0) {
            d->left--;
            d->body[d->length++] = byte;
        } else {
            if (count > 0)
                d->body[d->length++] = 0;
            d->left = (uint8_t)(byte - 1u);
        }
        return CLUTCH_NOTHING;
    }
    d->length = d->count = d->left = d->dropping = 0;
    if (count == 0 || dropping)
        return CLUTCH_NOTHING;
    if (left > 0)
        return CLUTCH_BAD_COBS;
    if (length < 5)
        return CLUTCH_TOO_SHORT;
    if (clutch_crc32(d->body, length - 4u) != clutch_get_u32(d->body + length - 4))
        return CLUTCH_BAD_CRC;
    expected = clutch_length(d->body);
    if (expected == 0)
        return CLUTCH_UNKNOWN_KIND;
    if (expected != length)
        return CLUTCH_BAD_LENGTH;
    return d->body[0];
}

#endif
