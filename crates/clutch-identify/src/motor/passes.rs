//! Passes at even rates, both ways, and the curve of friction through them.

use crate::recording::Recording;
use crate::ride::{Place, Told, left_over, rides, waves};
use nalgebra::{SMatrix, SVector};

/// Share of the longest way that a pass has to go to show friction along the way.
const LONG: f64 = 0.8;
/// Share of a stretch that a map has to cover, and the part of the ripple's rest that is left where it does.
const COVERED: f64 = 0.7;
const MAPPED: f64 = 0.7;
/// Slowest rate at which friction along the way is not Stribeck's, rad/s.
pub(crate) const FINEST: f64 = 0.03;
/// Time over which a velocity is taken, s: in less a sample is a large part of it.
const WINDOW_S: f64 = 0.01;
/// Deviation of friction at rest where no break-away determines it, as a share.
const UNKNOWN: f64 = 1.0;
/// Share of its rate that an even pass has everywhere, below a rate, rad/s, above which Stribeck's fall is done.
const EVEN: f64 = 0.5;
const SLOW: f64 = 0.06;
/// Share by which rates are the same.
const ALIKE: f64 = 0.1;
/// Rates that determine a slope lie this far apart, rad/s.
const RATES_APART: f64 = 0.15;

/// An even pass one way.
#[derive(Clone, Debug)]
pub struct Pass {
    /// 0 forwards, 1 backwards.
    pub way: usize,
    /// Friction that it shows, the axis turned so that it goes forwards.
    pub told: Told,
    /// First and last angle, rad.
    stretch: (f64, f64),
    /// Velocities along the way, rad/s, one for each count.
    velocities: Vec<f64>,
}

/// The passes of both views, for K/J (rad/s² per volt) and delay (s) as known.
#[must_use]
pub fn passes(views: &[Vec<Recording>; 2], pull: f64, delay: f64) -> Vec<Pass> {
    let mut found = Vec::new();
    let rides = views.each_ref().map(|view| view.iter().flat_map(rides).collect::<Vec<_>>());
    // Both ways go over the same places.
    let shown: Vec<_> = rides.iter().flatten().filter(|ride| ride.rate >= FINEST).collect();
    let waves = waves(&shown, pull, delay);
    for (way, mut rides) in rides.into_iter().enumerate() {
        // The longest way first, of these the slowest: it shows the ripple.
        let length = |r: &crate::ride::Ride<'_>| {
            r.recording.ticks[r.ticks.1].counts - r.recording.ticks[r.ticks.0].counts
        };
        let longest = rides.iter().map(length).max().unwrap_or(0) as f64;
        let short = |r: &crate::ride::Ride<'_>| (length(r) as f64) < LONG * longest;
        rides.sort_by(|a, b| short(a).cmp(&short(b)).then(a.rate.total_cmp(&b.rate)));
        let mut share = None;
        for ride in rides {
            let told = ride.told(pull, delay, waves, share);
            share = share.or(Some(told.ripple.0));
            let r = ride.recording;
            let angle = |i: usize| r.ticks[i].counts as f64 * r.radians_per_count();
            let stretch = (angle(ride.ticks.0), angle(ride.ticks.1));
            found.push(Pass { way, told, stretch, velocities: velocities(r, ride.ticks) });
        }
    }
    found
}

/// One for each edge: over as many edges as take some time.
fn velocities(r: &Recording, (begin, end): (usize, usize)) -> Vec<f64> {
    let edges: Vec<usize> =
        (begin + 1..=end).filter(|&i| r.ticks[i].counts > r.ticks[i - 1].counts).collect();
    let n =
        (edges.len() as f64 * WINDOW_S / ((end - begin).max(1) as f64 * r.period)).ceil().max(1.0) as usize;
    edges
        .windows(n + 1)
        .map(|w| {
            let way = (r.ticks[w[n]].counts - r.ticks[w[0]].counts) as f64;
            way * r.radians_per_count() / ((w[n] - w[0]) as f64 * r.period)
        })
        .collect()
}

/// The pass that shows friction along the way: the first one, as they are sorted.
#[must_use]
pub fn reference(passes: &[Pass], way: usize) -> Option<&Pass> {
    passes.iter().find(|p| p.way == way)
}

/// The place-by-place friction over its mean that the slowest pass over a place shows, which sees it best; the mean is that of
/// the reference.
#[must_use]
pub fn finest(passes: &[Pass], way: usize) -> Vec<Place> {
    let Some(reference) = reference(passes, way) else { return Vec::new() };
    let whole = &reference.told.map;
    let slow = passes
        .iter()
        .filter(|p| p.way == way && p.told.rate >= FINEST)
        .min_by(|a, b| a.told.rate.total_cmp(&b.told.rate));
    let Some(slow) = slow.filter(|slow| slow.told.rate < reference.told.rate) else { return whole.clone() };
    // Of a wave as long as its way a pass does not know what is mean: the reference does.
    let (Some(here), Some(own)) = (mean(whole, slow.stretch), mean(&slow.told.map, slow.stretch)) else {
        return whole.clone();
    };
    let factor = here / own;
    slow.told.map.iter().map(|p| Place { factor: p.factor * factor, ..*p }).collect()
}

/// Mean of a map over a stretch; none where it covers too little of that.
fn mean(map: &[Place], stretch: (f64, f64)) -> Option<f64> {
    let here: Vec<f64> =
        map.iter().filter(|p| (stretch.0..stretch.1).contains(&p.angle)).map(|p| p.factor).collect();
    let step = map.windows(2).next().map_or(0.0, |w| w[1].angle - w[0].angle);
    let enough = here.len() as f64 * step >= COVERED * (stretch.1 - stretch.0);
    enough.then(|| here.iter().sum::<f64>() / here.len() as f64)
}

impl Pass {
    /// Share of friction by which its stretch, whose ripple has no whole waves, may be off the mean of all places.
    #[must_use]
    pub fn left_over(&self) -> f64 {
        left_over(self.told.ripple.0, self.told.waves.per_turn * (self.stretch.1 - self.stretch.0))
    }

    /// Friction, V, over what it is on this stretch by the map of another pass, and its deviation.
    pub(crate) fn friction(&self, map: &[Place]) -> (f64, f64) {
        let (volts, deviation) = self.told.hold;
        match mean(map, self.stretch) {
            // Where it is slow, the way that friction takes to fall is a part of what the map does not know.
            Some(factor) if self.told.rate < SLOW => (volts / factor, deviation),
            Some(factor) => (volts / factor, MAPPED * deviation),
            None => (volts, deviation),
        }
    }

    /// `false` if it is slow, and nearly stops somewhere: friction there is of a velocity that edges do not show.
    pub(crate) fn is_even(&self) -> bool {
        if self.told.rate > SLOW {
            return true;
        }
        let least = self.velocities.iter().copied().fold(f64::INFINITY, f64::min);
        least >= EVEN * self.told.rate
    }

    /// Share of Stribeck's fall that is not done, in the mean over the way.
    fn left(&self, velocity: f64) -> f64 {
        if velocity <= 0.0 || self.velocities.is_empty() {
            return 0.0;
        }
        self.velocities.iter().map(|v| libm::exp(-v / velocity)).sum::<f64>() / self.velocities.len() as f64
    }

    /// Factors of a curve's numbers in its friction, with a Stribeck velocity, rad/s.
    pub(crate) fn row(&self, velocity: f64) -> Numbers {
        let left = self.left(velocity);
        let mut row = Numbers::zeros();
        row[self.way] = 1.0 - left;
        row[2 + self.way] = left;
        row[4] = self.told.rate;
        row
    }
}

/// Friction in motion forwards and backwards, at rest forwards and backwards (V), and C/K (V s/rad).
pub type Numbers = SVector<f64, 5>;

/// A curve of friction.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Its numbers.
    pub value: Numbers,
    /// Their covariance.
    pub spread: SMatrix<f64, 5, 5>,
    /// Sum of squared deviations, each over its own.
    pub misfit: f64,
    /// Rows beyond its numbers.
    pub freedom: f64,
}

impl Curve {
    /// The curve through passes and friction at rest, as far as that is known, with a Stribeck velocity, rad/s; none without
    /// passes both ways at rates that are apart.
    #[must_use]
    pub fn through(passes: &[Pass], rest: [Option<(f64, f64)>; 2], velocity: f64) -> Option<Curve> {
        let mut rows: Vec<(Numbers, f64, f64)> = Vec::new();
        for pass in passes.iter().filter(|p| p.is_even()) {
            let map = &reference(passes, pass.way)?.told.map;
            let (volts, deviation) = pass.friction(map);
            // Passes at one rate go over the same places: together they show no more than one.
            let alike = |p: &&Pass| p.way == pass.way && (p.told.rate / pass.told.rate - 1.0).abs() < ALIKE;
            let deviation = deviation * (passes.iter().filter(alike).count() as f64).sqrt();
            rows.push((pass.row(velocity), volts, deviation));
        }
        for way in [0, 1] {
            let sliding = reference(passes, way)?.told.hold.0;
            let mut row = Numbers::zeros();
            row[2 + way] = 1.0;
            let (volts, deviation) = rest[way].unwrap_or((sliding, UNKNOWN * sliding));
            rows.push((row, volts, deviation));
        }
        let rates = passes.iter().filter(|p| p.is_even()).map(|p| p.told.rate);
        if rates.clone().fold(0.0, f64::max) - rates.fold(f64::INFINITY, f64::min) < RATES_APART {
            return None;
        }
        let (mut normal, mut right) = (SMatrix::<f64, 5, 5>::zeros(), Numbers::zeros());
        for (row, volts, deviation) in &rows {
            let weight = 1.0 / (deviation * deviation);
            normal += row * row.transpose() * weight;
            right += row * (weight * volts);
        }
        let mut spread = normal.try_inverse()?;
        let value = spread * right;
        let off = rows.iter().map(|(row, volts, deviation)| (volts - row.dot(&value)) / deviation);
        let misfit: f64 = off.map(|x| x * x).sum();
        // Passes that scatter more than they say count less.
        let freedom = rows.len().saturating_sub(6).max(1) as f64;
        spread *= (misfit / freedom).max(1.0);
        Some(Curve { value, spread, misfit, freedom })
    }

    /// Standard deviation of a number.
    #[must_use]
    pub fn deviation(&self, k: usize) -> f64 {
        self.spread[(k, k)].max(0.0).sqrt()
    }
}

/// Friction along the way over its mean: of both ways, the mean where both show it.
#[must_use]
pub fn map(passes: &[Pass]) -> Vec<Place> {
    let forwards = reference(passes, 0).map(|p| p.told.map.clone()).unwrap_or_default();
    let backwards = reference(passes, 1).map(|p| p.told.map.as_slice()).unwrap_or_default();
    let mut back: Vec<Place> = backwards.iter().rev().map(|p| Place { angle: -p.angle, ..*p }).collect();
    let step = forwards.windows(2).next().map_or(0.0, |w| w[1].angle - w[0].angle);
    let mut all = Vec::new();
    let mut ahead = forwards.into_iter().peekable();
    for place in back.drain(..) {
        while let Some(before) = ahead.next_if(|p| p.angle < place.angle - 0.5 * step) {
            all.push(before);
        }
        let same = ahead.next_if(|p| p.angle < place.angle + 0.5 * step);
        let factor = same.map_or(place.factor, |p| 0.5 * (p.factor + place.factor));
        all.push(Place { factor, ..place });
    }
    all.extend(ahead);
    all
}
