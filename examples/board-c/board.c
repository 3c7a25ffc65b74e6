/* The board's side of docs/wire.md. The names of its sections are in the comments.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#include "board.h"
#include "clutch_wire.h"

#define RECENT 8u /* samples that an Actuate may answer */

/* State that the board keeps. */
static struct {
    board_params_t params;
    clutch_decoder_t decoder;
    clutch_configure_t set;    /* the last Configure that was accepted */
    clutch_configure_t ending; /* that of the run whose safe output is under way */
    uint8_t state;
    uint8_t under_way;        /* the safe output: from the end of a run to the next Arm */
    uint8_t late;             /* flag for the next sample */
    uint8_t has_answered;     /* an Actuate was applied in this run */
    uint8_t recent;           /* samples of this run, up to RECENT */
    uint16_t code;            /* output of the converter */
    uint16_t sequence;        /* of the next sample */
    uint16_t answered;        /* sequence number that the last applied Actuate answered */
    uint32_t taken_us[RECENT]; /* times of the last samples, by sequence number modulo RECENT */
    uint32_t fed_us;          /* time of the last applied Actuate, or of consent */
    uint32_t level;           /* of the ramp, 2^-16 codes */
    uint32_t steps;           /* of the safe output so far */
    uint32_t configurations;
} b;

static uint16_t top(void)
{
    return (uint16_t)((UINT32_C(1) << b.params.dac_bits) - 1u);
}

static int driving(void)
{
    return b.state == CLUTCH_BOARD_STATE_ARMED || b.state == CLUTCH_BOARD_STATE_RUNNING;
}

static void put_out(uint16_t code)
{
    b.code = code;
    write_dac(code);
}

static void refuse(uint8_t request, uint8_t reason, uint32_t value)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_refused_t m;
    m.request = request;
    m.reason = reason;
    m.value = value;
    serial_write(wire, clutch_encode_refused(wire, &m));
}

/* ---- Safe output ---- */

static void safe_step(void)
{
    uint32_t target = (uint32_t)b.ending.hold_code << 16;
    uint32_t rest = b.level < target ? target - b.level : b.level - target;
    uint32_t step = b.ending.ramp_step < rest ? b.ending.ramp_step : rest;
    uint16_t code = b.ending.hold_code;
    switch (b.ending.safe_kind) {
    case CLUTCH_SAFE_KIND_RAMP:
        b.level = b.level < target ? b.level + step : b.level - step;
        code = (uint16_t)(b.level >> 16);
        break;
    case CLUTCH_SAFE_KIND_RELEASE:
        code = b.ending.release_code;
        break;
    case CLUTCH_SAFE_KIND_HOLD_THEN_RELEASE:
        if (b.steps >= b.ending.hold_periods)
            code = b.ending.release_code;
        break;
    default: /* Hold: Configure has let in no other kind */
        break;
    }
    if (b.steps != UINT32_MAX)
        b.steps++;
    put_out(code);
}

static void make_safe(uint8_t state)
{
    b.level = (uint32_t)b.code << 16;
    b.steps = 0;
    /* A copy: it continues in Ready, where the next run's Configure has come already. With that one's kind it
     * would continue from numbers that mean something else, and may let go. */
    b.ending = b.set;
    b.under_way = 1;
    b.state = state;
    safe_step();
}

/* ---- Watchdog and faults ---- */

static void fault(uint32_t now_us, uint8_t cause, uint32_t value)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_fault_t m;
    make_safe(CLUTCH_BOARD_STATE_FAULTED); /* first: the line may be slow */
    m.run = b.set.run;
    m.sequence = (uint16_t)(b.sequence - 1u);
    m.time_us = now_us;
    m.cause = cause;
    m.value = value;
    serial_write(wire, clutch_encode_fault(wire, &m));
}

void board_poll(uint32_t now_us)
{
    uint32_t silent = now_us - b.fed_us; /* right across the wrap of the clock */
    if (driving() && silent >= b.set.watchdog_us)
        fault(now_us, CLUTCH_BOARD_FAULT_WATCHDOG, silent);
}

/* ---- Each period ---- */

void board_tick(uint32_t now_us)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_sample_t m;
    uint8_t faults;
    int begun = b.under_way;
    if (b.state == CLUTCH_BOARD_STATE_BOOT)
        return;
    m.counts = read_encoder(); /* before anything that takes time */
    faults = hardware_faults() & (CLUTCH_STATUS_ENCODER_FAULT | CLUTCH_STATUS_DAC_FAULT);
    board_poll(now_us);
    if (driving() && faults != 0) {
        int encoder = (faults & CLUTCH_STATUS_ENCODER_FAULT) != 0;
        fault(now_us, encoder ? CLUTCH_BOARD_FAULT_ENCODER : CLUTCH_BOARD_FAULT_CONVERTER, 0);
    }
    if (begun) /* if it has begun just now, this period's step is taken */
        safe_step();
    m.run = b.set.run;
    m.sequence = b.sequence;
    m.time_us = now_us;
    m.status = (uint8_t)(b.state | faults | (b.late ? CLUTCH_STATUS_LATE : 0u));
    b.late = 0;
    b.taken_us[b.sequence % RECENT] = now_us;
    if (b.recent < RECENT)
        b.recent++;
    b.sequence++;
    serial_write(wire, clutch_encode_sample(wire, &m));
}

/* ---- Each frame ---- */

static void discover(const clutch_discover_t *m)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_hello_t hello;
    if (m->version != CLUTCH_VERSION) {
        refuse(CLUTCH_DISCOVER_KIND, CLUTCH_REFUSAL_VERSION, CLUTCH_VERSION);
        return;
    }
    if (m->schema != CLUTCH_SCHEMA) {
        refuse(CLUTCH_DISCOVER_KIND, CLUTCH_REFUSAL_SCHEMA, (uint32_t)(CLUTCH_SCHEMA & 0xffffffffu));
        return;
    }
    hello.nonce = m->nonce;
    hello.version = CLUTCH_VERSION;
    hello.schema = CLUTCH_SCHEMA;
    hello.board = b.params.board;
    hello.boot = b.params.boot;
    hello.counts_per_rev = b.params.counts_per_rev;
    hello.dac_bits = b.params.dac_bits;
    hello.dac_lowest_mv = b.params.dac_lowest_mv;
    hello.dac_highest_mv = b.params.dac_highest_mv;
    hello.period_min_us = b.params.period_min_us;
    hello.period_max_us = b.params.period_max_us;
    hello.watchdog_max_us = b.params.watchdog_max_us;
    hello.boot_code = b.params.boot_code;
    hello.started_by = b.params.started_by;
    hello.warnings = b.params.warnings;
    hello.state = b.state;
    hello.run = b.set.run;
    hello.config = b.set.config;
    serial_write(wire, clutch_encode_hello(wire, &hello));
}

static void configure(const clutch_configure_t *m)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_configured_t configured;
    int again = b.state == CLUTCH_BOARD_STATE_READY && m->run == b.set.run && m->config == b.set.config;
    if (!again) {
        if (driving()) {
            refuse(CLUTCH_CONFIGURE_KIND, CLUTCH_REFUSAL_STATE, b.state);
            return;
        }
        if (b.state != CLUTCH_BOARD_STATE_BOOT && m->run == b.set.run) {
            refuse(CLUTCH_CONFIGURE_KIND, CLUTCH_REFUSAL_RUN, b.set.run);
            return;
        }
        if (m->period_us < b.params.period_min_us || m->period_us > b.params.period_max_us) {
            refuse(CLUTCH_CONFIGURE_KIND, CLUTCH_REFUSAL_PERIOD, m->period_us);
            return;
        }
        /* Halved, not doubled: twice a period may not fit 32 bits. */
        if (m->watchdog_us / 2u < m->period_us || m->watchdog_us > b.params.watchdog_max_us ||
            m->watchdog_us > (uint64_t)m->period_us * CLUTCH_WATCHDOG_PERIODS) {
            refuse(CLUTCH_CONFIGURE_KIND, CLUTCH_REFUSAL_WATCHDOG, m->watchdog_us);
            return;
        }
        if (m->safe_kind > CLUTCH_SAFE_KIND_HOLD_THEN_RELEASE || m->hold_code > top() ||
            m->release_code > top() || (m->safe_kind == CLUTCH_SAFE_KIND_RAMP && m->ramp_step == 0)) {
            refuse(CLUTCH_CONFIGURE_KIND, CLUTCH_REFUSAL_SAFE, m->safe_kind);
            return;
        }
        b.set = *m;
        b.state = CLUTCH_BOARD_STATE_READY; /* the output stays as it is */
        b.sequence = 0;
        b.recent = 0;
        b.has_answered = 0;
        b.late = 0;
        b.configurations++;
    }
    configured.run = b.set.run;
    configured.config = b.set.config;
    configured.boot = b.params.boot;
    serial_write(wire, clutch_encode_configured(wire, &configured));
}

static void arm(const clutch_arm_t *m, uint32_t now_us)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_armed_t armed;
    if (b.state != CLUTCH_BOARD_STATE_READY && b.state != CLUTCH_BOARD_STATE_ARMED) {
        refuse(CLUTCH_ARM_KIND, CLUTCH_REFUSAL_STATE, b.state);
        return;
    }
    if (m->run != b.set.run) {
        refuse(CLUTCH_ARM_KIND, CLUTCH_REFUSAL_RUN, b.set.run);
        return;
    }
    if (m->config != b.set.config) {
        refuse(CLUTCH_ARM_KIND, CLUTCH_REFUSAL_CONFIG, (uint32_t)(b.set.config & 0xffffffffu));
        return;
    }
    if (m->boot != b.params.boot) {
        /* A controller that has not heard Hello hears no answer either. */
        refuse(CLUTCH_ARM_KIND, CLUTCH_REFUSAL_BOOT, 0);
        return;
    }
    if (b.state == CLUTCH_BOARD_STATE_READY) {
        b.state = CLUTCH_BOARD_STATE_ARMED;
        b.under_way = 0;
        b.fed_us = now_us; /* a repeated Arm does not feed the watchdog */
    }
    armed.run = b.set.run;
    armed.config = b.set.config;
    serial_write(wire, clutch_encode_armed(wire, &armed));
}

static void actuate(const clutch_actuate_t *m, uint32_t now_us)
{
    uint16_t ahead = (uint16_t)(m->sequence - b.answered);
    uint16_t behind = (uint16_t)(b.sequence - 1u - m->sequence); /* 0: answers the newest sample */
    if (!driving() || m->run != b.set.run)
        return;
    if (m->code > top()) {
        refuse(CLUTCH_ACTUATE_KIND, CLUTCH_REFUSAL_CODE, m->code);
        return;
    }
    if (b.has_answered && (ahead == 0 || ahead >= 0x8000u))
        return; /* a duplicate, or overtaken */
    if (behind >= b.recent || now_us - b.taken_us[m->sequence % RECENT] > m->valid_us) {
        b.late = 1;
        return;
    }
    put_out(m->code);
    b.fed_us = now_us;
    b.answered = m->sequence;
    b.has_answered = 1;
    b.state = CLUTCH_BOARD_STATE_RUNNING;
}

static void stop(const clutch_stop_t *m)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_stopped_t stopped;
    if (b.state == CLUTCH_BOARD_STATE_BOOT || m->run != b.set.run)
        return;
    if (driving())
        make_safe(m->reason == CLUTCH_STOP_REASON_FAULT ? CLUTCH_BOARD_STATE_FAULTED
                                                        : CLUTCH_BOARD_STATE_STOPPED);
    stopped.run = b.set.run;
    stopped.reason = m->reason;
    stopped.code = b.code;
    serial_write(wire, clutch_encode_stopped(wire, &stopped));
}

static void ping(const clutch_ping_t *m, uint32_t now_us)
{
    uint8_t wire[CLUTCH_MAX_FRAME];
    clutch_pong_t pong;
    pong.run = m->run;
    pong.nonce = m->nonce;
    pong.time_us = now_us;
    serial_write(wire, clutch_encode_pong(wire, &pong));
}

void board_byte(uint8_t byte, uint32_t now_us)
{
    union {
        clutch_discover_t discover;
        clutch_configure_t configure;
        clutch_arm_t arm;
        clutch_actuate_t actuate;
        clutch_stop_t stop;
        clutch_ping_t ping;
    } m;
    int kind;
    /* A code must not feed a watchdog that has run out and was not checked. */
    board_poll(now_us);
    kind = clutch_push(&b.decoder, byte);
    if (kind <= 0)
        return; /* no frame yet, or a bad one: that is never answered */
    switch (kind) {
    case CLUTCH_DISCOVER_KIND:
        clutch_get_discover(b.decoder.body, &m.discover);
        discover(&m.discover);
        break;
    case CLUTCH_CONFIGURE_KIND:
        clutch_get_configure(b.decoder.body, &m.configure);
        configure(&m.configure);
        break;
    case CLUTCH_ARM_KIND:
        clutch_get_arm(b.decoder.body, &m.arm);
        arm(&m.arm, now_us);
        break;
    case CLUTCH_ACTUATE_KIND:
        clutch_get_actuate(b.decoder.body, &m.actuate);
        actuate(&m.actuate, now_us);
        break;
    case CLUTCH_STOP_KIND:
        clutch_get_stop(b.decoder.body, &m.stop);
        stop(&m.stop);
        break;
    case CLUTCH_PING_KIND:
        clutch_get_ping(b.decoder.body, &m.ping);
        ping(&m.ping, now_us);
        break;
    default: /* a board's own kinds: an echo, or two boards on one line */
        break;
    }
}

/* ---- Power-up ---- */

const char *board_init(const board_params_t *params)
{
    if (params->dac_bits < 1 || params->dac_bits > 16)
        return "dac_bits: expected 1 to 16";
    if (params->boot_code > (UINT32_C(1) << params->dac_bits) - 1u)
        return "boot_code: expected a code that the converter has";
    if (params->dac_highest_mv <= params->dac_lowest_mv)
        return "dac_highest_mv: expected a voltage above dac_lowest_mv";
    if (params->period_min_us == 0 || params->period_min_us > params->period_max_us)
        return "period_min_us: expected above 0 and not above period_max_us";
    if (params->watchdog_max_us / 2u < params->period_min_us)
        return "watchdog_max_us: expected at least two of the shortest periods";
    memset(&b, 0, sizeof b); /* state Boot, run and hash 0 */
    b.params = *params;
    put_out(params->boot_code);
    return NULL;
}

uint32_t board_period_us(void)
{
    return b.state == CLUTCH_BOARD_STATE_BOOT ? 0 : b.set.period_us;
}

uint32_t board_configurations(void)
{
    return b.configurations;
}

uint8_t board_state(void)
{
    return b.state;
}
