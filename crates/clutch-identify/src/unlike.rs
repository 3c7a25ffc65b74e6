//! Rigs that are unlike the model, and the experiments that show in which way.
//!
//! | the rig | shows in |
//! |---|---|
//! | a torque that varies | releases, each of which has another T/J |
//! | bristles whose stiffness does not scale with the brake's force | rides: a voltage takes effect over a way, and so the later the slower the shaft |
//! | a disc that is not square to its shaft | rides: friction differs from section to section of the turn |

use crate::recording::Recording;
use crate::release::{Apart, Fall, Unexplained};
use crate::ride::{Ride, Told, rides, section_rest, shaft};

/// Ways over which a voltage may take effect, counts.
const WAYS: [f64; 7] = [0.1, 0.2, 0.4, 0.7, 1.0, 2.0, 4.0];
/// Fastest ride that shows it, rad/s: a faster one leaves more than such a way in a period.
const SLOW: f64 = 0.5;
/// Logarithm of the density that a way has to add. Sound discs under fine encoders add up to 12, for thousands of samples
/// make much of the filter's own error; bristles add hundreds.
const CLEAR: f64 = 15.0;
/// Times that what a ripple leaves in the mean of a section may be exceeded, and what it is at least, as a share.
const EXCEEDED: f64 = 4.0;
const LEAST_RUNOUT: f64 = 5e-3;

/// The words on a torque that varies.
const VARIES: &str = "a torque that varies, as a hand's, and nothing is determined under it; a weight as the drive does, and releases before \
     and behind the rides that agree show that the torque is steady";

/// The reason why releases determine no T/J.
#[must_use]
pub fn fall_refused(at: &Unexplained) -> String {
    match at.apart {
        Some(Apart::Pulls(low, high)) => format!(
            "a release needs a T/J of at least {high:.2} rad/s², another allows at most {low:.2}: {VARIES}"
        ),
        Some(Apart::Within(number)) => {
            format!("{number} releases are no free fall under a steady torque: {VARIES}")
        }
        Some(Apart::Delays(low, high)) => format!(
            "the releases have delays between {:.1} and {:.1} ms, which no one lag explains: one of more than three periods, or a torque \
             that varies; an actuator with a shorter lag, under a steady weight, shows T/J",
            1e3 * low,
            1e3 * high
        ),
        None => format!(
            "{}: no free fall with any delay explains the counts up to tick {}: a count that was lost, a \
             shaft that was not at rest before or not let go at once, or a torque that varies; releases from a longer rest show which",
            at.name, at.tick
        ),
    }
}

/// The reason why friction is not determined, if in stretches of motion, uneven ones among them, a voltage takes effect over a way;
/// `told`: friction, found from a ride.
#[must_use]
pub fn bristles(stretches: &[Ride<'_>], told: &Told, fall: &Fall) -> Option<String> {
    // The delay may be wrong within its interval, and is another way for a voltage to be late.
    let e = fall.delay.less(fall.lags());
    let delays = [e.low, 0.5 * (e.low + e.value), e.value, 0.5 * (e.value + e.high), e.high];
    let density = |counts: f64| -> f64 {
        let with = |delay: f64| -> f64 {
            let slow = stretches.iter().filter(|ride| ride.rate < SLOW);
            slow.map(|ride| {
                let way = counts * ride.recording.radians_per_count();
                let friction = 1.0 / told.hold.0;
                let shaft = shaft(
                    ride.recording,
                    fall.pull.value,
                    0.0,
                    told.ripple.0 * friction,
                    told.waves.per_turn,
                );
                ride.density(&shaft, delay, friction, way)
            })
            .sum()
        };
        delays.into_iter().map(with).fold(f64::NEG_INFINITY, f64::max)
    };
    let at_once = density(0.0);
    let best = |best: (f64, f64), next: (f64, f64)| if next.1 > best.1 { next } else { best };
    let (counts, by_way) = WAYS.into_iter().map(|n| (n, density(n))).fold((0.0, at_once), best);
    if by_way - at_once <= CLEAR {
        return None;
    }
    Some(format!(
        "a voltage takes effect over some {counts} counts of the way, and so the later the slower the shaft: bristles that do not scale \
         with the brake's force, or play of the pad; a pad that is held more stiffly shows friction, and a ride at 5 °/s then shows \
         no such way"
    ))
}

/// Rates of a ride on which glide sticks on no shaft of its model with an encoder that is fine enough, rad/s, and the least length and way
/// of one that says something.
const SURE: std::ops::RangeInclusive<f64> = 0.05..=0.2;
const LONG_S: f64 = 3.0;
const EDGES: usize = 200;

/// The reason why friction is not determined, if a ride on which a law slides wherever friction is of its model shows no even motion.
#[must_use]
pub fn sticks(recordings: &[Recording]) -> Option<String> {
    let stuck = |r: &&Recording| {
        let moves = r.ticks.windows(2).filter(|w| w[1].counts > w[0].counts).count();
        r.glides_at.is_some_and(|rate| SURE.contains(&rate))
            && r.ticks.len() as f64 * r.period > LONG_S
            && moves > EDGES
            && rides(r).is_empty()
    };
    recordings.iter().find(stuck).map(|r| {
        format!(
            "{}: the shaft sticks at {:.0} °/s, where a law slides on any shaft of the model: a voltage may take effect over a way, by bristles \
             that do not scale with the brake's force, or play of the pad, and faster rides then show another friction; a pad that is held more \
             stiffly, or a finer encoder, shows friction",
            r.name,
            r.glides_at.unwrap_or_default().to_degrees()
        )
    })
}

/// Root mean square by which friction differs from section to section of the turn, as a share, if that is more than a ripple's
/// rest.
#[must_use]
pub fn runout(told: &[Told]) -> Option<f64> {
    let most = told.iter().map(|ride| {
        let n = ride.sections.len() as f64;
        let mean = ride.sections.iter().sum::<f64>() / n.max(1.0);
        let square = ride.sections.iter().map(|h| (h / mean - 1.0) * (h / mean - 1.0)).sum::<f64>();
        (square / n.max(1.0)).sqrt()
    });
    let most = most.fold(0.0, f64::max);
    let slow = told.first()?;
    (most > (EXCEEDED * section_rest(slow.ripple.0, slow.waves.per_turn)).max(LEAST_RUNOUT)).then_some(most)
}

/// The share that a run-out leaves in the mean over a way, rad, for one wave in a turn and for two.
#[must_use]
pub fn left_of_runout(share: f64, way: f64) -> f64 {
    let half = [0.5 * way, way];
    let left = half.map(|x| if x > 0.0 { (libm::sin(x) / x).abs() } else { 1.0 });
    share * left[0].max(left[1])
}
