/* Reads lines of hexadecimal bytes, and prints the C codec's result for each: the fields of a
 * Sample or an Actuate, other messages encoded again, errors by name. */
#include <stdio.h>

#include "clutch_wire.h"

#define AGAIN(NAME, name)                               \
    case CLUTCH_##NAME##_KIND: {                        \
        clutch_##name##_t m;                            \
        clutch_get_##name(body, &m);                    \
        return clutch_encode_##name(wire, &m);          \
    }

static size_t again(uint8_t *wire, const uint8_t *body)
{
    switch (body[0]) {
        AGAIN(DISCOVER, discover)
        AGAIN(CONFIGURE, configure)
        AGAIN(ARM, arm)
        AGAIN(ACTUATE, actuate)
        AGAIN(STOP, stop)
        AGAIN(PING, ping)
        AGAIN(SET, set)
        AGAIN(HELLO, hello)
        AGAIN(CONFIGURED, configured)
        AGAIN(ARMED, armed)
        AGAIN(SAMPLE, sample)
        AGAIN(FAULT, fault)
        AGAIN(STOPPED, stopped)
        AGAIN(PONG, pong)
        AGAIN(REFUSED, refused)
        AGAIN(CONTROLLER_HELLO, controller_hello)
        AGAIN(TAKEN, taken)
        AGAIN(TELEMETRY, telemetry)
        AGAIN(ENDED, ended)
        AGAIN(LINK, link)
    default:
        return 0;
    }
}

static const char *error(int result)
{
    switch (result) {
    case CLUTCH_BAD_COBS: return "!Cobs";
    case CLUTCH_TOO_LONG: return "!TooLong";
    case CLUTCH_TOO_SHORT: return "!TooShort";
    case CLUTCH_BAD_CRC: return "!Crc";
    case CLUTCH_UNKNOWN_KIND: return "!UnknownKind";
    case CLUTCH_BAD_LENGTH: return "!Length";
    default: return "!?";
    }
}

static void print(int result, const uint8_t *body)
{
    if (result < 0) {
        printf("%s", error(result));
    } else if (result == CLUTCH_SAMPLE_KIND) {
        clutch_sample_t m;
        clutch_get_sample(body, &m);
        printf("Sample run=%u sequence=%u time_us=%lu counts=%ld status=%u", m.run, m.sequence,
               (unsigned long)m.time_us, (long)m.counts, m.status);
    } else if (result == CLUTCH_ACTUATE_KIND) {
        clutch_actuate_t m;
        clutch_get_actuate(body, &m);
        printf("Actuate run=%u sequence=%u code=%u valid_us=%u", m.run, m.sequence, m.code, m.valid_us);
    } else {
        uint8_t wire[CLUTCH_MAX_FRAME];
        size_t i, length = again(wire, body);
        for (i = 0; i < length; i++)
            printf("%02x", wire[i]);
    }
}

int main(void)
{
    static char line[4096];
    while (fgets(line, sizeof line, stdin)) {
        clutch_decoder_t decoder;
        const char *at = line;
        unsigned byte;
        int events = 0;
        memset(&decoder, 0, sizeof decoder);
        while (sscanf(at, "%2x", &byte) == 1) {
            int result = clutch_push(&decoder, (uint8_t)byte);
            if (result != CLUTCH_NOTHING) {
                printf("%s", events++ ? "; " : "");
                print(result, decoder.body);
            }
            at += 2;
        }
        printf("\n");
    }
    return 0;
}
