//! Curves of a likelihood over a parameter, and the intervals that they give.

/// The curve of a likelihood over a parameter.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    pub(crate) points: Vec<(f64, f64)>,
}

impl Profile {
    pub(crate) fn best(&self) -> (f64, f64) {
        self.points.iter().copied().fold((f64::NAN, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a })
    }

    /// Mean under the curve, and the values at which it has fallen by `fall`; none at an end that it does not fall to. A peak
    /// below the best one lies between these ends, one above it does not: it sets off a whole step of the voltage earlier, and
    /// any curve has another one step on.
    pub(crate) fn estimate(&self, fall: f64) -> (f64, Option<f64>, Option<f64>) {
        let (_, top) = self.best();
        let level = top - fall;
        let at = self.points.iter().position(|p| p.1 == top).unwrap_or(0);
        let first = self.points.iter().position(|p| p.1 >= level).unwrap_or(0);
        let last = (at..self.points.len()).take_while(|&i| self.points[i].1 >= level).last().unwrap_or(at);
        let weight = |log: f64| libm::exp(log - top);
        let mut sums = (0.0, 0.0);
        let end =
            (last + 1..self.points.len()).take_while(|&i| self.points[i].1 <= self.points[i - 1].1).last();
        for w in self.points[..=end.unwrap_or(last)].windows(2) {
            let (middle, mean) = (0.5 * (w[0].0 + w[1].0), 0.5 * (weight(w[0].1) + weight(w[1].1)));
            sums = (sums.0 + mean * (w[1].0 - w[0].0), sums.1 + mean * middle * (w[1].0 - w[0].0));
        }
        let crossing = |a: (f64, f64), b: (f64, f64)| a.0 + (b.0 - a.0) * (level - a.1) / (b.1 - a.1);
        let low = (first > 0).then(|| crossing(self.points[first - 1], self.points[first]));
        let high = self.points.get(last + 1).map(|&next| crossing(self.points[last], next));
        // Of a curve that falls off gently on one side the mean may lie beyond that end.
        let mean = (sums.1 / sums.0).max(low.unwrap_or(f64::NEG_INFINITY)).min(high.unwrap_or(f64::INFINITY));
        (mean, low, high)
    }
}

/// Numbers from one to another, evenly in the logarithm.
pub(crate) fn spaced(low: f64, high: f64, n: usize) -> impl Iterator<Item = f64> + Clone {
    (0..n).map(move |i| low * libm::pow(high / low, i as f64 / (n - 1) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(logs: &[f64]) -> Profile {
        Profile { points: logs.iter().enumerate().map(|(i, log)| (i as f64, *log)).collect() }
    }

    #[test]
    fn an_interval_ends_above_its_best_peak_and_begins_at_the_lowest_value_that_is_as_likely() {
        let (value, low, high) = profile(&[-9.0, -4.0, 0.0, -4.0, -9.0, -1.0, -9.0]).estimate(2.0);
        assert_eq!((low, high), (Some(1.5), Some(2.5)));
        assert!((value - 2.0).abs() < 0.01, "{value}");
        let (value, low, high) = profile(&[-9.0, -1.0, -9.0, 0.0, -9.0]).estimate(2.0);
        assert_eq!((low, high), (Some(0.875), Some(3.0 + 2.0 / 9.0)));
        assert!(value > 1.0 && value < 3.0, "{value}");
        // An end that the curve does not fall to is open.
        assert_eq!(profile(&[-1.0, 0.0, -9.0]).estimate(2.0).1, None);
        assert_eq!(profile(&[-9.0, 0.0, -1.0]).estimate(2.0).2, None);
    }
}
