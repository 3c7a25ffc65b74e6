/* libclutch: slow, smooth motion of shafts restrained by friction. Written by `cargo run -p clutch-c --example header`.
 *
 * Units are SI and radians; positions are in 2^-16 counts of the encoder. A call never allocates, never blocks and never ends
 * the program. Objects live in memory of yours, and one is not used by two threads at once.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef CLUTCH_H
#define CLUTCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* States of control. */
enum {
    CLUTCH_STATE_DISCONNECTED = 0,
    CLUTCH_STATE_READY = 1,
    CLUTCH_STATE_ARMED = 2,
    CLUTCH_STATE_RUNNING = 3,
    CLUTCH_STATE_HOLDING = 4,
    CLUTCH_STATE_RELEASED = 5,
    CLUTCH_STATE_FAULTED = 6,
};

/* Causes of the end of control. */
enum {
    CLUTCH_CAUSE_NONE = 0,
    CLUTCH_CAUSE_LOST = 1,
    CLUTCH_CAUSE_LATE = 2,
    CLUTCH_CAUSE_DUPLICATED = 3,
    CLUTCH_CAUSE_REORDERED = 4,
    CLUTCH_CAUSE_JUMP = 5,
    CLUTCH_CAUSE_STAND_STILL = 6,
    CLUTCH_CAUSE_FOLLOWING_ERROR = 7,
    CLUTCH_CAUSE_SATURATION = 8,
    CLUTCH_CAUSE_NOT_FINITE = 9,
    CLUTCH_CAUSE_DEADLINE = 10,
    CLUTCH_CAUSE_SILENCE = 11,
    CLUTCH_CAUSE_BOARD = 12,
    CLUTCH_CAUSE_TARGET = 13,
    CLUTCH_CAUSE_OPERATOR = 14,
    CLUTCH_CAUSE_DONE = 15,
    CLUTCH_CAUSE_CHANNEL = 16,
    CLUTCH_CAUSE_REVERSED = 17,
    CLUTCH_CAUSE_TOO_SLOW = 18,
    CLUTCH_CAUSE_TOO_FAST = 19,
    CLUTCH_CAUSE_CLOCK = 20,
};

/* Fates of a sample. */
enum {
    CLUTCH_ARRIVAL_FRESH = 0,
    CLUTCH_ARRIVAL_MISSING = 1,
    CLUTCH_ARRIVAL_DUPLICATE = 2,
    CLUTCH_ARRIVAL_REORDERED = 3,
    CLUTCH_ARRIVAL_LATE = 4,
    CLUTCH_ARRIVAL_IMPLAUSIBLE = 5,
};

/* The meaning of the keys of a list of settings: compare it with clutch_settings_hash(). */
#define CLUTCH_SETTINGS_HASH UINT64_C(0x36bca6d1f97bad42)

/* Settings: those of the options that are chosen are needed; others are not looked at. */
enum {
    CLUTCH_KEY_TICKS = 0, /* whole, periods */
    CLUTCH_KEY_START_COUNTS_X65536 = 1, /* whole */
    CLUTCH_KEY_TIMES_WATCHDOG_US = 2, /* whole, us */
    CLUTCH_KEY_TIMES_VALID_US = 3, /* whole, us */
    CLUTCH_KEY_TIMES_SILENCE_US = 4, /* whole, us */
    CLUTCH_KEY_TIMES_HOST_SILENCE_US = 5, /* whole, us */
    CLUTCH_KEY_SAMPLING_PERIOD_US = 6, /* whole, us */
    CLUTCH_KEY_RIG_ENCODER_COUNTS_PER_REV = 7, /* whole, counts per revolution */
    CLUTCH_KEY_RIG_DAC_BITS = 8, /* whole, bits */
    CLUTCH_KEY_RIG_DAC_LOWEST_V = 9, /* f32, V */
    CLUTCH_KEY_RIG_DAC_HIGHEST_V = 10, /* f32, V */
    CLUTCH_KEY_VELOCITY_SMOOTHED_DERIVATIVE_SMOOTHING = 11, /* f32 */
    CLUTCH_KEY_MODEL_INERTIA_KG_M2 = 12, /* f32, kg m^2 */
    CLUTCH_KEY_MODEL_DRIVE_TORQUE_NM = 13, /* f32, N m */
    CLUTCH_KEY_MODEL_VISCOUS_DAMPING_NM_S_RAD = 14, /* f32, N m s/rad */
    CLUTCH_KEY_MODEL_ACTUATOR = 15, /* brake/geometry/motor/both */
    CLUTCH_KEY_MODEL_ACTUATOR_BRAKE_GAIN_NM_V = 16, /* f32, N m/V */
    CLUTCH_KEY_MODEL_ACTUATOR_BRAKE_PRELOAD_NM = 17, /* f32, N m */
    CLUTCH_KEY_MODEL_ACTUATOR_GEOMETRY_INNER_RADIUS_M = 18, /* f32, m */
    CLUTCH_KEY_MODEL_ACTUATOR_GEOMETRY_TORQUE_CONSTANT_NM_A = 19, /* f32, N m/A */
    CLUTCH_KEY_MODEL_ACTUATOR_GEOMETRY_PAD_AREA_M2 = 20, /* f32, m^2 */
    CLUTCH_KEY_MODEL_ACTUATOR_GEOMETRY_LEVER_AREA_M2 = 21, /* f32, m^2 */
    CLUTCH_KEY_MODEL_ACTUATOR_GEOMETRY_ARMATURE_RESISTANCE_OHM = 22, /* f32, Ohm */
    CLUTCH_KEY_MODEL_ACTUATOR_GEOMETRY_CONTACT_RADIUS_M = 23, /* f32, m */
    CLUTCH_KEY_MODEL_ACTUATOR_MOTOR_GAIN_NM_V = 24, /* f32, N m/V */
    CLUTCH_KEY_MODEL_ACTUATOR_MOTOR_PRELOAD_NM = 25, /* f32, N m */
    CLUTCH_KEY_MODEL_ACTUATOR_MOTOR_LOAD_SHARE = 26, /* f32 */
    CLUTCH_KEY_MODEL_ACTUATOR_BOTH_BRAKE_GAIN_NM_V = 27, /* f32, N m/V */
    CLUTCH_KEY_MODEL_ACTUATOR_BOTH_MOTOR_GAIN_NM_V = 28, /* f32, N m/V */
    CLUTCH_KEY_MODEL_ACTUATOR_BOTH_PRELOAD_NM = 29, /* f32, N m */
    CLUTCH_KEY_MODEL_FRICTION = 30, /* stribeck/coulomb/lugre/dahl/elasto_plastic/maxwell */
    CLUTCH_KEY_MODEL_FRICTION_STRIBECK_MU_STATIC = 31, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_STRIBECK_MU_DYNAMIC = 32, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_STRIBECK_STRIBECK_VELOCITY_RAD_S = 33, /* f32, rad/s */
    CLUTCH_KEY_MODEL_FRICTION_STRIBECK_STRIBECK_EXPONENT = 34, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_COULOMB_MU_STATIC = 35, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_COULOMB_MU_DYNAMIC = 36, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_LUGRE_MU_STATIC = 37, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_LUGRE_MU_DYNAMIC = 38, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_LUGRE_STRIBECK_VELOCITY_RAD_S = 39, /* f32, rad/s */
    CLUTCH_KEY_MODEL_FRICTION_LUGRE_STRIBECK_EXPONENT = 40, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_LUGRE_STIFFNESS_1_RAD = 41, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_LUGRE_DAMPING_S_RAD = 42, /* f32, s/rad */
    CLUTCH_KEY_MODEL_FRICTION_DAHL_MU_DYNAMIC = 43, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_DAHL_STIFFNESS_1_RAD = 44, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_MU_STATIC = 45, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_MU_DYNAMIC = 46, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_STRIBECK_VELOCITY_RAD_S = 47, /* f32, rad/s */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_STRIBECK_EXPONENT = 48, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_STIFFNESS_1_RAD = 49, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_DAMPING_S_RAD = 50, /* f32, s/rad */
    CLUTCH_KEY_MODEL_FRICTION_ELASTO_PLASTIC_MU_ELASTIC = 51, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_MU_STATIC = 52, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_MU_DYNAMIC = 53, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STRIBECK_VELOCITY_RAD_S = 54, /* f32, rad/s */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STRIBECK_EXPONENT = 55, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_A_1_RAD = 56, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_B_1_RAD = 57, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_C_1_RAD = 58, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_D_1_RAD = 59, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_E_1_RAD = 60, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_F_1_RAD = 61, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_G_1_RAD = 62, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_STIFFNESS_H_1_RAD = 63, /* f32, 1/rad */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_A = 64, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_B = 65, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_C = 66, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_E = 67, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_F = 68, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_G = 69, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_SHARE_H = 70, /* f32 */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_ATTRACTION_1_S = 71, /* f32, 1/s */
    CLUTCH_KEY_MODEL_FRICTION_MAXWELL_DAMPING_S_RAD = 72, /* f32, s/rad */
    CLUTCH_KEY_LAW = 73, /* pd/ctc/smc/smc_sign/pid/super_twisting/smc_integral/dob/glide/voltage/hold */
    CLUTCH_KEY_LAW_PD_KP_V_RAD = 74, /* f32, V/rad */
    CLUTCH_KEY_LAW_PD_KD_V_S_RAD = 75, /* f32, V s/rad */
    CLUTCH_KEY_LAW_CTC_OUTER_GAIN = 76, /* f32 */
    CLUTCH_KEY_LAW_CTC_KP_1_S2 = 77, /* f32, 1/s^2 */
    CLUTCH_KEY_LAW_CTC_KD_1_S = 78, /* f32, 1/s */
    CLUTCH_KEY_LAW_SMC_KP_V = 79, /* f32, V */
    CLUTCH_KEY_LAW_SMC_KD_V_S_RAD = 80, /* f32, V s/rad */
    CLUTCH_KEY_LAW_SMC_SLOPE_1_S = 81, /* f32, 1/s */
    CLUTCH_KEY_LAW_SMC_BOUNDARY_RAD_S = 82, /* f32, rad/s */
    CLUTCH_KEY_LAW_SMC_SIGN_KP_V = 83, /* f32, V */
    CLUTCH_KEY_LAW_SMC_SIGN_KD_V_S_RAD = 84, /* f32, V s/rad */
    CLUTCH_KEY_LAW_SMC_SIGN_SLOPE_1_S = 85, /* f32, 1/s */
    CLUTCH_KEY_LAW_PID_KP_V_RAD = 86, /* f32, V/rad */
    CLUTCH_KEY_LAW_PID_KI_V_RAD_S = 87, /* f32, V/(rad s) */
    CLUTCH_KEY_LAW_PID_KD_V_S_RAD = 88, /* f32, V s/rad */
    CLUTCH_KEY_LAW_PID_DERIVATIVE_TIME_S = 89, /* f32, s */
    CLUTCH_KEY_LAW_PID_TRACKING_TIME_S = 90, /* f32, s */
    CLUTCH_KEY_LAW_PID_BIAS_V = 91, /* f32, V */
    CLUTCH_KEY_LAW_PID_COULOMB_V = 92, /* f32, V */
    CLUTCH_KEY_LAW_PID_VELOCITY_V_S_RAD = 93, /* f32, V s/rad */
    CLUTCH_KEY_LAW_PID_ACCELERATION_V_S2_RAD = 94, /* f32, V s^2/rad */
    CLUTCH_KEY_LAW_SUPER_TWISTING_K1_V_RT_S_RAD = 95, /* f32, V sqrt(s/rad) */
    CLUTCH_KEY_LAW_SUPER_TWISTING_K2_V_S = 96, /* f32, V/s */
    CLUTCH_KEY_LAW_SUPER_TWISTING_SLOPE_1_S = 97, /* f32, 1/s */
    CLUTCH_KEY_LAW_SUPER_TWISTING_BOUNDARY_RAD_S = 98, /* f32, rad/s */
    CLUTCH_KEY_LAW_SMC_INTEGRAL_KP_V = 99, /* f32, V */
    CLUTCH_KEY_LAW_SMC_INTEGRAL_KD_V_S_RAD = 100, /* f32, V s/rad */
    CLUTCH_KEY_LAW_SMC_INTEGRAL_SLOPE_1_S = 101, /* f32, 1/s */
    CLUTCH_KEY_LAW_SMC_INTEGRAL_INTEGRAL_1_S2 = 102, /* f32, 1/s^2 */
    CLUTCH_KEY_LAW_SMC_INTEGRAL_BOUNDARY_RAD_S = 103, /* f32, rad/s */
    CLUTCH_KEY_LAW_DOB_KP_1_S2 = 104, /* f32, 1/s^2 */
    CLUTCH_KEY_LAW_DOB_KD_1_S = 105, /* f32, 1/s */
    CLUTCH_KEY_LAW_DOB_BANDWIDTH_RAD_S = 106, /* f32, rad/s */
    CLUTCH_KEY_LAW_GLIDE_KP_1_S = 107, /* f32, 1/s */
    CLUTCH_KEY_LAW_GLIDE_KD_1_S = 108, /* f32, 1/s */
    CLUTCH_KEY_LAW_GLIDE_FLOOR = 109, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_CAP = 110, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_OPTIMISM = 111, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_MICRO_BELOW_RAD_S = 112, /* f32, rad/s */
    CLUTCH_KEY_LAW_GLIDE_FILTER_DELAY_TICKS = 113, /* whole, periods */
    CLUTCH_KEY_LAW_GLIDE_FILTER_LAG_S = 114, /* f32, s */
    CLUTCH_KEY_LAW_GLIDE_FILTER_FRICTION_DOUBT = 115, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_FILTER_RIPPLE_SHARE = 116, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_FILTER_RIPPLE_WAVES_PER_TURN = 117, /* f32, waves per turn */
    CLUTCH_KEY_LAW_GLIDE_FILTER_RIPPLE_DAMPING = 118, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_FILTER_WALK_RAD_S_RT_S = 119, /* f32, rad/s/sqrt(s) */
    CLUTCH_KEY_LAW_GLIDE_FILTER_GAIN_DOUBT = 120, /* f32 */
    CLUTCH_KEY_LAW_GLIDE_FILTER_SILENCE_COUNTS = 121, /* f32, counts */
    CLUTCH_KEY_LAW_VOLTAGE_START_V = 122, /* f32, V */
    CLUTCH_KEY_LAW_VOLTAGE_END_V = 123, /* f32, V */
    CLUTCH_KEY_LAW_VOLTAGE_RATE_V_S = 124, /* f32, V/s */
    CLUTCH_KEY_LAW_VOLTAGE_WAIT_S = 125, /* f32, s */
    CLUTCH_KEY_LAW_VOLTAGE_RETURNS = 126, /* switch */
    CLUTCH_KEY_LAW_HOLD_MARGIN = 127, /* f32 */
    CLUTCH_KEY_OUTPUT_LOWEST_V = 128, /* f32, V */
    CLUTCH_KEY_OUTPUT_HIGHEST_V = 129, /* f32, V */
    CLUTCH_KEY_OUTPUT_ON_INVALID_V = 130, /* f32, V */
    CLUTCH_KEY_OUTPUT_BUMPLESS_TIME_S = 131, /* f32, s */
    CLUTCH_KEY_SHELL_SLOPE_1_S = 132, /* f32, 1/s */
    CLUTCH_KEY_SHELL_BOUNDARY_RAD_S = 133, /* f32, rad/s */
    CLUTCH_KEY_SAFETY_ON_FAULT = 134, /* hold/ramp/release/hold_then_release */
    CLUTCH_KEY_SAFETY_ON_FAULT_HOLD_VOLTS_V = 135, /* f32, V */
    CLUTCH_KEY_SAFETY_ON_FAULT_RAMP_RATE_V_S = 136, /* f32, V/s */
    CLUTCH_KEY_SAFETY_ON_FAULT_RAMP_VOLTS_V = 137, /* f32, V */
    CLUTCH_KEY_SAFETY_ON_FAULT_HOLD_THEN_RELEASE_VOLTS_V = 138, /* f32, V */
    CLUTCH_KEY_SAFETY_ON_FAULT_HOLD_THEN_RELEASE_AFTER_S = 139, /* f32, s */
    CLUTCH_KEY_SAFETY_LIMITS_JUMP_RAD = 140, /* f32, rad */
    CLUTCH_KEY_SAFETY_LIMITS_JUMPS = 141, /* whole, within 128 periods */
    CLUTCH_KEY_SAFETY_LIMITS_GOOD_SAMPLES = 142, /* whole */
    CLUTCH_KEY_SAFETY_LIMITS_FOLLOWING_ERROR_RAD = 143, /* f32, rad */
    CLUTCH_KEY_SAFETY_LIMITS_FOLLOWING_TIME_S = 144, /* f32, s */
    CLUTCH_KEY_SAFETY_LIMITS_SATURATION_TIME_S = 145, /* f32, s */
    CLUTCH_KEY_SAFETY_LIMITS_EDGE_COUNTS = 146, /* f32, counts */
    CLUTCH_KEY_SAFETY_LIMITS_FRICTION_MARGIN = 147, /* f32 */
    CLUTCH_KEY_SAFETY_LIMITS_GRIP_MARGIN = 148, /* f32 */
    CLUTCH_KEY_SAFETY_LIMITS_DELAY_CYCLES = 149, /* whole, periods */
    CLUTCH_KEY_SAFETY_LIMITS_LOST = 150, /* whole, within 128 periods */
    CLUTCH_KEY_SAFETY_LIMITS_LATE = 151, /* whole, within 128 periods */
    CLUTCH_KEY_SAFETY_LIMITS_DISORDER = 152, /* whole, within 128 periods */
    CLUTCH_KEY_SAFETY_LIMITS_SILENCE_CYCLES = 153, /* whole, periods */
    CLUTCH_KEY_SAFETY_LIMITS_DEADLINE_US = 154, /* whole, us */
    CLUTCH_KEY_SAFETY_LIMITS_OVERRUNS = 155, /* whole, within 128 periods */
    CLUTCH_KEY_RIG_SPEED_LIMIT_RAD_S = 156, /* f32, rad/s */
    CLUTCH_KEY_BOUNDS_ACTUATOR = 157, /* brake/motor/both */
    CLUTCH_KEY_BOUNDS_PRELOAD_NM = 158, /* f32, N m */
    CLUTCH_KEY_BOUNDS_LOAD_SHARE = 159, /* f32 */
    CLUTCH_KEY_BOUNDS_INERTIA_KG_M2_LOW = 160, /* f32 */
    CLUTCH_KEY_BOUNDS_INERTIA_KG_M2_HIGH = 161, /* f32 */
    CLUTCH_KEY_BOUNDS_DRIVE_TORQUE_NM_LOW = 162, /* f32 */
    CLUTCH_KEY_BOUNDS_DRIVE_TORQUE_NM_HIGH = 163, /* f32 */
    CLUTCH_KEY_BOUNDS_VISCOUS_DAMPING_NM_S_RAD_LOW = 164, /* f32 */
    CLUTCH_KEY_BOUNDS_VISCOUS_DAMPING_NM_S_RAD_HIGH = 165, /* f32 */
    CLUTCH_KEY_BOUNDS_BRAKE_GAIN_NM_V_LOW = 166, /* f32 */
    CLUTCH_KEY_BOUNDS_BRAKE_GAIN_NM_V_HIGH = 167, /* f32 */
    CLUTCH_KEY_BOUNDS_MOTOR_GAIN_NM_V_LOW = 168, /* f32 */
    CLUTCH_KEY_BOUNDS_MOTOR_GAIN_NM_V_HIGH = 169, /* f32 */
    CLUTCH_KEY_BOUNDS_FRICTION_AT_REST_LOW = 170, /* f32 */
    CLUTCH_KEY_BOUNDS_FRICTION_AT_REST_HIGH = 171, /* f32 */
    CLUTCH_KEY_BOUNDS_FRICTION_SLIDING_LOW = 172, /* f32 */
    CLUTCH_KEY_BOUNDS_FRICTION_SLIDING_HIGH = 173, /* f32 */
    CLUTCH_KEY_BOUNDS_FRICTION_LOW = 174, /* f32 */
    CLUTCH_KEY_BOUNDS_FRICTION_HIGH = 175, /* f32 */
    CLUTCH_KEY_REFERENCE = 176, /* hold/ramp/trapezoid/jerk_limited/minimum_jerk/sine/chirp/table */
    CLUTCH_KEY_REFERENCE_RAMP_RATE_RAD_S = 177, /* f32, rad/s */
    CLUTCH_KEY_REFERENCE_TRAPEZOID_DISTANCE_RAD = 178, /* f32, rad */
    CLUTCH_KEY_REFERENCE_TRAPEZOID_SPEED_RAD_S = 179, /* f32, rad/s */
    CLUTCH_KEY_REFERENCE_TRAPEZOID_ACCELERATION_RAD_S2 = 180, /* f32, rad/s^2 */
    CLUTCH_KEY_REFERENCE_JERK_LIMITED_DISTANCE_RAD = 181, /* f32, rad */
    CLUTCH_KEY_REFERENCE_JERK_LIMITED_SPEED_RAD_S = 182, /* f32, rad/s */
    CLUTCH_KEY_REFERENCE_JERK_LIMITED_ACCELERATION_RAD_S2 = 183, /* f32, rad/s^2 */
    CLUTCH_KEY_REFERENCE_JERK_LIMITED_JERK_RAD_S3 = 184, /* f32, rad/s^3 */
    CLUTCH_KEY_REFERENCE_MINIMUM_JERK_DISTANCE_RAD = 185, /* f32, rad */
    CLUTCH_KEY_REFERENCE_MINIMUM_JERK_DURATION_S = 186, /* f32, s */
    CLUTCH_KEY_REFERENCE_SINE_RATE_RAD_S = 187, /* f32, rad/s */
    CLUTCH_KEY_REFERENCE_SINE_AMPLITUDE_RAD = 188, /* f32, rad */
    CLUTCH_KEY_REFERENCE_SINE_FREQUENCY_HZ = 189, /* f32, Hz */
    CLUTCH_KEY_REFERENCE_SINE_PHASE_TURNS = 190, /* f32, turns */
    CLUTCH_KEY_REFERENCE_CHIRP_RATE_RAD_S = 191, /* f32, rad/s */
    CLUTCH_KEY_REFERENCE_CHIRP_AMPLITUDE_RAD = 192, /* f32, rad */
    CLUTCH_KEY_REFERENCE_CHIRP_FROM_HZ = 193, /* f32, Hz */
    CLUTCH_KEY_REFERENCE_CHIRP_TO_HZ = 194, /* f32, Hz */
    CLUTCH_KEY_REFERENCE_CHIRP_DURATION_S = 195, /* f32, s */
    CLUTCH_KEY_REFERENCE_CHIRP_PHASE_TURNS = 196, /* f32, turns */
    CLUTCH_KEY_REFERENCE_TABLE_POINTS = 197, /* points, s, rad */
    CLUTCH_KEY_REFERENCE_TABLE_INTERPOLATION = 198, /* linear/cubic */
};

/* Values of settings that are choices. */
enum {
    CLUTCH_MODEL_ACTUATOR_BRAKE = 0,
    CLUTCH_MODEL_ACTUATOR_GEOMETRY = 1,
    CLUTCH_MODEL_ACTUATOR_MOTOR = 2,
    CLUTCH_MODEL_ACTUATOR_BOTH = 3,
    CLUTCH_MODEL_FRICTION_STRIBECK = 0,
    CLUTCH_MODEL_FRICTION_COULOMB = 1,
    CLUTCH_MODEL_FRICTION_LUGRE = 2,
    CLUTCH_MODEL_FRICTION_DAHL = 3,
    CLUTCH_MODEL_FRICTION_ELASTO_PLASTIC = 4,
    CLUTCH_MODEL_FRICTION_MAXWELL = 5,
    CLUTCH_LAW_PD = 0,
    CLUTCH_LAW_CTC = 1,
    CLUTCH_LAW_SMC = 2,
    CLUTCH_LAW_SMC_SIGN = 3,
    CLUTCH_LAW_PID = 4,
    CLUTCH_LAW_SUPER_TWISTING = 5,
    CLUTCH_LAW_SMC_INTEGRAL = 6,
    CLUTCH_LAW_DOB = 7,
    CLUTCH_LAW_GLIDE = 8,
    CLUTCH_LAW_VOLTAGE = 9,
    CLUTCH_LAW_HOLD = 10,
    CLUTCH_SAFETY_ON_FAULT_HOLD = 0,
    CLUTCH_SAFETY_ON_FAULT_RAMP = 1,
    CLUTCH_SAFETY_ON_FAULT_RELEASE = 2,
    CLUTCH_SAFETY_ON_FAULT_HOLD_THEN_RELEASE = 3,
    CLUTCH_BOUNDS_ACTUATOR_BRAKE = 0,
    CLUTCH_BOUNDS_ACTUATOR_MOTOR = 1,
    CLUTCH_BOUNDS_ACTUATOR_BOTH = 2,
    CLUTCH_REFERENCE_HOLD = 0,
    CLUTCH_REFERENCE_RAMP = 1,
    CLUTCH_REFERENCE_TRAPEZOID = 2,
    CLUTCH_REFERENCE_JERK_LIMITED = 3,
    CLUTCH_REFERENCE_MINIMUM_JERK = 4,
    CLUTCH_REFERENCE_SINE = 5,
    CLUTCH_REFERENCE_CHIRP = 6,
    CLUTCH_REFERENCE_TABLE = 7,
    CLUTCH_REFERENCE_TABLE_INTERPOLATION_LINEAR = 0,
    CLUTCH_REFERENCE_TABLE_INTERPOLATION_CUBIC = 1,
};


/**
 * The kind of a misfit: none.
 */
#define CLUTCH_MISFIT_NONE 0

/**
 * A setting that is not in the list.
 */
#define CLUTCH_MISFIT_MISSING 1

/**
 * A choice that is not known, or a number that the setting's type does not hold.
 */
#define CLUTCH_MISFIT_UNKNOWN 2

/**
 * A number out of range.
 */
#define CLUTCH_MISFIT_UNFIT 3

/**
 * Keys that do not ascend: two of one key, or a list out of order.
 */
#define CLUTCH_MISFIT_ORDER 4

/**
 * The most points that a table may have.
 */
#define CLUTCH_MAX_KNOTS 256

/**
 * The most terms that a law has.
 */
#define CLUTCH_MAX_TERMS 8

/**
 * Holds at once.
 */
#define CLUTCH_SAFE_HOLD 0

/**
 * Goes to holding at a rate.
 */
#define CLUTCH_SAFE_RAMP 1

/**
 * Lets go at once.
 */
#define CLUTCH_SAFE_RELEASE 2

/**
 * Holds, then lets go.
 */
#define CLUTCH_SAFE_HOLD_THEN_RELEASE 3

/**
 * The converter's side is ready and its output as it was.
 */
#define CLUTCH_BOARD_READY 0

/**
 * It takes codes.
 */
#define CLUTCH_BOARD_DRIVING 1

/**
 * It is in its safe state, or as it was at power-up.
 */
#define CLUTCH_BOARD_SAFE 2

/**
 * The outcome of a call.
 */
typedef enum {
  /**
   * Done.
   */
  CLUTCH_OK = 0,
  /**
   * A pointer is null, or not aligned for what it points to. Nothing has been done.
   */
  CLUTCH_BAD_POINTER = 1,
  /**
   * The object has not been built, or its memory was overwritten. Nothing has been done.
   */
  CLUTCH_NOT_BUILT = 2,
  /**
   * The settings make no run; `clutch_misfit` says why. Nothing has been built.
   */
  CLUTCH_MISFIT = 3,
  /**
   * Not in this state. Nothing has been done.
   */
  CLUTCH_WRONG_STATE = 4,
} clutch_result;

/**
 * A number of a run, under its key. `clutch scenario header FILE` prints those of a scenario, in order of their keys.
 */
typedef struct {
  /**
   * One of `CLUTCH_KEY_*`.
   */
  uint16_t key;
  /**
   * A whole number, a switch (0 or 1), the place of a choice from 0, or the bits of a single-precision number in SI units.
   */
  uint64_t value;
} clutch_setting;

/**
 * Memory of a path.
 */
typedef struct {
  uint64_t opaque[64];
} clutch_path;

/**
 * A point of a path that is a table.
 */
typedef struct {
  /**
   * Time since the start, us.
   */
  uint64_t time_us;
  /**
   * Position, 2^-16 counts.
   */
  int64_t position_x65536;
} clutch_knot;

/**
 * A run: its settings, in order of their keys, and the points of its path if that is a table.
 */
typedef struct {
  /**
   * Its settings.
   */
  const clutch_setting *settings;
  /**
   * Number of its settings.
   */
  size_t settings_count;
  /**
   * Points of its path; null if there are none.
   */
  const clutch_knot *knots;
  /**
   * Number of these points.
   */
  size_t knots_count;
} clutch_run;

/**
 * The reason why settings make no run.
 */
typedef struct {
  /**
   * One of `CLUTCH_MISFIT_*`.
   */
  uint8_t kind;
  /**
   * The number, from 1, of the relation with other settings that does not hold; 0 for the number's own range.
   */
  uint8_t relation;
  /**
   * The key of the setting; from 4096 on that of a number of a table's points, two each; 65535 if it is no setting.
   */
  uint16_t key;
  /**
   * Its value, SI; 0 for a setting that is missing or unknown.
   */
  float value;
} clutch_misfit;

/**
 * The target of a shaft.
 */
typedef struct {
  /**
   * Position, 2^-16 counts.
   */
  int64_t position_x65536;
  /**
   * Velocity, rad/s.
   */
  float velocity;
  /**
   * Acceleration, rad/s^2.
   */
  float acceleration;
} clutch_target;

/**
 * Memory of a law.
 */
typedef struct {
  uint64_t opaque[160];
} clutch_law;

/**
 * The input of a law in each period.
 */
typedef struct {
  /**
   * Target minus position, rad.
   */
  float error;
  /**
   * Its rate, rad/s.
   */
  float error_rate;
  /**
   * Velocity of the target, rad/s.
   */
  float target_velocity;
  /**
   * Acceleration of the target, rad/s^2.
   */
  float target_acceleration;
} clutch_tick;

/**
 * The answer of a law.
 */
typedef struct {
  /**
   * Voltage within the limits, V.
   */
  float voltage;
  /**
   * The limit that decided it: 0 none, the law did, 1 the lowest voltage, 2 the highest, 3 an invalid demand.
   */
  uint8_t limit;
  /**
   * Number of its terms.
   */
  uint8_t terms_count;
  /**
   * Its terms, for a log.
   */
  float terms[CLUTCH_MAX_TERMS];
} clutch_command;

/**
 * Memory of a servo.
 */
typedef struct {
  uint64_t opaque[224];
} clutch_servo;

/**
 * The output of a period.
 */
typedef struct {
  /**
   * The law's input.
   */
  clutch_tick tick;
  /**
   * The law's answer.
   */
  clutch_command command;
  /**
   * Voltage that the code stands for, V.
   */
  float voltage;
  /**
   * Code for the converter.
   */
  uint16_t code;
} clutch_output;

/**
 * Memory of a detector of stick-slip.
 */
typedef struct {
  uint64_t opaque[16];
} clutch_stick_slip;

/**
 * Sticks that the encoder has shown so far.
 */
typedef struct {
  /**
   * True while the shaft seems to stick.
   */
  bool stuck;
  /**
   * Largest step after a stick, counts.
   */
  uint32_t stair;
  /**
   * Stick-slip cycles.
   */
  uint64_t cycles;
  /**
   * Ticks stuck.
   */
  uint64_t stuck_ticks;
} clutch_sticks;

/**
 * Memory of a safe state under way.
 */
typedef struct {
  uint64_t opaque[4];
} clutch_safe_run;

/**
 * A safe state in the converter's codes. `clutch_axis_safe` gives that of an axis.
 */
typedef struct {
  /**
   * One of `CLUTCH_SAFE_*`.
   */
  uint8_t kind;
  /**
   * Code that holds.
   */
  uint16_t hold;
  /**
   * Code that lets go.
   */
  uint16_t release;
  /**
   * Step of a ramp, 2^-16 codes per period.
   */
  uint32_t ramp_step;
  /**
   * Periods of holding before letting go.
   */
  uint32_t hold_periods;
} clutch_safe_codes;

/**
 * Memory of an axis.
 */
typedef struct {
  uint64_t opaque[384];
} clutch_axis;

/**
 * A sample of the encoder. Fill it with zeros, then set what you know.
 */
typedef struct {
  /**
   * Running number of the periods; wraps. A number left out is a lost sample.
   */
  uint16_t sequence;
  /**
   * The state of the converter's side, one of `CLUTCH_BOARD_*`: `CLUTCH_BOARD_DRIVING` while it takes codes.
   */
  uint8_t board;
  /**
   * Not 0: there is no encoder.
   */
  uint8_t encoder_fault;
  /**
   * Not 0: the converter does not do what it is told.
   */
  uint8_t converter_fault;
  /**
   * Not 0: the code before came too late and was refused.
   */
  uint8_t command_late;
  /**
   * Not 0: a newer sample is there already, and this one is not to be answered.
   */
  uint8_t superseded;
  /**
   * Time of the sample, us; wraps.
   */
  uint32_t time_us;
  /**
   * Counts of the encoder; wrap.
   */
  int32_t counts;
  /**
   * Time that the answer to the sample before took, us.
   */
  uint32_t lateness_us;
} clutch_sample;

/**
 * The outcome of a sample.
 */
typedef struct {
  /**
   * Period of the run, from 0 at the first answer.
   */
  uint64_t tick;
  /**
   * The code that the converter has or is to have: an answer of the law, or the safe state's. Write it if `answered` or
   * if control has ended.
   */
  uint16_t code;
  /**
   * 1 if the law has answered this sample.
   */
  uint8_t answered;
  /**
   * The fate of the sample, one of `CLUTCH_ARRIVAL_*`.
   */
  uint8_t arrival;
  /**
   * The state before, one of `CLUTCH_STATE_*`.
   */
  uint8_t from;
  /**
   * The state after.
   */
  uint8_t state;
  /**
   * The cause of the end of control, one of `CLUTCH_CAUSE_*`.
   */
  uint8_t cause;
  /**
   * 1 if the law was asked: `target` and `output` hold.
   */
  uint8_t asked;
  /**
   * The quantity that the check saw which ended control, in its unit: events, counts, us, rad or V.
   */
  float value;
  /**
   * The target, with the start of the run added.
   */
  clutch_target target;
  /**
   * The servo's output.
   */
  clutch_output output;
} clutch_cycle;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The hash of all keys with their types and units: equal to `CLUTCH_SETTINGS_HASH` of the header with which a list of settings
 * was compiled, or the list means something else to this library.
 */
uint64_t clutch_settings_hash(void);

/**
 * Changes a real number of a list, SI. `CLUTCH_WRONG_STATE` if the list does not have the key.
 */
clutch_result clutch_settings_real(clutch_setting *settings, size_t count, uint16_t key, float value);

/**
 * Changes a whole number, a switch or a choice of a list. A choice changes which other keys are needed.
 * `CLUTCH_WRONG_STATE` if the list does not have the key.
 */
clutch_result clutch_settings_number(clutch_setting *settings, size_t count, uint16_t key, uint64_t value);

/**
 * Builds the path of a run. The points of a table are borrowed: they stay where they are.
 */
clutch_result clutch_path_build(clutch_path *path, const clutch_run *run, clutch_misfit *misfit);

/**
 * The target at a tick. The path begins within the count 0: add the counts of your start, times 65536, to its position.
 */
clutch_result clutch_path_at(clutch_path *path, uint64_t tick, clutch_target *target);

/**
 * Builds the law of a run, at rest.
 */
clutch_result clutch_law_build(clutch_law *law, const clutch_run *run, clutch_misfit *misfit);

/**
 * Starts it while the converter is at `applied` volts.
 */
clutch_result clutch_law_start(clutch_law *law, const clutch_tick *tick, float applied);

/**
 * One period. The law `glide` learns from the encoder's edges, which only a servo shows it: by itself it answers with its
 * belief.
 */
clutch_result clutch_law_update(clutch_law *law,
                                const clutch_tick *tick,
                                clutch_command *command);

/**
 * Builds the servo of a run.
 */
clutch_result clutch_servo_build(clutch_servo *servo, const clutch_run *run, clutch_misfit *misfit);

/**
 * Starts it at `counts`, with `applied` volts at the converter and a shaft that moves with the target.
 */
clutch_result clutch_servo_start(clutch_servo *servo, int32_t counts, const clutch_target *target, float applied);

/**
 * One period. `CLUTCH_WRONG_STATE` before the start.
 */
clutch_result clutch_servo_tick(clutch_servo *servo, int32_t counts, const clutch_target *target, clutch_output *out);

/**
 * Builds a detector for the encoder and the period of a run.
 */
clutch_result clutch_stick_slip_build(clutch_stick_slip *detector, const clutch_run *run, clutch_misfit *misfit);

/**
 * One period: the counts, and the velocity of the target (rad/s).
 */
clutch_result clutch_stick_slip_update(clutch_stick_slip *detector,
                                       int32_t counts,
                                       float target_velocity,
                                       clutch_sticks *sticks);

/**
 * Begins at the code that the converter has now.
 */
clutch_result clutch_safe_begin(clutch_safe_run *run, uint16_t present);

/**
 * The code of the next period; the first one is the safe state's own already.
 */
clutch_result clutch_safe_next(clutch_safe_run *run, const clutch_safe_codes *codes, uint16_t *code);

/**
 * Builds the axis of a run, without consent to drive it. The points of a table are borrowed: they stay where they are.
 */
clutch_result clutch_axis_build(clutch_axis *axis, const clutch_run *run, clutch_misfit *misfit);

/**
 * Consent: the next sample starts the law. `present` is the code that the converter has now. `CLUTCH_WRONG_STATE` if the axis
 * is not ready: after an end it wants `clutch_axis_acknowledge` first.
 */
clutch_result clutch_axis_consent(clutch_axis *axis,
                                  uint16_t present);

/**
 * One period: a sample in, what to do out. The law answers the run's last tick, too; the axis has ended then, as if stopped, and
 * `clutch_axis_state` and the next sample say so.
 */
clutch_result clutch_axis_sample(clutch_axis *axis,
                                 const clutch_sample *sample,
                                 clutch_cycle *cycle);

/**
 * A period without a sample, once each: `cycles` periods, this one among them, since the last sample came. The safe
 * state takes its next step where control has ended. `clutch_axis_state` has the code to write.
 */
clutch_result clutch_axis_silence(clutch_axis *axis, uint32_t cycles);

/**
 * An operator's stop: the safe state, without a fault. Its steps come with the samples, or with `clutch_axis_silence`.
 */
clutch_result clutch_axis_stop(clutch_axis *axis);

/**
 * Consent to leave the safe state: the axis is ready, everything is forgotten. The converter keeps its code, that of a ramp under
 * way, too.
 * `CLUTCH_WRONG_STATE` if control has not ended.
 */
clutch_result clutch_axis_acknowledge(clutch_axis *axis);

/**
 * The state, one of `CLUTCH_STATE_*`, the cause of the end of control, one of `CLUTCH_CAUSE_*`, and the code that the
 * converter has or is to have. A pointer that is null is left out.
 */
clutch_result clutch_axis_state(clutch_axis *axis, uint8_t *state, uint8_t *cause, uint16_t *code);

/**
 * The voltage that a code stands for, V: for a converter of another kind than the settings'.
 */
clutch_result clutch_axis_volts(clutch_axis *axis, uint16_t code, float *volts);

/**
 * The safe state of the axis, for a watchdog.
 */
clutch_result clutch_axis_safe(clutch_axis *axis, clutch_safe_codes *codes);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* CLUTCH_H */
