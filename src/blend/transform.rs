//! Sine transforms of sixteen lines at once.

use crate::math::ops;

/// Lines that are transformed side by side, in two groups.
pub(super) const LANES: usize = 16;

const HALF: usize = LANES / 2;

/// One value of each line. For the Fourier transform the first group is the real part and the second the imaginary
/// part of eight complex lines.
pub(super) type Lines = [[f32; HALF]; 2];

pub(super) const ZERO: Lines = [[0.0; HALF]; 2];

#[inline(always)]
fn zip(a: Lines, b: Lines, f: impl Fn(f32, f32) -> f32) -> Lines {
    std::array::from_fn(|part| std::array::from_fn(|lane| f(a[part][lane], b[part][lane])))
}

#[inline(always)]
fn add(a: Lines, b: Lines) -> Lines {
    zip(a, b, |a, b| a + b)
}

#[inline(always)]
fn sub(a: Lines, b: Lines) -> Lines {
    zip(a, b, |a, b| a - b)
}

/// `a + s b`.
#[inline(always)]
fn add_scaled(a: Lines, b: Lines, s: f32) -> Lines {
    zip(a, b, |a, b| a + s * b)
}

/// `a - i b`, lane by lane.
#[inline(always)]
fn sub_turned([re, im]: Lines, [turned_re, turned_im]: Lines) -> Lines {
    [std::array::from_fn(|k| re[k] + turned_im[k]), std::array::from_fn(|k| im[k] - turned_re[k])]
}

/// `a + i b`, lane by lane.
#[inline(always)]
fn add_turned([re, im]: Lines, [turned_re, turned_im]: Lines) -> Lines {
    [std::array::from_fn(|k| re[k] - turned_im[k]), std::array::from_fn(|k| im[k] + turned_re[k])]
}

/// The product with the complex number `c + i s`.
#[inline(always)]
fn turn([re, im]: Lines, [c, s]: [f32; 2]) -> Lines {
    [std::array::from_fn(|k| re[k] * c - im[k] * s), std::array::from_fn(|k| re[k] * s + im[k] * c)]
}

/// Sine transforms (type I) of lines of one length, and the memory that they take.
///
/// The transform of `f[1], .. f[n]` is `F[m] = Σ f[j] sin(π j m / (n + 1))`. It is its own inverse up to a factor of
/// `(n + 1) / 2`. A line is folded into one of length `n + 1` whose Fourier transform has the even values as its
/// imaginary part and the differences of odd values as its real part (Press et al., Numerical Recipes, 12.3); two
/// lines share a complex transform. It takes time in proportion to the sum of the prime factors of `n + 1`.
pub(super) struct SineTransform {
    /// `n + 1`.
    period: usize,
    /// The prime factors of the period, with fours for pairs of twos.
    factors: Vec<usize>,
    /// Cosine and sine of `-2 π k / period`.
    turns: Vec<[f32; 2]>,
    /// Sine of `π k / period`.
    sines: Vec<f32>,
    here: Vec<Lines>,
    there: Vec<Lines>,
    sums: Vec<Lines>,
    gaps: Vec<Lines>,
}

fn factors(mut rest: usize) -> Vec<usize> {
    let mut found = Vec::new();
    let mut factor = 4;
    while rest > 1 {
        if rest.is_multiple_of(factor) {
            found.push(factor);
            rest /= factor;
        } else {
            factor = match factor {
                4 => 2,
                2 => 3,
                _ if factor * factor > rest => rest,
                _ => factor + 2,
            };
        }
    }
    found
}

impl SineTransform {
    pub(super) fn new(n: usize) -> Self {
        let period = n + 1;
        let factors = factors(period);
        let most = factors.iter().copied().max().unwrap_or(1);
        let share = |k: usize, whole: usize| ops::turn(k as f64 / whole as f64);
        Self {
            period,
            turns: (0..period).map(|k| share(k, period)).map(|[c, s]| [c, -s]).collect(),
            sines: (0..period).map(|k| share(k, 2 * period)[1]).collect(),
            here: vec![ZERO; period],
            there: vec![ZERO; period],
            sums: vec![ZERO; most],
            gaps: vec![ZERO; most],
            factors,
        }
    }

    /// Transforms the lines in place.
    #[inline(always)]
    pub(super) fn apply(&mut self, lines: &mut [Lines]) {
        let period = self.period;
        let lines = &mut lines[..period - 1];
        self.here[0] = ZERO;
        for j in 1..period {
            let (low, high) = (lines[j - 1], lines[period - 1 - j]);
            let sine = self.sines[j];
            self.here[j] = zip(low, high, |low, high| sine * (low + high) + 0.5 * (low - high));
        }
        self.fourier();
        // Value `2 k + 1` is the sum of the real parts up to `k`.
        let mut odd = ZERO;
        for k in 0..period.div_ceil(2) {
            let [re, im] = self.here[k];
            let [back_re, back_im] = self.here[if k == 0 { 0 } else { period - k }];
            let half: Lines = [
                std::array::from_fn(|lane| 0.5 * (re[lane] + back_re[lane])),
                std::array::from_fn(|lane| 0.5 * (im[lane] + back_im[lane])),
            ];
            odd = if k == 0 { half.map(|part| part.map(|value| 0.5 * value)) } else { add(odd, half) };
            if k > 0 {
                lines[2 * k - 1] = [
                    std::array::from_fn(|lane| 0.5 * (back_im[lane] - im[lane])),
                    std::array::from_fn(|lane| 0.5 * (re[lane] - back_re[lane])),
                ];
            }
            if 2 * k < period - 1 {
                lines[2 * k] = odd;
            }
        }
    }

    /// The Fourier transform of what is `here` (Stockham's: no reordering, each pass from one buffer to the other).
    #[inline(always)]
    fn fourier(&mut self) {
        let (mut left, mut stride) = (self.period, 1);
        for i in 0..self.factors.len() {
            let radix = self.factors[i];
            left /= radix;
            match radix {
                4 => self.pass_of_four(left, stride),
                2 => self.pass_of_two(left, stride),
                _ => self.pass_of_odd(radix, left, stride),
            }
            stride *= radix;
            std::mem::swap(&mut self.here, &mut self.there);
        }
    }

    #[inline(always)]
    fn pass_of_two(&mut self, groups: usize, stride: usize) {
        let (low, high) = self.here.split_at(groups * stride);
        let inputs = low.chunks_exact(stride).zip(high.chunks_exact(stride));
        for (p, ((a, b), out)) in inputs.zip(self.there.chunks_exact_mut(2 * stride)).enumerate() {
            let w = self.turns[p * stride];
            let (first, second) = out.split_at_mut(stride);
            for q in 0..stride {
                first[q] = add(a[q], b[q]);
                second[q] = turn(sub(a[q], b[q]), w);
            }
        }
    }

    #[inline(always)]
    fn pass_of_four(&mut self, groups: usize, stride: usize) {
        let part = groups * stride;
        let (a, rest) = self.here.split_at(part);
        let (b, rest) = rest.split_at(part);
        let (c, d) = rest.split_at(part);
        for (p, out) in self.there.chunks_exact_mut(4 * stride).enumerate() {
            let at = p * stride;
            let [a, b, c, d] = [a, b, c, d].map(|part| &part[at..][..stride]);
            let [w1, w2, w3] = [1, 2, 3].map(|k| self.turns[k * at]);
            let (out0, rest) = out.split_at_mut(stride);
            let (out1, rest) = rest.split_at_mut(stride);
            let (out2, out3) = rest.split_at_mut(stride);
            for q in 0..stride {
                let (sum, gap) = (add(a[q], c[q]), sub(a[q], c[q]));
                let (other_sum, other_gap) = (add(b[q], d[q]), sub(b[q], d[q]));
                out0[q] = add(sum, other_sum);
                out1[q] = turn(sub_turned(gap, other_gap), w1);
                out2[q] = turn(sub(sum, other_sum), w2);
                out3[q] = turn(add_turned(gap, other_gap), w3);
            }
        }
    }

    /// An odd radix: the two halves of a sum share their products.
    #[inline(always)]
    fn pass_of_odd(&mut self, radix: usize, groups: usize, stride: usize) {
        let (part, half) = (groups * stride, radix / 2);
        let step = self.period / radix;
        for p in 0..groups {
            for q in 0..stride {
                let at = p * stride + q;
                let first = self.here[at];
                let mut total = first;
                for j in 1..=half {
                    let (a, b) = (self.here[at + j * part], self.here[at + (radix - j) * part]);
                    (self.sums[j], self.gaps[j]) = (add(a, b), sub(a, b));
                    total = add(total, self.sums[j]);
                }
                let out = p * stride * radix + q;
                self.there[out] = total;
                for k in 1..=half {
                    let (mut even, mut odd) = (first, ZERO);
                    let mut angle = 0;
                    for j in 1..=half {
                        angle += k;
                        angle -= if angle < radix { 0 } else { radix };
                        let [c, s] = self.turns[angle * step];
                        even = add_scaled(even, self.sums[j], c);
                        odd = add_scaled(odd, self.gaps[j], s);
                    }
                    let (w, back) = (self.turns[k * p * stride], self.turns[(radix - k) * p * stride]);
                    self.there[out + k * stride] = turn(add_turned(even, odd), w);
                    self.there[out + (radix - k) * stride] = turn(sub_turned(even, odd), back);
                }
            }
        }
    }
}

/// Odd factors of periods with fast transforms.
const FAST: [usize; 5] = [1, 3, 5, 9, 15];

/// The smallest period from `least` on that has a fast transform.
pub(super) fn fast_period(least: usize) -> usize {
    FAST.into_iter().fold(usize::MAX, |best, factor| best.min(factor * least.div_ceil(factor).next_power_of_two()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Against the sum itself, in f64, for every length up to 70 and some longer ones with large prime factors.
    #[test]
    fn transforms_are_sums_of_sines() {
        let mut rng = Rng::new(3);
        for n in (1..70).chain([100, 127, 255, 256, 257, 359, 510, 511, 512]) {
            let mut lines = vec![ZERO; n];
            lines.iter_mut().flatten().flatten().for_each(|value| *value = rng.range(-1.0, 1.0));
            let before = lines.clone();
            SineTransform::new(n).apply(&mut lines);
            for lane in [0, 3, 8, 15] {
                let of = |lines: &[Lines], j: usize| f64::from(lines[j][lane / HALF][lane % HALF]);
                for m in 1..=n {
                    let angle = |j: usize| std::f64::consts::PI * (j * m % (2 * n + 2)) as f64 / (n + 1) as f64;
                    let expected: f64 = (1..=n).map(|j| of(&before, j - 1) * angle(j).sin()).sum();
                    let off = (expected - of(&lines, m - 1)).abs();
                    assert!(off < 2e-6 * (n as f64).max(4.0), "{n}: {m} is off by {off}");
                }
            }
        }
    }

    #[test]
    fn fast_periods_are_the_next_ones() {
        let fast = |period: usize| FAST.iter().any(|f| period.is_multiple_of(*f) && (period / f).is_power_of_two());
        for least in 1..3000 {
            assert_eq!(fast_period(least), (least..).find(|period| fast(*period)).unwrap());
        }
    }
}
