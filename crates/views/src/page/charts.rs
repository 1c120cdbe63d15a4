//! Histograms as SVG: bars, numbers below, a mark where a limit lies.

use std::fmt::Write;

use crate::table::grouped;

/// How many there are of each size.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Histogram {
    /// Where the first bar begins.
    pub start: f64,
    /// Width of a bar.
    pub step: f64,
    /// How many fall into each.
    pub counts: Vec<u64>,
    /// What is counted along, with its unit.
    pub axis: String,
    /// A place to be marked, and what it is.
    pub mark: Option<(f64, String)>,
}

const WIDE: f64 = 560.0;
const HIGH: f64 = 230.0;
const LEFT: f64 = 76.0;
const BOTTOM: f64 = 44.0;
const TOP: f64 = 24.0;

impl Histogram {
    /// Bars of whole numbers, `step` of them to a bar, from 0 to the largest value or the limit.
    pub fn of_counts(values: &[u32], limit: u32, what: &str) -> Self {
        let most = values.iter().copied().max().unwrap_or(0).max(limit);
        let step = (most / 40).max(1).next_multiple_of(if most < 40 { 1 } else { 5 });
        let mut counts = vec![0; (most / step + 1) as usize];
        values.iter().for_each(|value| counts[(value / step) as usize] += 1);
        let mark = Some((f64::from(limit), format!("limit {}", grouped(u64::from(limit)))));
        Self { start: 0.0, step: f64::from(step), counts, axis: what.into(), mark }
    }

    /// Bars of metres from `-reach_m` to `reach_m`; what lies beyond is in the first and the last.
    pub fn of_metres(values_m: impl Iterator<Item = f64>, reach_m: f64, what: &str) -> Self {
        const BARS: usize = 40;
        let step = 2.0 * reach_m / BARS as f64;
        let mut counts = vec![0; BARS];
        for value in values_m {
            let bar = ((value + reach_m) / step).floor().clamp(0.0, BARS as f64 - 1.0);
            counts[bar as usize] += 1;
        }
        Self { start: -reach_m, step, counts, axis: what.into(), mark: None }
    }

    /// The picture.
    pub fn svg(&self) -> String {
        let most = self.counts.iter().copied().max().unwrap_or(0).max(1);
        let (wide, high) = (WIDE - LEFT - 8.0, HIGH - TOP - BOTTOM);
        let bar = wide / self.counts.len() as f64;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDE} {HIGH}\" width=\"{WIDE}\" height=\"{HIGH}\" role=\"img\" \
             font-family=\"sans-serif\" font-size=\"12\">"
        );
        for (index, &count) in self.counts.iter().enumerate() {
            let length = count as f64 / most as f64 * high;
            let (x, y) = (LEFT + index as f64 * bar, TOP + high - length);
            let from = self.start + index as f64 * self.step;
            let _ = write!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{length:.1}\" class=\"bars\">\
                 <title>{} to {}: {}</title></rect>",
                (bar - 1.0).max(0.5),
                number(from),
                number(from + self.step),
                grouped(count)
            );
        }
        let base = TOP + high;
        let _ = write!(svg, "<path d=\"M{LEFT} {TOP}V{base}H{}\" class=\"axis\"/>", LEFT + wide);
        for tick in self.ticks() {
            let x = LEFT + (tick - self.start) / self.step * bar;
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} {base}v5\" class=\"axis\"/>\
                 <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                base + 18.0,
                number(tick)
            );
        }
        for count in round_counts(most) {
            let y = base - count as f64 / most as f64 * high;
            let _ = write!(
                svg,
                "<path d=\"M{LEFT} {y:.1}h-4\" class=\"axis\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 7.0,
                y + 4.0,
                grouped(count)
            );
        }
        if let Some((at, text)) = &self.mark {
            let x = LEFT + (at - self.start) / self.step * bar;
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} {}V{base}\" class=\"limit\"/>\
                 <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"end\" class=\"limit\">{text}</text>",
                TOP - 4.0,
                TOP - 8.0
            );
        }
        let _ = write!(
            svg,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text></svg>",
            LEFT + wide / 2.0,
            HIGH - 6.0,
            self.axis
        );
        svg
    }

    /// Round numbers along the axis.
    fn ticks(&self) -> Vec<f64> {
        let length = self.counts.len() as f64 * self.step;
        let mut apart = 0.001;
        for power in -3..7 {
            for digit in [1.0, 2.0, 5.0] {
                let step = digit * 10_f64.powi(power);
                if apart * 10.0 < length {
                    apart = step;
                }
            }
        }
        let first = (self.start / apart).ceil() as i64;
        let last = ((self.start + length) / apart + 1e-9).floor() as i64;
        (first..=last).map(|index| index as f64 * apart).collect()
    }
}

/// Round numbers up to `most`: at least one, at most four.
fn round_counts(most: u64) -> Vec<u64> {
    let steps = (0..19).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_u64.pow(power)));
    let step = steps.into_iter().find(|step| most / step <= 4).unwrap_or(most);
    (1..=most / step).map(|index| index * step).collect()
}

/// A number without needless digits.
fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_in_one_bar() {
        let counts = Histogram::of_counts(&[0, 1, 99, 100, 107], 100, "x");
        assert_eq!((counts.step, counts.counts.iter().sum::<u64>()), (5.0, 5));
        assert_eq!((counts.counts[0], counts.counts[19], counts.counts[20], counts.counts[21]), (2, 1, 1, 1));
        let metres = Histogram::of_metres([-100.0, -0.01, 0.01, 1.99, 2.0, 50.0].into_iter(), 2.0, "m");
        assert_eq!((metres.counts[0], metres.counts[19], metres.counts[20], metres.counts[39]), (1, 1, 1, 3));
    }

    #[test]
    fn ticks_are_round_and_a_few() {
        let histogram = Histogram::of_counts(&[3; 7], 100, "x");
        assert_eq!(histogram.ticks(), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        for (most, counts) in
            [(1, &[1][..]), (7, &[2, 4, 6]), (1160, &[500, 1000]), (419_198, &[100_000, 200_000, 300_000, 400_000])]
        {
            assert_eq!(round_counts(most), counts);
        }
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(0.25), "0.25");
    }
}
