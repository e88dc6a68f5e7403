//! Numbers become bytes here: exposure, tone curves, and the colors of numbers that are no light.
//!
//! A curve is monotone, so that a byte begins at one number: [`Encoder`] finds all 255 of them once, and encoding is then
//! a look into a table. It gives the bytes that the curve gives, and a picture of a million pixels takes milliseconds.

/// How linear light becomes what a screen shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// What PNG files have: cut at 1, then sRGB (docs/outputs.md).
    #[default]
    Srgb,
    /// Narkowicz's fit of the ACES curve, then sRGB: highlights roll off.
    Filmic,
    /// `x / (1 + x)`, then sRGB: nothing is cut, everything is flat.
    Soft,
    /// The number itself, cut at 1: dark, but twice the number is twice the byte.
    Plain,
}

impl Curve {
    /// Every curve, in the order of the menu.
    pub const ALL: [Self; 4] = [Self::Srgb, Self::Filmic, Self::Soft, Self::Plain];

    /// What the menu calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Srgb => "sRGB",
            Self::Filmic => "Filmic",
            Self::Soft => "Soft",
            Self::Plain => "Plain",
        }
    }

    /// What it does, in a sentence.
    pub fn about(self) -> &'static str {
        match self {
            Self::Srgb => "What PNG files have: cut at 1, encoded as sRGB.",
            Self::Filmic => {
                "A fit of the ACES curve: highlights roll off. PNG files do not have it."
            }
            Self::Soft => "x / (1 + x): nothing is cut. PNG files do not have it.",
            Self::Plain => "Numbers without sRGB's encoding, cut at 1. PNG files do not have it.",
        }
    }

    /// Is light above 1 cut?
    pub fn cuts(self) -> bool {
        matches!(self, Self::Srgb | Self::Plain)
    }

    /// The byte of exposed light.
    pub fn byte(self, x: f32) -> u8 {
        let x = x.max(0.0);
        let encoded = match self {
            Self::Srgb => srgb(x.min(1.0)),
            Self::Filmic => {
                let y = x.min(1e6);
                let y = y * (2.51 * y + 0.03) / (y * (2.43 * y + 0.59) + 0.14);
                srgb(y.clamp(0.0, 1.0))
            }
            Self::Soft if x.is_infinite() => 1.0,
            Self::Soft => srgb(x / (1.0 + x)),
            Self::Plain => x.min(1.0),
        };
        (encoded * 255.0 + 0.5) as u8
    }
}

/// A linear value from 0 to 1 as sRGB (IEC 61966-2-1), as the PNG writer has it.
pub fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The linear value of an sRGB value from 0 to 1.
pub fn linear(srgb: f32) -> f32 {
    if srgb <= 0.040_45 {
        srgb / 12.92
    } else {
        ((srgb + 0.055) / 1.055).powf(2.4)
    }
}

/// Bits of a float that the table of [`Encoder`] does not look at. Between two numbers that it tells apart, no curve has
/// more than one step.
const DROPPED: u32 = 16;

/// A curve after an exposure, as a table.
#[derive(Clone)]
pub struct Encoder {
    curve: Curve,
    exposure: f32,
    scale: f32,
    /// The least number of each byte; behind them one that no number reaches.
    least: [f32; 257],
    /// The byte of the least number that begins with these bits; 0 of numbers below 0.
    first: Box<[u8; 1 << DROPPED]>,
}

impl Encoder {
    /// The table of a curve after so many stops.
    pub fn new(curve: Curve, exposure: f32) -> Self {
        let mut least = [f32::NAN; 257];
        least[0] = 0.0;
        for byte in 1..=255u8 {
            least[usize::from(byte)] = least_of(curve, byte);
        }
        let mut first = Box::new([0; 1 << DROPPED]);
        let mut byte = 0u8;
        for cell in 0..=f32::INFINITY.to_bits() >> DROPPED {
            let x = f32::from_bits(cell << DROPPED);
            while least[usize::from(byte) + 1] <= x {
                byte += 1;
            }
            first[cell as usize] = byte;
        }
        Self {
            curve,
            exposure,
            scale: exposure.exp2(),
            least,
            first,
        }
    }

    /// Is it of this curve and exposure?
    pub fn is(&self, curve: Curve, exposure: f32) -> bool {
        self.curve == curve && self.exposure == exposure
    }

    /// The factor that the exposure is.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The byte of a linear value. What is no number is 0, as it is in a PNG.
    #[inline]
    pub fn byte(&self, linear: f32) -> u8 {
        let x = linear * self.scale;
        // Without branches, which a noisy picture would send the processor the wrong way.
        let byte = self.first[usize::from((x.to_bits() >> DROPPED) as u16)];
        let byte = byte + u8::from(self.least[usize::from(byte) + 1] <= x);
        if x.is_nan() { 0 } else { byte }
    }
}

/// The least number of at least this byte; NaN, which nothing reaches, if there is none.
fn least_of(curve: Curve, byte: u8) -> f32 {
    let (mut low, mut high) = (0u32, f32::INFINITY.to_bits());
    if curve.byte(f32::from_bits(high)) < byte {
        return f32::NAN;
    }
    // Positive floats are in the order of their bits.
    while low < high {
        let middle = low + (high - low) / 2;
        if curve.byte(f32::from_bits(middle)) >= byte {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    f32::from_bits(high)
}

/// The colors of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Map {
    /// From dark blue to yellow, even to the eye and to those who see few colors.
    #[default]
    Viridis,
    /// From black over red to pale yellow.
    Inferno,
    /// From black to white.
    Grey,
}

impl Map {
    /// Every map, in the order of the menu.
    pub const ALL: [Self; 3] = [Self::Viridis, Self::Inferno, Self::Grey];

    /// What the menu calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "Viridis",
            Self::Inferno => "Inferno",
            Self::Grey => "Grey",
        }
    }

    /// The color at a place from 0 to 1, in sRGB bytes.
    pub fn color(self, at: f32) -> [u8; 3] {
        let at = if at.is_nan() { 0.0 } else { at.clamp(0.0, 1.0) };
        // Polynomials by Matt Zucker, CC0.
        let coefficients: [[f32; 3]; 7] = match self {
            Self::Grey => return [(at * 255.0 + 0.5) as u8; 3],
            Self::Viridis => [
                [0.277_727_34, 0.005_407_344_6, 0.334_099_8],
                [0.105_093_04, 1.404_613_5, 1.384_590_1],
                [-0.330_861_84, 0.214_847_56, 0.095_095_165],
                [-4.634_230_6, -5.799_101, -19.332_441],
                [6.228_27, 14.179_934, 56.690_55],
                [4.776_385, -13.745_145, -65.353_03],
                [-5.435_456, 4.645_852_6, 26.312_435],
            ],
            Self::Inferno => [
                [0.000_218_940_37, 0.001_651_004_6, -0.019_480_899],
                [0.106_513_42, 0.563_956_44, 3.932_712_3],
                [11.602_493, -3.972_854, -15.942_394],
                [-41.703_995, 17.436_398, 44.354_145],
                [77.162_94, -33.402_36, -81.807_31],
                [-71.319_43, 32.626_064, 73.209_52],
                [25.131_126, -12.242_669, -23.070_325],
            ],
        };
        [0, 1, 2].map(|channel| {
            let value = coefficients
                .iter()
                .rev()
                .fold(0.0, |sum, row| sum * at + row[channel]);
            (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
        })
    }

    /// The colors at 256 places.
    pub fn table(self) -> [[u8; 3]; 256] {
        std::array::from_fn(|i| self.color(i as f32 / 255.0))
    }
}

/// Where numbers lie between two others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// What has the first color.
    pub low: f32,
    /// What has the last color.
    pub high: f32,
    /// Are equal ratios equally far from each other?
    pub is_log: bool,
}

impl Span {
    /// The least span that has all finite numbers. A logarithmic one has the positive ones, over 1e6 at most.
    pub fn around(numbers: impl Iterator<Item = f32>, is_log: bool) -> Self {
        let finite = numbers.filter(|x| x.is_finite() && (!is_log || *x > 0.0));
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for x in finite {
            low = low.min(x);
            high = high.max(x);
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if is_log {
            high = high.max(1e-30);
            low = low.max(high * 1e-6);
        }
        Self { low, high, is_log }
    }

    /// Where numbers are: 0 at the low end, 1 at the high one.
    pub fn placing(&self) -> impl Fn(f32) -> f32 + use<> {
        let is_log = self.is_log;
        let scale = move |x: f32| if is_log { x.max(1e-38).log2() } else { x };
        let (low, high) = (scale(self.low), scale(self.high));
        let factor = if high > low { 1.0 / (high - low) } else { 0.0 };
        move |x| ((scale(x) - low) * factor).clamp(0.0, 1.0)
    }

    /// Where a number is.
    pub fn place(&self, x: f32) -> f32 {
        self.placing()(x)
    }

    /// The number at a place from 0 to 1.
    pub fn at(&self, place: f32) -> f32 {
        if self.is_log {
            let (low, high) = (self.low.max(1e-38).log2(), self.high.max(1e-38).log2());
            (low + (high - low) * place).exp2()
        } else {
            self.low + (self.high - self.low) * place
        }
    }
}

/// Colors of indices, neighbours far apart in hue.
pub fn index_color(index: usize) -> [u8; 3] {
    let hue = (index as f32 * 0.618_034 + 0.08).fract() * 6.0;
    let (strength, least) = [(0.42, 0.36), (0.36, 0.22), (0.34, 0.48)][index % 3];
    [0.0, 4.0, 2.0].map(|shift| {
        let distance = ((hue + shift) % 6.0 - 3.0).abs() - 1.0;
        let value = least + strength * distance.clamp(0.0, 1.0);
        (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers() -> impl Iterator<Item = f32> {
        // Every magnitude, from many places of the line of floats.
        let spread = (0..200_000u32).map(|i| f32::from_bits(i.wrapping_mul(0x9E37_79B1)));
        let odd = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            1e-45,
        ];
        spread
            .chain(odd)
            .chain((0..=2048).map(|i| i as f32 / 1024.0))
    }

    #[test]
    fn the_table_gives_the_bytes_of_the_curve() {
        for curve in Curve::ALL {
            for exposure in [0.0, -3.5, 2.0] {
                let encoder = Encoder::new(curve, exposure);
                for x in numbers() {
                    let expected = curve.byte(x * exposure.exp2());
                    let expected = if x.is_nan() { 0 } else { expected };
                    assert_eq!(encoder.byte(x), expected, "{curve:?} {exposure} {x:e}");
                }
            }
        }
    }

    /// The table of docs/outputs.md, which the PNG writer is held to as well.
    #[test]
    fn the_first_curve_is_that_of_the_png() {
        let encoder = Encoder::new(Curve::Srgb, 0.0);
        let manual = include_str!("../../../docs/outputs.md");
        let (_, section) = manual.split_once("## The PNG").expect("a section");
        let (section, _) = section.split_once("\n## ").expect("its end");
        let rows = section.lines().filter_map(|line| {
            let row = line.strip_prefix("| ")?.strip_suffix(" |")?;
            let (linear, byte) = row.split_once(" | ")?;
            Some((linear.parse::<f32>().ok()?, byte.parse::<u8>().ok()?))
        });
        let rows: Vec<(f32, u8)> = rows.collect();
        assert!(rows.len() >= 8, "{rows:?}");
        for (linear, byte) in rows {
            assert_eq!(encoder.byte(linear), byte, "{linear}");
        }
        assert_eq!(Encoder::new(Curve::Srgb, 2.0).byte(0.045), 118);
        assert_eq!(Curve::default(), Curve::Srgb);
    }

    #[test]
    fn curves_rise_and_end_in_white_or_below() {
        for curve in Curve::ALL {
            let bytes: Vec<u8> = (0..4000).map(|i| curve.byte(i as f32 / 400.0)).collect();
            assert!(bytes.is_sorted(), "{curve:?}");
            assert_eq!(bytes[0], 0);
            assert_eq!(curve.byte(f32::INFINITY), 255, "{curve:?}");
        }
        assert!(Curve::Filmic.byte(1.0) < 255 && Curve::Soft.byte(1.0) < 200);
    }

    #[test]
    fn srgb_and_back() {
        for i in 0..=255 {
            let x = i as f32 / 255.0;
            assert!((srgb(linear(x)) - x).abs() < 1e-5, "{x}");
        }
    }

    #[test]
    fn maps_go_from_dark_to_bright() {
        let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 4);
        assert!(
            near(Map::Viridis.color(0.0), [68, 1, 84]),
            "{:?}",
            Map::Viridis.color(0.0)
        );
        assert!(
            near(Map::Viridis.color(1.0), [253, 231, 37]),
            "{:?}",
            Map::Viridis.color(1.0)
        );
        assert!(
            near(Map::Inferno.color(0.0), [0, 0, 4]),
            "{:?}",
            Map::Inferno.color(0.0)
        );
        assert!(
            near(Map::Inferno.color(1.0), [252, 255, 164]),
            "{:?}",
            Map::Inferno.color(1.0)
        );
        for map in Map::ALL {
            let luminance = |c: [u8; 3]| {
                let [r, g, b] = c.map(|v| linear(f32::from(v) / 255.0));
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            let rising = map.table().map(luminance);
            let falls = rising.windows(2).filter(|w| w[1] < w[0] - 2e-3).count();
            assert_eq!(falls, 0, "{map:?}");
        }
        assert_eq!(Map::Grey.color(f32::NAN), [0; 3]);
    }

    #[test]
    fn spans_are_those_of_the_numbers() {
        let numbers = [3.0, f32::NAN, 0.0, 8.0, f32::INFINITY];
        let span = Span::around(numbers.into_iter(), false);
        assert_eq!((span.low, span.high), (0.0, 8.0));
        assert_eq!(
            [span.place(0.0), span.place(4.0), span.place(9.0)],
            [0.0, 0.5, 1.0]
        );
        let log = Span::around(numbers.into_iter(), true);
        assert_eq!((log.low, log.high), (3.0, 8.0));
        assert!((log.at(log.place(5.0)) - 5.0).abs() < 1e-4);
        let none = Span::around([f32::NAN].into_iter(), false);
        assert_eq!((none.low, none.high), (0.0, 1.0));
        let one = Span::around([2.0].into_iter(), false);
        assert_eq!(one.place(2.0), 0.0);
    }

    #[test]
    fn neighbouring_indices_differ() {
        for i in 0..40 {
            let (a, b) = (index_color(i), index_color(i + 1));
            let distance: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
            assert!(distance > 60, "{i}: {a:?} {b:?}");
        }
    }
}
