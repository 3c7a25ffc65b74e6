/* What a servo has to do at a step: positions of 64 bits in 2^-16 counts across the wrap of the counter, the offset of a
 * bumpless start, a voltage for what is no number, the converter's code, and what is asked of it afterwards. */

#include <stdint.h>

typedef struct {
    double kp, kd, keep, scale, radians_per_count, lowest, highest, decay;
    double dac_lowest, dac_step, per_volt, top;
    int32_t counts;
    int64_t position, error;
    double rate, offset, applied;
    /* Of the last step. */
    double tick_error, tick_rate, demand, terms[2];
    int limit;
    uint16_t code;
} servo;

static inline servo servo_of(double kp, double kd, double smoothing, double period, double radians_per_count,
                             double lowest, double highest)
{
    return (servo){
        .kp = kp, .kd = kd, .keep = 1.0 - smoothing, .scale = smoothing * radians_per_count / period,
        .radians_per_count = radians_per_count, .lowest = lowest, .highest = highest,
        .dac_lowest = -10.0, .dac_step = 20.0 / 4096.0, .per_volt = 4096.0 / 20.0, .top = 4095.0,
    };
}

static inline double servo_step(servo *self, int32_t counts, double target_counts)
{
    int32_t moved = (int32_t)((uint32_t)counts - (uint32_t)self->counts);
    self->counts = counts;
    self->position += (int64_t)moved * 65536;
    int64_t error = (int64_t)(target_counts * 65536.0) - self->position;
    self->rate = self->keep * self->rate + self->scale * ((double)(error - self->error) * (1.0 / 65536.0));
    self->error = error;
    self->tick_error = (double)error * (1.0 / 65536.0) * self->radians_per_count;
    self->tick_rate = self->rate;
    self->terms[0] = -(self->kp * self->tick_error);
    self->terms[1] = -(self->kd * self->tick_rate);
    double volts = self->terms[0] + self->terms[1] + self->offset;
    self->offset *= self->decay;
    self->limit = 0;
    if (volts < self->lowest) {
        volts = self->lowest;
        self->limit = 1;
    } else if (volts > self->highest) {
        volts = self->highest;
        self->limit = 2;
    } else if (volts != volts) {
        volts = self->highest;
        self->limit = 3;
    }
    self->demand = volts;
    double code = (volts - self->dac_lowest) * self->per_volt + 0.5;
    code = code < 0.0 ? 0.0 : code > self->top ? self->top : code;
    self->code = (uint16_t)code;
    self->applied = self->dac_lowest + self->dac_step * self->code;
    return self->demand;
}
